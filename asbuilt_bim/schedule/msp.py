"""MS Project XML (namespace http://schemas.microsoft.com/project): its tasks, their links and its calendar.

Reference: Microsoft, Project XML Data Interchange Schema (mspdi_pj12.xsd).
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from asbuilt_bim.bim.schedule import LinkKind, TaskLink
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.schedule.rows import ScheduleRow, dates, global_ids, listed, moment
from asbuilt_bim.schedule.safe_xml import child, children, text

_LINKS: dict[str, LinkKind] = {"0": "FF", "1": "FS", "2": "SF", "3": "SS"}
_SHARE_OF_DURATION = {"19", "20", "51", "52"}  # lag formats that are percents, not times
_TENTHS_OF_MINUTE = 600.0  # in an hour


def msp_rows(root: ET.Element, path: Path) -> tuple[tuple[ScheduleRow, ...], tuple[Note, ...]]:
    """Return the tasks of an MS Project document and remarks; summaries only as the outline of what is below them."""
    rows: list[ScheduleRow] = []
    above: list[tuple[int, str]] = []
    tasks = [t for t in children(child(root, "Tasks"), "Task") if text(t, "IsNull") != "1" and text(t, "Active") != "0"]
    levels = [_level(task) for task in tasks]
    baselines = 0
    for index, task in enumerate(tasks):
        level = levels[index]
        while above and above[-1][0] >= level:
            above.pop()
        if text(task, "Summary") == "1" or (index + 1 < len(tasks) and levels[index + 1] > level):
            if level > 0:  # level 0 is the project itself
                above.append((level, text(task, "Name")))
            continue
        if not text(task, "Name"):
            continue
        baseline = _baseline(task)
        baselines += baseline is not None
        holder = task if baseline is None else baseline
        fields = [text(field, "Value") for field in children(task, "ExtendedAttribute")]
        start, finish, fault = dates(text(holder, "Start"), text(holder, "Finish"), text(task, "Name"))
        rows.append(
            ScheduleRow(
                uid=text(task, "UID"),
                name=text(task, "Name"),
                identification=text(task, "WBS") or text(task, "OutlineNumber"),
                outline=tuple(name for _, name in above),
                start=start,
                finish=finish,
                links=tuple(_links(task)),
                global_ids=global_ids(fields),
                listed=listed(fields),
                fault=fault,
                calendar=text(task, "CalendarUID"),
            )
        )
    note = noted(Reason.SCHEDULE_BASELINES, about(SubjectKind.SCHEDULE, path.name), count=baselines, of=len(rows))
    return tuple(rows), ((note,) if baselines else ())


def last_uid(root: ET.Element) -> int:
    """Return the largest UID that a task or summary of the file has."""
    uids = (text(task, "UID") for tasks in children(root, "Tasks") for task in children(tasks, "Task"))
    return max((int(uid) for uid in uids if uid.isdecimal() and len(uid) < 11), default=0)


def _baseline(task: ET.Element) -> ET.Element | None:
    """Return a task's first baseline where it has both dates: a task in progress has moved its own."""
    for baseline in children(task, "Baseline"):
        start, finish = moment(text(baseline, "Start"), end=False), moment(text(baseline, "Finish"), end=True)
        if text(baseline, "Number") == "0" and start and finish:
            return baseline
    return None


def _links(task: ET.Element) -> Iterator[TaskLink]:
    for link in children(task, "PredecessorLink"):
        if text(link, "CrossProject") == "1" or not text(link, "PredecessorUID"):
            continue
        lag = 0.0 if text(link, "LagFormat") in _SHARE_OF_DURATION else number(text(link, "LinkLag"))
        kind = _LINKS.get(text(link, "Type"), "FS")
        yield TaskLink(predecessor=text(link, "PredecessorUID"), kind=kind, lag_h=lag / _TENTHS_OF_MINUTE)


def _level(task: ET.Element) -> int:
    return int(number(text(task, "OutlineLevel")))


def number(written: str) -> float:
    """Return a number as it is written, 0 where it is none, or one that no schedule holds."""
    try:
        value = float(written)
    except ValueError:
        return 0.0
    return value if abs(value) < 1e9 else 0.0
