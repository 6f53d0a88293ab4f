from __future__ import annotations

import csv
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import date, datetime
from itertools import pairwise
from pathlib import Path

import openpyxl
import pytest

from asbuilt_bim.bim.schedule import EVERY_DAY, ScheduleSource, TaskLink, WorkCalendar, WorkDay, weekday
from asbuilt_bim.progress.report import Completion, ProgressReport, TaskProgress
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.schedule.lines import schedule_lines
from asbuilt_bim.report.schedule.msp import write_msp
from asbuilt_bim.report.schedule.p6 import write_p6
from asbuilt_bim.report.schedule.write import write_tasks_csv
from asbuilt_bim.report.task_rows import late_words
from asbuilt_bim.report.wording.of_workbook.columns import TASKS, UNCLEAR
from asbuilt_bim.report.workbook.write import write_workbook
from asbuilt_bim.schedule.read import read_schedule
from tests.report.sample_report import HOSTILE_FORMULA, VISIT, renamed, sample_report

# The order of the published schema (mspdi_pj12.xsd and the Task element of later versions), as far as it is used here.
TASK_ORDER = [
    "UID",
    "ID",
    "Name",
    "Active",
    "Manual",
    "Type",
    "IsNull",
    "WBS",
    "OutlineNumber",
    "OutlineLevel",
    "Start",
    "Finish",
    "Duration",
    "DurationFormat",
    "Estimated",
    "Milestone",
    "Summary",
    "PercentComplete",
    "ActualStart",
    "ActualFinish",
    "ActualDuration",
    "RemainingDuration",
    "ConstraintType",
    "CalendarUID",
    "ConstraintDate",
    "Notes",
    "PhysicalPercentComplete",
    "EarnedValueMethod",
    "PredecessorLink",
    "ExtendedAttribute",
    "Baseline",
]
PROJECT_ORDER = [
    "SaveVersion",
    "Name",
    "Title",
    "ScheduleFromStart",
    "StartDate",
    "FinishDate",
    "CalendarUID",
    "DefaultStartTime",
    "DefaultFinishTime",
    "MinutesPerDay",
    "MinutesPerWeek",
    "DaysPerMonth",
    "DurationFormat",
    "StatusDate",
    "NewTasksAreManual",
    "DefaultTaskEVMethod",
    "ExtendedAttributes",
    "Calendars",
    "Tasks",
    "Resources",
    "Assignments",
]


def task(key: str, best: float | None, lower: float, upper: float, unknown: int = 0, **more: object) -> TaskProgress:
    base = sample_report().tasks[0]
    completion = Completion(best=best, lower=lower, upper=upper, coverage=1.0 - (upper - lower))
    progress = replace(base.progress, key=key, name=key, completion=completion, unknown=unknown)
    begun = date(2026, 3, 2) if lower > 0.0 else None
    return replace(base, progress=progress, actual_start=begun, **more)  # type: ignore[arg-type]


def report_of(*tasks: TaskProgress) -> ProgressReport:
    return replace(sample_report(), tasks=tasks)


ZERO = task("zero", 0.0, 0.0, 0.0, outline=("Ground floor",))
PART = task("part", 0.6, 0.355, 0.8, 2, outline=("Ground floor", "North"))
UNKNOWN = task("unknown", None, 0.0, 1.0)
WHOLE = task("whole", 0.9999, 0.9999, 0.9999, identification="A1000")
DONE = task("done", 0.985, 0.985, 0.985, actual_finish=VISIT, outline=("Ground floor",))
ALL = (ZERO, PART, UNKNOWN, WHOLE, DONE)


def msp(report: ProgressReport, tmp_path: Path) -> dict[str, ET.Element]:
    write_msp(report, tmp_path / "s.xml")
    root = ET.parse(tmp_path / "s.xml").getroot()
    for element in root.iter():
        element.tag = element.tag.removeprefix("{http://schemas.microsoft.com/project}")
    tasks = {one.findtext("Name", ""): one for one in root.iter("Task")}
    return {"": root, **tasks}


