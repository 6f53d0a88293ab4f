"""`asbuilt-bim fill`: as-built quantities into a workbook of the user's own."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from asbuilt_bim.errors import FillError, ResultError
from asbuilt_bim.flow.output.carried_on import as_in_workbook
from asbuilt_bim.flow.output.folder import read_current
from asbuilt_bim.flow.output.kept import WORKBOOK
from asbuilt_bim.flow.output.publish import no_run
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.fill.write import Change, Filled, fill_workbook, read_map, save_filled
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.terminal.screen import Screen

MAX_LISTED = 15


def fill_command(path: Path, map_path: Path, source: Path, screen: Screen, when: datetime, *, dry_run: bool) -> int:
    """Fill a workbook from a run's result, or list what that would change.

    Raises:
        AsBuiltError: the result, the map or the workbook can't be used; the workbook stays as it is.
    """
    report, mapping = _result(source), read_map(map_path)
    if report.faults:
        reasons = "\n".join(f"  {words_of(fault)}" for fault in report.faults)
        raise FillError(f"{source}: nobody should be paid by this result before this is clear:\n{reasons}")
    if mapping.of_valuation:
        report = with_amounts(source, report, screen)
    filled = fill_workbook(path, mapping, report)
    _list(filled.plan.changes, screen, len(filled.plan.changes) if dry_run else MAX_LISTED)
    _warn(filled, report, screen)
    visit = f"the visit of {report.visit_date.isoformat()}"
    count = _count(len(filled.plan.changes), "cell")
    if filled.data is None:
        screen.say(f"{path}: nothing to change; {_count(filled.plan.same, 'cell')} already as of {visit}.")
    elif dry_run:
        screen.say(f"{path}: {count} would change ({visit}). Nothing was written (--dry-run).")
    else:
        backup = save_filled(filled, when)
        screen.say(f"{path}: {count} filled ({visit}). The workbook as it was: {backup}")
    if filled.stale:
        lost, them = ("Their last values were", "them") if filled.stale > 1 else ("Its last value was", "it")
        screen.say(
            f"{_count(filled.stale, 'formula')} {'depend' if filled.stale > 1 else 'depends'} on filled cells. {lost} "
            f"taken away; the next program that opens the workbook calculates {them}."
        )
    return 0


def with_amounts(source: Path, report: ProgressReport, screen: Screen) -> ProgressReport:
    """Return a result with the amounts of the workbook that lies in its folder, and say so where a person changed it.

    Raises:
        AsBuiltError: the workbook's amounts can't be known.
    """
    folder = source if source.is_dir() else source.parent
    if read_current(folder) is None:
        return report
    valued = as_in_workbook(folder, report)
    if valued is not report:
        screen.say(f"{folder / WORKBOOK}: was changed since the run; its amounts count, overrides and rates included.")
    return valued


def _result(source: Path) -> ProgressReport:
    """Read a result, or that of the current run in a folder."""
    if not source.exists():
        raise ResultError(f"{source}: there is no such folder; name the run's folder with --result FOLDER")
    if not source.is_dir():
        return read_result(source)
    current = read_current(source)
    if current is None:
        raise ResultError(no_run(source))
    return read_result(current.folder / "result.json")


def _list(changes: Sequence[Change], screen: Screen, most: int) -> None:
    for change in changes[:most]:
        old, new = _shown(change.old), _shown(change.new)
        screen.say(f"  {change.cell}: {old} -> {new}  ({change.quantity} of {' '.join(change.about.split())})")
    if len(changes) > most:
        screen.say(f"  ... and {len(changes) - most} more; --dry-run lists them all")


def _warn(filled: Filled, report: ProgressReport, screen: Screen) -> None:
    """Say what a person should know before somebody is paid."""
    plan = filled.plan
    for found, words in (
        (plan.strangers, "has a key that the result doesn't know, and was left as it was"),
        (plan.unknown, "is unknown: no number was filled in"),
        (plan.missing, "is in the result, and no row has it"),
    ):
        for text in found[:MAX_LISTED]:
            screen.warn(f"{text}: {words}")
        if len(found) > MAX_LISTED:
            screen.warn(f"... and {len(found) - MAX_LISTED} more like it")
    doubtful = [element.name or element.global_id for element in report.elements if element.doubts]
    if doubtful:
        names = ", ".join(doubtful[:MAX_LISTED]) + (" ..." if len(doubtful) > MAX_LISTED else "")
        screen.warn(f"look at the report before you pay for {names}: photos leave a doubt about them")


def _shown(value: object) -> str:
    if value is None:
        return "(empty)"
    return f"{value:.10g}" if isinstance(value, float) else f"'{value}'" if isinstance(value, str) else str(value)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
