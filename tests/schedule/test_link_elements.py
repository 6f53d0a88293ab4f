from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

import pytest

from asbuilt_bim.bim.schedule import EVERY_DAY
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.progress.completion.planned import due_by, planned_share
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.schedule.link_elements import with_schedule
from asbuilt_bim.schedule.read import read_schedule
from tests.notes import the
from tests.schedule.files import COLUMN, MSP, P6, TASK_A, TASK_B, WALL, design, task, written

OLD = datetime(2025, 1, 1)


def test_tasks_are_tied_by_name_and_what_makes_no_element_is_named(tmp_path: Path) -> None:
    plan = read_schedule(written(tmp_path, MSP))
    tied = with_schedule(design(task(TASK_A, "columns "), task(TASK_B, "Walls")), plan)
    columns, walls = tied.tasks
    assert columns.schedule_start == datetime(2026, 3, 2, 8)
    assert columns.outline == ("Ground floor",)
    assert walls.links[0].predecessor == TASK_A  # links are between the IFC's own tasks
    assert walls.schedule_uid == "12"
    assert tied.schedule is not None
    assert tied.schedule.kind == "MS Project XML"
    note = the(tied.notes, Reason.SCHEDULE_NOT_LINKED)
    assert note.values == {"linked": 2, "of": 3, "tasks": ("Painting",), "count": 1}
    assert note.subject == about(SubjectKind.SCHEDULE, plan.source.name)


def test_a_global_id_goes_before_a_name_and_an_activity_id_ties_what_has_another_name(tmp_path: Path) -> None:
    plan = read_schedule(written(tmp_path, P6))
    tied = with_schedule(design(task(TASK_B, "Columns", "A1010"), task(TASK_A, "Stützen")), plan)
    by_key = {one.global_id: one for one in tied.tasks}
    assert by_key[TASK_A].identification == "A1000"
    assert by_key[TASK_B].identification == "A1010"


def test_a_schedule_that_dates_no_task_of_the_ifc_brings_them_no_calendar(tmp_path: Path) -> None:
    for text in (MSP, P6):
        tied = with_schedule(design(task(TASK_B, "Facade")), read_schedule(written(tmp_path, text)))
        assert [one.calendar for one in tied.tasks] == [EVERY_DAY]


def test_an_export_is_told_the_ids_of_what_the_file_has_beside_the_ifcs_tasks(tmp_path: Path) -> None:
    tied = with_schedule(design(task(TASK_A, "Columns")), read_schedule(written(tmp_path, MSP)))
    assert tied.schedule is not None and tied.schedule.last_uid == 14  # of a blank line
    named = P6.replace("<Id>A1010</Id>", "<Id>1.1.2</Id>")
    tied = with_schedule(design(task(TASK_B, "Walls", "1.1.2")), read_schedule(written(tmp_path, named)))
    assert tied.schedule is not None and tied.schedule.other_ids == ("1.1.2",)


def test_a_task_with_a_calendar_of_its_own_is_held_against_that(tmp_path: Path) -> None:
    seven = "<Calendar><UID>2</UID><Name>All days</Name><BaseCalendarUID>-1</BaseCalendarUID><WeekDays>" + "".join(
        f"<WeekDay><DayType>{n}</DayType><DayWorking>1</DayWorking><WorkingTimes><WorkingTime>"
        "<FromTime>08:00:00</FromTime><ToTime>17:00:00</ToTime></WorkingTime></WorkingTimes></WeekDay>"
        for n in range(1, 8)
    )
    msp = MSP.replace("</Calendars>", f"{seven}</WeekDays></Calendar></Calendars>")
    msp = msp.replace("<UID>12</UID>", "<UID>12</UID><CalendarUID>2</CalendarUID>")
    p6 = P6.replace("<Project>", _seven_days_in_p6() + "<Project>")
    p6 = p6.replace("<Activity><Id>A1010", "<Activity><CalendarObjectId>8</CalendarObjectId><Id>A1010")
    for text in (msp, p6):
        plan = read_schedule(written(tmp_path, text))
        tied = with_schedule(design(task(TASK_A, "Columns"), task(TASK_B, "Walls", "A1010")), plan)
        assert tied.schedule is not None
        columns, walls = tied.tasks
        assert columns.calendar is None and walls.calendar is not None
        assert [day.minutes for day in walls.calendar.week] == [540] * 7  # the project's rests on Sundays
        assert the(tied.notes, Reason.SCHEDULE_OWN_CALENDARS).values == {"count": 1}
    held = {
        one.name: planned_share(walls.schedule_start, walls.schedule_finish, date(2026, 3, 22), one)
        for one in (tied.schedule.calendar, walls.calendar)
    }
    assert held == {"Five days": 0.5, "All days": pytest.approx(7 / 12)}  # a Sunday evening, of 16 to 27 March


