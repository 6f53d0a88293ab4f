"""The door of this room: fills a workbook of the user's own, or says why not; it is the old one or the new one."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from asbuilt_bim.errors import FillError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.fill.book import Book, open_book
from asbuilt_bim.report.fill.mapping import FillMap, read_map
from asbuilt_bim.report.fill.package import open_package
from asbuilt_bim.report.fill.plan import Change, Plan, plan_fill
from asbuilt_bim.report.fill.sheet import Cell, Value, cell_value, with_values
from asbuilt_bim.report.fill.stale import stale_cells
from asbuilt_bim.storage.atomic_write import PART, replace_all

__all__ = ["Change", "FillMap", "Filled", "Plan", "fill_workbook", "read_map", "save_filled"]
MAX_FAULTS = 20
LEFT_S = 3600.0
"""No process writes one file for an hour."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Filled:
    """A workbook as it is to be; `data` is None where nothing changes."""

    path: Path
    before: bytes
    data: bytes | None
    plan: Plan
    stale: int  # formulas whose last value was taken away


def fill_workbook(path: Path, mapping: FillMap, report: ProgressReport) -> Filled:
    """Return a workbook with a result's quantities in its mapped cells; nothing is written yet.

    Raises:
        FillError: it can't be filled; the message names every row and cell that stands in the way.
    """
    book = open_book(open_package(path))
    plan = plan_fill(book, mapping, report)
    if plan.faults:
        shown = "\n".join(f"  {fault}" for fault in plan.faults[:MAX_FAULTS])
        more = f"\n  and {len(plan.faults) - MAX_FAULTS} more" if len(plan.faults) > MAX_FAULTS else ""
        raise FillError(f"{path}: was not filled, because\n{shown}{more}")
    if not plan.changes:
        return Filled(path=path, before=book.package.data, data=None, plan=plan, stale=0)
    values: dict[str, dict[tuple[int, int], Value]] = {}
    for change in plan.changes:
        values.setdefault(change.sheet, {})[change.row, change.column] = change.new
    stale = _stale(book, plan, values)
    changed = {
        plan.sheets[name].part: with_values(plan.sheets[name], values.get(name, {}), stale.get(name, []))
        for name in values.keys() | stale.keys()
    }
    if stale:
        changed[book.part] = book.calculating()
    data = book.package.with_parts(changed)
    _check(path, data, values)
    return Filled(path=path, before=book.package.data, data=data, plan=plan, stale=sum(map(len, stale.values())))


def save_filled(filled: Filled, when: datetime) -> Path:
    """Put the filled workbook in the old one's place, and the old one beside it; return where that lies.

    Both are whole on the disk before the workbook is replaced, so a kill leaves the old one or the new one.

    Raises:
        FillError: the workbook is open in another program, was changed meanwhile, or can't be written.
    """
    place = filled.path.resolve()  # a link stays one
    lock = next((one for one in (f"~${place.name}", f".~lock.{place.name}#") if place.with_name(one).exists()), None)
    if lock is not None:
        raise FillError(f"{filled.path}: is open in another program ({lock} is there); close it there, and fill again")
    if not os.access(place, os.W_OK):
        raise FillError(f"{filled.path}: is write-protected; allow writing, or fill a copy")
    if filled.data is None:
        raise FillError(f"{filled.path}: there is nothing to fill in")
    backup = _free(place, when)
    try:
        _sweep(place.parent, when)
        if place.read_bytes() != filled.before:
            raise FillError(f"{filled.path}: was changed while it was being filled; fill it again")
        replace_all({backup: filled.before, place: filled.data}, like=place)
    except OSError as problem:
        reason = problem.strerror or problem
        raise FillError(
            f"{filled.path}: can't be written ({reason}); it stays as it was: close it, or free space"
        ) from problem
    return filled.path.with_name(backup.name)


def _stale(book: Book, plan: Plan, values: Mapping[str, Mapping[tuple[int, int], Value]]) -> dict[str, list[Cell]]:
    """Return the cells of the whole workbook whose values follow from filled ones; their sheets go into the plan."""
    for name, part in book.parts.items():
        if name not in plan.sheets and any(word in book.package.parts[part] for word in (b"<f", b":f")):
            plan.sheets[name] = book.sheet(name)
    return {name: cells for name, cells in stale_cells(plan.sheets, values).items() if cells}


def _check(path: Path, data: bytes, values: Mapping[str, Mapping[tuple[int, int], Value]]) -> None:
    """Read the new workbook back: what isn't as it should be is never put in the old one's place."""
    book = open_book(open_package(path, data))
    for name, wanted in values.items():
        sheet = book.sheet(name)
        for (row, column), value in wanted.items():
            if cell_value(sheet.cells.get((row, column)), book.shared) != value:
                raise FillError(f"{path}: {name}, row {row}: couldn't be filled, and the fault is the program's own")


def _sweep(folder: Path, when: datetime) -> None:
    """Take away what a killed process of this program left half written long ago."""
    for half in folder.glob(f"{PART}*.part"):
        if when.timestamp() - half.stat().st_mtime > LEFT_S:
            half.unlink(missing_ok=True)


def _free(place: Path, when: datetime) -> Path:
    """Return a name for the old workbook that no file has."""
    stem = f"{place.stem}.before-{when:%Y%m%dT%H%M%SZ}"
    number = 1
    while (backup := place.with_name(f"{stem}{'' if number == 1 else f'-{number}'}{place.suffix}")).exists():
        number += 1
    return backup
