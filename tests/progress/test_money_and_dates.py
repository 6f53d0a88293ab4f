from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime, timedelta

import pytest

from asbuilt_bim.bim.model import BimElement, BimModel, CostLine, Task
from asbuilt_bim.bim.schedule import WorkCalendar, weekday
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.progress.completion.planned import late_elements, verdict
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.money import cents, rounded, total
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.surface import SurfaceState, unseen
from asbuilt_bim.report.cost_rows import cost_groups
from asbuilt_bim.report.result.convert import report_from_plain, report_to_plain
from tests.match.small_site import box, element, model
from tests.progress.clear_rows import clearly

DAY, LATER = date(2026, 3, 2), date(2026, 3, 16)
FULL = element("A", "column", box(0, 0, 0, 0.5, 0.5, 3.0))
HALF = element("B", "column", box(3, 0, 0, 0.5, 0.5, 3.0))
UNSEEN = element("C", "wall", box(6, 0, 0, 4.0, 0.25, 3.0))
NOTHING = MatchResult(stations=(), matches=(), unmatched=(), unobserved=())


def line(*elements: str, measure: str = "volume", unit: str = "m3", planned: float = 1.5) -> CostLine:
    return CostLine(
        global_id="L", name="Concrete", identification="1.1", elements=elements, unit=unit, measure=measure,  # type: ignore[arg-type]
        planned_quantity=planned, rate=200.0, currency="EUR",
    )  # fmt: skip


def poured(one: BimElement, height_m: float) -> list[SurfaceState]:
    """Return an element's faces as seen from its first side: measured up to a height, open above."""
    width = one.length_m
    built = polygon.box(0, 0, width, height_m) if height_m > 0 else ()
    opened = polygon.box(0, height_m, width, one.height_m) if height_m < one.height_m else ()
    seen = replace(unseen(one.faces[0]), built_uv_m=built, open_uv_m=opened, outline_uv_m=built)
    first = replace(seen, stations={"A1": 1.0})
    return [first, *(unseen(face) for face in one.faces[1:])]


def report(
    *lines: CostLine, tasks: tuple[Task, ...] = (), half: float = 1.5, day: date = DAY,
    history: VisitHistory = EMPTY_HISTORY, full: float = 3.0,
) -> ProgressReport:  # fmt: skip
    design: BimModel = model([FULL, HALF, UNSEEN], tasks, lines)
    surfaces = [*poured(FULL, full), *poured(HALF, half), *(unseen(face) for face in UNSEEN.faces)]
    return summarise(surfaces, NOTHING, design, history, day)


def task(*elements: str, finish: datetime | None = datetime(2026, 3, 10, 17)) -> Task:
    return Task(
        global_id="T", name="Columns", identification="T1", elements=elements,
        schedule_start=datetime(2026, 3, 1), schedule_finish=finish,
    )  # fmt: skip


def test_a_cost_line_earns_completion_times_planned_quantity_in_its_own_unit() -> None:
    told = report(line("A", "B", planned=1.5))
    (cost,), half = told.cost_lines, told.elements[1].completion
    assert half.best == pytest.approx(0.5, abs=0.02) and half.lower < 0.5 < half.upper
    assert cost.completion.best == pytest.approx(0.5 + 0.5 * (half.best or 0.0))
    assert cost.as_built_best == pytest.approx(1.5 * (cost.completion.best or 0.0), abs=0.001)
    assert cost.earned_best == pytest.approx(200.0 * (cost.as_built_best or 0.0))
    assert cost.unit == "m3" and cost.earned_lower == pytest.approx(200.0 * 1.5 * (0.5 + 0.5 * half.lower), abs=0.11)


