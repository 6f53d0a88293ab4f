"""Days along a drawing: where a day lies in percent of its width, and which days are named below it."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date, datetime, timedelta

from asbuilt_bim.report.wording.values import day_and_month

MOST_TICKS = 7
_DAYS = (1, 2, 7, 14)
_MONTHS = (1, 2, 3, 6, 12, 24, 60, 120, 600, 1200, 6000, 12000)
_DAYS_OF_A_MONTH = 30.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Tick:
    """A place on an axis, in percent of its length, and what it is called."""

    at: float
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeAxis:
    """The days from `first` to the end of `last` along a drawing."""

    first: date
    last: date

    def at(self, moment: date | datetime) -> float:
        """Return where a moment lies, in percent of the width; what lies outside lies at an end."""
        hours = moment.hour + moment.minute / 60.0 if isinstance(moment, datetime) else 12.0
        day = moment.date() if isinstance(moment, datetime) else moment
        whole = (self.last - self.first).days + 1
        return min(100.0, max(0.0, 100.0 * ((day - self.first).days + hours / 24.0) / whole))

    @property
    def ticks(self) -> tuple[Tick, ...]:
        """Return the days that are named: Mondays, first days of months or of years, `MOST_TICKS` at most."""
        span = (self.last - self.first).days + 1
        step = next((days for days in _DAYS if span / days <= MOST_TICKS), None)
        days = self._days(step) if step else self._months(span)
        letters = len("2026-03") if span < _DAYS_OF_A_MONTH * 60 else len("2026")
        words = [day_and_month(one) if step else one.isoformat()[:letters] for one in days]
        places = [self.at(datetime(one.year, one.month, one.day)) for one in days]
        return tuple(Tick(at=at, words=word) for at, word in zip(places, words, strict=True))

    def _days(self, step: int) -> list[date]:
        start = self.first if step < 7 else self.first + timedelta(days=-self.first.weekday() % 7)
        return [start + timedelta(days=n) for n in range(0, (self.last - start).days + 1, step)]

    def _months(self, span: int) -> list[date]:
        step = next((m for m in _MONTHS if span / _DAYS_OF_A_MONTH / m <= MOST_TICKS), _MONTHS[-1])
        months = range(self.first.year * 12 + self.first.month - 1, self.last.year * 12 + self.last.month)
        found = [date(m // 12, m % 12 + 1, 1) for m in months if m % step == 0 and m // 12 >= 1]
        return [one for one in found if one >= self.first]


def axis_over(days: Iterable[date]) -> TimeAxis:
    """Return the axis that holds all of some days; at least one day."""
    known = sorted(days)
    return TimeAxis(first=known[0], last=known[-1])
