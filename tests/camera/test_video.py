"""A walk's video: sharp frames that overlap by half become pairs; what is no stereo video is refused by name."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.video.container import check_container
from asbuilt_bim.camera.video.frames import LEAST_OVERLAP, SPARE, TakenFrame, take_frames
from asbuilt_bim.errors import PhotoError
from tests.camera.stereo_films import SIZE, panned, write_film


def shaking(number: int) -> float:
    """A hand's motion, up and down by two pixels, never the same twice."""
    return float(np.random.default_rng(number).uniform(-2.0, 2.0))


def taken(tmp_path: Path, left: Path, right: Path | None) -> tuple[TakenFrame, ...]:
    folder = tmp_path / "frames"
    folder.mkdir(exist_ok=True)
    return take_frames(str(left), "" if right is None else str(right), str(folder), "walk")


def two_films(tmp_path: Path, count: int = 140, step_px: float = 5.0, late: int = 0) -> tuple[Path, Path]:
    pairs = panned(count + late, step_px, shaking)
    left = write_film(tmp_path / "walk_left.avi", [left for left, _ in pairs[late:]])
    return left, write_film(tmp_path / "walk_right.avi", [right for _, right in pairs[:count]])


def test_each_station_shows_about_half_of_the_one_before(tmp_path: Path) -> None:
    found = taken(tmp_path, *two_films(tmp_path))
    steps = np.diff([frame.number for frame in found]) * 5.0 / SIZE[0]
    assert len(found) >= 5
    assert np.all(steps[:-1] <= 1.0 - LEAST_OVERLAP + 0.1)
    assert np.all(steps[:-1] >= 1.0 - LEAST_OVERLAP - SPARE - 0.1)
    assert [frame.left for frame in found] == [f"walk_{n:04d}_left.png" for n in range(1, len(found) + 1)]


def test_a_camera_that_rests_gives_one_station(tmp_path: Path) -> None:
    assert len(taken(tmp_path, *two_films(tmp_path, count=40, step_px=0.0))) == 1


def test_a_blurred_frame_is_passed_over(tmp_path: Path) -> None:
    pairs = panned(100, 5.0)
    sharp = {0, 12, 24, 26, 48, 50, 72, 74, 98}
    blurred = [pair if n in sharp else tuple(cv2.blur(one, (9, 1)) for one in pair) for n, pair in enumerate(pairs)]
    left = write_film(tmp_path / "l.avi", [pair[0] for pair in blurred])
    right = write_film(tmp_path / "r.avi", [pair[1] for pair in blurred])
    found = taken(tmp_path, left, right)
    assert {frame.number for frame in found[:-1]} <= sharp


def test_a_covered_lens_gives_no_stations_before_the_walk_or_in_it(tmp_path: Path) -> None:
    pairs = panned(100, 5.0)
    dark = (np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8),) * 2
    noisy = [np.random.default_rng(n).integers(0, 30, (SIZE[1], SIZE[0], 3)).astype(np.uint8) for n in range(40)]
    walk = [*[dark] * 40, *pairs[:50], *[dark] * 40, *[(one, one) for one in noisy], *pairs[50:]]
    films = [write_film(tmp_path / f"{side}.avi", [pair[n] for pair in walk]) for n, side in enumerate("lr")]
    numbers = [frame.number for frame in taken(tmp_path, *films)]
    assert all(40 <= number < 90 or number >= 170 for number in numbers)
    assert any(number < 90 for number in numbers) and any(number >= 170 for number in numbers)


def test_one_video_of_both_eyes_gives_the_same_frames_as_two(tmp_path: Path) -> None:
    pairs = panned(60, 5.0)
    both = write_film(tmp_path / "both.avi", [np.hstack(pair) for pair in pairs])
    apart = [write_film(tmp_path / f"{n}.avi", [pair[n] for pair in pairs]) for n in (0, 1)]
    two, one = taken(tmp_path, *apart), taken(tmp_path, both, None)
    assert abs(len(one) - len(two)) <= 1
    picture = cv2.imread(str(tmp_path / "frames" / one[1].right))
    assert picture is not None and picture.shape == (SIZE[1], SIZE[0], 3)
    assert float(np.mean(cv2.absdiff(picture, pairs[one[1].number][1]))) < 4.0