def test_money_is_told_in_cents_halves_up_and_a_finished_line_earns_its_planned_value() -> None:
    assert [cents(amount) for amount in (1.005, 2.675, -1.005, 114.99999999999999, 1e15 + 0.3)] == [
        1.01, 2.68, -1.01, 115.0, 1e15 + 0.3,
    ]  # fmt: skip
    assert total([0.1] * 3) == 0.3
    assert str(cents(-0.0)) == "0.0" == str(cents(-0.001))
    (done,) = report(replace(line("A", planned=0.37), rate=33.5)).cost_lines  # 12.395
    assert (done.planned_value, done.earned_best, done.earned_lower) == (12.4, 12.4, 12.4)


def test_what_a_line_earns_follows_from_its_shares_as_the_result_holds_them() -> None:
    told = report(line("A", "B", "C", planned=3.3e8))
    (cost,) = told.cost_lines
    (kept,) = report_from_plain(report_to_plain(report(line("A", "B", "C", planned=3.3e8)))).cost_lines
    assert kept.completion.lower != cost.completion.lower  # 9 decimals
    shares = {element.global_id: round(element.completion.lower, 9) for element in told.elements}
    assert cost.as_built_lower == rounded(sum(3.3e8 * part * shares[key] for key, part in cost.parts.items()), 3)
    assert cost.earned_lower == cents(cost.as_built_lower * 200.0)


def test_what_was_not_seen_is_not_paid_but_is_no_nought_percent_either() -> None:
    (cost,) = report(line("A", "C", measure="count", unit="pcs", planned=2)).cost_lines
    assert cost.completion.best == pytest.approx(1.0)
    assert cost.as_built_lower == pytest.approx(1.0) and cost.earned_lower == pytest.approx(200.0)
    (blind,) = report(line("C")).cost_lines
    assert blind.as_built_best is None and blind.earned_best is None and blind.earned_lower == 0.0
    assert blind.completion.upper == 1.0


def test_elements_of_a_line_that_the_model_lacks_count_as_unseen() -> None:
    (cost,) = report(line("A", "slab-1", measure="count", planned=2)).cost_lines
    assert cost.completion.lower == pytest.approx(0.5) and cost.completion.upper == pytest.approx(1.0)
    assert cost.completion.coverage == pytest.approx(0.5)


def test_an_element_of_which_little_was_seen_weighs_no_less_in_the_best_estimate() -> None:
    low = replace(unseen(HALF.faces[0]), open_uv_m=polygon.box(0, 0.2, 0.2, 1.4), stations={"A1": 1.0})
    few = [low, *(unseen(face) for face in HALF.faces[1:])]
    design = model([FULL, HALF], (), (line("A", "B"),))
    found = summarise([*poured(FULL, 3.0), *few], NOTHING, design, EMPTY_HISTORY, DAY)
    _, little = found.elements
    assert little.completion.best == 0.0 and little.completion.coverage < 0.7
    weights = FULL.volume_m3, HALF.volume_m3
    assert found.cost_lines[0].completion.best == pytest.approx(weights[0] / sum(weights))


def test_a_slab_on_a_line_takes_what_the_plan_holds_beyond_the_measured_elements() -> None:
    column_m3 = 0.75  # the line plans 30 m3: nearly all of it is the slab
    (cost,) = report(replace(line("A", planned=30.0), others=1)).cost_lines
    assert cost.as_built_lower == pytest.approx(column_m3) and cost.others == 1
    (litres,) = report(replace(line("A", planned=30_000.0, unit="l"), others=1, unit_scale=1e-3)).cost_lines
    assert litres.as_built_lower == pytest.approx(1000.0 * column_m3)


def test_the_parts_of_a_lines_elements_add_up_to_what_it_earned_for_certain() -> None:
    told = report(line("A", "B", "C", planned=3.0), replace(line("A", "B", planned=30.0), others=1))
    lower = {element.global_id: element.completion.lower for element in told.elements}
    for cost in told.cost_lines:
        parts = sum(share * cost.planned_quantity * lower[key] for key, share in cost.parts.items())
        assert cost.as_built_lower == pytest.approx(parts, abs=0.000501) and cost.as_built_lower > 0.0
    assert next(sum(cost.parts.values()) for cost in told.cost_lines) == pytest.approx(1.0)


