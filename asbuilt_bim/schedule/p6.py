"""Primavera P6 XML (APIBusinessObjects, any version): its activities, their links and its calendar."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.bim.schedule import LinkKind, TaskLink
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.schedule.msp import number
from asbuilt_bim.schedule.rows import ScheduleRow, dates, global_ids, listed
from asbuilt_bim.schedule.safe_xml import children, text

_LINKS: dict[str, LinkKind] = {
    "Finish to Start": "FS",
    "Start to Start": "SS",
    "Finish to Finish": "FF",
    "Start to Finish": "SF",
}
_NO_WORK = {"WBS Summary", "Level of Effort"}
MAX_OUTLINE = 50


def p6_rows(root: ET.Element, path: Path) -> tuple[tuple[ScheduleRow, ...], tuple[Note, ...]]:
    """Return the activities of a P6 document's projects and remarks; baselines are other projects and aren't read."""
    projects = children(root, "Project")
    note = noted(Reason.SCHEDULE_PROJECTS, about(SubjectKind.SCHEDULE, path.name), count=len(projects))
    rows = _rows([*projects, root])  # the schema allows activities beside their project too
    return tuple(rows), ((note,) if len(projects) > 1 else ())


def _rows(holders: Sequence[ET.Element]) -> list[ScheduleRow]:
    wbs = {text(node, "ObjectId"): node for node in _all(holders, "WBS")}
    links: dict[str, list[TaskLink]] = {}
    for relation in _all(holders, "Relationship"):
        link = TaskLink(
            predecessor=text(relation, "PredecessorActivityObjectId"),
            kind=_LINKS.get(text(relation, "Type"), "FS"),
            lag_h=number(text(relation, "Lag")),
        )
        links.setdefault(text(relation, "SuccessorActivityObjectId"), []).append(link)
    return [
        _row(activity, wbs, links) for activity in _all(holders, "Activity") if text(activity, "Type") not in _NO_WORK
    ]


def _row(activity: ET.Element, wbs: dict[str, ET.Element], links: dict[str, list[TaskLink]]) -> ScheduleRow:
    start, finish, fault = dates(
        text(activity, "PlannedStartDate") or text(activity, "StartDate"),
        text(activity, "PlannedFinishDate") or text(activity, "FinishDate"),
        text(activity, "Name"),
    )
    fields = [text(field, "TextValue") for field in children(activity, "UDF")]
    return ScheduleRow(
        uid=text(activity, "ObjectId"),
        name=text(activity, "Name"),
        identification=text(activity, "Id"),
        outline=_outline(text(activity, "WBSObjectId"), wbs),
        start=start,
        finish=finish,
        links=tuple(links.get(text(activity, "ObjectId"), ())),
        global_ids=global_ids(fields),
        listed=listed(fields),
        fault=fault,
        calendar=text(activity, "CalendarObjectId"),
    )


def _all(holders: Sequence[ET.Element], tag: str) -> list[ET.Element]:
    return [one for holder in holders for one in children(holder, tag)]


def _outline(key: str, wbs: dict[str, ET.Element]) -> tuple[str, ...]:
    """Return the names of the work breakdown above an activity, the outermost first."""
    names: list[str] = []
    while key in wbs and len(names) < MAX_OUTLINE:
        names.append(text(wbs[key], "Name"))
        key = text(wbs[key], "ParentObjectId")
    return tuple(reversed(names))
