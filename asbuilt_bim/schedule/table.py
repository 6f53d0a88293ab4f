"""A schedule as CSV: one task a line, its columns named in the first."""

import re
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from pathlib import Path

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import ScheduleError
from asbuilt_bim.schedule.rows import ScheduleRow, at_time, global_ids, moment
from asbuilt_bim.storage.csv_file import csv_table

DURATIONS = ("duration", "plannedduration", "originalduration", "remainingduration", "days")
COLUMNS = {
    "id": ("id", "identification", "taskid", "activityid", "wbs"),
    "name": ("name", "task", "taskname", "activityname", "activity"),
    "start": ("start", "plannedstart", "startdate", "schedulestart"),
    "finish": ("finish", "end", "plannedfinish", "finishdate", "enddate", "schedulefinish"),
    "globalids": ("globalid", "globalids", "elements", "ifcglobalid", "ifcglobalids"),
}
"""What a column may be called; capitals, spaces, dashes and underscores don't count."""
_GERMAN = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")
MAX_FAULTS = 8


def csv_rows(data: bytes, path: Path) -> tuple[tuple[ScheduleRow, ...], tuple[Note, ...]]:
    """Return the tasks of a CSV file; dates as 2026-03-02 (with or without a time) or 02.03.2026.

    Raises:
        ScheduleError: no text, no known columns, or dates that can't be read; names the lines.
    """
    table = csv_table(data, str(path), ScheduleError)
    places = _places(table.header, path)
    faults: list[str] = []
    rows = []
    for number, cells in table.rows:
        got = {key: cells[index] if index < len(cells) else "" for key, index in places.items()}
        rows.append(_row(number, got, faults))
    if faults:
        more = f"\n  and {len(faults) - MAX_FAULTS} more" if len(faults) > MAX_FAULTS else ""
        raise ScheduleError(f"{path}: can't be used:\n  " + "\n  ".join(faults[:MAX_FAULTS]) + more)
    return tuple(rows), _unread(table.header, rows, path)


def _unread(header: Sequence[str], rows: Sequence[ScheduleRow], path: Path) -> tuple[Note, ...]:
    """Say that durations aren't read, where a task has a start and no finish: which days are worked, no CSV says."""
    named = [cell for cell in header if re.sub(r"[\s_-]", "", cell).casefold() in DURATIONS]
    lack = sum(1 for row in rows if row.start and not row.finish)
    if not named or not lack:
        return ()
    subject = about(SubjectKind.SCHEDULE, path.name)
    return (noted(Reason.SCHEDULE_DURATIONS_UNREAD, subject, column=named[0][:40], count=lack),)


def _row(number: int, got: Mapping[str, str], faults: list[str]) -> ScheduleRow:
    start, finish = _date(got["start"], False, number, faults), _date(got["finish"], True, number, faults)
    if start and finish and finish < start:
        faults.append(f"line {number}: finish {got['finish']} is before start {got['start']}")
    if not got.get("name") and not got.get("id"):
        faults.append(f"line {number}: has neither an id nor a name")
    return ScheduleRow(
        uid=str(number),
        name=got.get("name") or got.get("id", ""),
        identification=got.get("id", ""),
        outline=(),
        start=start,
        finish=finish,
        links=(),
        global_ids=global_ids([got.get("globalids", "")]),
    )


def _date(written: str, end: bool, number: int, faults: list[str]) -> datetime | None:
    if not written:
        return None
    if dotted := _GERMAN.fullmatch(written):
        try:
            day, month, year = (int(part) for part in dotted.groups())
            return at_time(date(year, month, day), end=end)
        except ValueError:
            pass
    when = moment(written, end=end)
    if when is None:
        shown = written if len(written) <= 40 else written[:37] + "..."
        faults.append(f"line {number}: '{shown}' is no date; write 2026-03-02 (what 03/02 means differs by country)")
    return when


def _places(header: Sequence[str], path: Path) -> dict[str, int]:
    """Return where each column is; a start, a finish, and a name or an id must be there."""
    names = [re.sub(r"[\s_-]", "", cell).casefold() for cell in header]
    places = {key: names.index(name) for key, known in COLUMNS.items() for name in reversed(known) if name in names}
    for key in ("start", "finish"):
        twice = [cell for cell, name in zip(header, names, strict=True) if name in COLUMNS[key]]
        if len(twice) > 1:
            raise ScheduleError(
                f"{path}: the first line names more than one {key} ({', '.join(twice)[:80]}); keep the planned one"
            )
    missing = [key for key in ("start", "finish") if key not in places]
    missing += [] if "name" in places or "id" in places else ["name"]
    if missing:
        raise ScheduleError(
            f"{path}: the first line names no column {', '.join(missing)}; a schedule as CSV has the columns "
            "id, name, start, finish, and where wanted globalids"
        )
    return places
