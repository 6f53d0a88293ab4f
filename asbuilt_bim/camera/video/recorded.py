"""The day that a video says it was made on: MP4 and MOV hold it in their movie header (ISO 14496-12, 8.2.2)."""

import struct
from datetime import UTC, date, datetime, timedelta
from io import BufferedReader
from pathlib import Path

from asbuilt_bim.storage.regular_file import open_regular

_EPOCH = datetime(1904, 1, 1, tzinfo=UTC)
_BOXES = 100  # a camera's file holds a handful at a level


def made_on(path: Path) -> date | None:
    """Return the day, in UTC, that a video was written or exported on; None where it doesn't say.

    An export is younger than the walk, so the walk was recorded on that day or before.
    """
    try:
        with open_regular(path) as file:
            if not _enter(file, b"moov") or not _enter(file, b"mvhd"):
                return None
            head = file.read(12)
            (seconds,) = struct.unpack(">Q", head[4:]) if head[:1] == b"\x01" else struct.unpack(">I", head[4:8])
        return (_EPOCH + timedelta(seconds=seconds)).date() if seconds else None  # 0: the writer didn't know
    except (OSError, struct.error, OverflowError):
        return None


def _enter(file: BufferedReader, name: bytes) -> bool:
    """Go to the content of the first box of a name among those that follow."""
    for _ in range(_BOXES):
        start = file.tell()
        size, kind = struct.unpack(">I4s", file.read(8))
        if size == 1:
            (size,) = struct.unpack(">Q", file.read(8))
        if kind == name:
            return True
        if size < 8:
            return False
        file.seek(start + size)
    return False
