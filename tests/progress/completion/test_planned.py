from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime

import pytest

from asbuilt_bim.bim.model import Task
from asbuilt_bim.bim.schedule import EVERY_DAY, WorkCalendar, weekday
from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.completion.planned import days_behind, due_but_unknown, late_elements, planned_share, verdict
from asbuilt_bim.progress.completion.summary import task_progress
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, TaskProgress
from asbuilt_bim.report.result.convert import report_from_document, report_to_document
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_workbook.columns import TASKS
from asbuilt_bim.report.wording.result_terms import TERMS
from tests.report.sample_report import sample_report

START, FINISH = datetime(2026, 3, 2, 0), datetime(2026, 3, 12, 0)  # ten days
OFFICE = WorkCalendar(name="office", week=tuple(weekday(n, (480, 1020)) if n < 5 else weekday(n) for n in range(7)))


def done(best: float | None, lower: float | None = None, upper: float | None = None) -> Completion:
    value = best or 0.0
    return Completion(
        best=best,
        lower=value if lower is None else lower,
        upper=(1.0 if best is None else value) if upper is None else upper,
        coverage=1.0,
    )


def task(completion: Completion, unknown: int = 0, **dates: date | None) -> TaskProgress:
    progress = replace(sample_report().tasks[0].progress, completion=completion, unknown=unknown)
    values: dict[str, object] = {"schedule_start": START, "schedule_finish": FINISH, "actual_finish": None, **dates}
    return replace(sample_report().tasks[0], progress=progress, **values)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("day", "share"),
    [(date(2026, 3, 1), 0.0), (date(2026, 3, 2), 0.1), (date(2026, 3, 6), 0.5), (date(2026, 3, 11), 1.0)],
)
def test_the_planned_share_grows_evenly_and_counts_the_day_of_the_visit(day: date, share: float) -> None:
    assert planned_share(START, FINISH, day) == pytest.approx(share)


def test_a_calendar_stops_the_plan_over_the_weekend() -> None:
    friday, sunday = date(2026, 3, 6), date(2026, 3, 8)
    monday_start, next_friday = datetime(2026, 3, 2, 8), datetime(2026, 3, 13, 17)
    assert planned_share(monday_start, next_friday, friday, OFFICE) == 0.5
    assert planned_share(monday_start, next_friday, sunday, OFFICE) == 0.5
    assert planned_share(monday_start, next_friday, sunday, EVERY_DAY) != 0.5


def test_no_plan_gives_no_share() -> None:
    assert planned_share(None, FINISH, date(2026, 3, 6)) is None
    assert planned_share(FINISH, START, date(2026, 3, 6)) is None
    assert days_behind(task(done(0.5), schedule_finish=None), done(0.5), date(2026, 3, 6)) == (None, None, None)


def test_a_task_is_as_late_as_the_plan_is_ahead_of_it() -> None:
    # 30 % stands at the end of 6 March; the plan wanted 30 % at the end of 4 March
    assert days_behind(task(done(0.3)), done(0.3), date(2026, 3, 6)) == (2, 2, 2)
    assert days_behind(task(done(0.7)), done(0.7), date(2026, 3, 6)) == (-2, -2, -2)
    # half of it unknown: by the best estimate on time, two days ahead at best, two behind at worst
    assert days_behind(task(done(0.5, 0.3, 0.7)), done(0.5, 0.3, 0.7), date(2026, 3, 6)) == (0, -2, 2)


def test_the_days_by_the_best_estimate_lie_between_best_and_worst_case() -> None:
    for day in (date(2026, 3, 1), date(2026, 3, 6), date(2026, 3, 11), date(2026, 3, 30)):
        for lower, best, upper in ((0.0, 0.0, 0.4), (0.55, 0.9, 1.0), (0.62, 0.8, 0.85), (1.0, 1.0, 1.0)):
            said = days_behind(task(done(best, lower, upper)), done(best, lower, upper), day)
            assert None not in said and said[1] <= said[0] <= said[2], (day, lower, said)  # type: ignore[operator]
    early = task(done(1.0), actual_finish=date(2026, 3, 8))
    assert days_behind(early, early.progress.completion, date(2026, 3, 30)) == (-4, -4, -4)


