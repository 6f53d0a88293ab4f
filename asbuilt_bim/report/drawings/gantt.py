"""The tasks as bars: planned, what was seen of them with its bounds, the status date, the forecast.

All places are percents of the drawing's width, so that it takes any width and needs no script.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from itertools import groupby

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.drawings.timeline import Tick, TimeAxis, axis_over
from asbuilt_bim.report.task_rows import TaskRow
from asbuilt_bim.report.wording.of_page.gantt_words import (
    group_row_words,
    lateness_words,
    planned_words,
    seen_row_words,
)

MOST_ON_A_PAGE, MOST_TASKS = 60, 1200
_LEAST = 0.6  # percent: a day of a long plan is still seen
_AHEAD = 0.5  # of what is planned: a forecast further off ends at the border, and its date is told


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """A piece of a row, in percent of the drawing's width."""

    left: float
    width: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GanttRow:
    """A task; bars are None where nothing says where they begin or end."""

    number: str
    name: str
    planned: Bar | None
    certain: Bar | None  # of the planned bar, from its start: at least built
    possible: Bar | None  # further, up to what may be built
    seen: Bar | None  # from the visit that saw it begun to the one that saw it complete, or to now
    forecast: Bar | None  # from now on
    forecast_at: float | None  # its end; None where it lies past the drawing
    finished_at: float | None
    late: str  # "" where it isn't
    is_late: bool
    words: str

    @property
    def label(self) -> str:
        """Return the row as it is read out."""
        return f"{self.words}; {self.late}" if self.late else self.words


@dataclass(frozen=True, slots=True, kw_only=True)
class GanttGroup:
    """Tasks below one summary, in the schedule's order."""

    name: str  # "" where there is no summary
    words: str
    span: Bar | None
    rows: tuple[GanttRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class GanttPage:
    """As many tasks as are shown at a time."""

    first: int
    last: int
    late: int
    groups: tuple[GanttGroup, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Gantt:
    """The drawing; `more` tasks are left out."""

    pages: tuple[GanttPage, ...]
    ticks: tuple[Tick, ...]
    now: float
    status: date
    tasks: int
    more: int


def gantt_of(report: ProgressReport, tasks: Sequence[TaskRow]) -> Gantt | None:
    """Draw tasks, `MOST_ON_A_PAGE` at a time; None where no task has a date."""
    if not any(task.planned_start or task.planned_finish or task.seen_begun for task in tasks):
        return None
    shown = tasks[:MOST_TASKS]
    axis = _axis(shown, report.visit_date)
    pages = [shown[at : at + MOST_ON_A_PAGE] for at in range(0, len(shown), MOST_ON_A_PAGE)]
    return Gantt(
        pages=tuple(
            GanttPage(
                first=MOST_ON_A_PAGE * number + 1,
                last=MOST_ON_A_PAGE * number + len(page),
                late=sum(bool(task.late) for task in page),
                groups=tuple(_group(name, list(own), axis, report) for name, own in groupby(page, lambda t: t.outline)),
            )
            for number, page in enumerate(pages)
        ),
        ticks=axis.ticks,
        now=_now(axis, report),
        status=report.visit_date,
        tasks=len(tasks),
        more=len(tasks) - len(shown),
    )


def _axis(tasks: Sequence[TaskRow], status: date) -> TimeAxis:
    """Return the days that the bars need; forecasts stretch them by half of what is planned at most."""
    days = [status]
    for task in tasks:
        moments = (task.planned_start, task.planned_finish)
        days += [one.date() for one in moments if one is not None]
        days += [one for one in (task.seen_begun, task.seen_complete) if one is not None]
    known = axis_over(days)
    room = (date.max - known.last).days
    ahead = timedelta(days=min(room, int(_AHEAD * (known.last - known.first).days) + 1))
    ends = [task.forecast_finish.date() for task in tasks if task.forecast_finish is not None]
    return axis_over([*days, *(min(end, known.last + ahead) for end in ends)])


def _now(axis: TimeAxis, report: ProgressReport) -> float:
    """Return where the status date ends."""
    return axis.at(datetime(report.visit_date.year, report.visit_date.month, report.visit_date.day, 23, 59))


def _group(outline: str, tasks: Sequence[TaskRow], axis: TimeAxis, report: ProgressReport) -> GanttGroup:
    starts = [task.planned_start for task in tasks if task.planned_start is not None]
    ends = [task.planned_finish for task in tasks if task.planned_finish is not None]
    late = sum(bool(task.late) for task in tasks)
    return GanttGroup(
        name=outline,
        words=group_row_words(len(tasks), late),
        span=_bar(axis, min(starts), max(ends)) if outline and starts and ends else None,
        rows=tuple(_row(task, axis, report) for task in tasks),
    )


def _row(task: TaskRow, axis: TimeAxis, report: ProgressReport) -> GanttRow:
    now = _now(axis, report)
    planned = _bar(axis, task.planned_start, task.planned_finish)
    lower, upper = task.completion.lower, task.completion.upper
    seen = forecast = None
    if task.seen_begun is not None:
        begun, end = axis.at(task.seen_begun), axis.at(task.seen_complete) if task.seen_complete else now
        seen = Bar(left=begun, width=max(end - begun, _LEAST))
    ahead = axis.at(task.forecast_finish) if task.forecast_finish is not None and not task.seen_complete else None
    if ahead is not None and ahead > now:
        start = max(now, planned.left) if planned is not None and seen is None else now
        forecast = Bar(left=min(start, ahead), width=max(ahead - start, 0.0))
    inside = task.forecast_finish is not None and task.forecast_finish.date() <= axis.last
    return GanttRow(
        number=task.identification,
        name=task.name,
        planned=planned,
        certain=Bar(left=planned.left, width=planned.width * lower) if planned else None,
        possible=Bar(left=planned.left + planned.width * lower, width=planned.width * (upper - lower))
        if planned
        else None,
        seen=seen,
        forecast=forecast,
        forecast_at=ahead if inside else None,
        finished_at=axis.at(task.seen_complete) if task.seen_complete else None,
        late=lateness_words(task, report.visit_date),
        is_late=bool(task.late),
        words=f"{planned_words(task)}; {seen_row_words(task)}",
    )


def _bar(axis: TimeAxis, start: datetime | None, finish: datetime | None) -> Bar | None:
    """Return the bar between two moments; of one alone a short one there."""
    known = [moment for moment in (start, finish) if moment is not None]
    if not known or (start is not None and finish is not None and finish < start):
        return None
    left, right = axis.at(known[0]), axis.at(known[-1])
    width = max(right - left, _LEAST)
    return Bar(left=min(left, 100.0 - width), width=width)
