from __future__ import annotations

import os
from datetime import date, datetime
from pathlib import Path

import pytest

from asbuilt_bim.bim.schedule import TaskLink
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import ScheduleError
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.schedule.read import read_schedule
from tests.notes import codes, the
from tests.schedule.files import COLUMN, MSP, P6, TASK_A, WALL, written

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "ifc"


def test_ms_project_tasks_come_with_their_outline_their_baseline_and_their_links(tmp_path: Path) -> None:
    found = read_schedule(written(tmp_path, MSP))
    columns, walls, painting = found.rows
    assert (columns.uid, columns.identification, columns.outline) == ("11", "1.1", ("Ground floor",))
    assert columns.start == datetime(2026, 3, 2, 8)  # the baseline, not what was rescheduled
    assert walls.links == (TaskLink(predecessor="11", kind="SS", lag_h=8.0),)
    assert walls.finish == datetime(2026, 3, 27, 17)
    assert painting.outline == ()
    assert the(found.notes, Reason.SCHEDULE_BASELINES).values == {"count": 1, "of": 3}


def test_ms_project_working_time_holds_holidays_and_falls_back_on_the_office_week(tmp_path: Path) -> None:
    calendar = read_schedule(written(tmp_path, MSP)).source.calendar
    monday, tuesday = datetime(2026, 3, 2), datetime(2026, 3, 3)
    assert calendar.hours(monday, tuesday) == 8.0  # 7 to 15, as the file says
    assert calendar.hours(tuesday, datetime(2026, 3, 4)) == 8.0  # not in the file: 8 to 12, 13 to 17
    assert calendar.hours(datetime(2026, 3, 4), datetime(2026, 3, 6)) == 0.0  # two holidays
    assert calendar.after(datetime(2026, 3, 3, 8), 9.0) == datetime(2026, 3, 6, 9)


def test_days_off_that_recur_are_named_and_not_taken_for_one_long_holiday(tmp_path: Path) -> None:
    weekly = (
        "<Exceptions><Exception><TimePeriod><FromDate>2026-03-02T00:00:00</FromDate><ToDate>2026-12-31T23:59:00</ToDate>"
        "</TimePeriod><Type>6</Type><Period>1</Period><DayWorking>0</DayWorking></Exception></Exceptions></Calendar>"
    )
    found = read_schedule(written(tmp_path, MSP.replace("</Calendar>", weekly)))
    assert found.source.calendar.hours(datetime(2026, 3, 2), datetime(2026, 3, 4)) == 16.0
    assert the(found.notes, Reason.SCHEDULE_RECURRING).values == {"count": 1}


def test_exceptions_that_cover_centuries_are_refused_by_their_sum_and_in_time(tmp_path: Path) -> None:
    shut = (
        "<Exceptions><Exception><TimePeriod><FromDate>1990-01-01T00:00:00</FromDate><ToDate>2020-12-31T23:59:00</ToDate>"
        "</TimePeriod><Type>1</Type><DayWorking>0</DayWorking></Exception></Exceptions>"
    )
    one, two = shut, shut.replace("</Exceptions>", "") + shut.replace("<Exceptions>", "")
    closed = read_schedule(written(tmp_path, MSP.replace("</Calendar>", one + "</Calendar>"))).source.calendar
    assert len(closed.exceptions) == 11_323 + 2
    with pytest.raises(ScheduleError, match="exceptions of its calendar 'Site' cover more than 20,000 days"):
        read_schedule(written(tmp_path, MSP.replace("</Calendar>", two + "</Calendar>")))


def test_more_exceptions_of_p6_than_a_calendar_has_are_refused_and_none_is_dropped(tmp_path: Path) -> None:
    first, one = date(1990, 1, 1).toordinal(), "<HolidayOrException><Date>{}T00:00:00</Date></HolidayOrException>"
    days = [one.format(date.fromordinal(first + n)) for n in range(20_001)]
    text, beginning = P6.replace("2026-04-06T", "1990-01-01T"), "<HolidayOrExceptions>"
    whole = read_schedule(written(tmp_path, text.replace(beginning, beginning + "".join(days[:-1]))))
    assert len(whole.source.calendar.exceptions) == 20_000
    with pytest.raises(ScheduleError, match="exceptions of its calendar 'Five days' cover more than 20,000 days"):
        read_schedule(written(tmp_path, text.replace(beginning, beginning + "".join(days))))