def test_of_a_deduction_all_that_may_be_built_is_certain_to_be_taken_off_at_most() -> None:
    for planned, rate in ((3.0, -200.0), (-3.0, 200.0)):
        told = report(replace(line("A", "B", "C", planned=planned), rate=rate))
        (off,) = told.cost_lines
        assert off.takes_off and off.certain == off.completion.upper > off.completion.lower
        assert off.as_built_lower == pytest.approx(off.completion.upper * planned, abs=0.01)  # each element rounded
        assert off.earned_lower == cents(off.as_built_lower * rate) < (off.earned_best or 0.0) < 0.0
    (mixed,) = report(replace(line("A", planned=30.0), others=1, rate=-1.0)).cost_lines
    assert mixed.earned_lower == -30.0  # a slab that nobody measures may stand


def test_a_certain_total_with_a_deduction_for_what_nobody_saw_is_no_more_than_what_is_earned_if_it_stands() -> None:
    work, off = line("A", planned=3.0), replace(line("C", planned=1.0), rate=-20.0, name="deduction", global_id="D")
    (group,) = cost_groups(report(work, off))
    assert group.earned_lower == pytest.approx(3.0 * 200.0 - 20.0)


def test_of_a_line_with_little_planned_the_measured_elements_earn_no_more_than_their_number() -> None:
    (cost,) = report(replace(line("A", planned=1.0), others=1)).cost_lines
    assert cost.as_built_lower == pytest.approx(0.5)


def test_a_line_weighs_its_elements_by_what_its_measure_says() -> None:
    volume, area, count = (
        report(line("B", "C", measure=m)).cost_lines[0].completion for m in ("volume", "area", "count")
    )
    sure = report().elements[1].completion.lower
    assert 0.3 < sure < 0.5
    assert volume.lower == pytest.approx(sure * 0.75 / 3.75)
    assert area.lower == pytest.approx(sure * 6.0 / 31.5)
    assert count.lower == pytest.approx(sure / 2.0)


def test_a_storey_is_weighted_by_exposed_area_and_its_bounds_hold_the_unseen() -> None:
    (storey,), half = report().storeys, report().elements[1].completion
    assert storey.completion.best == pytest.approx(0.5 + 0.5 * (half.best or 0.0))
    assert storey.completion.lower == pytest.approx(6.0 * (1.0 + half.lower) / 37.5)
    assert storey.completion.upper == pytest.approx((6.0 * (1.0 + half.upper) + 25.5) / 37.5)
    assert (storey.complete, storey.part, storey.not_started, storey.unknown) == (1, 1, 0, 1)
    assert report().whole.design_area_m2 == pytest.approx(37.5)


def test_a_task_starts_with_the_first_visit_that_sees_something_built_and_ends_with_the_one_that_sees_all() -> None:
    first = report(tasks=(task("A", "B"),), half=0.0)
    history = remember(EMPTY_HISTORY, first)
    (before,) = first.tasks
    assert (before.actual_start, before.actual_finish) == (DAY, None)
    (after,) = report(tasks=(task("A", "B"),), half=3.0, day=LATER, history=history).tasks
    assert (after.actual_start, after.actual_finish) == (DAY, LATER)
    assert after.late is False


def test_the_plan_of_a_task_with_a_calendar_of_its_own_is_counted_in_that() -> None:
    mondays = WorkCalendar(name="Mondays", week=(weekday(0, (0, 1440)), *(weekday(n) for n in range(1, 7))))
    (usual, own) = report(tasks=(task("A"), replace(task("A"), calendar=mondays))).tasks  # from 1 March, a Sunday
    assert usual.planned == pytest.approx(48 / (9 * 24 + 17))
    assert own.planned == pytest.approx(0.5)  # of two Mondays one, to its end