def test_frames_are_those_of_one_moment_in_both_eyes(tmp_path: Path) -> None:
    found = taken(tmp_path, *two_films(tmp_path))
    for frame in found:
        left, right = (
            cv2.imread(str(tmp_path / "frames" / one), cv2.IMREAD_GRAYSCALE) for one in (frame.left, frame.right)
        )
        shift, _ = cv2.phaseCorrelate(left[:, 12:].astype(np.float32), right[:, :-12].astype(np.float32))
        assert np.hypot(*shift) < 0.3


@pytest.mark.parametrize("late", [1, 4])
def test_eyes_that_were_not_triggered_together_are_refused_with_how_late_one_is(tmp_path: Path, late: int) -> None:
    with pytest.raises(PhotoError, match=rf"walk_right.avi: runs {late} frames .* triggered together"):
        taken(tmp_path, *two_films(tmp_path, late=late))


def test_an_eye_that_loses_a_frame_on_the_way_is_refused_with_where(tmp_path: Path) -> None:
    pairs = panned(321, 2.0, shaking)
    left = write_film(tmp_path / "walk_left.avi", [left for left, _ in pairs[:320]], rate=5.0)
    lossy = [right for number, (_, right) in enumerate(pairs) if number != 130]
    right = write_film(tmp_path / "walk_right.avi", lossy, rate=5.0)
    with pytest.raises(PhotoError, match=r"walk_left.avi: runs 1 frames \(200 ms\) behind .* from \d+ s on, .*lost"):
        taken(tmp_path, left, right)


def test_videos_of_unequal_length_are_refused(tmp_path: Path) -> None:
    pairs = panned(40, 5.0)
    left = write_film(tmp_path / "l.avi", [left for left, _ in pairs])
    right = write_film(tmp_path / "r.avi", [right for _, right in pairs[:30]])
    with pytest.raises(PhotoError, match=r"ends after 30 frames, and .*l.avi goes on"):
        taken(tmp_path, left, right)


def test_videos_of_unequal_rates_and_sizes_are_refused(tmp_path: Path) -> None:
    pairs = panned(10, 5.0)
    left = write_film(tmp_path / "l.avi", [left for left, _ in pairs])
    slow = write_film(tmp_path / "r.avi", [right for _, right in pairs], rate=25.0)
    with pytest.raises(PhotoError, match=r"24.000 and 25.000 frames a second"):
        taken(tmp_path, left, slow)
    small = write_film(tmp_path / "s.avi", [right[:120, :160] for _, right in pairs])
    with pytest.raises(PhotoError, match="320 x 240 and 160 x 120"):
        taken(tmp_path, left, small)


def test_a_video_cut_off_in_its_middle_is_refused(tmp_path: Path) -> None:
    whole = write_film(tmp_path / "l.avi", [left for left, _ in panned(40, 5.0)])
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(PhotoError, match=r"video .*l.avi"):
        taken(tmp_path, whole, None)


def test_a_damaged_frame_is_named_with_its_own_file_and_both_eyes_are_not_blamed(tmp_path: Path) -> None:
    pairs = panned(40, 5.0)
    left = write_film(tmp_path / "l.avi", [left for left, _ in pairs])
    right = write_film(tmp_path / "r.avi", [right for _, right in pairs])
    data = bytearray(right.read_bytes())
    at = [found.start() for found in re.finditer(b"00dc", bytes(data))][30] + 10  # behind the picture's first bytes
    data[at : at + 2000] = bytes(2000)
    right.write_bytes(data)
    with pytest.raises(PhotoError, match=r"video .*r\.avi: a frame behind the first \d+ can't be decoded"):
        taken(tmp_path, left, right)


@pytest.mark.parametrize(
    "content",
    [b"#EXTM3U\nhttp://example.org/walk.ts\n", b"ffconcat version 1.0\nfile /etc/passwd\n", b"v=0\nc=IN IP4 1.2.3.4\n",
     b"<?xml version='1.0'?><MPD/>", b"\x89PNG\r\n\x1a\n0000", b""],
)  # fmt: skip
def test_a_list_of_other_files_is_no_video_whatever_its_name(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "walk.mp4").write_bytes(content)
    with pytest.raises(PhotoError, match=r"walk\.mp4: (its first bytes are no video's|the file is empty)"):
        check_container(tmp_path / "walk.mp4")


def test_bytes_that_only_begin_as_a_video_are_refused(tmp_path: Path) -> None:
    (tmp_path / "walk.mp4").write_bytes(b"\0\0\0\x18ftypmp42" + b"\x7f" * 5000)
    check_container(tmp_path / "walk.mp4")
    with pytest.raises(PhotoError, match="no picture in it can be decoded"):
        taken(tmp_path, tmp_path / "walk.mp4", None)
