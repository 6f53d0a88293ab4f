"""Damage within a JPEG's coded data is refused; sound photos of every kind of coding are not."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.photo.jpeg.scan import damage_in_scan, jpeg_frame
from asbuilt_bim.camera.photo.jpeg.seam import seam
from asbuilt_bim.camera.photo.read import decode, photo_from_bytes, read_photo
from asbuilt_bim.errors import PhotoError

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "sample_models" / "site" / "visits" / "2026-03-02"
DATA = Path(os.environ.get("ASBUILT_BIM_DATA", ROOT.parent / "shared" / "data"))
PHOTO = SAMPLE / "G1_left.jpg"


def a_photo() -> np.ndarray:
    image = cv2.imread(str(PHOTO))
    assert image is not None
    return np.asarray(image)


def coded(image: np.ndarray, *options: int) -> bytes:
    return cv2.imencode(".jpg", image, list(options))[1].tobytes()


@pytest.mark.parametrize(
    "options",
    [
        (),
        (cv2.IMWRITE_JPEG_QUALITY, 100),
        (cv2.IMWRITE_JPEG_QUALITY, 5),
        (cv2.IMWRITE_JPEG_OPTIMIZE, 1),
        (cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
        (cv2.IMWRITE_JPEG_RST_INTERVAL, 1),
        (cv2.IMWRITE_JPEG_RST_INTERVAL, 7),
        (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444),
        (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422),
        (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_440),
        (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_411),
    ],
)
def test_a_sound_photo_is_taken_however_it_was_coded(options: tuple[int, ...]) -> None:
    image = a_photo()[100:613, 200:1001]  # no whole number of blocks
    for data in (coded(image, *options), coded(image[:, :, 1], *options), coded(image, *options) + b"\x00" * 99):
        assert decode(photo_from_bytes("a.jpg", data)).shape == (513, 801, 3)


def test_bytes_that_some_cameras_leave_before_the_end_do_no_harm() -> None:
    data = coded(a_photo())
    own = np.random.default_rng(1).integers(1, 255, 300, dtype=np.uint8).tobytes()
    for more in (b"\x00", b"\x12\x34", b"\xff", b"\x00" * 40, own, b"\xff\xd0", b"\xff\xd0" + own):
        assert decode(photo_from_bytes("a.jpg", data[:-2] + more + data[-2:])) is not None


def test_the_samples_photos_are_sound() -> None:
    for path in sorted(SAMPLE.glob("*.jpg"))[:6]:
        decode(read_photo(path))


@pytest.mark.skipif(not DATA.is_dir(), reason="no folder of real data")
def test_photos_of_real_cameras_are_sound() -> None:
    found = [path for path in sorted(DATA.rglob("*")) if path.suffix.lower() in (".jpg", ".jpeg")]
    chosen = found[:: max(1, len(found) // 30)]
    assert len(chosen) > 10
    for path in chosen:
        decode(read_photo(path))


def test_lost_bytes_turned_bits_and_what_is_left_over_are_refused() -> None:
    data = coded(a_photo())
    half = len(data) // 2
    frame = jpeg_frame(data)
    assert frame is not None and damage_in_scan(data, frame) == ""
    for broken in (data[:half] + data[half + 40 :], data[:half] + data[half - 400 :]):
        with pytest.raises(PhotoError, match=r"a\.jpg: it is damaged, its .*; copy it from the camera again"):
            decode(photo_from_bytes("a.jpg", broken))


@pytest.mark.parametrize("more", [(), (cv2.IMWRITE_JPEG_RST_INTERVAL, 40)])
def test_a_progressive_photo_that_lost_data_is_refused_with_what_its_decoder_says(more: tuple[int, ...]) -> None:
    data = coded(a_photo(), cv2.IMWRITE_JPEG_PROGRESSIVE, 1, *more)
    assert decode(photo_from_bytes("a.jpg", data)).shape == (960, 1280, 3)
    for share in (0.2, 0.5, 0.9):
        at = int(share * len(data))
        for broken in (data[:at] + b"\xff\xd9", data[:at] + data[at + 40 :], data[:at] + bytes(400) + data[at + 400 :]):
            with pytest.raises(PhotoError, match=r"a\.jpg: it is damaged, its decoder says: .*copy it from the camera"):
                decode(photo_from_bytes("a.jpg", broken))


def test_a_photo_is_decoded_to_the_pixels_of_opencv() -> None:
    for options in ((), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_QUALITY, 30)):
        data = coded(a_photo(), *options)
        assert (decode(photo_from_bytes("a.jpg", data)) == cv2.imdecode(np.frombuffer(data, np.uint8), 1)).all()


def test_a_decoder_says_nothing_on_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    data = coded(a_photo())
    decode(photo_from_bytes("a.jpg", data[:-2] + bytes(40) + data[-2:]))
    with pytest.raises(PhotoError):
        decode(photo_from_bytes("a.jpg", data[: len(data) // 2] + data[-2:]))
    assert capfd.readouterr().err == ""


def test_a_picture_in_thousands_of_layers_is_refused_before_it_is_decoded() -> None:
    data = coded(a_photo(), cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
    last = data.rindex(b"\xff\xda")
    with pytest.raises(PhotoError, match="more than 200 layers"):
        photo_from_bytes("a.jpg", data[:last] + data[last:-2] * 300 + data[-2:])


def test_a_restart_marker_that_is_lost_or_out_of_turn_is_refused() -> None:
    data = coded(a_photo(), cv2.IMWRITE_JPEG_RST_INTERVAL, 80)
    place = data.index(b"\xff\xd3")
    for broken in (data[:place] + b"\xff\xd5" + data[place + 2 :], data[:place] + data[place + 2 :]):
        with pytest.raises(PhotoError, match="damaged"):
            decode(photo_from_bytes("a.jpg", broken))


@pytest.mark.parametrize("step", [-40, -12, 12, 40])
def test_a_step_in_brightness_along_the_blocks_is_refused_and_said_where(step: int) -> None:
    image = a_photo().astype(np.int64)
    row, column = 30, 37
    image[row * 16 : row * 16 + 16, column * 16 :] += step
    image[row * 16 + 16 :] += step
    for options in ((), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)):
        with pytest.raises(PhotoError, match=r"pixel row 480, column \d+ on is about \d+ grey levels .*copy it"):
            decode(photo_from_bytes("a.jpg", coded(np.clip(image, 0, 255).astype(np.uint8), *options)))


def test_a_straight_edge_over_the_whole_width_is_no_damage() -> None:
    image = a_photo()
    image[480:] = 255 - image[480:]
    assert seam(image, (16, 16)) is None
    bands = np.zeros((480, 640, 3), dtype=np.uint8)
    bands[240:] = 200
    assert seam(bands, (16, 16)) is None and seam(bands, (8, 8)) is None


def test_four_of_five_turned_bits_that_change_the_picture_are_found() -> None:
    whole = a_photo()[300:700, 300:940]
    data, rng = coded(whole, cv2.IMWRITE_JPEG_QUALITY, 90), np.random.default_rng(5)
    before = decode(photo_from_bytes("a.jpg", data)).astype(np.int64)
    harmful, found = 0, 0
    for _ in range(60):
        place = int(rng.integers(len(data) // 20, len(data) * 19 // 20))
        broken = data[:place] + bytes([data[place] ^ 1 << int(rng.integers(8))]) + data[place + 1 :]
        decoded = cv2.imdecode(np.frombuffer(broken, dtype=np.uint8), cv2.IMREAD_COLOR)
        changed = decoded is None or (np.abs(decoded - before).max(axis=2) > 10).mean() > 0.02
        harmful += changed
        try:
            decode(photo_from_bytes("a.jpg", broken))
        except PhotoError:
            found += changed
    assert harmful >= 10 and 5 * found >= 4 * harmful


@pytest.mark.parametrize("options", [(), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)])
def test_any_bit_of_a_photos_frame_may_be_turned(options: tuple[int, ...]) -> None:
    data = coded(a_photo()[:64, :64], *options)
    frame = data.index(b"\xff\xc2" if options else b"\xff\xc0")
    for bit in range(8 * frame, 8 * (frame + 19)):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        try:
            decode(photo_from_bytes("a.jpg", bytes(broken)))
        except PhotoError as refusal:
            assert "a.jpg" in str(refusal)
