"""The drawings over time: what is planned, what was seen with its bounds, and what the plan wanted in money."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date, datetime, timedelta

import pytest

from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.drawings.earned_curve import earned_curves
from asbuilt_bim.report.drawings.gantt import MOST_ON_A_PAGE, Gantt, GanttRow, gantt_of
from asbuilt_bim.report.drawings.timeline import MOST_TICKS, axis_over
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.task_rows import task_rows
from asbuilt_bim.report.wording.of_page.gantt_words import earned_words
from tests.report.sample_report import HOSTILE_MARKUP, sample_report


def with_tasks(report: ProgressReport, count: int) -> ProgressReport:
    """Return a result whose first task stands so often in the schedule."""
    first = report.tasks[0]
    copies = [
        replace(first, progress=replace(first.progress, key=f"t{n}", name=f"Task {n}"), outline=(f"Part {n // 7}",))
        for n in range(count)
    ]
    return replace(report, tasks=tuple(copies))


def gantt(report: ProgressReport) -> Gantt:
    found = gantt_of(report, task_rows(report))
    assert found is not None
    return found


def rows(drawn: Gantt) -> list[GanttRow]:
    return [row for page in drawn.pages for group in page.groups for row in group.rows]


@pytest.mark.parametrize("span", [0, 1, 6, 20, 80, 400, 4000, 40_000, 2_900_000])
def test_days_are_named_in_order_within_the_drawing_and_never_too_many(span: int) -> None:
    first = date(2026, 2, 20) if span < 2_000_000 else date(1, 1, 2)
    axis = axis_over([first, first + timedelta(days=span)])
    places = [tick.at for tick in axis.ticks]
    assert len(places) <= MOST_TICKS + 2 and places == sorted(places)
    assert len({tick.words for tick in axis.ticks}) == len(places)
    assert all(0.0 <= place <= 100.0 for place in places)
    assert axis.at(axis.first) <= axis.at(axis.last)


def test_a_day_on_an_axis_is_the_same_in_every_country() -> None:
    spans = {7: "8 Mar", 40: "9 Mar", 200: "2026-04", 3000: "2028"}
    for days, words in spans.items():
        axis = axis_over([date(2026, 3, 8), date(2026, 3, 8) + timedelta(days=days)])
        assert words in [tick.words for tick in axis.ticks], axis.ticks


def test_a_tasks_bar_is_filled_to_what_is_certain_and_hatched_to_what_is_possible() -> None:
    report = sample_report()
    for row, task in zip(rows(gantt(report)), task_rows(report), strict=True):
        if row.planned is None or row.certain is None or row.possible is None:
            continue
        assert row.certain.width == pytest.approx(row.planned.width * task.completion.lower)
        assert row.certain.width + row.possible.width == pytest.approx(row.planned.width * task.completion.upper)


def test_late_is_said_in_words_beside_the_bar() -> None:
    report = sample_report()
    task = replace(report.tasks[0], late=True, schedule_finish=datetime(2026, 3, 10, 17))
    late = replace(report, tasks=(task, *report.tasks[1:]))
    assert rows(gantt(late))[0].late == "late by 6 days"
    page = page_html(late, {})
    assert re.search(r'class="chip loud">late by 6 days', page[page.index('id="gantt"') :])
    unsure = replace(late, tasks=(replace(task, late=None),))
    stands = replace(task.progress, complete=3, part=0, not_started=0, unknown=0)
    assert rows(gantt(replace(unsure, tasks=(replace(task, late=None, progress=stands),))))[0].late == (
        "due, not all of it certain"
    )
    assert "too little seen" in rows(gantt(unsure))[0].late and not rows(gantt(unsure))[0].is_late


def test_a_forecast_far_off_ends_at_the_border_and_its_date_is_told() -> None:
    report = sample_report()
    task: TaskProgress = replace(report.tasks[0], forecast_finish=datetime(2125, 1, 1, 17), actual_finish=None)
    row = rows(gantt(replace(report, tasks=(task,))))[0]
    assert row.forecast_at is None and "2125-01-01" in row.words
    assert row.planned is not None and row.planned.width > 20.0


def test_hundreds_of_tasks_are_shown_a_page_at_a_time_and_all_of_them() -> None:
    drawn = gantt(with_tasks(sample_report(), 350))
    assert [page.first for page in drawn.pages] == [1 + MOST_ON_A_PAGE * n for n in range(6)]
    assert [row.name for row in rows(drawn)] == [f"Task {n}" for n in range(350)] and drawn.more == 0
    most = gantt(with_tasks(sample_report(), 3000))
    assert len(rows(most)) + most.more == 3000 and len(rows(most)) <= 1200
    page = page_html(with_tasks(sample_report(), 350), {})
    assert page.count("<summary>Tasks ") == 6 and page.count("<details open><summary>Tasks ") == 1


def test_hostile_names_are_text_in_the_drawing() -> None:
    report = sample_report()
    hostile = HOSTILE_MARKUP + '"><img src=x onerror=alert(1)>\u202e' + "A" * 300
    first = report.tasks[0]
    task = replace(first, progress=replace(first.progress, name=hostile), outline=(hostile,))
    page = page_html(replace(report, tasks=(task,)), {})
    drawn = page[page.index('id="gantt"') :].partition("</section>")[0]
    assert "<img" not in drawn and "<script" not in drawn and "&lt;script&gt;" in drawn


def test_without_a_date_there_is_no_drawing() -> None:
    report = sample_report()
    bare = tuple(
        replace(t, schedule_start=None, schedule_finish=None, actual_start=None, actual_finish=None)
        for t in report.tasks
    )
    assert gantt_of(replace(report, tasks=bare), task_rows(replace(report, tasks=bare))) is None
    assert 'id="gantt"' not in page_html(replace(report, tasks=bare), {})


def test_planned_against_earned_agrees_with_the_cost_lines_to_their_rounding() -> None:
    report = sample_report()
    keys = tuple(element.global_id for element in report.elements)
    first = report.tasks[0]
    task = replace(first, progress=replace(first.progress, elements=keys))
    report = replace(report, tasks=(task,))
    (curve, *_) = earned_curves(report, ())
    lines = [line for line in report.cost_lines if line.currency == curve.currency]
    known = sum(sum(line.parts.values()) * line.planned_value for line in lines)
    assert curve.total == pytest.approx(known)
    certain = sum(line.earned_lower for line in lines)
    assert curve.visits[-1].certain == pytest.approx(certain, abs=len(lines) * max(line.rate for line in lines))
    assert curve.visits[-1].certain <= curve.visits[-1].possible <= curve.total + 0.005


def test_what_has_no_planned_dates_is_in_neither_curve() -> None:
    report = sample_report()
    assert earned_curves(replace(report, tasks=()), ()) == ()
    first = report.tasks[0]
    one = replace(first, progress=replace(first.progress, elements=(report.elements[0].global_id,)))
    (curve, *_) = earned_curves(replace(report, tasks=(one,)), ())
    assert 0.0 < curve.total < curve.contract


def test_behind_or_ahead_is_said_only_where_it_is_certain() -> None:
    day = date(2026, 3, 16)
    assert "behind the schedule by 40" in earned_words(10.0, 60.0, 100.0, "EUR", day)
    assert "ahead of the schedule by 10" in earned_words(110.0, 160.0, 100.0, "EUR", day)
    assert "Too little was seen" in earned_words(10.0, 160.0, 100.0, "EUR", day)


def test_a_single_chart_of_money_says_its_currency() -> None:
    report = sample_report()
    lines = tuple(line for line in report.cost_lines if line.currency == "EUR")
    assert "<h3>Planned against earned, EUR</h3>" in page_html(replace(report, cost_lines=lines), {})
