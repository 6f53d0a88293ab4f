"""A schedule as CSV: one task a line, its columns named in the first."""

import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime, time
from pathlib import Path

from asbuilt_bim.bim.schedule import at_time
from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, about, noted
from asbuilt_bim.errors import ScheduleError
from asbuilt_bim.schedule.rows import ScheduleRow, global_ids, listed, moment
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.storage.table_file import in_excel

DURATIONS = ("duration", "plannedduration", "originalduration", "remainingduration", "days", "dauer")
COLUMNS = {
    "id": ("id", "identification", "taskid", "activityid", "wbs", "nr", "nr.", "psp", "pspcode"),
    "name": ("name", "task", "taskname", "activityname", "activity", "vorgangsname", "vorgang"),
    "start": ("start", "plannedstart", "startdate", "schedulestart", "anfang", "beginn", "startdatum", "anfangstermin"),
    "finish": (
        "finish",
        "end",
        "plannedfinish",
        "finishdate",
        "enddate",
        "schedulefinish",
        "ende",
        "enddatum",
        "endtermin",
    ),
    "baseline start": ("baselinestart", "baselinestartdate", "blprojectstart", "geplanteranfang"),
    "baseline finish": ("baselinefinish", "baselinefinishdate", "baselineend", "blprojectfinish", "geplantesende"),
    "globalids": ("globalid", "globalids", "elements", "ifcglobalid", "ifcglobalids"),
}
"""What a column may be called; capitals, spaces, dashes and underscores don't count."""
_ACTUAL = re.compile(
    r"actual(start|finish|end)(date)?|.*(%|percent|pct)(work)?completed?"
    r"|ist(anfang|ende)|(tatsächlich|aktuell)e[rs](anfang|ende)|.*(%|prozent)(arbeit)?abgeschlossen"
)
_NO_DATE = ("", "NA", "NV")
"""How MS Project's tables leave a date out, in English and in German."""
_GERMAN = re.compile(r"(?:[A-Za-z]{2,3}\.? )?(\d{1,2})\.(\d{1,2})\.(\d{4}|\d{2})(?: (\d{1,2}):(\d{2})(?::\d{2})?)?")
"""02.03.2026, as MS Project writes it in German, too: `Mo 02.03.26 08:00`."""
MAX_FAULTS = 8


def csv_rows(data: bytes, path: Path) -> tuple[tuple[ScheduleRow, ...], tuple[Note, ...]]:
    """Return the tasks of a CSV file; dates as 2026-03-02 (with or without a time) or 02.03.2026.

    Raises:
        ScheduleError: no text, no known columns, or dates that can't be read; names the lines.
    """
    table = csv_table(data, str(path), ScheduleError)
    places = _places(table.header, path)
    faults: list[str] = []
    rows, baselines = list[ScheduleRow](), 0
    for number, cells in table.rows:
        got = {key: cells[index] if index < len(cells) else "" for key, index in places.items()}
        rows.append(_row(number, got, faults))
        baselines += _has_baseline(got)
    if faults:
        more = f"\n  and {len(faults) - MAX_FAULTS} more" if len(faults) > MAX_FAULTS else ""
        raise ScheduleError(f"{path}: can't be used:\n  " + "\n  ".join(faults[:MAX_FAULTS]) + more)
    subject = about(SubjectKind.SCHEDULE, path.name)
    note = noted(Reason.SCHEDULE_BASELINES, subject, count=baselines, of=len(rows))
    return tuple(rows), (*((note,) if baselines else ()), *_unread(table.header, rows, subject))


def _unread(header: Sequence[str], rows: Sequence[ScheduleRow], subject: Subject) -> Iterator[Note]:
    """Name the columns of what is measured here, and of durations where a task has a start and no finish.

    Which days are worked, no CSV says.
    """
    named = [cell[:40] for cell in header if _plain(cell) in DURATIONS]
    lack = sum(1 for row in rows if row.start and not row.finish)
    if named and lack:
        yield noted(Reason.SCHEDULE_DURATIONS_UNREAD, subject, column=named[0], count=lack)
    if actual := [cell[:40] for cell in header if _ACTUAL.fullmatch(_plain(cell))]:
        yield noted(Reason.SCHEDULE_ACTUALS_UNREAD, subject, columns=tuple(actual[:MAX_FAULTS]), count=len(actual))


def _has_baseline(got: Mapping[str, str]) -> bool:
    """Say whether a task has a baseline with both dates: then that is its plan, as in MS Project XML."""
    return all(got.get(f"baseline {end}", "").upper() not in _NO_DATE for end in ("start", "finish"))


def _row(number: int, got: Mapping[str, str], faults: list[str]) -> ScheduleRow:
    first, last = (("baseline " if _has_baseline(got) else "") + end for end in ("start", "finish"))
    start, finish = _date(got[first], False, number, faults), _date(got[last], True, number, faults)
    if start and finish and finish < start:
        faults.append(f"line {number}: {last} {got[last]} is before {first} {got[first]}")
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
        listed=listed([got.get("globalids", "")]),
    )


def _date(written: str, end: bool, number: int, faults: list[str]) -> datetime | None:
    if written.upper() in _NO_DATE:
        return None
    if dotted := _GERMAN.fullmatch(written):
        try:
            day, month, year = (int(part) for part in dotted.groups()[:3])
            hour, minute = dotted.groups()[3:]
            on = date(year if year > 99 else 2000 + year, month, day)
            return datetime.combine(on, time(int(hour), int(minute))) if hour else at_time(on, end=end)
        except ValueError:
            pass
    when = moment(written, end=end)
    if when is None:
        shown = written if len(written) <= 40 else written[:37] + "..."
        faults.append(
            f"line {number}: '{shown}' is no date; write 2026-03-02 or 02.03.2026{in_excel(shown)}; "
            "what 03/02 means differs by country, or give the plan as XML, as MS Project and P6 save it"
        )
    return when


def _places(header: Sequence[str], path: Path) -> dict[str, int]:
    """Return where each column is; a start, a finish, and a name or an id must be there."""
    names = [_plain(cell) for cell in header]
    places = {key: names.index(name) for key, known in COLUMNS.items() for name in reversed(known) if name in names}
    for key in ("start", "finish", "baseline start", "baseline finish"):
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
            f"id, name, start, finish, and where wanted globalids, and this one has {', '.join(header)[:120]}"
        )
    return places


def _plain(heading: str) -> str:
    return re.sub(r"[\s_-]", "", heading).casefold()