def p6(report: ProgressReport, tmp_path: Path) -> dict[str, ET.Element]:
    write_p6(report, tmp_path / "s.xml")
    root = ET.parse(tmp_path / "s.xml").getroot()
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    return {"": root, **{one.findtext("Name", ""): one for one in root.iter("Activity")}}


def test_ms_project_shows_measured_0_part_and_unknown_as_three_different_things(tmp_path: Path) -> None:
    found = msp(report_of(*ALL), tmp_path)
    percents = {name: found[name].findtext("PercentComplete") for name in ("zero", "part", "unknown", "whole", "done")}
    assert percents == {"zero": "0", "part": "35", "unknown": None, "whole": "99", "done": "100"}
    said = {name: found[name].findtext("ExtendedAttribute/Value") for name in percents}
    assert said == {
        "zero": "measured 0",
        "part": "part measured",
        "unknown": "unknown",
        "whole": "measured",
        "done": "measured",
    }
    for name in ("PhysicalPercentComplete", "ActualStart", "RemainingDuration", "ActualDuration"):
        assert found["unknown"].find(name) is None
    assert "at least 35.5 % (lower bound)" in found["part"].findtext("Notes", "")
    assert found["done"].findtext("ActualFinish") == "2026-03-16T17:00:00"
    assert found["zero"].find("ActualStart") is None


def test_what_remains_and_what_is_done_make_the_duration(tmp_path: Path) -> None:
    found = msp(report_of(*ALL), tmp_path)["part"]
    hours = [float(found.findtext(name, "").partition("H")[0][2:]) for name in ("ActualDuration", "RemainingDuration")]
    whole = 352.0 + 0.645 * 441.0  # 2 March 8:00 to the end of 16 March, then what remains of the planned 441 hours
    assert sum(hours) == pytest.approx(whole, abs=2.0)
    assert hours[0] / whole == pytest.approx(0.355, abs=0.003)
    assert found.findtext("Finish") == "2026-03-28T20:27:00"
    assert found.findtext("Baseline/Start") == "2026-02-23T08:00:00"


def test_the_elements_stand_in_the_order_of_microsofts_schema(tmp_path: Path) -> None:
    linked = replace(WHOLE, links=(TaskLink(predecessor="zero", kind="SS", lag_h=2.0),))
    found = msp(report_of(ZERO, PART, UNKNOWN, linked, DONE), tmp_path)
    root = found.pop("")
    for order, element in [(PROJECT_ORDER, root), *((TASK_ORDER, one) for one in found.values())]:
        places = [order.index(child.tag) for child in element]
        assert all(a <= b for a, b in pairwise(places)), [child.tag for child in element]
    assert found["whole"].findtext("PredecessorLink/Type") == "3"
    assert found["whole"].findtext("PredecessorLink/LinkLag") == "1200"


def test_the_outline_comes_with_summaries_in_their_place() -> None:
    lines = schedule_lines(report_of(*ALL))
    assert [(line.number, line.name) for line in lines] == [
        ("1", "Ground floor"),
        ("1.1", "zero"),
        ("1.2", "North"),
        ("1.2.1", "part"),
        ("1.3", "done"),
        ("2", "unknown"),
        ("3", "whole"),
    ]


def test_p6_gets_physical_percent_and_leaves_the_unknown_alone(tmp_path: Path) -> None:
    found = p6(report_of(*ALL), tmp_path)
    told = {
        name: (found[name].findtext("PhysicalPercentComplete"), found[name].findtext("Status"))
        for name in ("zero", "part", "unknown", "whole", "done")
    }
    assert told == {
        "zero": ("0", "Not Started"),
        "part": ("0.355", "In Progress"),
        "unknown": (None, None),
        "whole": ("0.9999", "In Progress"),
        "done": ("1", "Completed"),
    }
    assert found["unknown"].find("RemainingDuration") is None
    assert found["zero"].findtext("RemainingDuration") == "441"
    assert found["unknown"].findtext("UDF/TextValue") == "unknown"
    assert found["whole"].findtext("Id") == "A1000"
    assert len({one.findtext("Id") for name, one in found.items() if name}) == 5
    assert found[""].findtext("Project/DataDate") == "2026-03-16T23:59:00"


