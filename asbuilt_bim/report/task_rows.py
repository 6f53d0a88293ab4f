"""The rows of tasks and of late elements, worked out once: csv, workbook and page only write them."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime

from asbuilt_bim.progress.completion.forecast import forecast_of
from asbuilt_bim.progress.completion.moments import late_days
from asbuilt_bim.progress.completion.planned import (
    Knowledge,
    LateElement,
    due_but_unknown,
    late_alone,
    late_elements,
    verdict,
)
from asbuilt_bim.progress.report import Completion, ProgressReport, TaskProgress
from asbuilt_bim.report.tables import NO_STOREY, storey_names
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.values import plain


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRow:
    """A task: what the plan wants, what is known, how late it is."""

    identification: str
    name: str
    outline: str
    global_id: str
    planned_start: datetime | None
    planned_finish: datetime | None
    seen_begun: date | None
    seen_complete: date | None
    knowledge: Knowledge
    completion: Completion
    certain: float | None  # the share that schedules get: the lower bound
    planned: float | None
    behind_days: int | None  # None: unknown, or there is no plan
    behind_least_days: int | None  # None: there is no plan
    behind_most_days: int | None  # None: there is no plan
    late: bool | None
    late_days: int | None  # past its planned finish, as an element's are; None: unknown, or there is no plan
    forecast_finish: datetime | None  # None: nothing says when
    forecast_earliest: datetime | None  # the same, if all that may be built is built
    elements: int
    complete: int  # less those complete as far as seen
    as_far_as_seen: int
    part: int
    not_started: int
    displaced: int
    unknown: int
    others: int  # made by the task, too, and not measured here
    note: str

    @property
    def has_plan(self) -> bool:
        """Say whether there is a plan to be behind of."""
        return self.behind_least_days is not None

    @property
    def days_range(self) -> str:
        """Write how many days behind it is in the best and worst case; one number where that is all that is known."""
        least, most = self.behind_least_days, self.behind_most_days
        return str(least) if most is None or most <= (least or 0) else f"{least} to {most}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LateRow:
    """An element that should stand and was seen not to, or seen too little to say."""

    storey: str
    name: str
    global_id: str
    state: str
    best: float | None
    lower: float
    task: str
    due: date
    late_days: int  # since it was due
    is_sure: bool  # whether it was seen not to stand


def task_rows(report: ProgressReport) -> tuple[TaskRow, ...]:
    """Return the tasks in the schedule's order."""
    return tuple(_task_row(task, report) for task in report.tasks)


def late_rows(report: ProgressReport) -> tuple[LateRow, ...]:
    """Return the late elements, the latest first."""
    return _rows_of(late_elements(report), report, is_sure=True)


def unclear_rows(report: ProgressReport) -> tuple[LateRow, ...]:
    """Return the elements that should stand and were seen too little to say, the longest due first."""
    return _rows_of(due_but_unknown(report), report, is_sure=False)


def _rows_of(found: Sequence[LateElement], report: ProgressReport, *, is_sure: bool) -> tuple[LateRow, ...]:
    names = storey_names(report)
    return tuple(
        LateRow(
            storey=names.get(late.element.storey, NO_STOREY),
            name=late.element.name or late.element.global_id,
            global_id=late.element.global_id,
            state=late.element.shown_state,
            best=late.element.completion.best_shown,
            lower=late.element.completion.lower,
            task=late.task,
            due=late.due,
            late_days=late.late_days,
            is_sure=is_sure,
        )
        for late in found
    )


def plan_words(report: ProgressReport) -> str:
    """Return in a sentence what the planned dates are and how they are counted."""
    status = f"Status date: the end of {report.visit_date.isoformat()}."
    if report.schedule is None:
        return f"{status} Planned dates are the IFC file's; every day counts alike."
    source, working = report.schedule, plain(report.schedule.calendar.name)
    return f"{status} Planned dates are those of {plain(source.name)} ({source.kind}), working time '{working}'."


def late_words(report: ProgressReport) -> str:
    """Return in a sentence how many elements are late; "" where the plan has no dates."""
    if not any(task.schedule_finish for task in report.tasks):
        return ""
    late, unknown = late_rows(report), len(due_but_unknown(report))
    open_ones = f"; {unknown} {'more ' if late else ''}should stand, and too little was seen of them to say"
    more = f"{open_ones if unknown else ''}.{_late_tasks(report)}"
    if not late and report.nothing_seen:
        return f"Nothing was seen at this visit, so nothing says whether an element is late{more}"
    if not late:
        return f"No element was seen late{more}"
    days = f"{late[0].late_days} day{'' if late[0].late_days == 1 else 's'}"
    count = "1 element is" if len(late) == 1 else f"{len(late)} elements are"
    return f"{count} late, '{plain(late[0].name)}' by {days}{more}"


def _late_tasks(report: ProgressReport) -> str:
    """Say which tasks are late by themselves: their elements have a later one; "" where there are none."""
    alone = [task.progress for task in late_alone(report)]
    if not alone:
        return ""
    first = plain(alone[0].name or alone[0].key)
    if len(alone) == 1:
        return f" The task '{first}' is late; its elements have until a later one."
    return f" {len(alone)} tasks are late, '{first}' among them; their elements have until later ones."


def _task_row(task: TaskProgress, report: ProgressReport) -> TaskRow:
    known, group, ends = verdict(task), task.progress, forecast_of(task, report)
    return TaskRow(
        identification=task.identification,
        name=group.name or group.key,
        outline=" / ".join(task.outline),
        global_id=group.key,
        planned_start=task.schedule_start,
        planned_finish=task.schedule_finish,
        seen_begun=task.actual_start,
        seen_complete=task.actual_finish,
        knowledge=known.knowledge,
        completion=group.completion,
        certain=known.share,
        planned=task.planned,
        behind_days=task.behind_days_shown,
        behind_least_days=task.behind_least_days,
        behind_most_days=task.behind_most_days,
        late=task.late,
        late_days=late_days(task.schedule_finish, task.late, report.visit_date),
        forecast_finish=ends.finish,
        forecast_earliest=ends.earliest,
        elements=len(group.elements),
        complete=group.surely_complete,
        as_far_as_seen=group.as_far_as_seen,
        part=group.part,
        not_started=group.not_started,
        displaced=group.displaced,
        unknown=group.unknown,
        others=task.others,
        note=note_words(known.note),
    )