def _seven_days_in_p6() -> str:
    names = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
    days = "".join(
        f"<StandardWorkHours><DayOfWeek>{name}</DayOfWeek><WorkTime><Start>08:00:00</Start><Finish>16:59:00</Finish>"
        "</WorkTime></StandardWorkHours>"
        for name in names
    )
    return (
        f"<Calendar><Name>All days</Name><ObjectId>8</ObjectId><StandardWorkWeek>{days}</StandardWorkWeek></Calendar>"
    )


def test_an_outline_number_alone_ties_nothing(tmp_path: Path) -> None:
    plan = read_schedule(written(tmp_path, MSP))
    tied = with_schedule(design(task(TASK_A, "Site fence", "1.1")), plan)
    assert tied.tasks[0].schedule_start == OLD
    assert the(tied.notes, Reason.SCHEDULE_LACKS_TASKS).values["tasks"] == ("Site fence",)


def test_what_fits_twice_is_tied_to_neither_and_named(tmp_path: Path) -> None:
    plan = read_schedule(written(tmp_path, MSP.replace("Painting", "Walls")))
    tied = with_schedule(design(task(TASK_A, "Columns"), task(TASK_B, "Walls")), plan)
    assert tied.tasks[1].schedule_start == OLD
    assert the(tied.notes, Reason.SCHEDULE_AMBIGUOUS).values["tasks"] == ("Walls",)
    twice = with_schedule(design(task(TASK_A, "Columns"), task(TASK_B, "Columns")), plan)
    assert all(one.schedule_start == OLD for one in twice.tasks)


@pytest.mark.parametrize(
    ("rows", "code", "named"),
    [
        ("1.2.1,,D", Reason.SCHEDULE_NUMBER_ALONE, "1.2.1"),
        ("1.2.1,Shell,D", Reason.SCHEDULE_NUMBER_ALONE, "1.2.1"),
        ("1.2.2,Walls,D 1.2.3,Walls,D", Reason.SCHEDULE_TASK_TAKEN, "Walls"),
        ("A1,Piers,D A1,More,D", Reason.SCHEDULE_AMBIGUOUS, "Piers"),
        (",Walls,D ,Walls,D", Reason.SCHEDULE_AMBIGUOUS, "Walls"),
        ("1.2.2,Walls,D 1.2.2,Paint,D", Reason.SCHEDULE_NOT_LINKED, "Paint"),
    ],
)
def test_why_a_row_is_tied_to_nothing_is_said_as_it_is(tmp_path: Path, rows: str, code: Reason, named: str) -> None:
    text = "id,name,start,finish\n" + rows.replace(" ", "\n").replace("D", "2026-03-02,2026-03-13")
    third = task("2TaskCGlobalId00000001", "C", "A1")
    tasks = (task(TASK_A, "Columns", "1.2.1"), task(TASK_B, "Walls", "1.2.2"), third)
    tied = with_schedule(design(*tasks), read_schedule(written(tmp_path, text, "plan.csv")))
    (note,) = [one for one in tied.notes if one.code is not Reason.SCHEDULE_LACKS_TASKS]
    assert note.code is code
    assert note.values["tasks"][0] == named  # type: ignore[index]


def test_outline_number_and_name_together_tell_two_of_a_name_apart(tmp_path: Path) -> None:
    plan = read_schedule(written(tmp_path, MSP.replace("<Name>Painting</Name>", "<Name>Walls</Name><WBS>2.2</WBS>")))
    tied = with_schedule(design(task(TASK_A, "Walls", "1.2"), task(TASK_B, "Walls", "2.2")), plan)
    assert [one.schedule_uid for one in tied.tasks] == ["12", "13"]