def test_what_was_nowhere_seen_unfinished_is_late_by_no_number() -> None:
    # every element that was seen is complete, one was not seen, and the finish has passed
    plan = task(done(0.985, 0.8, 0.99), unknown=1, late=None)
    assert days_behind(plan, plan.progress.completion, date(2026, 3, 30)) == (None, 0, 21)  # 80 % by 9 March


def test_a_plan_at_the_end_of_time_breaks_nothing() -> None:
    last, end = datetime(9999, 12, 30), datetime(9999, 12, 31, 23)
    plan = task(done(0.5), schedule_start=last, schedule_finish=end)
    assert len(set(days_behind(plan, done(0.5), date(2026, 3, 6)))) == 1
    with pytest.raises(ValueError, match="too little working time"):
        EVERY_DAY.after(end, 48.0)


def test_a_task_that_was_seen_unfinished_after_its_finish_is_late_by_that_whatever_was_seen_since() -> None:
    plan = task(done(None), late=None)
    said = days_behind(plan, done(None), date(2026, 3, 30), unfinished_on=date(2026, 3, 20))
    assert said == (None, 8, 29)
    open_ended = task(done(0.5, 0.3, 1.0), late=True)
    assert days_behind(open_ended, done(0.5, 0.3, 1.0), date(2026, 3, 30), unfinished_on=date(2026, 3, 20))[1] == 8


def test_an_unknown_task_is_late_by_no_number() -> None:
    assert days_behind(task(done(None)), done(None), date(2026, 3, 30)) == (None, 0, 29)  # begun on 2 March at best


@pytest.mark.parametrize(
    ("unfinished_on", "least"), [(None, 0), (date(2026, 3, 9), 0), (date(2026, 3, 12), 0), (date(2026, 3, 14), 2)]
)
def test_a_finished_task_is_late_at_least_till_it_was_last_seen_unfinished(
    unfinished_on: date | None, least: int
) -> None:
    finished = task(done(0.99), actual_finish=date(2026, 3, 16))
    said = days_behind(finished, finished.progress.completion, date(2026, 4, 1), unfinished_on=unfinished_on)
    assert said == (4, least, 4)


def test_measured_0_part_measured_unknown_and_finished_are_four_different_things() -> None:
    zero, unknown = verdict(task(done(0.0))), verdict(task(done(None)))
    part, whole = verdict(task(done(0.6, 0.35, 0.8), unknown=1)), verdict(task(done(0.6)))
    assert (zero.knowledge, zero.share) == ("measured 0", 0.0)
    assert (unknown.knowledge, unknown.share) == ("unknown", None)
    assert (part.knowledge, part.share) == ("part measured", 0.35)
    assert part.note.code == Reason.TASK_PART_MEASURED and part.note.values["lower"] == 0.35
    assert "at least 35.0 % (lower bound)" in note_words(part.note)
    assert (whole.knowledge, whole.share) == ("measured", 0.6)
    finished = verdict(task(done(0.985), actual_finish=date(2026, 3, 16)))
    assert (finished.share, finished.finished) == (1.0, True)
    assert note_words(finished.note).endswith("Best estimate 98.5 %, at least 98.5 %.")


def test_bounds_in_a_note_are_rounded_outwards() -> None:
    def words(completion: Completion, actual_finish: date | None = None) -> str:
        return note_words(verdict(task(completion, actual_finish=actual_finish)).note)

    assert "at least 89.1 % (lower bound), possibly 92.6 %" in words(done(0.9, 0.89182, 0.92505))
    assert "at least 80.0 % (lower bound), possibly 90.0 %" in words(done(0.85, 0.7 + 0.1, 3 * 0.3))
    assert "possibly 30.0 %" in words(done(0.2, 0.1, 0.1 + 0.2))
    assert words(done(1.0, 0.80227, 1.0), date(2026, 3, 16)).endswith("at least 80.2 %.")


