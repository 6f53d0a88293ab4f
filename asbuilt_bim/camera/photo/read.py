"""Photos: read as bytes first, looked at from outside, then decoded as they were stored, never turned by EXIF."""

import hashlib
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.camera.photo.by_opencv import decoded_by_opencv
from asbuilt_bim.camera.photo.exif import PhotoExif, exif_from_tiff
from asbuilt_bim.camera.photo.jpeg.damage import damage_of_picture, sound_jpeg
from asbuilt_bim.camera.photo.picture_file import has_alpha, is_jpeg, look_at
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.storage.regular_file import open_regular

__all__ = ["MAX_PIXELS", "Photo", "PhotoExif", "decode", "photo_from_bytes", "read_photo", "side_by_side"]

MAX_PIXELS = 100_000_000
"""No site camera has more than 100 megapixels; a file that says so is damaged or meant to exhaust the memory."""
MAX_BYTES = 500_000_000
_REMEDY = "copy it from the camera again"
_FILL_ROWS = 8  # the decoder fills whole blocks of 8 rows where data is missing
_FILL_GREY = 128  # with the middle of its range
_DARK_GREY, _LEAST_LIT = 32, 0.001
"""Of 255: under an eighth of the range concrete's grain is one or two levels, and its faces fall into pieces."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Photo:
    """A picture file as bytes: `digest` is their SHA-256, `exif` what they say of the camera; not decoded yet.

    `eye` says which half of the file is this photo, where one file holds both eyes side by side.
    """

    name: str  # the path as the user wrote it, for messages
    data: bytes
    digest: str
    exif: PhotoExif
    eye: Literal["", "left", "right"] = ""

    @property
    def size_px(self) -> tuple[int, int]:
        """Return width and height as the file's header says, of one eye; `decode` holds the pixels to it."""
        return self.exif.width_px // (2 if self.eye else 1), self.exif.height_px


def side_by_side(both: Photo) -> tuple[Photo, Photo]:
    """Return the left and the right photo of a file that holds both eyes, each half of its width.

    Raises: PhotoError where its width is odd.
    """
    if both.exif.width_px % 2:
        raise PhotoError(
            f"photo {both.name}: {both.exif.width_px} pixels wide, so it can't hold two photos side by side; name a "
            "file each for left and right"
        )

    def half(eye: Literal["left", "right"], name: str) -> Photo:
        digest = hashlib.sha256(f"{eye} of {both.digest}".encode()).hexdigest()
        return replace(both, name=name, digest=digest, eye=eye)

    return half("left", both.name), half("right", f"{both.name} (right half)")


def read_photo(path: Path) -> Photo:
    """Read a photo's bytes and look at them from outside.

    Raises: PhotoError where the file is missing, can't be read, is empty, is no JPEG or PNG, is truncated, or holds
    more than `MAX_PIXELS`.
    """
    try:
        with open_regular(path) as file:
            if (size := os.fstat(file.fileno()).st_size) > MAX_BYTES:
                raise PhotoError(f"photo {path}: {size / 1e6:.0f} MB is no photo of a station")
            data = file.read()
    except FileNotFoundError:
        raise PhotoError(f"photo {path}: there is no such file; copy it there, or correct the path") from None
    except IsADirectoryError:
        raise PhotoError(f"photo {path}: this is a folder; name the picture file") from None
    except OSError as error:
        raise PhotoError(
            f"photo {path}: it can't be read ({error.strerror or error}); check the file's rights and the disk"
        ) from error
    return photo_from_bytes(str(path), data)


def photo_from_bytes(name: str, data: bytes) -> Photo:
    """Look at a picture file's bytes from outside.

    Raises: PhotoError as `read_photo` does.
    """
    outside = look_at(data)
    if outside.problem:
        raise PhotoError(f"photo {name}: {outside.problem}; copy the photo from the camera again, as JPEG or PNG")
    pixels = outside.width_px * outside.height_px
    if pixels > MAX_PIXELS:
        raise PhotoError(
            f"photo {name}: {outside.width_px} x {outside.height_px} pixels exceed {MAX_PIXELS / 1e6:.0f} million; "
            "the file is damaged, or not a photo of the rig"
        )
    exif = exif_from_tiff(outside.exif, outside.width_px, outside.height_px)
    return Photo(name=name, data=data, digest=hashlib.sha256(data).hexdigest(), exif=exif)


def decode(photo: Photo) -> ByteImage:
    """Decode to BGR uint8 (H, W, 3) as the sensor stored it: EXIF orientation is not applied.

    Raises: PhotoError where the bytes can't be decoded, only in part, show damage (`jpeg/damage.py`), or
    are nearly black.
    """
    decoded, damage = sound_jpeg(photo.data) if is_jpeg(photo.data) else (decoded_by_opencv(photo.data), "")
    if damage:
        raise PhotoError(f"photo {photo.name}: it is damaged, {damage}; {_REMEDY}")
    if decoded is None:
        raise PhotoError(f"photo {photo.name}: it can't be decoded, it is damaged; {_REMEDY}")
    if hidden := _transparent(photo.data):
        raise PhotoError(
            f"photo {photo.name}: {hidden:.0%} of its pixels are transparent, so it was edited; give it as it was taken"
        )
    height, width = decoded.shape[:2]
    if (width, height) != (photo.exif.width_px, photo.exif.height_px):
        raise PhotoError(f"photo {photo.name}: it decodes to {width} x {height} pixels, not to what it says")
    if height > _FILL_ROWS and bool((decoded[-_FILL_ROWS:] == _FILL_GREY).all()):
        raise PhotoError(f"photo {photo.name}: its lower part is missing (it decodes to plain grey); {_REMEDY}")
    brightest = np.maximum(np.maximum(decoded[..., 0], decoded[..., 1]), decoded[..., 2])  # a tenth of max(axis=2)
    if (lit := float(np.mean(brightest >= _DARK_GREY))) < _LEAST_LIT:
        raise PhotoError(
            f"photo {photo.name}: it is nearly black, {lit:.2%} of its pixels are brighter than an eighth of its range "
            f"(at least {_LEAST_LIT:.1%}). Where 10, 12 or 14 bits were stored in 16, export it over the whole range. "
            "Else take the station again with more light"
        )
    if damage := damage_of_picture(photo.data, decoded):
        raise PhotoError(f"photo {photo.name}: it is damaged, {damage}; {_REMEDY}")
    if photo.eye:
        half = width // 2
        decoded = np.ascontiguousarray(decoded[:, :half] if photo.eye == "left" else decoded[:, half:])
    return decoded


def _transparent(data: bytes) -> float:
    """Return the share of a picture's pixels that are hidden by half or more; what lies there is anything."""
    if not has_alpha(data):
        return 0.0
    whole = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if whole is None or whole.ndim != 3 or whole.shape[2] != 4:
        return 0.0
    opaque = 255 if whole.dtype == np.uint8 else 65535
    return float(np.mean(whole[..., 3] < opaque / 2))