def test_p6_elements_are_in_alphabetical_order_as_its_schema_has_them(tmp_path: Path) -> None:
    found = p6(report_of(*ALL), tmp_path)
    root = found.pop("")
    scalars = [one for one in [*found.values(), *root.iter("WBS"), *root.iter("Relationship"), *root.iter("UDFType")]]
    for element in scalars:
        tags = [child.tag for child in element if child.tag != "UDF"]
        assert tags == sorted(tags, key=str.lower)
        assert all(child.tag == "UDF" for child in list(element)[len(tags) :])


def test_hostile_names_stay_text_in_one_line_without_control_characters(tmp_path: Path) -> None:
    name = "a\x00\x0b]]>\n<Task><UID>99</UID></Task>&amp;" + "x" * 400
    report = report_of(replace(ZERO, progress=replace(ZERO.progress, name=name), outline=("\ud800<b>",)))
    found = msp(report, tmp_path)
    assert len([one for one in found if one]) == 2
    written = next(one for one in found if one.startswith("a"))
    assert written.startswith("a]]> <Task><UID>99</UID></Task>&amp;xxx")
    assert len(written) == 255
    assert max(len(one) for one in p6(report, tmp_path)) == 120


def test_what_is_written_is_read_back_as_the_same_plan_and_the_same_ties(tmp_path: Path) -> None:
    key = "1TaskGlobalId000000001"
    one = replace(PART, progress=replace(PART.progress, key=key), identification="A1")
    for write in (write_msp, write_p6):
        write(report_of(one), tmp_path / "s.xml")
        (row,) = read_schedule(tmp_path / "s.xml").rows
        assert row.global_ids == (key,)
        assert (row.start, row.finish) == (one.schedule_start, one.schedule_finish)
        assert (row.identification, row.outline) == ("A1", ("Ground floor", "North"))


def test_a_task_of_the_schedules_own_is_tied_by_all_its_elements_or_not_at_all(tmp_path: Path) -> None:
    ids = tuple(f"1Element{n:03}GlobalId000" for n in range(20))
    for count, tied in ((3, ids[:3]), (20, ())):  # twenty don't fit into a custom field
        one = replace(PART, progress=replace(PART.progress, key="schedule:7", elements=ids[:count]))
        for write in (write_msp, write_p6):
            write(report_of(one), tmp_path / "s.xml")
            assert read_schedule(tmp_path / "s.xml").rows[0].global_ids == tied


def test_the_calendar_comes_along(tmp_path: Path) -> None:
    days = tuple(weekday(n, (480, 720), (780, 1020)) if n < 5 else weekday(n) for n in range(7))
    holiday = WorkDay(weekday=None, day=date(2026, 3, 9), spans=())
    calendar = WorkCalendar(name="Site", week=days, exceptions=(holiday,))
    source = ScheduleSource(name="p.xml", digest="", kind="MS Project XML", calendar=calendar)
    report = replace(report_of(PART), schedule=source)
    for write in (write_msp, write_p6):
        write(report, tmp_path / "s.xml")
        assert read_schedule(tmp_path / "s.xml").source.calendar == calendar
    found = p6(report, tmp_path)
    part = found["part"]
    assert all(time.findtext("Start") for time in found[""].iter("WorkTime"))  # an empty one stops MPXJ
    assert part.findtext("PlannedDuration") == "112"  # 23 February to 13 March: 14 working days
    assert part.findtext("ActualDuration") == "80"  # 2 to 16 March without the holiday


def test_no_task_gets_the_number_or_id_of_another_task_of_the_planners_file(tmp_path: Path) -> None:
    source = ScheduleSource(
        name="p.xml", digest="", kind="MS Project XML", calendar=EVERY_DAY, last_uid=40, other_ids=("1.1.2",)
    )
    linked, ours = replace(PART, schedule_uid="7"), replace(WHOLE, identification="1.1.2", schedule_uid="")
    report = replace(report_of(linked, ours), schedule=source)
    found = msp(report, tmp_path)
    uids = {name: int(one.findtext("UID", "")) for name, one in found.items() if name}
    assert uids.pop("part") == 7 and min(uids.values()) > 40
    ids = {name: one.findtext("Id") for name, one in p6(report, tmp_path).items() if name}
    assert ids["whole"] not in ("1.1.2", None)
    theirs = replace(report, tasks=(replace(ours, schedule_uid="9"),))
    assert p6(theirs, tmp_path)["whole"].findtext("Id") == "1.1.2"


