from __future__ import annotations

from datetime import date, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.bim.schedule import EVERY_DAY, WorkCalendar, WorkDay, WorkSpan, weekday

OFFICE = WorkCalendar(
    name="office",
    week=tuple(weekday(n, (480, 720), (780, 1020)) if n < 5 else weekday(n) for n in range(7)),
    exceptions=(
        WorkDay(weekday=None, day=date(2026, 3, 4), spans=()),
        WorkDay(weekday=None, day=date(2026, 3, 7), spans=(WorkSpan(from_min=480, to_min=720),)),
    ),
)
MINUTES = st.integers(0, 60 * 24 * 60)
FIRST = datetime(2026, 2, 20)


def test_exceptions_count_from_within_their_own_day_too() -> None:
    holiday, saturday = datetime(2026, 3, 4), datetime(2026, 3, 7)
    assert OFFICE.hours(holiday.replace(hour=10), holiday.replace(hour=16)) == 0.0
    assert OFFICE.hours(saturday.replace(hour=10), saturday.replace(hour=16)) == 2.0
    assert OFFICE.hours(datetime(2026, 3, 2), datetime(2026, 3, 9)) == 4 * 8.0 + 4.0


@given(MINUTES, MINUTES)
def test_working_time_is_the_sum_of_its_minutes(begin: int, length: int) -> None:
    start, finish = FIRST + timedelta(minutes=begin), FIRST + timedelta(minutes=begin + length)
    middle = FIRST + timedelta(minutes=begin + length // 2)
    whole = OFFICE.hours(start, finish)
    assert 0.0 <= whole <= length / 60.0
    assert abs(OFFICE.hours(start, middle) + OFFICE.hours(middle, finish) - whole) < 1e-9
    assert EVERY_DAY.hours(start, finish) == length / 60.0


@given(MINUTES, st.integers(1, 400))
def test_after_so_many_hours_is_the_first_minute_by_which_they_are_worked(begin: int, quarters: int) -> None:
    start, hours = FIRST + timedelta(minutes=begin), quarters / 4.0
    end = OFFICE.after(start, hours)
    assert abs(OFFICE.hours(start, end) - hours) < 1e-6
    assert OFFICE.hours(start, end - timedelta(minutes=1)) < hours
