"""A video file from outside and opened: containers that cameras write, and nothing that leads to other files."""

import os
from pathlib import Path

import cv2

from asbuilt_bim.camera.photo.read import MAX_PIXELS
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.storage.regular_file import open_regular

MAX_BYTES = 100_000_000_000
"""An hour of two eyes at the highest rate that a camera writes."""
MAX_FRAMES = 216_000
"""An hour at 60 frames a second: nobody walks a visit for longer without a stop."""
_HEAD = 12
_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
_REMEDY = "give MP4, MOV, AVI or MKV as the camera wrote it, or export it to MP4"


def check_container(path: Path) -> None:
    """See that a file is a video in a container of its own.

    Playlists are refused by their first bytes: a decoder would open what they name, on this machine or another.

    Raises:
        PhotoError: it can't be read, is too large, or is no such video.
    """
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            head = file.read(_HEAD)
    except FileNotFoundError:
        raise PhotoError(f"video {path}: there is no such file; copy it there, or correct the path") from None
    except OSError as error:
        raise PhotoError(f"video {path}: it can't be read ({error.strerror or error})") from error
    if size > MAX_BYTES:
        raise PhotoError(f"video {path}: {size / 1e9:.0f} GB, limit {MAX_BYTES / 1e9:.0f}; cut it into walks")
    if not size:
        raise PhotoError(f"video {path}: the file is empty; copy it from the camera again")
    movie = head[4:8] in _BOXES
    avi = head[:4] == b"RIFF" and head[8:12] == b"AVI "
    matroska = head[:4] == b"\x1aE\xdf\xa3"
    if not (movie or avi or matroska):
        raise PhotoError(f"video {path}: its first bytes are no video's; {_REMEDY}")


def opened(path: Path) -> cv2.VideoCapture:
    """Open a video that `check_container` has passed, frames as they are stored, never turned.

    Raises:
        PhotoError: nothing in it can be decoded, or its frames are too large.
    """
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = "protocol_whitelist;file"  # in a process of its own
    film = cv2.VideoCapture(str(path.absolute()), cv2.CAP_FFMPEG)
    if not film.isOpened():
        raise PhotoError(f"video {path}: no picture in it can be decoded; {_REMEDY}")
    film.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    width, height = size_of(film)
    if not 0 < width * height <= 2 * MAX_PIXELS:
        raise PhotoError(f"video {path}: frames of {width} x {height} pixels are none of a camera's; {_REMEDY}")
    if (count := film.get(cv2.CAP_PROP_FRAME_COUNT)) > MAX_FRAMES:
        raise PhotoError(f"video {path}: {count:,.0f} frames, limit {MAX_FRAMES:,}; cut it into walks")
    return film


def size_of(film: cv2.VideoCapture) -> tuple[int, int]:
    """Return width and height of an open video's frames."""
    return int(film.get(cv2.CAP_PROP_FRAME_WIDTH)), int(film.get(cv2.CAP_PROP_FRAME_HEIGHT))