@pytest.mark.parametrize("sort", ["msp", "p6"])
def test_ifc4d_takes_the_schedule(tmp_path: Path, sort: str) -> None:
    ifc4d = pytest.importorskip(f"ifc4d.{'msp2ifc' if sort == 'msp' else 'p62ifc'}")
    import ifcopenshell

    # ifc4d reads no P6 activity without a Status, which the schema leaves optional and an unknown task can't have
    tasks = ALL if sort == "msp" else [one for one in ALL if one is not UNKNOWN]
    {"msp": write_msp, "p6": write_p6}[sort](report_of(*tasks), tmp_path / "s.xml")
    reader = ifc4d.MSP2Ifc() if sort == "msp" else ifc4d.P62Ifc()
    reader.xml, reader.output = str(tmp_path / "s.xml"), str(tmp_path / "s.ifc")
    reader.execute()
    times = {t.Name: t.TaskTime for t in ifcopenshell.open(str(tmp_path / "s.ifc")).by_type("IfcTask") if t.TaskTime}
    assert set(times) == {one.progress.name for one in tasks}
    done = {name: times[name].Completion for name in times}
    assert done["part"] == pytest.approx(0.355, abs=0.006)
    assert done["done"] == 1.0
    assert times["done"].ActualFinish == "2026-03-16T17:00:00"
    if sort == "msp":
        assert not done["unknown"]
        assert times["unknown"].ActualStart is None


