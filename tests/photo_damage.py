"""Ways in which a station's photos go wrong, each done to a pair of files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.photo.read import read_photo

Damage = Callable[[Path, Path], None]


def _picture(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    assert image is not None
    return np.asarray(image)


def _rewrite(path: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Change a photo's pixels and keep its EXIF."""
    before = path.read_bytes()
    done, data = cv2.imencode(".jpg", change(_picture(path)), [cv2.IMWRITE_JPEG_QUALITY, 95])
    assert done
    length = struct.unpack(">H", before[4:6])[0] if before[2:4] == b"\xff\xe1" else 0
    exif = before[2 : 4 + length] if length else b""
    path.write_bytes(data.tobytes()[:2] + exif + data.tobytes()[2:])


def missing(left: Path, right: Path) -> None:
    right.unlink()


def truncated(left: Path, right: Path) -> None:
    left.write_bytes(left.read_bytes()[: left.stat().st_size // 2])


def text(left: Path, right: Path) -> None:
    left.write_text("This is not a photo.")


def empty(left: Path, right: Path) -> None:
    right.write_bytes(b"")


def smaller(left: Path, right: Path) -> None:
    _rewrite(right, lambda image: cv2.resize(image, None, fx=0.5, fy=0.5))


def swapped(left: Path, right: Path) -> None:
    one, other = left.read_bytes(), right.read_bytes()
    left.write_bytes(other)
    right.write_bytes(one)


def upright(left: Path, right: Path) -> None:
    _rewrite(left, lambda image: np.ascontiguousarray(np.rot90(image)))


def other_camera(left: Path, right: Path) -> None:
    for path in (left, right):
        model = read_photo(path).exif.model
        assert model, "the sample's photos say which camera took them"
        word = model.split()[-1].encode()  # the maker's name may stand in a field of its own
        data = path.read_bytes()
        path.write_bytes(data[:1000].replace(word, b"9" * len(word)) + data[1000:])
        assert read_photo(path).exif.model != model


def zoomed(left: Path, right: Path) -> None:
    for path in (left, right):
        length_mm = read_photo(path).exif.focal_length_mm
        assert length_mm > 0
        data = path.read_bytes()
        for order in "<>":
            for below in (1, 10, 100, 1000, 10000):
                above = round(length_mm * below)
                data = data.replace(
                    struct.pack(order + "II", above, below), struct.pack(order + "II", 2 * above, below)
                )
        path.write_bytes(data)
        assert abs(read_photo(path).exif.focal_length_mm - 2 * length_mm) < 0.1


def _grey(image: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR))


def without_red(left: Path, right: Path) -> None:
    for path in (left, right):
        _rewrite(path, _grey)


def red_on_the_left_only(left: Path, right: Path) -> None:
    _rewrite(right, _grey)


def hardly_overlapping(left: Path, right: Path) -> None:
    def moved(image: np.ndarray) -> np.ndarray:
        width = image.shape[1]
        rng = np.random.default_rng(1)
        out = rng.integers(0, 255, image.shape, dtype=np.uint8)
        out[:, : width // 4] = image[:, -(width // 4) :]
        return out

    _rewrite(right, moved)


DAMAGES: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "missing": (missing, ("missing_right.jpg", "right photo is missing", "copy it")),
    "truncated": (truncated, ("truncated_left.jpg", "cut short|truncated|missing", "copy")),
    "text": (text, ("text_left.jpg", "text|no JPEG|not a picture|no picture", "copy")),
    "empty": (empty, ("empty_right.jpg", "empty", "copy")),
    "smaller": (
        smaller,
        (
            "smaller",
            "640|size|pixels",
        ),
    ),
    "swapped": (
        swapped,
        (
            "swapped",
            "left and right",
        ),
    ),
    "upright": (
        upright,
        (
            "upright_left.jpg",
            "rotated|turned",
        ),
    ),
    "other": (
        other_camera,
        (
            "other_left.jpg",
            "another camera|other camera",
        ),
    ),
    "zoomed": (
        zoomed,
        (
            "zoomed_left.jpg",
            "zoom|focal",
        ),
    ),
    "colourless": (without_red, ("no red disc", "target")),
    "halfred": (red_on_the_left_only, ("right|one photo",)),
    "apart": (hardly_overlapping, ("30 %|overlap",)),
}
"""By station name: what is done to it, and what its message must say (patterns)."""
