"""The moments that a visit's day stands for, the same in every file: status date, begun, finished, days late."""

from datetime import date, datetime, time, timedelta

_MORNING, _EVENING = time(8), time(17)


def status_moment(day: date) -> datetime:
    """Return the moment up to which everything is counted: the end of the visit's day."""
    return datetime(day.year, day.month, day.day) + timedelta(days=1)


def status_written(day: date) -> datetime:
    """Return the status date as files hold it: its last minute, which every program shows as the visit's day."""
    return status_moment(day) - timedelta(minutes=1)


def begun_at(day: date) -> datetime:
    """Return when something is said to have begun that a visit saw begun: in the morning of its day."""
    return datetime.combine(day, _MORNING)


def finished_at(day: date) -> datetime:
    """Return when something is said to have been finished that a visit saw complete: in the evening of its day."""
    return datetime.combine(day, _EVENING)


def days_past(finish: datetime, day: date) -> int:
    """Return the days from a planned finish to a visit's day; 0 on its own day: work may go on after the photos."""
    return max(0, (day - finish.date()).days)


def late_days(finish: datetime | None, late: bool | None, day: date) -> int | None:
    """Return how many days something is late: past the day of its planned finish, and seen not to be complete.

    The one meaning of "late", of tasks and of elements. 0: it isn't. None: unknown, or there is no planned finish.
    """
    if finish is None or late is None:
        return None
    return days_past(finish, day) if late else 0