def test_p6_activities_come_with_their_breakdown_ids_fields_and_links(tmp_path: Path) -> None:
    found = read_schedule(written(tmp_path, P6))
    columns, other = found.rows  # a level of effort is no work that could be measured
    assert (columns.identification, columns.outline) == ("A1000", ("Ground floor", "Columns of it"))
    assert columns.global_ids == (TASK_A,)
    assert other.links == (TaskLink(predecessor="100", kind="FS", lag_h=8.0),)
    calendar = found.source.calendar
    assert calendar.week[0].minutes == 480  # 11:59 is the last minute worked
    assert [one.day for one in calendar.exceptions] == [date(2026, 4, 6)]


def test_a_night_shift_is_worked_until_midnight_and_on_the_morning_after(tmp_path: Path) -> None:
    night = MSP.replace("07:00:00</FromTime><ToTime>15:00:00", "22:00:00</FromTime><ToTime>06:00:00")
    calendar = read_schedule(written(tmp_path, night)).source.calendar
    assert [(span.from_min, span.to_min) for span in calendar.week[0].spans] == [(1320, 1440)]
    assert [(span.from_min, span.to_min) for span in calendar.week[1].spans] == [(0, 360), (480, 720), (780, 1020)]
    assert calendar.hours(datetime(2026, 3, 9, 12), datetime(2026, 3, 10, 7)) == 8.0
    early = night.replace("06:00:00</ToTime>", "09:00:00</ToTime>")
    tuesday = read_schedule(written(tmp_path, early)).source.calendar.week[1]
    assert tuesday.minutes == 16 * 60  # 0 to 12 and 13 to 17: an hour that two spans hold is worked once


def test_working_times_that_overlap_or_stand_twice_are_worked_once(tmp_path: Path) -> None:
    span = "<WorkingTime>\n   <FromTime>07:00:00</FromTime><ToTime>15:00:00</ToTime></WorkingTime>"
    for more in (span, span.replace("07:00", "14:00").replace("15:00", "16:00")):
        calendar = read_schedule(written(tmp_path, MSP.replace(span, span + more))).source.calendar
        assert calendar.week[0].minutes == (480 if more == span else 540)


def test_an_exceptions_night_shift_runs_into_a_day_that_is_none(tmp_path: Path) -> None:
    shift = "<WorkTime><Start>20:00:00</Start><Finish>01:59:00</Finish></WorkTime>"
    calendar = read_schedule(written(tmp_path, P6.replace("<WorkTime></WorkTime>", shift))).source.calendar
    assert [(one.day, one.minutes) for one in calendar.exceptions] == [(date(2026, 4, 6), 240), (date(2026, 4, 7), 120)]


def test_a_p6_span_that_ends_on_the_half_hour_keeps_its_last_minute(tmp_path: Path) -> None:
    calendar = read_schedule(written(tmp_path, P6.replace("16:59:00", "16:29:00"))).source.calendar
    assert calendar.week[0].minutes == 450


def test_tasks_that_name_a_calendar_which_the_file_lacks_are_counted_in_a_note(tmp_path: Path) -> None:
    msp = MSP.replace("<UID>11</UID>", "<UID>11</UID><CalendarUID>3</CalendarUID>")
    msp = msp.replace("<UID>12</UID>", "<UID>12</UID><CalendarUID>1</CalendarUID>")
    p6 = P6.replace("<Activity><Id>A1000", "<Activity><CalendarObjectId>9</CalendarObjectId><Id>A1000")
    p6 = p6.replace("<Activity><Id>A1010", "<Activity><CalendarObjectId>7</CalendarObjectId><Id>A1010")
    for text in (msp, p6):
        assert the(read_schedule(written(tmp_path, text)).notes, Reason.SCHEDULE_LOST_CALENDARS).values == {"count": 1}
    for text in (MSP, P6):
        assert Reason.SCHEDULE_LOST_CALENDARS not in codes(read_schedule(written(tmp_path, text)).notes)


