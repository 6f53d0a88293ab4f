"""The one model inside an .ifczip, unpacked within bounds."""

import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import IO

from asbuilt_bim.errors import DesignError

MAX_BYTES = 2_000_000_000
"""Of a model: forty times the largest at hand; ifcopenshell holds some ten times the file in memory."""
MAX_RATIO = 100.0
"""STEP text packs 4 to 20 times; deflate can pack zeros 1,032 times, and that is a bomb."""
_FREE_BYTES = 10_000_000  # small archives may be packed as tightly as they like
_CHUNK = 1 << 20
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, RuntimeError, ValueError)
"""What `zipfile` raises, whichever byte is wrong."""
_ENCRYPTED = 0x1


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Give the .ifc inside an archive as a file of its own, for as long as the context lasts.

    Raises:
        DesignError: it is damaged, encrypted, holds no model, several, or one that would be too large.
    """
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        inside = Path(folder) / "model.ifc"
        try:
            with zipfile.ZipFile(path) as archive:
                member = _only_model(path, archive.infolist())
                with archive.open(member) as packed, inside.open("wb") as plain:
                    _copy(path, member, packed, plain)
        except _DAMAGE as error:
            reason = " ".join(str(error).split())[:160] or type(error).__name__
            raise DesignError(f"{path}: the archive is damaged ({reason}); pack the model again") from error
        except OSError as error:  # a damaged directory points before the file's beginning, too
            reason = error.strerror or str(error)
            raise DesignError(f"{path}: can't be unpacked ({reason}); pack it again, or free space") from error
        yield inside


def _only_model(path: Path, members: list[zipfile.ZipInfo]) -> zipfile.ZipInfo:
    """Return the one model of an archive, or refuse it by what it holds instead."""
    files = [m for m in members if not m.is_dir() and not _hidden(m.filename)]
    models = [m for m in files if m.filename.lower().endswith(".ifc")]
    if not models:
        if any(m.filename.startswith("xl/") for m in files):
            raise DesignError(f"{path}: is an Excel workbook, no model; save a plan as CSV and name it as schedule:")
        xml = any(m.filename.lower().endswith((".ifcxml", ".xml")) for m in files)
        found = "holds ifcXML, which can't be read" if xml else f"holds no .ifc ({len(files)} other files)"
        raise DesignError(f"{path}: the archive {found}; pack one model exported as IFC-SPF (.ifc)")
    if len(models) > 1:
        names = ", ".join(PurePosixPath(m.filename).name for m in models[:3])
        raise DesignError(f"{path}: the archive holds {len(models)} models ({names}); unpack it and name those wanted")
    (model,) = models
    if model.flag_bits & _ENCRYPTED:
        raise DesignError(f"{path}: the model in the archive is encrypted; pack it without a password")
    if model.file_size == 0:
        raise DesignError(f"{path}: the model in the archive is empty; pack it again")
    _check_size(path, model, model.file_size)
    return model


def _hidden(name: str) -> bool:
    return any(part.startswith((".", "__MACOSX")) for part in PurePosixPath(name).parts)


def _copy(path: Path, member: zipfile.ZipInfo, packed: IO[bytes], plain: IO[bytes]) -> None:
    """Inflate a member and count what really comes out, whatever the archive declares."""
    size = 0
    while chunk := packed.read(_CHUNK):
        size += len(chunk)
        _check_size(path, member, size)
        plain.write(chunk)


def _check_size(path: Path, member: zipfile.ZipInfo, size: int) -> None:
    ratio = size / max(member.compress_size, 1)
    if size > MAX_BYTES:
        why = f"{size / 1e6:.0f} MB exceeds {MAX_BYTES / 1e6:.0f} MB"
    elif size > _FREE_BYTES and ratio > MAX_RATIO:
        why = f"it grows {ratio:.0f} times (limit {MAX_RATIO:.0f})"
    else:
        return
    raise DesignError(f"{path}: the model in the archive is too large unpacked: {why}; give the model as .ifc")
