"""Sentences on planned dates, the schedule file and cost lines."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.template import Template, filled

_TASK = "task {task}: "
_ITEM = "cost item {item}: "
_LOST = "cost item {item} left out: "
_NO_PLAN = "It has no planned dates here: correct the schedule"
_FILE = "Schedule {subject.name}: "
_ROW = "Schedule, task '{subject.name}': "


def _row(text: str) -> Template:
    """Return the sentence on a task of the schedule file whose dates don't count, and on what counts instead."""

    def words(note: Note) -> str:
        stand = "The IFC's dates stand" if note.values.get("ifc_dates") else "The IFC has none either: correct it"
        return filled(f"{_ROW}{text}. {stand}", note)

    return words


def _missing(note: Note) -> str:
    there = "the IFC's counts" if note.values["ifc_dates"] else "nor has the IFC. Give the {missing}"
    return filled(f"{_ROW}it has no {{missing}}; {there}", note)


def _undated(note: Note) -> str:
    rows = "{count:# task has|# tasks have} no dates: {tasks:quoted}{more}"
    kept = ". {dated:# keeps|# keep} the IFC's" if note.values["dated"] else ""
    rest = ". What has none makes nothing late; its elements are due by their other tasks. Give start and finish"
    return filled(f"{_FILE}{rows}{kept}{'' if note.values['dated'] == note.values['count'] else rest}", note)


_DATES: Mapping[Reason, Template] = {
    Reason.WORK_SCHEDULES_SEVERAL: "tasks stand in {count} work schedules ({schedules:list}{more}). All are shown; an "
    "element is due when its last task is",
    Reason.FINISH_WORKED_OUT: "{count:# task has|# tasks have} a start and a duration but no finish. The calendar "
    "gives it: {tasks:list}{more}",
    Reason.PLANS_DIFFER: f"{_TASK}it stands in {{schedules}} schedules with other dates in each. It has no "
    "planned dates here",
    Reason.DATE_UNREADABLE: f"{_TASK}its {{end}} '{{written}}' is no date. {_NO_PLAN}",
    Reason.FINISH_BEFORE_START: f"{_TASK}its finish {{finish}} is before its start {{start}}. {_NO_PLAN}",
    Reason.FINISH_UNKNOWN: f"{_TASK}it has a start and a duration ({{duration}}) but no finish, and no calendar gives "
    "it. Write the finish into the schedule",
    Reason.TASK_DATES_MORE: "{count:# more task|# more tasks} whose dates don't count",
    Reason.SCHEDULE_PROJECTS: f"{_FILE}it holds {{count}} projects, read as one",
    Reason.SCHEDULE_BASELINES: f"{_FILE}{{count}} of its {{of}} tasks have a baseline: that is their plan",
    Reason.SCHEDULE_RECURRING: f"{_FILE}{{count:# recurring exception|# recurring exceptions}} of its calendars not "
    "counted as days off",
    Reason.SCHEDULE_OWN_CALENDARS: f"{_FILE}{{count:# task has its own calendar|# tasks have their own calendars}} "
    "and {count:is|are} judged by it. The schedules written here count them in the project's",
    Reason.SCHEDULE_LOST_CALENDARS: f"{_FILE}{{count:# task names|# tasks name}} a calendar that it doesn't hold. The "
    "project's counts",
    Reason.SCHEDULE_DURATIONS_UNREAD: f"{_FILE}the column '{{column}}' isn't read. Write the finish of "
    "{count:# task that has|# tasks that have} only a start",
    Reason.SCHEDULE_ACTUALS_UNREAD: f"{_FILE}the {{count:column|columns}} {{columns:quoted}}{{more}} "
    "{count:isn't|aren't} read. What has begun and what stands, photos say",
    Reason.SCHEDULE_DATE_UNREADABLE: _row("its {end} '{written}' is no date from {years[0]} to {years[1]}"),
    Reason.SCHEDULE_FINISH_BEFORE_START: _row("its finish {finish} is before its start {start}"),
    Reason.SCHEDULE_DATE_CONTRADICTED: _row("it has only a {given}, and the IFC's {missing} contradicts it"),
    Reason.SCHEDULE_DATE_MISSING: _missing,
    Reason.SCHEDULE_DATES_MORE: f"{_FILE}{{count:# more task|# more tasks}} with such dates",
    Reason.SCHEDULE_ROWS_UNDATED: _undated,
    Reason.SCHEDULE_DATES_TAKEN: f"{_FILE}it gives {{elements:# element|# elements}} dates of their own. They count, "
    "and the IFC's don't, for these tasks of the IFC: {tasks:quoted}{more}. Their other elements are due by the IFC's",
    Reason.SCHEDULE_AMBIGUOUS: f"{_FILE}not linked, because more than one row or task fits: {{tasks:quoted}}{{more}}. "
    "Give a task of the IFC one row, or each row the GlobalIds of its elements; tell tasks of one name apart by ids",
    Reason.SCHEDULE_TASK_TAKEN: f"{_FILE}not linked, because another row has their task of the IFC: "
    "{tasks:quoted}{more}. Give a task of the IFC one row, or each row the GlobalIds of its elements",
    Reason.SCHEDULE_NUMBER_ALONE: f"{_FILE}not linked, because a mere number isn't enough: {{tasks:quoted}}{{more}}. "
    "Where the IFC's task of that number is meant, write its name beside it",
    Reason.SCHEDULE_NOT_LINKED: f"{_FILE}{{linked}} of its {{of}} tasks are linked to walls or columns. None of the "
    "IFC's other tasks has the GlobalId, id or name of {tasks:quoted}{more}",
    Reason.SCHEDULE_IDS_UNKNOWN: f"{_FILE}no wall or column that is measured here and no task of the IFC has the "
    "{count:GlobalId|GlobalIds} {elements:quoted}{more}. Correct what is mistyped",
    Reason.SCHEDULE_LACKS_TASKS: f"{_FILE}these tasks of the IFC get no dates from it and keep their own: "
    "{tasks:quoted}{more}",
}

