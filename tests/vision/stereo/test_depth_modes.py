"""The published depth map and the fused one, on a pair whose depth is known everywhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, frozen
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.depth_fused import fused_depth
from asbuilt_bim.vision.stereo.depth_paper import paper_depth, relative_distance, scale_from_target
from asbuilt_bim.vision.target.find import TargetSighting
from tests.measure.box_world import make_camera

CAMERA = make_camera(160, 120, 130.0)
SEEN = np.ones((120, 160), dtype=bool)


@dataclass(frozen=True)
class Fake:
    """A network that answers with a map that was given."""

    answer: np.ndarray
    name: str = "fake"

    def estimate(self, image: ByteImage) -> Float32Array:
        return self.answer


def pair() -> RectifiedPair:
    blank = np.zeros((120, 160, 3), dtype=np.uint8)
    return RectifiedPair(name="T", left=blank, right=blank, valid_left=SEEN, valid_right=SEEN, camera=CAMERA)


def true_disparity() -> Float32Array:
    """A wall that runs away to the right before a ground that rises to it."""
    x, y = np.meshgrid(np.arange(160), np.arange(120))
    return np.maximum(9.0 - 0.03 * x, 2.0 + 0.05 * y).astype(np.float32)


def stereo(valid: BoolArray, noise: float = 0.05) -> DepthMap:
    rng = np.random.default_rng(3)
    disparity = true_disparity() + rng.normal(0.0, noise, SEEN.shape).astype(np.float32)
    return DepthMap(
        disparity_px=np.where(valid, disparity, np.nan).astype(np.float32),
        sigma_px=np.where(valid, np.float32(noise), np.inf).astype(np.float32),
        valid=valid, f_px=CAMERA.f_px, baseline_m=CAMERA.baseline_m, method="stereo",
    )  # fmt: skip


def target_at(x: int, y: int) -> TargetSighting:
    disparity = float(true_disparity()[y, x])
    depth = CAMERA.f_px * CAMERA.baseline_m / disparity
    return TargetSighting(
        left_px=frozen([x, y]), right_px=frozen([x - disparity, y]), radius_px=5.0,
        ellipse_left=(float(x), float(y), 10.0, 10.0, 0.0), disparity_px=disparity, depth_m=depth,
        depth_sigma_m=0.01, range_m=depth, diameter_m=0.3,
    )  # fmt: skip


def test_the_scalar_is_that_of_the_papers_two_experiments() -> None:
    assert 100 * scale_from_target(5.17, 0.976) == pytest.approx(529.713, abs=0.001)  # eq. 8, whose 512 is a misprint
    assert 100 * scale_from_target(5.59, 0.779) == pytest.approx(717.586, abs=0.001)  # eq. 9


def test_both_readings_of_the_inversion_put_the_near_low_and_the_far_at_one() -> None:
    nearness = np.array([[0.0, 5.0, 10.0]])
    seen = np.ones((1, 3), dtype=bool)
    assert relative_distance(nearness, seen, "complement").ravel() == pytest.approx([1.0, 0.5, 0.0])
    assert relative_distance(nearness, seen, "reciprocal").ravel() == pytest.approx([1.0, 2 / 255, 1 / 255], rel=1e-5)


def test_what_lies_outside_the_photo_neither_counts_nor_gets_a_value() -> None:
    seen = np.array([[True, True, False]])
    found = relative_distance(np.array([[2.0, 4.0, np.nan]]), seen, "complement")
    assert found[0, :2].tolist() == [1.0, 0.0]
    assert np.isnan(found[0, 2])


@pytest.mark.parametrize("inversion", ["complement", "reciprocal"])
def test_the_published_map_is_exact_at_the_target_and_the_scalar_elsewhere(inversion) -> None:
    target = target_at(100, 20)
    nearness = true_disparity()
    found = paper_depth(pair(), Fake(nearness), target, inversion)
    assert found.method == "paper"
    assert found.depth_m[20, 100] == pytest.approx(target.depth_m, rel=1e-4)
    relative = relative_distance(nearness, SEEN, inversion)
    expected = target.depth_m * relative[60, 30] / relative[20, 100]
    assert found.depth_m[60, 30] == pytest.approx(expected, rel=1e-4)
    assert np.isinf(found.sigma_px).all()  # the method states none


def test_scale_and_shift_of_a_network_change_nothing_in_the_published_map() -> None:
    one = paper_depth(pair(), Fake(true_disparity()), target_at(100, 20))
    other = paper_depth(pair(), Fake(7.0 * true_disparity() - 100.0), target_at(100, 20))
    assert np.nanmax(np.abs(one.depth_m - other.depth_m)) < 1e-3


def test_a_target_that_is_the_nearest_thing_leaves_nothing_to_divide_by() -> None:
    y, x = np.unravel_index(int(np.argmax(true_disparity())), SEEN.shape)
    with pytest.raises(ValueError, match="relative depth is 0"):
        paper_depth(pair(), Fake(true_disparity()), target_at(int(x), int(y)))


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (np.zeros((120, 160)), "0 everywhere"),
        (np.full((120, 160), np.nan), "not finite"),
        (np.zeros((60, 80)), "map of 60 x 80, the photo has 120 x 160"),
    ],
)
def test_a_map_that_is_no_map_is_refused_in_words(answer: np.ndarray, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        paper_depth(pair(), Fake(answer), target_at(100, 20))


def hole() -> BoolArray:
    valid = SEEN.copy()
    valid[30:70, 40:90] = False
    return valid


def test_scale_and_shift_are_found_through_noise_and_wrong_stereo() -> None:
    given = stereo(hole())
    rng = np.random.default_rng(5)
    wrong = given.valid & (rng.random(SEEN.shape) < 0.15)
    disparity = np.where(wrong, given.disparity_px + rng.uniform(1.0, 6.0, SEEN.shape), given.disparity_px)
    damaged = DepthMap(
        disparity_px=disparity.astype(np.float32), sigma_px=given.sigma_px, valid=given.valid, f_px=given.f_px,
        baseline_m=given.baseline_m, method="stereo",
    )  # fmt: skip
    found = fused_depth(pair(), damaged, Fake((true_disparity() - 3.0) / 40.0), target_at(100, 20))
    assert found.disparity_px[~hole()] == pytest.approx(true_disparity()[~hole()], rel=0.01)


def test_what_stereo_measured_stays_and_holes_are_filled_with_a_sigma_that_holds() -> None:
    given = stereo(hole())
    rng = np.random.default_rng(8)
    noisy = true_disparity() + rng.normal(0.0, 0.3, SEEN.shape)
    found = fused_depth(pair(), given, Fake((noisy / 10.0).astype(np.float32)))
    assert found.method == "fused"
    assert np.array_equal(found.disparity_px[given.valid], given.disparity_px[given.valid])
    assert np.array_equal(found.sigma_px[given.valid], given.sigma_px[given.valid])
    assert found.valid.all()
    pulls = ((found.disparity_px - true_disparity()) / found.sigma_px)[~given.valid]
    assert 0.6 < np.std(pulls) < 1.2
    assert found.sigma_px[~given.valid].min() > given.sigma_px[given.valid].max()


def test_what_lies_far_beyond_all_that_stereo_saw_is_not_filled() -> None:
    nearness = true_disparity()
    nearness[:30, :] = 0.0  # sky: the shift's error is all that a distance there would be
    valid = SEEN.copy()
    valid[:30, :] = False
    found = fused_depth(pair(), stereo(valid), Fake(nearness))
    assert not found.valid[:30].any()


def test_a_network_that_has_not_understood_the_picture_is_refused() -> None:
    noise = np.random.default_rng(1).random(SEEN.shape).astype(np.float32)
    with pytest.raises(ValueError, match="explains"):
        fused_depth(pair(), stereo(hole()), Fake(noise))
    with pytest.raises(ValueError, match="explains"):  # further is larger: it breaks the interface
        fused_depth(pair(), stereo(hole()), Fake(-true_disparity()))


def test_without_stereo_there_is_nothing_to_scale_a_network_by() -> None:
    valid = np.zeros_like(SEEN)
    valid[:10, :10] = True
    with pytest.raises(ValueError, match="100 pixels, limit 500"):
        fused_depth(pair(), stereo(valid), Fake(true_disparity()))