def test_late_elements_are_those_seen_unfinished_after_their_last_task() -> None:
    report = sample_report()
    late = late_elements(report)
    assert {one.element.state for one in late} <= {"part", "not started"}
    assert [one.task for one in late] == ["Columns, ground floor"] * len(late)
    assert late[0].late_days == 3
    assert len(late) == 2
    again = replace(report.tasks[0], schedule_finish=datetime(2026, 4, 13))  # a later task makes them too
    assert late_elements(replace(report, tasks=(*report.tasks, again))) == ()
    undated = replace(report.tasks[0], schedule_finish=None)
    assert late_elements(replace(report, tasks=(*report.tasks, undated))) == ()
    row = replace(undated, schedule_start=None, progress=replace(undated.progress, key="schedule:7"))
    assert late_elements(replace(report, tasks=(*report.tasks, row))) == late, "a blank row of a table hides lateness"
    assert due_but_unknown(report) == ()
    unseen = replace(report, elements=tuple(replace(e, state="unknown") for e in report.elements))
    ids = {one.element.global_id for one in late}
    assert {one.element.global_id for one in due_but_unknown(unseen)} >= ids
    far = tuple(replace(e, state="complete", as_far_as_seen=True) for e in report.elements)
    assert {one.element.global_id for one in due_but_unknown(replace(report, elements=far))} >= ids
    assert late_elements(unseen) == ()


def test_the_date_that_a_row_of_the_schedule_gives_an_element_is_its_only_one_beside_the_ifcs_task() -> None:
    report = sample_report()
    one = late_elements(report)[0].element.global_id
    (whole,) = (task for task in report.tasks if task.progress.name == "Columns, ground floor")
    alone = replace(whole.progress, key="schedule:7", name="Its own", elements=(one,))
    earlier = datetime(2026, 3, 1)
    row = replace(whole, schedule_finish=earlier, schedule_uid="7", progress=alone)
    for task, days in ((replace(whole, schedule_uid=""), 15), (replace(whole, schedule_uid="3"), 3)):
        late = {late.element.global_id: late for late in late_elements(replace(report, tasks=(task, row)))}
        assert late[one].late_days == days, "a task that the file dates, too, makes it as well"
        assert {late[key].late_days for key in late.keys() - {one}} == {3}


def test_what_a_schedule_file_doesnt_date_is_due_by_the_finish_of_its_task_in_the_ifc() -> None:
    report = sample_report()
    late = late_elements(report)
    stretched = [replace(t, ifc_finish=t.schedule_finish, schedule_finish=datetime(2026, 5, 1)) for t in report.tasks]
    read = report_from_document(report_to_document(replace(report, tasks=tuple(stretched))))
    assert [(one.due, one.late_days) for one in late_elements(read)] == [(one.due, one.late_days) for one in late]


def test_what_may_be_complete_by_its_bounds_is_not_called_late_but_should_stand() -> None:
    report = sample_report()
    ids = {one.element.global_id for one in late_elements(report)}
    for upper, late in ((0.96, ids), (0.97, set()), (0.991, set())):
        bounds = done(0.7, 0.06, upper)
        elements = tuple(replace(e, state="part", completion=bounds) for e in report.elements)
        glimpsed = replace(report, elements=elements)
        assert {one.element.global_id for one in late_elements(glimpsed)} >= late
        assert bool(late_elements(glimpsed)) is bool(late)
        assert bool(due_but_unknown(glimpsed)) is not bool(late)


@pytest.mark.parametrize(("upper", "late"), [(0.96, True), (0.991, None)])
def test_a_task_is_late_by_what_is_sure_not_to_be_complete(upper: float, late: bool | None) -> None:
    elements = {
        e.global_id: replace(e, state="part", completion=done(0.7, 0.06, upper)) for e in sample_report().elements
    }
    made = Task(
        global_id="T",
        name="Walls",
        identification="",
        elements=tuple(elements),
        schedule_start=START,
        schedule_finish=FINISH,
    )
    assert task_progress(made, elements, {}, date(2026, 3, 16), ProgressOptions()).late is late


@pytest.mark.parametrize(("day", "late", "days"), [(16, False, 0), (17, True, 1)])
def test_on_the_day_of_its_planned_finish_a_task_is_wanted_whole_and_is_not_late_as_every_file_says(
    day: int, late: bool, days: int
) -> None:
    elements = {e.global_id: replace(e, state="not started", completion=done(0.0)) for e in sample_report().elements}
    made = Task(
        global_id="T",
        name="Walls",
        identification="",
        elements=tuple(elements),
        schedule_start=START,
        schedule_finish=datetime(2026, 3, 16, 17),
    )
    found = task_progress(made, elements, {}, date(2026, 3, day), ProgressOptions())
    assert (found.planned, found.late, found.late_days) == (1.0, late, days)
    said = [next(one.meaning for one in TASKS if one.heading == "Late"), TERMS["late"]]
    assert all("day of the planned finish has passed" in words.casefold() for words in said)