def test_a_row_with_the_elements_own_global_ids_becomes_a_task(tmp_path: Path) -> None:
    text = f"name,start,finish,globalids\nAll of it,2026-03-02,2026-03-13,{COLUMN} {WALL}\n"
    (made,) = with_schedule(design(), read_schedule(written(tmp_path, text, "plan.csv"))).tasks
    assert made.elements == (COLUMN, WALL)
    assert made.schedule_finish == datetime(2026, 3, 13, 17)


def test_a_row_without_dates_leaves_the_tasks_own_and_is_named(tmp_path: Path) -> None:
    text = f"name,start,finish,globalids\nColumns,,,\nZone A,,,{COLUMN}\n"
    made = with_schedule(design(task(TASK_A, "Columns")), read_schedule(written(tmp_path, text, "plan.csv")))
    assert made.tasks[0].schedule_start == OLD
    note = the(made.notes, Reason.SCHEDULE_ROWS_UNDATED)
    assert note.values == {"tasks": ("Columns", "Zone A"), "count": 2, "dated": 1}
    assert "2 tasks have no dates: 'Columns', 'Zone A'. 1 keeps the IFC's" in note_words(note)


def test_dates_that_a_row_gives_elements_are_their_only_ones_also_in_the_ifcs_tasks(tmp_path: Path) -> None:
    both = replace(task(TASK_A, "Ground floor"), elements=(COLUMN, WALL))
    rows = f"One,2026-03-02,2026-03-13,{COLUMN}\nTwo,2026-03-09,2026-03-20,{WALL}\n"
    text = f"name,start,finish,globalids\n{rows}"
    made = with_schedule(design(both), read_schedule(written(tmp_path, text, "plan.csv")))
    whole = made.tasks[0]
    assert (whole.schedule_start, whole.schedule_finish) == (datetime(2026, 3, 2, 8), datetime(2026, 3, 20, 17))
    assert the(made.notes, Reason.SCHEDULE_DATES_TAKEN).values == {
        "tasks": ("Ground floor",), "count": 1, "elements": 2}  # fmt: skip
    assert all(note.code is not Reason.SCHEDULE_LACKS_TASKS for note in made.notes)


def test_elements_that_the_rows_leave_out_keep_the_ifcs_dates_in_their_task(tmp_path: Path) -> None:
    late = replace(task(TASK_A, "Ground floor"), elements=(COLUMN, WALL), schedule_finish=datetime(2027, 1, 2))
    text = f"name,start,finish,globalids\nOne,2026-03-02,2026-03-13,{COLUMN}\n"
    (whole, _) = with_schedule(design(late), read_schedule(written(tmp_path, text, "plan.csv"))).tasks
    assert (whole.schedule_start, whole.schedule_finish) == (OLD, datetime(2027, 1, 2))


def test_elements_that_the_rows_leave_out_are_due_by_their_ifc_tasks_own_finish(tmp_path: Path) -> None:
    both = replace(task(TASK_A, "Ground floor"), elements=(COLUMN, WALL), schedule_finish=datetime(2026, 3, 10, 17))
    text = f"name,start,finish,globalids\nOne,2026-03-02,{{}},{COLUMN}\n"
    for last, due in (("2026-03-13", {WALL}), ("2026-03-06", {WALL, COLUMN})):
        plan = read_schedule(written(tmp_path, text.format(last), "plan.csv"))
        made = with_schedule(design(both), plan)
        assert due_by(made.tasks, date(2026, 3, 11)) == due, "the wall's IFC task is stretched to the column's row"
        assert due_by(made.tasks, date(2026, 3, 10)) == due - {WALL}
        note = the(made.notes, Reason.SCHEDULE_DATES_TAKEN)
        assert note_words(note).endswith("'Ground floor'. Their other elements are due by the IFC's")
    (whole, _) = made.tasks
    assert (whole.finish_from, whole.ifc_finish) == ("", datetime(2026, 3, 10, 17))


def test_a_task_knows_the_schedule_file_that_its_finish_is_from(tmp_path: Path) -> None:
    both = replace(task(TASK_A, "Ground floor"), elements=(COLUMN, WALL))
    text = f"name,start,finish,globalids\nWalls,2026-03-02,2026-03-06,\nOne,2026-03-02,2026-03-13,{COLUMN}\nC,,,\n"
    plan = read_schedule(written(tmp_path, text, "plan.csv"))
    made = with_schedule(design(both, task(TASK_B, "Walls"), task("2TaskCGlobalId00000001", "C")), plan)
    assert [one.finish_from for one in made.tasks] == ["plan.csv", "plan.csv", "", "plan.csv"]