def test_p6_activities_beside_their_project_are_read_too(tmp_path: Path) -> None:
    inside, flat = P6, P6.replace("</Project>", "").replace("<WBS>", "</Project><WBS>", 1)
    found = [read_schedule(written(tmp_path, one)).rows for one in (inside, flat)]
    assert found[0] == found[1]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_csv_schedule_is_read_with_whatever_sign_and_date_form_is_unmistakable(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "plan.csv"
    lines = [
        "Task ID;Task Name;Start Date;Finish;GlobalIds",
        f"A1;Stützen;2.3.2026;2026-03-13;{COLUMN}, {WALL}",
        ";;;;",
    ]
    path.write_bytes("\r\n".join(lines).encode(encoding))
    (row,) = read_schedule(path).rows
    assert (row.identification, row.name) == ("A1", "Stützen")
    assert (row.start, row.finish) == (datetime(2026, 3, 2, 8), datetime(2026, 3, 13, 17))
    assert row.global_ids == (COLUMN, WALL)


def test_a_table_that_ms_project_exports_in_german_is_read(tmp_path: Path) -> None:
    text = "Nr.;Vorgangsname;Dauer;Anfang;Ende;Geplanter Anfang;Geplantes Ende\n"
    text += "7;Wände EG;5 Tage;Mo 02.03.26 08:00;Fr 06.03.26 17:00;23.02.2026;27.02.26\n"
    text += "8;Dach;1 Tag;09.03.26;09.03.26;NV;NV\n"
    walls, roof = read_schedule(written(tmp_path, text, "plan.csv")).rows
    assert (walls.identification, walls.name) == ("7", "Wände EG")
    assert walls.start and walls.finish and roof.start
    assert (walls.start.date(), walls.finish.date()) == (date(2026, 2, 23), date(2026, 2, 27))  # its baseline
    assert roof.start.date() == date(2026, 3, 9)
    late = text.replace("23.02.2026;27.02.26", "NV;NV")
    assert read_schedule(written(tmp_path, late, "plan.csv")).rows[0].finish == datetime(2026, 3, 6, 17)


@pytest.mark.parametrize("heads", ["Startdatum;Enddatum", "Anfangstermin;Endtermin", "Beginn;Ende"])
def test_german_headings_and_seconds_of_a_schedule_are_read(tmp_path: Path, heads: str) -> None:
    text = f"Nr.;Vorgang;{heads}\n7;Wände EG;02.03.2026 08:00:00;06.03.2026 17:00:00\n"
    (row,) = read_schedule(written(tmp_path, text, "plan.csv")).rows
    assert (row.start, row.finish) == (datetime(2026, 3, 2, 8), datetime(2026, 3, 6, 17))


def test_german_durations_and_actual_dates_are_said_not_to_be_read(tmp_path: Path) -> None:
    text = "Vorgangsname;Dauer;Anfang;Ende;Ist-Anfang;Aktuelles Ende;% Abgeschlossen\nA;5 Tage;02.03.26;;NV;NV;50%\n"
    durations, actual = read_schedule(written(tmp_path, text, "plan.csv")).notes
    assert durations.values == {"column": "Dauer", "count": 1}
    assert actual.values == {"columns": ("Ist-Anfang", "Aktuelles Ende", "% Abgeschlossen"), "count": 3}


def test_a_schedule_with_other_headings_or_dates_is_refused_with_what_it_has_and_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ScheduleError, match=r"no column finish; .* and this one has Nr, Vorgang, Anfang, Fertig$"):
        read_schedule(written(tmp_path, "Nr;Vorgang;Anfang;Fertig\n1;A;02.03.26;06.03.26\n", "plan.csv"))
    with pytest.raises(ScheduleError, match=r"'2. März 2026' is no date; .* or give the plan as XML, as MS Project"):
        read_schedule(written(tmp_path, "Vorgang;Anfang;Ende\nA;2. März 2026;06.03.26\n", "plan.csv"))


def test_durations_in_a_csv_are_said_not_to_be_read_where_a_finish_is_missing(tmp_path: Path) -> None:
    text = "name,start,Duration,finish\nA,2026-03-02,5,\nB,2026-03-02,5,2026-03-06\n"
    (note,) = read_schedule(written(tmp_path, text, "plan.csv")).notes
    assert note.code == Reason.SCHEDULE_DURATIONS_UNREAD and note.values == {"column": "Duration", "count": 1}
    assert read_schedule(written(tmp_path, text.replace("5,\n", "5,2026-03-06\n"), "plan.csv")).notes == ()