_COSTS: Mapping[Reason, Template] = {
    Reason.COST_NOT_IN_IFC2X3: "IFC2X3 cost items hold no quantities and no rates: nothing is priced. Use an IFC4 "
    "file, or price the workbook's elements by hand",
    Reason.COST_NO_QUANTITY: f"{_LOST}it has no quantity",
    Reason.COST_MIXED_QUANTITIES: f"{_LOST}its quantities are not all volumes, areas, lengths or counts",
    Reason.COST_UNIT_IMPOSSIBLE: f"{_LOST}one of its units would be {{unit_scale:.3g}} SI units, which no unit is. "
    "Correct the unit",
    Reason.COST_RATES_SEVERAL: f"{_LOST}it has several rates, some for a time or on a condition. Keep the one that "
    "holds",
    Reason.COST_NO_RATE: f"{_LOST}it has no rate, or one that is no plain sum",
    Reason.COST_QUANTITY_IMPOSSIBLE: f"{_LOST}its quantity {{written}} is no number up to {{limit:.0e}}: correct it",
    Reason.COST_RATE_IMPOSSIBLE: f"{_LOST}its rate {{written}} is no number up to {{limit:.0e}}: correct it",
    Reason.COST_NESTED: f"{_LOST}the items nested in it count in its place",
    Reason.COST_PART_UNMEASURED: f"{_ITEM}{{others}} of the {{of}} elements that it pays for are not measured here. "
    "Their part is unknown, so not certain",
    Reason.COST_TAKES_OFF: f"{_ITEM}takes {{amount:.2f}} off when all of it is built. Certain totals also take off "
    "what wasn't seen of it",
    Reason.COST_SCHEDULES_SEVERAL: "cost lines stand in {count} cost schedules; each has its own sum",
    Reason.COST_PAID_TWICE: "cost items {other} and {item}: both pay for the same elements by {measure}; both count",
    Reason.COST_OF_OTHER_WORK: "{count:# cost item pays|# cost items pay} for no wall or column measured here: "
    "in no sum here",
}

PLAN_NOTES: Mapping[Reason, Template] = {**_DATES, **_COSTS}
