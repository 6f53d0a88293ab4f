"""A photo's own state: each fault is named by its measure, and a good photo has none."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.compression import rounded_away_grey
from asbuilt_bim.camera.photo.quality import (
    StationQuality,
    clipped,
    photo_faults,
    photo_quality,
    quality_of,
)
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import PHOTO_FAULTS, Reason
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.report.wording.reasons import words_of

HEIGHT, WIDTH = 600, 800
ALL = np.ones((HEIGHT, WIDTH), dtype=bool)


def scene(seed: int = 1) -> ByteImage:
    """Draw grey, coloured and white things with sharp edges on textured ground, as a good camera stores them."""
    rng = np.random.default_rng(seed)
    large = np.full((4 * HEIGHT, 4 * WIDTH, 3), 110.0, dtype=np.float32)
    for _ in range(500):
        x, y = rng.integers(0, 4 * WIDTH), rng.integers(0, 4 * HEIGHT)
        size = (int(rng.integers(40, 300)), int(rng.integers(40, 300)))
        colour = rng.uniform(20, 220) * np.array([1.0, 1.0, 1.0]) * rng.uniform(0.85, 1.0, 3)
        box = cv2.boxPoints(((float(x), float(y)), size, float(rng.uniform(0, 180)))).astype(np.int32)
        cv2.fillConvexPoly(large, box, [float(c) for c in colour])
    small = cv2.resize(large, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    return stored(small + rng.normal(0.0, 0.8, small.shape))


def stored(values: np.ndarray) -> ByteImage:
    return np.asarray(np.clip(np.round(values), 0, 255), dtype=np.uint8)


def exposed(photo: ByteImage, stops: float) -> ByteImage:
    return stored(255.0 * np.minimum((photo / 255.0) ** 2.2 * 2.0**stops, 1.0) ** (1.0 / 2.2))


def moved(photo: ByteImage, length: int) -> ByteImage:
    return np.asarray(cv2.blur(photo, (length, 1)), dtype=np.uint8)


def defocused(photo: ByteImage, radius: int) -> ByteImage:
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)).astype(np.float32)
    return np.asarray(cv2.filter2D(photo, -1, disc / disc.sum()), dtype=np.uint8)


def with_drops(photo: ByteImage) -> ByteImage:
    mask = np.zeros((HEIGHT, WIDTH, 1), dtype=np.uint8)
    for x in (150, 420, 690):
        cv2.circle(mask, (x, 300), 150, 1, -1)
    return np.where(mask, defocused(photo, 4), photo).astype(np.uint8)


def grainy(photo: ByteImage) -> ByteImage:
    return stored(photo + np.random.default_rng(2).normal(0.0, 16.0, photo.shape))


def codes(left: ByteImage, right: ByteImage) -> list[Reason]:
    found = StationQuality(left=photo_quality(left, ALL), right=photo_quality(right, ALL))
    return [one.code for one in photo_faults(found, "A1")]


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_wrong_with_a_good_photo(seed: int) -> None:
    assert codes(scene(seed), scene(seed + 10)) == []


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda photo: exposed(photo, 3.0), Reason.PHOTO_CLIPPED),
        (lambda photo: exposed(photo, -5.0), Reason.PHOTO_DARK),
        (grainy, Reason.PHOTO_GRAINY),
        (lambda photo: stored(0.3 * photo + 150.0), Reason.PHOTO_HAZY),
        (lambda photo: stored(photo * np.array([0.3, 0.7, 1.0])), Reason.PHOTO_TINTED),
        (lambda photo: defocused(photo, 4), Reason.PHOTO_UNSHARP),
        (with_drops, Reason.PHOTO_SMEARED),
    ],
    ids=lambda value: value.name if isinstance(value, Reason) else "",
)
def test_each_fault_of_one_photo_is_named(spoil: Callable[[ByteImage], ByteImage], code: Reason) -> None:
    assert codes(scene(), spoil(scene())) == [code]
    assert code in PHOTO_FAULTS


def test_a_rig_moves_both_eyes_so_what_one_shows_alone_is_no_motion() -> None:
    assert codes(moved(scene(), 7), moved(scene(), 7)) == [Reason.PHOTO_MOVED]
    assert Reason.PHOTO_MOVED not in codes(moved(scene(), 7), scene())
    even = np.full_like(scene(), 120)
    assert Reason.PHOTO_MOVED in codes(moved(scene(), 7), even)  # the other has no edges to tell by


def test_every_fault_reads_as_a_sentence_with_what_to_do() -> None:
    spoilt = defocused(exposed(scene(), 3.0), 3)
    found = StationQuality(left=photo_quality(spoilt, ALL), right=photo_quality(spoilt, ALL))
    for fault in photo_faults(found, "A1"):
        assert str(words_of(fault)).startswith("station A1: ")
        assert "take the station again" in words_of(fault).remedy


def test_a_line_of_motion_is_found_with_its_length_and_direction() -> None:
    level = photo_quality(moved(scene(), 7), ALL).sharpness
    upright = photo_quality(np.asarray(cv2.blur(scene(), (1, 7)), dtype=np.uint8), ALL).sharpness
    assert level.motion_px > 4.0 and upright.motion_px > 4.0
    assert photo_quality(scene(), ALL).sharpness.motion_px < 1.0
    assert min(level.motion_deg, 180.0 - level.motion_deg) < 10.0
    assert abs(upright.motion_deg - 90.0) < 10.0


def test_noise_alone_is_no_sharp_edge() -> None:
    even = stored(120.0 + np.random.default_rng(4).normal(0.0, 6.0, (HEIGHT, WIDTH, 3)))
    assert photo_quality(even, ALL).sharpness.edges == 0


def test_a_glint_is_not_clipped_but_a_white_wall_is() -> None:
    photo = np.full((100, 200, 3), 120, dtype=np.uint8)
    photo[10:14, 20:24] = 255
    photo[40:90, 100:180] = 255
    assert not clipped(photo)[:30].any()
    assert clipped(photo)[45:85, 105:175].all()


def test_a_photo_without_anything_in_it_is_no_error() -> None:
    for level in (0, 128, 255):
        photo_quality(np.full((HEIGHT, WIDTH, 3), level, dtype=np.uint8), ALL)
    photo_quality(scene(), ~ALL)


def test_coarse_compression_is_known_from_the_file_and_a_fine_one_costs_nothing() -> None:
    lost = {}
    for quality in (30, 60, 92):
        done, data = cv2.imencode(".jpg", scene(), [cv2.IMWRITE_JPEG_QUALITY, quality])
        assert done
        one = photo_quality(scene(), ALL, bytes(data))
        lost[quality] = one.rounded_away_grey
        named = [fault.code for fault in photo_faults(StationQuality(left=one, right=one), "A1")]
        assert (Reason.PHOTO_COMPRESSED in named) == (quality == 30)
    assert lost[30] > lost[60] > lost[92] > 0.0
    assert rounded_away_grey(b"\x89PNG") == rounded_away_grey(b"\xff\xd8\xff") == 0.0
    assert rounded_away_grey(b"\xff\xd8\xff\xdb\x00\x05\x00\x01\x01") == 0.0


def test_what_is_soft_in_both_photos_is_no_drop_on_a_lens() -> None:
    soft = with_drops(scene())
    shifted = np.roll(soft, -60, axis=1)
    assert Reason.PHOTO_SMEARED not in codes(soft, shifted)
    assert Reason.PHOTO_SMEARED in codes(soft, np.roll(scene(), -60, axis=1))


def wide_rig(lower_px: float = 0.0) -> StereoRig:
    """Return a rig of two wide lenses, 10 cm apart, whose right photo shows all of it so much lower."""
    left, right = (
        Intrinsics(
            K=np.array([[400.0, 0.0, 399.5], [0.0, 400.0, 299.5 + lower], [0.0, 0.0, 1.0]]),
            distortion=np.array([-0.28, 0.074, 0.0, 0.0, 0.0]),
            width_px=WIDTH,
            height_px=HEIGHT,
        )
        for lower in (0.0, lower_px)
    )
    pose = np.eye(4)
    pose[0, 3] = -0.1
    return StereoRig(left=left, right=right, right_from_left=pose, covariance=np.zeros((14, 14)))


def test_noise_is_that_of_the_photo_as_it_was_taken_and_not_what_rectifying_leaves_of_it() -> None:
    noise = np.random.default_rng(3).normal(0.0, 6.0, (HEIGHT, WIDTH, 1))
    prepared, photo = rectification(wide_rig()), stored(scene() + noise)
    found = quality_of(*prepared.taken(photo, photo), b"", b"")
    assert [one.code for one in photo_faults(found, "A1")] == [Reason.PHOTO_GRAINY]
    drawn = rectify(prepared, photo, photo, "A1")
    assert photo_quality(drawn.left, drawn.valid_left).noise_grey < 0.7 * found.left.noise_grey


def test_parts_of_two_photos_are_compared_where_they_show_the_same_though_one_camera_looks_lower() -> None:
    photo = scene()
    photo[:300] = defocused(photo, 3)[:300]
    lower = np.roll(photo, 100, axis=0)
    taken = rectification(wide_rig(lower_px=100.0)).taken(photo, lower)
    assert photo_faults(quality_of(*taken, b"", b""), "A1") == ()
    beside = StationQuality(left=photo_quality(photo, ALL), right=photo_quality(lower, ALL))
    assert Reason.PHOTO_SMEARED in [one.code for one in photo_faults(beside, "A1")]