def test_a_csv_row_is_judged_by_its_baseline_where_it_has_both_dates_as_ms_project_xml_is(tmp_path: Path) -> None:
    heads = "name,start,finish,Baseline Start,baseline_finish\n"
    moved, half = "A,2026-02-20,2026-03-20,20.02.2026,2026-03-10\n", "B,2026-02-20,2026-03-21,2026-02-20,NA\n"
    found = read_schedule(written(tmp_path, heads + moved + half, "plan.csv"))
    assert [row.finish for row in found.rows] == [datetime(2026, 3, 10, 17), datetime(2026, 3, 21, 17)]
    assert the(found.notes, Reason.SCHEDULE_BASELINES).values == {"count": 1, "of": 2}
    with pytest.raises(ScheduleError, match=r"line 2: baseline finish 2026-02-10 is before baseline start 20\.02"):
        read_schedule(written(tmp_path, heads + moved.replace("03-10", "02-10"), "plan.csv"))
    plain = read_schedule(written(tmp_path, heads + "A,2026-02-20,2026-03-20,,\n", "plan.csv"))
    assert plain.notes == () and plain.rows[0].finish == datetime(2026, 3, 20, 17)


def test_columns_of_what_is_measured_here_are_said_once_not_to_be_read(tmp_path: Path) -> None:
    text = "name,start,finish,Actual Finish,% complete,physical % complete,actually\nA,2026-03-02,2026-03-06,,50,40,x\n"
    (note,) = read_schedule(written(tmp_path, text, "plan.csv")).notes
    assert note.values == {"columns": ("Actual Finish", "% complete", "physical % complete"), "count": 3}
    assert note_words(note) == (
        "Schedule plan.csv: the columns 'Actual Finish', '% complete', 'physical % complete' aren't read. What has "
        "begun and what stands, photos say"
    )


def test_a_sign_for_inches_in_a_name_is_no_quotation(tmp_path: Path) -> None:
    (row,) = read_schedule(written(tmp_path, 'name,start,finish\nWall 8" thick,2026-03-05,2026-03-06\n')).rows
    assert row.name == 'Wall 8" thick'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "id,name,start,finish\nA,B,03/02/2026,2026-03-04\n",
            "line 2: '03/02/2026' is no date; .*in Excel: .*yyyy-mm-dd",
        ),
        ("id,name,start,finish\nA,B,2026-03-05,2026-03-04\n", "line 2: finish 2026-03-04 is before start"),
        ("id,name,start,finish\n,,2026-03-05,2026-03-06\n", "neither an id nor a name"),
        ("task,begin\nA,2026-03-05\n", "names no column start, finish"),
        ("id,name,start,finish\n", "holds no task"),
        (
            'id,name,start,finish\nA,"B,2026-03-05,2026-03-06\nC,D,2026-03-05,2026-03-06\n',
            "quotation mark .* isn't closed",
        ),
        (
            "id,start,planned start,finish\nA,2026-03-05,2026-03-04,2026-03-06\n",
            r"more than one start \(start, planned",
        ),
        ("id,start,finish,Finish\nA,2026-03-05,2026-03-06,2026-03-07\n", r"more than one finish \(finish, Finish\)"),
        ('<!DOCTYPE p [<!ENTITY a "b">]><Project>&a;</Project>', "document type"),
        ("<Project>" + "<a>" * 80 + "</a>" * 80 + "</Project>", "nested deeper than 60"),
        (MSP[:900], "damaged XML"),
        ("<html></html>", "neither of MS Project nor of P6"),
        (MSP.replace("<UID>12<", "<UID>11<"), "two tasks have the number 11"),
        ("ERMHDR\t8.0\n", "P6 XER file"),
    ],
)
def test_a_schedule_that_cannot_be_used_is_refused_with_the_place(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ScheduleError, match=says):
        read_schedule(written(tmp_path, text))


def test_a_binary_schedule_and_a_missing_one_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.mpp").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(100))
    with pytest.raises(ScheduleError, match=r"MS Project file \(\.mpp\); save it as XML"):
        read_schedule(tmp_path / "a.mpp")
    (tmp_path / "plan.xlsx").write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(ScheduleError, match=r"plan\.xlsx: is an Excel workbook .* as CSV"):
        read_schedule(tmp_path / "plan.xlsx")
    with pytest.raises(ScheduleError, match="check the path"):
        read_schedule(tmp_path / "none.xml")


@pytest.mark.skipif(not DATA.is_dir(), reason="the shared files are not here (ASBUILT_BIM_DATA)")
def test_the_real_planning_of_a_housing_project_is_read_whole() -> None:
    found = read_schedule(DATA / "schependomlaan" / "Uitvoering Schependomlaan 18-02-2015.xml")
    assert len(found.rows) > 100
    assert all(row.start and row.finish and row.start <= row.finish for row in found.rows)
    calendar = found.source.calendar
    assert calendar.week[0].minutes == 480
    assert calendar.week[5].minutes == 0
    assert calendar.exceptions