def test_a_task_seen_complete_after_its_planned_finish_is_no_later_than_it_was_seen_unfinished() -> None:
    made, last = task("A", "B"), date(2026, 3, 30)  # planned until 10 March
    first = remember(EMPTY_HISTORY, report(tasks=(made,), half=1.5))
    (soon,) = report(tasks=(made,), half=3.0, day=LATER, history=first).tasks
    assert (soon.behind_days, soon.behind_least_days, soon.behind_most_days) == (6, 0, 6)
    second = report(tasks=(made,), half=1.5, day=LATER, history=first)
    (late,) = report(tasks=(made,), half=3.0, day=last, history=remember(EMPTY_HISTORY, second)).tasks
    assert (late.behind_days, late.behind_least_days, late.behind_most_days) == (20, 6, 20)


def test_a_forecast_at_the_earliest_counts_as_built_what_may_be() -> None:
    made = task("A", "B")  # from 1 March, 0:00, to 10 March, 17:00
    (some,) = report(tasks=(made,), half=1.5).tasks
    done, status = some.progress.completion, datetime(DAY.year, DAY.month, DAY.day) + timedelta(days=1)
    planned = datetime(2026, 3, 10, 17) - datetime(2026, 3, 1)
    assert some.forecast_finish is not None and some.forecast_earliest is not None
    assert 0.0 < done.lower < done.upper < 1.0
    assert abs(some.forecast_finish - (status + (1.0 - done.lower) * planned)) < timedelta(minutes=2)
    assert abs(some.forecast_earliest - (status + (1.0 - done.upper) * planned)) < timedelta(minutes=2)
    (full,) = report(tasks=(made,), half=3.0).tasks
    assert full.forecast_earliest == full.forecast_finish == datetime(DAY.year, DAY.month, DAY.day, 17)
    (maybe,) = report(tasks=(task("A", "C"),)).tasks  # nobody saw C
    assert maybe.forecast_earliest == datetime(DAY.year, DAY.month, DAY.day, 17)
    assert maybe.forecast_finish is not None and maybe.forecast_finish.date() > DAY


def test_the_last_result_alone_tells_since_when_things_stand_and_which_visits_it_holds() -> None:
    first = report(tasks=(task("A", "B"),), half=0.0)
    second = report(tasks=(task("A", "B"),), half=3.0, day=LATER, history=remember(EMPTY_HISTORY, first))
    last = date(2026, 3, 30)
    alone = report(tasks=(task("A", "B"),), half=3.0, day=last, history=remember(EMPTY_HISTORY, second))
    assert alone.earlier_visits == (DAY, LATER)
    assert [(t.actual_start, t.actual_finish) for t in alone.tasks] == [(DAY, LATER)]
    assert [(e.first_built, e.complete_on) for e in alone.elements] == [(DAY, DAY), (LATER, LATER), (None, None)]


def test_a_task_of_which_nothing_stands_any_more_has_no_start() -> None:
    history = replace(EMPTY_HISTORY, visits=(DAY,), first_built={"A": DAY})
    (gone,) = report(tasks=(task("A"),), full=0.0, history=history, day=LATER).tasks
    (stands,) = report(tasks=(task("A"),), history=history, day=LATER).tasks
    assert (gone.actual_start, stands.actual_start) == (None, DAY)


def test_a_task_is_late_only_when_something_of_it_is_known_to_be_missing() -> None:
    assert report(tasks=(task("A", "B"),), day=LATER).tasks[0].late is True
    assert report(tasks=(task("A", "C"),), day=LATER).tasks[0].late is None
    assert report(tasks=(task("A", "B"),), day=DAY).tasks[0].late is False
    assert report(tasks=(task("A", "B", finish=None),), day=LATER).tasks[0].late is None


def test_a_task_with_an_element_that_is_not_in_the_model_is_never_finished() -> None:
    assert report(tasks=(task("A", "slab-1"),)).tasks[0].actual_finish is None
    assert report(tasks=(task("A"),)).tasks[0].actual_finish == DAY


