"""What a photo's EXIF says of its camera: a small, bounded reader that never fails on hostile bytes."""

import struct
from dataclasses import dataclass
from datetime import date

MAX_ENTRIES = 512
"""A directory of a real camera holds under a hundred entries."""
MAX_TEXT_BYTES = 256

_MAKE, _MODEL, _ORIENTATION, _EXIF_IFD = 0x010F, 0x0110, 0x0112, 0x8769
_FOCAL_LENGTH, _BODY_SERIAL, _TAKEN = 0x920A, 0xA431, 0x9003
_ASCII, _SHORT, _LONG, _RATIONAL = 2, 3, 4, 5

Tags = dict[int, str | int | float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotoExif:
    """What tells one camera, one zoom and one orientation from another; "" and 0 where the photo doesn't say.

    `model` is make and model in one; `width_px`, `height_px` are of the stored picture, before any turning.
    """

    model: str = ""
    serial: str = ""
    focal_length_mm: float = 0.0
    orientation: int = 0  # 1..8 as EXIF numbers them, 0 unknown
    width_px: int = 0
    height_px: int = 0
    taken: date | None = None  # by the camera's clock


def exif_from_tiff(tiff: bytes, width_px: int, height_px: int) -> PhotoExif:
    """Read camera, serial, focal length, orientation and day out of an EXIF block (a TIFF header and directories)."""
    tags = _tags(tiff)
    make, model = _text(tags, _MAKE), _text(tags, _MODEL)
    orientation = tags.get(_ORIENTATION, 0)
    focal = tags.get(_FOCAL_LENGTH, 0.0)
    return PhotoExif(
        model=model if model.lower().startswith(make.lower()) else f"{make} {model}".strip(),
        serial=_text(tags, _BODY_SERIAL),
        focal_length_mm=float(focal) if isinstance(focal, int | float) and 0.0 < focal < 1e4 else 0.0,
        orientation=orientation if isinstance(orientation, int) and 1 <= orientation <= 8 else 0,
        width_px=width_px,
        height_px=height_px,
        taken=_day(_text(tags, _TAKEN)),
    )


def tiff_of_day(taken: date) -> bytes:
    """Return an EXIF block that says nothing but the day, as `exif_from_tiff` reads it."""
    text = taken.strftime("%Y:%m:%d 00:00:00").encode("ascii") + b"\x00"
    head = struct.pack("<4sI", b"II*\x00", 8)
    main = struct.pack("<HHHIII", 1, _EXIF_IFD, _LONG, 1, 26, 0)
    return head + main + struct.pack("<HHHIII", 1, _TAKEN, _ASCII, len(text), 44, 0) + text


def _day(text: str) -> date | None:
    """Read `2026:03:02 09:33:00`; None for anything else, such as a clock that was never set."""
    try:
        return date.fromisoformat(text[:10].replace(":", "-"))
    except ValueError:
        return None


def _text(tags: Tags, tag: int) -> str:
    value = tags.get(tag, "")
    return value if isinstance(value, str) else ""


def _tags(tiff: bytes) -> Tags:
    """Read the main directory and the EXIF directory; what can't be read is left out."""
    order = {b"II*\x00": "<", b"MM\x00*": ">"}.get(tiff[:4])
    if order is None or len(tiff) < 8:
        return {}
    tags = _directory(tiff, order, struct.unpack_from(order + "I", tiff, 4)[0])
    deeper = tags.get(_EXIF_IFD)
    if isinstance(deeper, int):
        tags = _directory(tiff, order, deeper) | tags
    return tags


def _directory(tiff: bytes, order: str, start: int) -> Tags:
    if start + 2 > len(tiff):
        return {}
    count = min(struct.unpack_from(order + "H", tiff, start)[0], MAX_ENTRIES, (len(tiff) - start - 2) // 12)
    tags: Tags = {}
    for index in range(count):
        at = start + 2 + 12 * index
        tag, kind, length = struct.unpack_from(order + "HHI", tiff, at)
        value = _value(tiff, order, at + 8, kind, length)
        if value is not None:
            tags.setdefault(tag, value)
    return tags


def _value(tiff: bytes, order: str, at: int, kind: int, length: int) -> str | int | float | None:
    """Return the first value of an entry whose value field starts at `at`; None for kinds that no tag here has."""
    if length < 1:
        return None
    if kind == _SHORT:
        return int(struct.unpack_from(order + "H", tiff, at)[0])
    (word,) = struct.unpack_from(order + "I", tiff, at)
    if kind == _LONG:
        return int(word)
    if kind == _RATIONAL and word + 8 <= len(tiff):
        over, under = struct.unpack_from(order + "II", tiff, word)
        return float(over / under) if under else None
    if kind == _ASCII:
        first = at if length <= 4 else int(word)
        raw = tiff[first : first + min(length, MAX_TEXT_BYTES)]
        text = raw.split(b"\x00")[0].decode("utf-8", "replace")
        return "".join(c for c in text if c.isprintable()).strip()
    return None