def test_the_table_the_workbook_and_the_page_tell_them_apart_too(tmp_path: Path) -> None:
    report = report_of(*ALL, replace(ZERO, progress=replace(ZERO.progress, name=HOSTILE_FORMULA)))
    write_tasks_csv(report, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = {row["Name"]: row for row in csv.DictReader(file)}
    assert [rows[n]["CompletionTold"] for n in ("zero", "part", "unknown")] == ["0.0000", "0.3550", ""]
    assert [rows[n]["Known"] for n in ("zero", "part", "unknown")] == ["measured 0", "part measured", "unknown"]
    assert f"'{HOSTILE_FORMULA}" in rows
    write_tasks_csv(replace(report, csv="semicolon"), tmp_path / "t.csv")
    assert ";0,0000;" in (tmp_path / "t.csv").read_text(encoding="utf-8-sig")
    write_workbook(report, tmp_path / "q.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "q.xlsx")["Tasks"]
    cells = {row[0]: (row[5], row[8], row[6]) for row in sheet.iter_rows(min_row=2, values_only=True)}
    assert cells["zero"] == ("measured 0", 0, 0)
    assert cells["part"] == ("part measured", 0.6, 0.355)
    assert cells["unknown"] == ("unknown", "unknown", 0)
    page = page_html(report, {})
    for words in ("measured 0, seen", "part measured, seen", "unknown, seen"):
        assert words in page


def test_a_lower_bound_that_a_task_is_told_by_is_rounded_down(tmp_path: Path) -> None:
    sure = replace(PART.progress, completion=replace(PART.progress.completion, lower=0.35507))
    write_tasks_csv(report_of(replace(PART, progress=sure)), tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8-sig", newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["CompletionLower"], row["CompletionTold"]) == ("0.3550", "0.3550")


def test_a_task_of_known_elements_is_told_by_its_lower_bound_as_one_of_unknown_ones_is(tmp_path: Path) -> None:
    known = task("known", 0.64, 0.6, 0.7)
    write_tasks_csv(report_of(known), tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8-sig", newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["Known"], row["CompletionBest"], row["CompletionTold"]) == ("measured", "0.6400", "0.6000")
    assert row["Note"] == "Measured: at least 60.0 % (lower bound), possibly 70.0 %; best estimate 64.0 %."
    assert msp(report_of(known), tmp_path)["known"].findtext("PercentComplete") == "60"


def test_a_task_seen_begun_of_which_nothing_is_certain_yet_has_begun_in_the_schedules(tmp_path: Path) -> None:
    begun = replace(task("begun", 0.03, 0.0, 0.06), actual_start=date(2026, 3, 2))
    told = msp(report_of(begun), tmp_path)["begun"]
    assert told.findtext("PercentComplete") == "0" and (told.findtext("ActualStart") or "").startswith("2026-03-02")
    write_p6(report_of(begun), tmp_path / "p6.xml")
    activity = next(one for one in ET.parse(tmp_path / "p6.xml").getroot().iter() if one.tag.endswith("Activity"))
    said = {one.tag.rpartition("}")[2]: one.text for one in activity}
    assert said["Status"] == "In Progress" and (said["ActualStartDate"] or "").startswith("2026-03-02")


def test_late_elements_are_named_on_the_page_and_on_a_sheet(tmp_path: Path) -> None:
    report = sample_report()
    page = page_html(report, {})
    assert "2 elements are late" in page
    write_workbook(report, tmp_path / "q.xlsx")
    rows = list(openpyxl.load_workbook(tmp_path / "q.xlsx")["Late"].iter_rows(min_row=2, values_only=True))
    assert len(rows) == 2
    assert rows[0][6:10] == ("Columns, ground floor", datetime(2026, 3, 13), 3, "late")


def test_what_is_due_and_too_little_seen_stands_on_the_sheet_of_late_elements_marked_so(tmp_path: Path) -> None:
    report = sample_report()
    first = replace(report.elements[0], state="complete", as_far_as_seen=True)
    unseen = replace(report.elements[2], state="unknown")
    report = replace(report, elements=(first, report.elements[1], unseen, *report.elements[3:]))
    write_workbook(report, tmp_path / "q.xlsx")
    rows = list(openpyxl.load_workbook(tmp_path / "q.xlsx")["Late"].iter_rows(min_row=2, values_only=True))
    told = {row[2]: (row[3], *row[8:10]) for row in rows}
    assert told == {
        report.elements[1].global_id: ("part", 3, "late"),
        first.global_id: ("complete as far as seen", "unknown", UNCLEAR),
        unseen.global_id: ("unknown", "unknown", UNCLEAR),
    }
    assert "1 element is late" in late_words(report) and "2 more should stand" in late_words(report)
    page = page_html(report, {})
    assert f"{first.name}</a> (complete as far as seen, at least" in page[page.index('id="late"') :]


def test_a_late_task_whose_elements_have_until_a_later_one_is_told_though_no_element_is_late() -> None:
    report = sample_report()
    late = next(one for one in report.tasks if one.late)
    later = replace(
        late, progress=replace(late.progress, key="L" * 22, name="Fair finish"), late=False,
        schedule_finish=datetime(2027, 1, 1, 17),
    )  # fmt: skip
    assert "until a later" not in late_words(report)
    told = late_words(replace(report, tasks=(*report.tasks, later)))
    assert told.startswith("No element was seen late")
    assert f"The task '{late.progress.name}' is late; its elements have until a later one." in told


def test_the_schedule_is_called_so_and_never_the_plan_which_is_a_drawing(tmp_path: Path) -> None:
    page = page_html(sample_report(), {})
    for part in ("time", "tasks"):
        text = page[page.index(f'<section id="{part}"') :].partition("</section>")[0]
        assert "schedule" in text and not re.search(r">[^<]*\b[Pp]lan\b[^<]*<", text)
    assert [c.heading for c in TASKS if "plan" in c.heading.lower().replace("planned", "")] == []


def test_the_terminals_line_on_late_elements_holds_no_escape_sequence() -> None:
    report = renamed(sample_report(), 2, name="\x1b[31mred\x07")
    assert late_words(report) == "2 elements are late, '[31mred' by 3 days."
    assert late_words(replace(report, tasks=(replace(report.tasks[2]),))) == ""