def test_a_task_that_makes_a_slab_too_is_told_by_its_lower_bound_and_never_finished() -> None:
    (made,) = report(tasks=(replace(task("A"), others=1),)).tasks
    told = verdict(made)
    assert made.actual_finish is None and not told.finished
    assert (told.knowledge, told.share) == ("part measured", pytest.approx(0.5))
    assert told.note.code == Reason.TASK_PART_MEASURED
    assert (told.note.values["others"], told.note.values["of"]) == (1, 2)


def test_a_task_is_finished_only_where_all_of_each_element_is_certain_not_as_far_as_seen() -> None:
    """Complete as far as seen: what was seen stands, and a fifth was not seen."""
    nearly = [replace(unseen(FULL.faces[0]), built_uv_m=polygon.box(0, 0, 0.5, 2.4), stations={"A1": 1.0})]
    surfaces = [*nearly, *(unseen(face) for face in FULL.faces[1:])]
    first = summarise(surfaces, NOTHING, model([FULL], (task("A"),), ()), EMPTY_HISTORY, DAY)
    (one,), (made,) = first.elements, first.tasks
    assert one.completion.best == 1.0 and one.completion.lower < 0.97
    told = verdict(made)
    assert (made.actual_finish, told.finished, told.share) == (None, False, made.progress.completion.lower)
    history = remember(EMPTY_HISTORY, replace(first, elements=(replace(one, state="complete", complete_on=DAY),)))
    again = summarise(poured(FULL, 3.0), NOTHING, model([FULL], (task("A"),), ()), history, LATER)
    assert again.tasks[0].actual_finish == LATER  # the day that saw it, also after an older result that said so before


def seen_up_to(built_m: float, seen_m: float) -> list[SurfaceState]:
    """Return a column's faces as two sides show it: measured up to a height, open above it as far as seen."""
    built, opened = polygon.box(0, 0, 0.5, built_m), polygon.box(0, built_m, 0.5, seen_m) if seen_m > built_m else ()
    first, second = (
        replace(
            unseen(face), built_uv_m=built, open_uv_m=opened, outline_uv_m=built, stations={"A1": 1.0},
            row_log_odds=clearly(FULL, number, built, opened),
        )
        for number, face in enumerate(FULL.faces[:2])
    )  # fmt: skip
    return [first, second, *(unseen(face) for face in FULL.faces[2:])]


def test_what_a_project_calls_complete_says_what_is_late_also_in_a_result_that_is_read_back() -> None:
    surfaces, design = seen_up_to(2.6, 3.0), model([FULL], (task("A"),), ())
    usual, made = (
        summarise(surfaces, NOTHING, design, EMPTY_HISTORY, LATER, options=options)
        for options in (None, ProgressOptions(complete_from=0.88))
    )
    assert [one.element.completion.best for one in late_elements(usual)] == [made.elements[0].completion.best]
    assert made.elements[0].state == "part" and 0.88 <= made.elements[0].completion.upper < 0.97
    assert late_elements(made) == late_elements(report_from_plain(report_to_plain(made))) == ()


def test_what_a_project_calls_complete_stays_so_since_the_visit_that_found_it_complete() -> None:
    design, options = model([FULL], (task("A"),), ()), ProgressOptions(complete_from=0.9)
    first = summarise(seen_up_to(2.8, 2.8), NOTHING, design, EMPTY_HISTORY, DAY, options=options)
    assert first.elements[0].complete_on == DAY and first.elements[0].completion.lower < 0.97
    again = summarise(poured(FULL, 3.0), NOTHING, design, remember(EMPTY_HISTORY, first), LATER, options=options)
    assert again.elements[0].complete_on == again.tasks[0].actual_finish == DAY


def test_faces_without_a_decision_are_listed_as_unobserved() -> None:
    assert set(report().unobserved) >= {face.face_id for face in UNSEEN.faces}