def test_a_task_of_the_ifc_whose_elements_no_row_names_keeps_its_dates(tmp_path: Path) -> None:
    other = replace(task(TASK_A, "Ground floor"), elements=(WALL,))
    text = f"name,start,finish,globalids\nOne,2026-03-02,2026-03-13,{COLUMN}\n"
    made = with_schedule(design(other), read_schedule(written(tmp_path, text, "plan.csv")))
    assert made.tasks[0] == replace(other, calendar=EVERY_DAY)
    assert all(note.code is not Reason.SCHEDULE_DATES_TAKEN for note in made.notes)


@pytest.mark.parametrize("kind", ["plan.csv", "msp.xml", "p6.xml"])
@pytest.mark.parametrize(
    ("cell", "named"),
    [
        (f"{COLUMN} 1WallGlobalId00000000X", ("1WallGlobalId00000000X",)),
        (f"1WallGlobalId00000001;{COLUMN}", ("1WallGlobalId00000001",)),  # a sign is missing
        ("1WallGlobalId00000000X", ("1WallGlobalId00000000X",)),
        (f"ifc: {COLUMN} {WALL} 1WallGlobalId00000000X", ("1WallGlobalId00000000X",)),
        (f"{COLUMN} {WALL}", ()),
        ("see order 1WallGlobalId00000000X", ()),
        ("Bauabschnitt_West_Wand", ()),
    ],
)
def test_a_mistyped_global_id_is_named_where_a_field_lists_global_ids(
    tmp_path: Path, kind: str, cell: str, named: tuple[str, ...]
) -> None:
    text = {
        "plan.csv": f'name,start,finish,globalids\nPart,2026-03-02,2026-03-13,"{cell}"\n',
        "msp.xml": MSP.replace("<WBS>1.1</WBS>", f"<ExtendedAttribute><Value>{cell}</Value></ExtendedAttribute>"),
        "p6.xml": P6.replace("ifc 2TaskAGlobalId00000001", cell),
    }[kind]
    made = with_schedule(design(task(TASK_A, "Ground floor")), read_schedule(written(tmp_path, text, kind)))
    found = [note for note in made.notes if note.code is Reason.SCHEDULE_IDS_UNKNOWN]
    assert [note.values["elements"] for note in found] == ([named] if named else [])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            MSP.replace("2026-03-27T17", "2026-01-27T17"),
            "its finish 2026-01-27 17:00 is before its start 2026-03-16 08:00",
        ),
        (
            P6.replace("2026-03-27T17", "2026-01-27T17"),
            "its finish 2026-01-27 17:00 is before its start 2026-03-16 08:00",
        ),
        (
            MSP.replace("2026-03-27T17", "2026-99-99T17"),
            "its finish '2026-99-99T17:00:00' is no date from 1950 to 2200",
        ),
    ],
)
def test_dates_that_cannot_be_leave_the_ifcs_own_and_are_said(tmp_path: Path, text: str, says: str) -> None:
    plan = read_schedule(written(tmp_path, text.replace("Something else", "Walls")))
    tied = with_schedule(design(task(TASK_B, "Walls")), plan)
    (walls,) = tied.tasks
    assert (walls.schedule_start, walls.schedule_finish) == (OLD, datetime(2025, 1, 2))
    assert f"Schedule, task 'Walls': {says}. The IFC's dates stand" in map(note_words, tied.notes)


def test_a_start_alone_leaves_the_ifcs_finish_or_its_dates_where_that_is_before_it(tmp_path: Path) -> None:
    text = MSP.replace("<Finish>2026-03-27T17:00:00</Finish>", "")
    for year, start, code in [
        (2027, datetime(2026, 3, 16, 8), Reason.SCHEDULE_DATE_MISSING),
        (2025, OLD, Reason.SCHEDULE_DATE_CONTRADICTED),
    ]:
        walls = replace(task(TASK_B, "Walls"), schedule_finish=datetime(year, 1, 2))
        tied = with_schedule(design(walls), read_schedule(written(tmp_path, text)))
        assert (tied.tasks[0].schedule_start, tied.tasks[0].schedule_finish) == (start, datetime(year, 1, 2))
        note = the(tied.notes, code)
        assert note.values["missing"] == "finish" and note.values["ifc_dates"]
