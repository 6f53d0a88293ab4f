"""The benchmark of choices of stations: which it makes, and what it calls a rise."""

from __future__ import annotations

import pytest

from benchmarks.site.subsets import Choice, chosen, lines_of, rises


def choice(stations: str, lower: float, best: float | None = None, true: float = 0.5) -> Choice:
    return Choice(
        site="s", day="d", stations=tuple(stations), lower=lower, best=best, groups=((lower, 0.9, true),),
        elements=((lower, 0.9, true),),
    )  # fmt: skip


def test_all_choices_are_made_of_few_stations_and_a_draw_with_the_whole_visit_of_many() -> None:
    assert len(chosen(tuple("abc"))) == 7
    many = chosen(tuple("abcdefghij"))
    assert len(many) == len(set(many)) == 200
    assert many[-1] == tuple("abcdefghij")


def test_a_rise_is_against_one_station_more_and_against_the_whole_visit() -> None:
    found = [choice("a", 0.30), choice("b", 0.10), choice("ab", 0.25), choice("abc", 0.28)]
    assert sorted(round(gap, 2) for gap in rises(found, "lower")) == [-0.18, -0.15, -0.03, 0.02, 0.05]


def test_fewer_photos_that_say_more_and_a_truth_outside_fall_short() -> None:
    good = [choice("a", 0.2), choice("ab", 0.3)] * 30
    bad = [choice("a", 0.6, true=0.5), choice("ab", 0.3)]
    assert all(one.holds is not False for one in lines_of(good) if one.n >= 25)
    assert [one.what for one in lines_of(bad) if one.holds is False]
    assert float(lines_of(bad)[1].figure.split()[0]) == pytest.approx(30.0)
