"""The result into copies of the design's files: each element into the file that owns it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from asbuilt_bim.errors import ResultError
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.write.copy import mark_file, save, write_asbuilt
from asbuilt_bim.ifc.write.entities import Words, bare
from asbuilt_bim.progress.report import ProgressReport, ShownState


def write_copies(
    sources: Sequence[Path],
    report: ProgressReport,
    folder: Path,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
    words: Words = bare,
) -> tuple[Path, ...]:
    """Write `<name>.asbuilt.ifc` into `folder` for each source that owns an element of the report; return the paths.

    What two sources hold is written into the one named first, as it is read. `words` makes the texts of notes.

    Raises:
        DesignError: a source can't be read.
        ResultError: the report names an element that no source holds.
        OutputError: a copy can't be written.
    """
    targets = _targets(sources, folder)
    if len(sources) == 1:
        write_asbuilt(sources[0], report, targets[0], earlier=earlier, colours=colours, words=words)
        return targets
    left = {element.global_id for element in report.elements}
    written = []
    for source, target in zip(sources, targets, strict=True):
        file = open_ifc(source)
        own = {key for key in left if _holds(file, key, "IfcProduct")}
        if own:
            part = _part(report, file, own)
            mark_file(file, part, earlier=earlier, colours=colours, words=words, name=str(source))
            save(file, target)
            written.append(target)
            left -= own
    if left:
        names = ", ".join(str(source) for source in sources)
        raise ResultError(
            f"{names}: {len(left)} of the result's {len(report.elements)} elements are in none of these files "
            f"({min(left)} ...). The result belongs to another design; give the files that the run was made with"
        )
    return tuple(written)


def _targets(sources: Sequence[Path], folder: Path) -> tuple[Path, ...]:
    """Return a copy's path for each source; of two sources with one name in two folders the second gets a number."""
    taken: set[str] = set()
    targets = []
    for source in sources:
        stem, number = source.stem, 1
        while (name := stem if number == 1 else f"{stem}-{number}").casefold() in taken:
            number += 1
        taken.add(name.casefold())
        targets.append(folder / f"{name}.asbuilt.ifc")
    return tuple(targets)


def _part(report: ProgressReport, file: Any, own: set[str]) -> ProgressReport:
    """Return what of a report belongs into one file; storeys and tasks that it lacks are passed over in writing."""
    return replace(
        report,
        elements=tuple(element for element in report.elements if element.global_id in own),
        cost_lines=tuple(line for line in report.cost_lines if _holds(file, line.global_id, "IfcCostItem")),
    )


def _holds(file: Any, global_id: str, ifc_class: str) -> bool:
    try:
        return bool(file.by_guid(global_id).is_a(ifc_class))
    except RuntimeError:
        return False
