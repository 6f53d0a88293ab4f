"""A workbook as the archive that it is: which parts it has, what can't be filled, and the same with parts replaced."""

import io
import posixpath
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from asbuilt_bim.errors import FillError
from asbuilt_bim.report.fill.xml_places import Place, places
from asbuilt_bim.storage.regular_file import read_bytes

MAX_BYTES = 200_000_000
MAX_UNPACKED = 1_000_000_000
MAX_PARTS = 20_000
"""Corporate workbooks with pictures reach 100 MB; an archive that unpacks to more than this is made to do harm."""
_OLD = b"\xd0\xcf\x11\xe0"
_ENCRYPTED = "EncryptedPackage".encode("utf-16-le")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Package:
    """A workbook's parts by name, in their order; `data` is the file as it was read."""

    path: Path
    data: bytes
    infos: tuple[zipfile.ZipInfo, ...]
    parts: Mapping[str, bytes]
    comment: bytes

    def related(self, part: str) -> dict[str, tuple[str, str]]:
        """Return relation id -> (kind, part) of what a part refers to; kind is the last word of its type."""
        folder, name = posixpath.split(part)
        rels = self.parts.get(posixpath.join(folder, "_rels", f"{name}.rels"), b"")
        found = {}
        for one in self.places(rels, posixpath.join(folder, "_rels", f"{name}.rels")) if rels else ():
            if one.name == "Relationship" and one.attributes.get("TargetMode") != "External":
                target = one.attributes.get("Target", "")
                inside = target.lstrip("/") if target.startswith("/") else posixpath.join(folder, target)
                kind = one.attributes.get("Type", "").rpartition("/")[2]
                found[one.attributes.get("Id", "")] = (kind, posixpath.normpath(inside))
        return found

    def xml(self, part: str) -> list[Place]:
        """Return every element of a part with its place.

        Raises:
            FillError: there is no such part, or it is no XML that can be edited.
        """
        if part not in self.parts:
            raise FillError(f"{self.path}: the workbook is damaged: {part} is missing; {SAVE_AGAIN}")
        return self.places(self.parts[part], part)

    def places(self, data: bytes, part: str) -> list[Place]:
        """Return every element of a piece of XML with its place.

        Raises:
            FillError: it is no XML that can be edited.
        """
        try:
            return places(data)
        except ValueError as problem:
            raise FillError(f"{self.path}: {part}: {problem}; {SAVE_AGAIN}") from problem

    def with_parts(self, changed: Mapping[str, bytes]) -> bytes:
        """Return the archive with some parts replaced; all others, their order, dates and names stay."""
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.comment = self.comment
            for old in self.infos:
                info = zipfile.ZipInfo(old.filename, old.date_time)
                info.compress_type = old.compress_type
                info.external_attr, info.create_system = old.external_attr, old.create_system
                archive.writestr(info, changed.get(old.filename, self.parts[old.filename]))
        return out.getvalue()


SAVE_AGAIN = "open it in a spreadsheet program, save it as .xlsx, and fill that"


def open_package(path: Path, data: bytes | None = None) -> Package:
    """Read a workbook whole, from its file or from bytes that are to become it.

    Raises:
        FillError: it can't be read, or is of a sort that can't be filled; the message names the sort.
    """
    if data is None:
        data = read_bytes(path, MAX_BYTES, FillError)
    if data.startswith(_OLD):
        if _ENCRYPTED in data:
            raise FillError(f"{path}: is encrypted; take its password off, fill it, and put the password on again")
        raise FillError(f"{path}: is an old .xls, which isn't filled here; save it as .xlsx and fill that")
    if not data.startswith(b"PK\x03\x04"):
        raise FillError(f"{path}: is no .xlsx or .xlsm; name a workbook of one of these two sorts")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            infos = tuple(archive.infolist())
            _check(path, infos)
            parts = {info.filename: archive.read(info) for info in infos}
            comment = archive.comment
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        raise FillError(f"{path}: the archive is damaged ({error!s:.120}); {SAVE_AGAIN}") from error
    package = Package(path=path, data=data, infos=infos, parts=parts, comment=comment)
    _check_sort(package)
    return package


def workbook_part(package: Package) -> str:
    """Return the name of the part that lists the sheets.

    Raises:
        FillError: there is none.
    """
    found = [part for kind, part in package.related("").values() if kind == "officeDocument"]
    if len(found) != 1 or found[0] not in package.parts:
        raise FillError(f"{package.path}: is an archive, and no workbook; name a .xlsx or .xlsm")
    return found[0]


def _check(path: Path, infos: tuple[zipfile.ZipInfo, ...]) -> None:
    size = sum(info.file_size for info in infos)
    if len(infos) > MAX_PARTS or size > MAX_UNPACKED:
        limit = f"{MAX_UNPACKED / 1e6:,.0f} MB or {MAX_PARTS:,} parts"
        raise FillError(f"{path}: unpacks to {size / 1e6:,.0f} MB in {len(infos):,} parts, limit {limit}; {SAVE_AGAIN}")
    if any(info.flag_bits & 1 for info in infos):
        raise FillError(f"{path}: is an archive with a password; take it off, and fill that")
    if len({info.filename for info in infos}) < len(infos):
        raise FillError(f"{path}: the archive has a part twice, and programs read either; {SAVE_AGAIN}")


def _check_sort(package: Package) -> None:
    """Refuse what looks like a workbook and can't be filled, by its name."""
    names = package.parts.keys()
    if "mimetype" in names and b"opendocument" in package.parts["mimetype"]:
        raise FillError(f"{package.path}: is an OpenDocument file (.ods), which isn't filled here; save it as .xlsx")
    if any(name.endswith("workbook.bin") for name in names):
        raise FillError(f"{package.path}: is a binary workbook (.xlsb), which isn't filled here; save it as .xlsx")
    if any(name.startswith("_xmlsignatures/") for name in names):
        raise FillError(f"{package.path}: is signed, and filling it would break the signature; fill it before signing")
