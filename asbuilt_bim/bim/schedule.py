"""A work schedule as plain data: working time, links between tasks, and where the dates came from."""

from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from typing import Literal

DAY_START, DAY_END = time(8), time(17)
"""What a date without a time means: the customary working day of both MS Project and P6."""
LinkKind = Literal["FS", "SS", "FF", "SF"]
"""Finish-to-start and so on: which end of the predecessor holds which end of the successor."""

DAY_MIN = 24 * 60
SCHEDULE_KEY = "schedule:"
"""What the key of a task begins with that the schedule file has and the IFC has not; a GlobalId has no colon."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskLink:
    """A predecessor of a task; `lag_h` in working hours, negative for a lead."""

    predecessor: str  # the other task's key
    kind: LinkKind
    lag_h: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkSpan:
    """A piece of a day that is worked, in minutes from midnight."""

    from_min: int
    to_min: int


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkDay:
    """What is worked on one day of the week (0 is Monday), or, as an exception, on one date."""

    weekday: int | None
    day: date | None
    spans: tuple[WorkSpan, ...]

    @property
    def minutes(self) -> int:
        """Return how many minutes are worked."""
        return sum(span.to_min - span.from_min for span in self.spans)

    def minutes_before(self, minute: int) -> int:
        """Return how many minutes are worked before a minute of the day."""
        return sum(max(0, min(minute, span.to_min) - span.from_min) for span in self.spans)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkCalendar:
    """Working time: seven weekdays from Monday on, and the dates that differ."""

    name: str
    week: tuple[WorkDay, ...]
    exceptions: tuple[WorkDay, ...] = ()

    def hours(self, start: datetime, finish: datetime) -> float:
        """Return the working hours from `start` to `finish`; negative where they are the other way round."""
        return (self._minutes(finish) - self._minutes(start)) / 60.0

    def after(self, start: datetime, hours: float) -> datetime:
        """Return the first minute at which `hours` have been worked since `start`; no hours: `start` itself.

        Raises:
            ValueError: the calendar has no working time within ten thousand days.
        """
        if hours <= 0.0:
            return start
        goal = self._minutes(start) + hours * 60.0 - 1e-6
        low, high = 0, DAY_MIN
        end = (datetime.max - start) // timedelta(minutes=1)
        while self._minutes(start + timedelta(minutes=min(high, end))) < goal:
            low, high = high, high * 2
            if low > min(end, 10_000 * DAY_MIN):
                raise ValueError(f"the calendar '{self.name}' has too little working time for {hours:g} hours")
        high = min(high, end)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._minutes(start + timedelta(minutes=middle)) < goal else (low, middle)
        return start + timedelta(minutes=high)

    def _minutes(self, moment: datetime) -> float:
        """Return the working minutes since the beginning of the calendar's counting, up to a moment."""
        days = moment.toordinal()  # day 1 is a Monday
        minute = moment.hour * 60 + moment.minute
        weeks, rest = divmod(days - 1, 7)
        per_day = [day.minutes for day in self.week]
        worked = weeks * sum(per_day) + sum(per_day[:rest])
        today = self.week[rest]
        for other in self.exceptions:
            if other.day is None:
                continue
            if other.day.toordinal() < days:
                worked += other.minutes - per_day[other.day.weekday()]
            elif other.day.toordinal() == days:
                today = other
        return worked + today.minutes_before(minute)


def weekday(number: int, *spans: tuple[int, int]) -> WorkDay:
    """Return a day of the week with its spans as minutes from midnight."""
    return WorkDay(weekday=number, day=None, spans=tuple(WorkSpan(from_min=a, to_min=b) for a, b in spans))


def at_time(day: date, *, end: bool) -> datetime:
    """Return the beginning or the end of a date's working day."""
    return datetime.combine(day, DAY_END if end else DAY_START)


EVERY_DAY = WorkCalendar(name="Every day", week=tuple(weekday(n, (0, DAY_MIN)) for n in range(7)))
"""Where no calendar is known: time passes evenly, so that planned dates stay as they are in every program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleSource:
    """The file that the planned dates were read from, beside the IFC, and its working time."""

    name: str
    digest: str  # sha256 of the file
    kind: Literal["MS Project XML", "Primavera P6 XML", "CSV"]
    calendar: WorkCalendar
    last_uid: int = 0  # the largest number that the file knows a task by
    other_ids: tuple[str, ...] = ()  # of its activities that are no task of the IFC, and have the id of one
