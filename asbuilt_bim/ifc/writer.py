"""A copy of the IFC file that carries the result; the source is never touched."""

from __future__ import annotations

import os
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.ifc.marks import Marker, Value
from asbuilt_bim.ifc.source import open_ifc
from asbuilt_bim.ifc.strip import strip
from asbuilt_bim.ifc.write_costs import write_costs
from asbuilt_bim.ifc.write_tasks import write_task
from asbuilt_bim.progress.report import Completion, ElementProgress, GroupProgress, ProgressReport, TaskProgress
from asbuilt_bim.version import __version__

_END = b"END-ISO-10303-21"


def write_asbuilt(source: Path, report: ProgressReport, target: Path) -> None:
    """Write a copy of `source` to `target` with the report's state on every observed element, storey, task, cost line.

    What an earlier run had written into `source` is replaced, so writing twice gives the same file. The copy appears
    whole or not at all.

    Raises:
        DesignError: the source can't be read.
        ResultError: the report names an element that the source doesn't hold.
        OutputError: the copy can't be written, or would replace its own source.
    """
    if target.resolve() == source.resolve():
        raise OutputError(f"{target}: would overwrite the design itself; give another name")
    file = open_ifc(source)
    strip(file)
    marker = Marker(file)
    elements = _elements(file, report, source)
    for progress, element in elements:
        if observed(progress):
            _mark_element(marker, element, progress, report)
    for storey in report.storeys:
        if (thing := _find(file, storey.key, "IfcBuildingStorey")) is not None:
            marker.properties(thing, _group_values(storey, report))
    for task in report.tasks:
        if (thing := _find(file, task.progress.key, "IfcTask")) is not None:
            _mark_task(marker, thing, task, report)
    write_costs(marker, report.cost_lines, report.visit_date)
    save(file, target)


def strip_asbuilt(source: Path, target: Path) -> int:
    """Write a copy of `source` without anything of ours, overwritten values put back; return how many sets went.

    Raises:
        DesignError: the source can't be read.
        OutputError: the copy can't be written, or would replace its own source.
    """
    if target.resolve() == source.resolve():
        raise OutputError(f"{target}: would overwrite its own source; give another name")
    file = open_ifc(source)
    count = strip(file)
    save(file, target)
    return count


def observed(progress: ElementProgress) -> bool:
    """Say whether anything at all is known of an element: only then does it get our sets."""
    return progress.completion.coverage > 0.0 or progress.as_built_area_m2 is not None


def save(file: Any, target: Path) -> None:
    """Write an open file to `target`: first beside it, whole and flushed, then moved into its place.

    Raises:
        OutputError: the folder can't be written, the disk is full, or the file is held by another program.
    """
    beside = target.with_name(f".{uuid.uuid4().hex[:12]}.ifc")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        beside.touch(exist_ok=False)  # the library would not say that it can't write here
        file.write(str(beside))
        _flush(beside)
        beside.replace(target)
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(
            f"{target}: the IFC copy can't be written ({reason}); check the folder's rights, free space, and that no "
            "other program holds the file"
        ) from error
    finally:
        with suppress(OSError):
            beside.unlink()


def _flush(path: Path) -> None:
    """Force a written file to the disk, and see that it came out whole."""
    with path.open("rb+") as stream:
        stream.seek(max(0, path.stat().st_size - 4096))
        if _END not in stream.read():
            raise OSError(28, "the file was cut short: no space left on device?")
        os.fsync(stream.fileno())


def _elements(file: Any, report: ProgressReport, source: Path) -> list[tuple[ElementProgress, Any]]:
    pairs = [(progress, _find(file, progress.global_id, "IfcProduct")) for progress in report.elements]
    missing = [progress.global_id for progress, element in pairs if element is None]
    if missing:
        raise ResultError(
            f"{source}: {len(missing)} of the result's {len(pairs)} elements are not in this file ({missing[0]} ...): "
            "the result belongs to another design; give the IFC file that the run was made with"
        )
    return pairs


def _find(file: Any, global_id: str, ifc_class: str) -> Any:
    try:
        found = file.by_guid(global_id)
    except RuntimeError:
        return None
    return found if found.is_a(ifc_class) else None


def _mark_element(marker: Marker, element: Any, progress: ElementProgress, report: ProgressReport) -> None:
    marker.properties(
        element,
        {
            "State": progress.state,
            **_completion_values(progress.completion),
            "DeviationFromDesign": progress.offset_m,
            "DeviationSigma": progress.offset_sigma_m,
            "Tilt": progress.tilt_rad,
            "VisitDate": progress.last_seen or report.visit_date,
            "Stations": ", ".join(progress.stations) or None,
            "ProgramVersion": _version(report),
        },
    )
    marker.areas(
        element,
        {
            "AsBuiltArea": progress.as_built_area_m2,
            "AsBuiltAreaSigma": progress.as_built_sigma_m2,
            "DesignExposedArea": progress.design_area_m2,
        },
    )


def _mark_task(marker: Marker, thing: Any, task: TaskProgress, report: ProgressReport) -> None:
    said = write_task(marker, thing, task, report.visit_date)
    marker.properties(thing, _group_values(task.progress, report) | said)


def _group_values(group: GroupProgress, report: ProgressReport) -> dict[str, Value | None]:
    return {
        "State": _group_state(group),
        **_completion_values(group.completion),
        "VisitDate": report.visit_date,
        "ProgramVersion": _version(report),
        "ElementsComplete": group.complete,
        "ElementsPart": group.part,
        "ElementsNotStarted": group.not_started,
        "ElementsUnknown": group.unknown,
    }


def _group_state(group: GroupProgress) -> str:
    if group.completion.best is None:
        return "unknown"
    if group.complete == len(group.elements):
        return "complete"
    return "not started" if group.not_started == len(group.elements) else "part"


def _completion_values(completion: Completion) -> dict[str, Value | None]:
    return {
        "CompletionBest": completion.best,
        "CompletionLower": completion.lower,
        "CompletionUpper": completion.upper,
        "Coverage": completion.coverage,
    }


def _version(report: ProgressReport) -> str:
    return report.provenance.program_version if report.provenance is not None else __version__
