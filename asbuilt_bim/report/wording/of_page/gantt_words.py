"""What stands beside the drawings over time: planned, seen and late in words, never by a colour alone."""

from collections.abc import Sequence
from datetime import date

from asbuilt_bim.report.drawings.chart import Bounds
from asbuilt_bim.report.task_rows import TaskRow
from asbuilt_bim.report.wording.completion import at_most, in_words
from asbuilt_bim.report.wording.values import day, number, percent, percent_certain

_STEPS = ((1e9, " bn"), (1e6, " M"), (1e3, " k"))


def money_level(amount: float, most: float) -> str:
    """Write money at an axis, in thousands or millions where the axis holds so many."""
    size, sign = next(((size, sign) for size, sign in _STEPS if most >= 5 * size), (1.0, ""))
    short = f"{amount / size:.1f}"
    return f"{short.removesuffix('.0')}{sign}" if amount else "0"


def planned_words(task: TaskRow) -> str:
    """Say when a task is planned."""
    start, finish = task.planned_start, task.planned_finish
    if start is None and finish is None:
        return "no planned dates"
    if start is None or finish is None:
        return f"planned finish {day(finish)}" if start is None else f"planned start {day(start)}"
    return f"planned {day(start)} to {day(finish)}"


def seen_row_words(task: TaskRow) -> str:
    """Say what was seen of a task, and when it will be finished."""
    begun = f"; seen begun {day(task.seen_begun)}" if task.seen_begun else ""
    end = f"; forecast finish {finish_words(task)}" if task.forecast_finish else ""
    if task.seen_complete is not None:
        end = f"; seen complete {day(task.seen_complete)}"
    return f"{in_words(task.completion)}{begun}{end}"


def finish_words(task: TaskRow) -> str:
    """Say when a task will be finished: from the best case to what is certain; "" where nothing says."""
    known = (task.forecast_earliest, task.forecast_finish)
    return " to ".join(dict.fromkeys(day(one) for one in known if one is not None))


def lateness_words(task: TaskRow, today: date) -> str:
    """Say whether a task is late; "" where it isn't."""
    if task.late and task.late_days is not None:
        return f"late by {task.late_days} day{'' if task.late_days == 1 else 's'}"
    if task.late:
        return "late"
    due = task.planned_finish is not None and task.planned_finish.date() < today
    if task.late is not None or not due:
        return ""
    if task.complete == task.elements:  # each stands, and not as much of it is certain as finishes a task
        return "due, not all of it certain"
    return "due, too little seen to say"


def trend_words(visits: Sequence[Bounds], planned_now: float | None, elements: int, of: int) -> str:
    """Say what each visit knew, and what the schedule wants by now; of so many elements of all."""
    known = [f"{day(one.day)}: at least {percent_certain(one.lower)}, possibly {at_most(one.upper)}." for one in visits]
    if planned_now is not None:
        known.append(f"The schedule wants {percent(planned_now)} by now.")
    if elements != of:
        known.append(f"Of the {elements} of {of} elements that have planned dates.")
    return " ".join(known)


def group_row_words(tasks: int, late: int) -> str:
    """Say how many tasks a summary holds, and how many of them are late."""
    return f"{tasks} task{'' if tasks == 1 else 's'}" + (f", {late} late" if late else "")


def earned_words(certain: float, possible: float, planned: float, currency: str, status: date) -> str:
    """Say how what was earned stands against what the schedule wanted by a day, without cents."""
    low, high, wanted = number(certain, 0), number(possible, 0), number(planned, 0)
    known = f"By {day(status)} the schedule wanted {wanted} {currency}. At least {low} was earned, possibly {high}."
    if certain >= planned:
        return f"{known} That is ahead of the schedule by {number(certain - planned, 0)} at least."
    if possible < planned:
        return f"{known} That is behind the schedule by {number(planned - possible, 0)} at least."
    return f"{known} Too little was seen to say whether that is behind the schedule."
