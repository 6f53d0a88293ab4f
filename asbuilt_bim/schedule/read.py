"""The door of this room: reads a schedule file by what it is, whatever its name ends in, and ties it to a design."""

import hashlib
from pathlib import Path
from typing import Literal

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.bim.schedule import EVERY_DAY, ScheduleSource, WorkCalendar
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import ScheduleError
from asbuilt_bim.schedule.calendars import msp_calendar, msp_recurring, own_calendars, p6_calendar
from asbuilt_bim.schedule.link_elements import with_schedule
from asbuilt_bim.schedule.msp import last_uid, msp_rows
from asbuilt_bim.schedule.p6 import p6_rows
from asbuilt_bim.schedule.rows import MAX_ROWS, ScheduleFile, ScheduleRow
from asbuilt_bim.schedule.safe_xml import local, parse_xml
from asbuilt_bim.schedule.table import csv_rows
from asbuilt_bim.storage.regular_file import path_of, read_bytes

MAX_BYTES = 200_000_000
_BINARY = {
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls) or an MS Project file (.mpp)",
    b"PK\x03\x04": "an Excel workbook (.xlsx) or a zip archive",
}


def scheduled(design: BimModel, path: Path | str) -> BimModel:
    """Return the design with the dates, outline and links of a schedule file on its tasks.

    Raises:
        ScheduleError: it can't be read, is no schedule, or holds no task.
    """
    return with_schedule(design, read_schedule(path))


def read_schedule(path: Path | str) -> ScheduleFile:
    """Read an MS Project XML, a Primavera P6 XML or a CSV file.

    Raises:
        ScheduleError: it can't be read, is none of these, or holds no task.
    """
    path = path_of(path, "path")
    data = read_bytes(path, MAX_BYTES, ScheduleError, f"schedule {path}")
    for beginning, what in _BINARY.items():
        if data.startswith(beginning):
            raise ScheduleError(f"{path}: is {what}; save it as XML (MS Project, P6) or as CSV")
    if data.startswith(b"ERMHDR"):
        raise ScheduleError(f"{path}: is a P6 XER file; export it as Primavera P6 XML")
    calendar, calendars, last = EVERY_DAY, dict[str, WorkCalendar](), 0
    kind: Literal["MS Project XML", "Primavera P6 XML", "CSV"] = "CSV"
    if _looks_like_xml(data):
        root = parse_xml(data, path)
        if local(root.tag) == "APIBusinessObjects":
            kind, (rows, notes), calendar = "Primavera P6 XML", p6_rows(root, path), p6_calendar(root, path)
        elif local(root.tag) == "Project":
            kind, (rows, notes), calendar = "MS Project XML", msp_rows(root, path), msp_calendar(root, path)
            last = last_uid(root)
            if recurring := msp_recurring(root):
                notes = (*notes, _count(Reason.SCHEDULE_RECURRING, recurring, path))
        else:
            raise ScheduleError(
                f"{path}: XML, but neither of MS Project nor of P6 (its root is <{local(root.tag)[:40]}>)"
            )
        calendars, own, lost = own_calendars(root, path)
        if own:
            notes = (*notes, _count(Reason.SCHEDULE_OWN_CALENDARS, own, path))
        if lost:
            notes = (*notes, _count(Reason.SCHEDULE_LOST_CALENDARS, lost, path))
    else:
        rows, notes = csv_rows(data, path)
    _check(rows, path)
    digest = f"sha256:{hashlib.sha256(data).hexdigest()}"
    source = ScheduleSource(name=path.name, digest=digest, kind=kind, calendar=calendar, last_uid=last)
    return ScheduleFile(source=source, rows=rows, notes=notes, calendars=calendars)


def _count(code: Reason, count: int, path: Path) -> Note:
    return noted(code, about(SubjectKind.SCHEDULE, path.name), count=count)


def _looks_like_xml(data: bytes) -> bool:
    start = data[:200].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start.startswith(b"<")


def _check(rows: tuple[ScheduleRow, ...], path: Path) -> None:
    if not rows:
        raise ScheduleError(f"{path}: holds no task; export the schedule with its tasks")
    if len(rows) > MAX_ROWS:
        raise ScheduleError(f"{path}: holds {len(rows):,} tasks, more than the {MAX_ROWS:,} of any building project")
    seen: set[str] = set()
    doubled = [row for row in rows if row.uid in seen or seen.add(row.uid)]  # type: ignore[func-returns-value]
    if doubled:
        raise ScheduleError(f"{path}: two tasks have the number {doubled[0].uid} ('{doubled[0].name[:60]}'); damaged")
