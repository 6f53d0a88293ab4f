"""A copy of the IFC file that carries the result; the source is never touched."""

import os
import shutil
import uuid
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from asbuilt_bim.bim.file_names import file_names
from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.ifc.names import PHOTO
from asbuilt_bim.ifc.native_path import native_path
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.write.colours import Painter
from asbuilt_bim.ifc.write.costs import write_costs
from asbuilt_bim.ifc.write.entities import Marker, Words, bare
from asbuilt_bim.ifc.write.history import HistoryWriter
from asbuilt_bim.ifc.write.progress import mark_element, mark_storey, mark_task, photographed_areas
from asbuilt_bim.ifc.write.strip import strip
from asbuilt_bim.progress.report import ElementProgress, ProgressReport, ShownState, StationRecord

_END = b"END-ISO-10303-21"
_LEAST_FREE = 1_000_000  # bytes: a disk with less is what a copy failed for; the library doesn't say why it failed
_PLAIN = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/")
_LONGEST = 255  # an IfcLabel in IFC2X3


def write_asbuilt(
    source: Path | str,
    report: ProgressReport,
    target: Path | str,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
    words: Words = bare,
) -> None:
    """Write a copy of `source` to `target` that carries the report, and the visits before it as a history.

    `colours` (each state -> "#rrggbb") paints the elements by state, `words` makes the texts of notes. What an
    earlier run had written into `source` is replaced, so writing twice gives the same file. The copy appears whole or
    not at all.

    Raises:
        DesignError: the source can't be read.
        ResultError: the report names an element that the source doesn't hold.
        OutputError: the copy can't be written, or would replace its own source.
    """
    source, target = Path(source), Path(target)
    if target.resolve() == source.resolve():
        raise OutputError(f"{target}: would overwrite the design itself; give another name")
    file = open_ifc(source)
    mark_file(file, report, earlier=earlier, colours=colours, words=words, name=str(source))
    save(file, target)


def mark_file(
    file: Any,
    report: ProgressReport,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
    words: Words = bare,
    name: str = "the IFC file",
) -> None:
    """Write the result into an open file; `write_asbuilt` says what, `name` is what errors call the file.

    Raises:
        ResultError: the report names an element that the file doesn't hold.
    """
    strip(file)
    marker = Marker(file, words)
    visits = (*(one for one in earlier if one.visit_date < report.visit_date), report)
    history = HistoryWriter(marker, visits)
    painter = Painter(marker, colours) if colours else None
    photographed = photographed_areas(report)
    for progress, element in _elements(marker, report, name):
        mark_element(marker, element, progress, report, photographed.get(progress.global_id))
        history.write(element)
        if painter is not None:
            painter.paint(element, progress)
    files = _several(report)
    for group in report.storeys:
        if (thing := marker.find(group.key, "IfcSpatialStructureElement")) is not None:
            mark_storey(marker, thing, group, report, photographed, files)
            history.write(thing)
    for task in report.tasks:
        if (thing := marker.find(task.progress.key, "IfcTask")) is not None:
            mark_task(marker, thing, task, report, files)
            history.write(thing)
    history.finish()
    write_costs(marker, report.cost_lines, report.visit_date)
    write_photos(marker, visits)
    if painter is not None:
        painter.finish()


def _several(report: ProgressReport) -> str:
    """Return the names of the result's IFC files where they are several, "" else: a copy may bear any name."""
    names = report.provenance.ifc_name if report.provenance is not None else ""
    return names if len(file_names(names)) > 1 else ""


def strip_asbuilt(source: Path | str, target: Path | str) -> int:
    """Write a copy of `source` without what this program added, old values put back; return how many sets went.

    Raises:
        DesignError: the source can't be read.
        OutputError: the copy can't be written, or would replace its own source.
    """
    original, copy = Path(source), Path(target)
    if copy.resolve() == original.resolve():
        raise OutputError(f"{copy}: would overwrite its own source; give another name")
    file = open_ifc(original)
    count = strip(file)
    save(file, copy)
    return count


def save(file: Any, target: Path) -> None:
    """Write an open file to `target`: first beside it, whole and flushed, then moved into its place.

    Raises:
        OutputError: the folder can't be written, the disk is full, or the file is held by another program.
    """
    beside = target.with_name(f".{uuid.uuid4().hex[:12]}.ifc")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        beside.touch(exist_ok=False)  # the library would not say that it can't write here
        with native_path(beside.parent) as folder:
            file.write(str(folder / beside.name))
        _flush(beside)
        beside.replace(target)
    except (OSError, RuntimeError) as error:
        told = getattr(error, "strerror", None)
        full = not told and target.parent.is_dir() and shutil.disk_usage(target.parent).free < _LEAST_FREE
        reason = "the disk is full" if full else told or str(error)
        raise OutputError(
            f"{target}: the IFC copy can't be written ({reason}); check the folder's rights, free space, and that no "
            "other program holds the file"
        ) from error
    finally:
        for left_over in target.parent.glob(f"{beside.name}*"):  # the library writes into a file of its own first
            with suppress(OSError):
                left_over.unlink()


def _flush(path: Path) -> None:
    """Force a written file to the disk, and see that it came out whole."""
    with path.open("rb+") as stream:
        stream.seek(max(0, path.stat().st_size - 4096))
        if _END not in stream.read():
            raise OSError(28, "the file was cut short: no space left on device?")
        os.fsync(stream.fileno())


def _elements(marker: Marker, report: ProgressReport, name: str) -> list[tuple[ElementProgress, Any]]:
    pairs = [(progress, marker.find(progress.global_id, "IfcProduct")) for progress in report.elements]
    missing = [progress.global_id for progress, element in pairs if element is None]
    if missing:
        raise ResultError(
            f"{name}: {len(missing)} of the result's {len(pairs)} elements are not in this file ({missing[0]} ...). "
            "The result belongs to another design; give the IFC file that the run was made with"
        )
    return pairs


def write_photos(marker: Marker, reports: Sequence[ProgressReport]) -> None:
    """Add one IfcDocumentReference a station: the overlay beside the copy, and the left photo's path as identification.

    Paths are relative: the overlay's to the folder of the copy, the photo's to the project's. A visit carried over from
    an earlier run has no picture here, so no overlay.
    """
    for report in reports:
        seen: dict[str, list[str]] = {}
        for element in report.elements:
            if element.last_seen == report.visit_date:
                for name in element.stations:
                    seen.setdefault(name, []).append(element.global_id)
        for station in report.stations:
            things = [thing for key in seen.get(station.name, ()) if (thing := marker.find(key, "IfcProduct"))]
            if things:
                _refer(marker, station, things)


def _refer(marker: Marker, station: StationRecord, things: list[object]) -> None:
    day = station.day.isoformat()
    identification = "ItemReference" if marker.schema == "IFC2X3" else "Identification"
    location = uri(station.overlay) if station.picture else ""
    reference = marker.file.create_entity(
        "IfcDocumentReference",
        Location=location if 0 < len(location) <= _LONGEST else None,
        Name=f"{day} {station.name}"[:_LONGEST],
        **{identification: station.left_photo[-_LONGEST:] or None},
    )
    marker.rooted(
        "IfcRelAssociatesDocument",
        f"photo/{day}/{station.name}",
        Name=PHOTO,
        RelatedObjects=things,
        RelatingDocument=reference,
    )


def uri(path: str) -> str:
    """Return a relative path as a URI reference: what may not stand in one is escaped."""
    return "".join(chr(byte) if byte in _PLAIN else f"%{byte:02X}" for byte in path.encode())
