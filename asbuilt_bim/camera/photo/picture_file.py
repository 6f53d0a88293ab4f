"""A picture file's outside: which kind it is, how large, whether it is whole, all before anything is decoded."""

import re
import struct
import zlib
from dataclasses import dataclass

_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_MARKER = re.compile(rb"\xff([^\x00\xd0-\xd7\xff])")
_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_MOST_SCANS = 200
"""Of a progressive picture, each as dear as a picture: programs write ten, and 64 waves of three colours are 192."""
_END_OF_IMAGE, _START_OF_SCAN, _APP1 = 0xD9, 0xDA, 0xE1


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureOutside:
    """What the bytes of a picture file say without decoding: `problem` is "" when nothing is wrong."""

    width_px: int = 0
    height_px: int = 0
    exif: bytes = b""  # the TIFF block, b"" where there is none
    problem: str = ""


def look_at(data: bytes) -> PictureOutside:
    """Tell kind, size and wholeness of a JPEG or PNG file from its bytes; other bytes come back with a problem."""
    if not data:
        return PictureOutside(problem="the file is empty")
    if data.startswith(_JPEG):
        return _jpeg(data)
    if data.startswith(_PNG):
        return _png(data)
    return PictureOutside(problem=f"the file is not a JPEG or PNG picture ({_guess(data)})")


def is_jpeg(data: bytes) -> bool:
    """Say whether a file begins as a JPEG does."""
    return data.startswith(_JPEG)


def has_alpha(data: bytes) -> bool:
    """Say whether a PNG picture holds how opaque its pixels are, in a channel of its own or by colours."""
    return data.startswith(_PNG) and (data[25:26] in (b"\x04", b"\x06") or b"tRNS" in data[: data.find(b"IDAT")])


def _guess(data: bytes) -> str:
    if data[4:8] == b"ftyp" and data[8:11] in (b"hei", b"hev", b"mif", b"msf", b"avi"):
        return "it looks like HEIC"
    if data[4:8] in (b"ftyp", b"moov", b"wide") or data[8:12] == b"AVI " or data[:4] == b"\x1aE\xdf\xa3":
        return "it looks like a video, which belongs under video in the project file"
    if data[:4] in (b"II*\x00", b"MM\x00*"):
        return "it looks like TIFF or a camera's RAW"
    if data[:4] == b"RIFF" or data[:4] == b"GIF8" or data[:2] == b"BM":
        return "it looks like another picture format"
    text = all(byte >= 32 or byte in b"\t\r\n" for byte in data[:64])
    return "it looks like text" if text else "its first bytes belong to no picture format"


def _jpeg(data: bytes) -> PictureOutside:
    """Walk the segments of a JPEG up to the end-of-image marker of its first picture."""
    at, width, height, exif, scans = 2, 0, 0, b"", 0
    while (found := _MARKER.search(data, at)) is not None:
        kind, body = found.group(1)[0], found.end()
        scans += kind == _START_OF_SCAN
        if scans > _MOST_SCANS:
            return PictureOutside(
                problem=f"its picture comes in more than {_MOST_SCANS} layers, which no camera writes"
            )
        if kind == _END_OF_IMAGE:
            problem = "" if width and height else "the picture has no size"
            return PictureOutside(width_px=width, height_px=height, exif=exif, problem=problem)
        if body + 2 > len(data):
            break
        (length,) = struct.unpack_from(">H", data, body)
        if kind in _START_OF_FRAME and body + 7 <= len(data):
            height, width = struct.unpack_from(">HH", data, body + 3)
        if kind == _APP1 and not exif and data[body + 2 : body + 8] == b"Exif\x00\x00":
            exif = data[body + 8 : body + length]
        at = body + max(length, 2)
    return PictureOutside(
        width_px=width, height_px=height, exif=exif, problem="the file is truncated: a JPEG that ends before its end"
    )


def png_with_exif(png: bytes, exif: bytes) -> bytes:
    """Return a PNG picture with an EXIF block behind its first chunk, the header."""
    chunk = b"eXIf" + exif
    end = 33  # signature, and length, kind, 13 bytes and check sum of the header
    return png[:end] + struct.pack(">I", len(exif)) + chunk + struct.pack(">I", zlib.crc32(chunk)) + png[end:]


def _png(data: bytes) -> PictureOutside:
    """Walk the chunks of a PNG up to IEND."""
    at, width, height, exif = 8, 0, 0, b""
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = at + 8
        if kind == b"IHDR" and body + 8 <= len(data):
            width, height = struct.unpack_from(">II", data, body)
        if kind == b"eXIf" and not exif:
            exif = data[body : body + length]
        if kind == b"IEND":
            problem = "" if width and height else "the picture has no size"
            return PictureOutside(width_px=width, height_px=height, exif=exif, problem=problem)
        at = body + length + 4
    return PictureOutside(
        width_px=width, height_px=height, exif=exif, problem="the file is truncated: a PNG that ends before its end"
    )
