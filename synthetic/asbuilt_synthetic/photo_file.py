"""Writes photos as JPEG with the few EXIF entries a camera would set."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import cv2
import numpy as np

_QUALITY = 92


@dataclass(frozen=True, slots=True, kw_only=True)
class ExifTags:
    """What is written into a photo: who took it and when."""

    make: str
    model: str
    serial: str
    focal_mm: float
    taken: datetime
    width_px: int
    height_px: int


def write_photo(path: Path, rgb: np.ndarray, tags: ExifTags) -> None:
    """Encode and write a photo, whole or not at all."""
    done, coded = cv2.imencode(".jpg", np.ascontiguousarray(rgb[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    if not done:
        raise RuntimeError(f"{path}: the photo could not be encoded as JPEG")
    data = coded.tobytes()
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_bytes(data[:2] + exif_segment(tags) + data[2:])
    part.replace(path)


def exif_segment(tags: ExifTags) -> bytes:
    """Build the APP1 segment: IFD0 (make, model, orientation) and the Exif IFD (date, focal length, serial)."""
    stamp = tags.taken.strftime("%Y:%m:%d %H:%M:%S")
    exif = [
        (0x9003, 2, stamp),
        (0x920A, 5, (round(tags.focal_mm * 100), 100)),
        (0xA002, 4, tags.width_px),
        (0xA003, 4, tags.height_px),
        (0xA431, 2, tags.serial),
    ]
    first = [(0x010F, 2, tags.make), (0x0110, 2, tags.model), (0x0112, 3, 1), (0x0132, 2, stamp), (0x8769, 4, 0)]
    start = 8
    size = len(_directory(first, start))
    first[-1] = (0x8769, 4, start + size)
    tiff = b"II*\0" + struct.pack("<I", start) + _directory(first, start) + _directory(exif, start + size)
    body = b"Exif\0\0" + tiff
    return b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body


def _directory(entries: list[tuple[int, int, object]], offset: int) -> bytes:
    """Pack one image file directory that lies at an offset; long values follow it."""
    head, tail = struct.pack("<H", len(entries)), b""
    data_at = offset + 2 + 12 * len(entries) + 4
    for tag, kind, value in entries:
        if kind == 2:
            raw = str(value).encode("ascii") + b"\0"
            count = len(raw)
        elif kind == 5:
            raw, count = struct.pack("<II", *value), 1  # type: ignore[misc]
        else:
            raw, count = struct.pack("<H" if kind == 3 else "<I", value), 1
        if len(raw) <= 4:
            field = raw.ljust(4, b"\0")
        else:
            field = struct.pack("<I", data_at + len(tail))
            tail += raw + b"\0" * (len(raw) % 2)
        head += struct.pack("<HHI", tag, kind, count) + field
    return head + struct.pack("<I", 0) + tail
