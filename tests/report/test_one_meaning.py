"""Late, forecast and finish are the same day in every file of one run of the sample."""

from __future__ import annotations

import csv
import gzip
import io
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import openpyxl
import pytest

from asbuilt_bim.bim.schedule import EVERY_DAY
from asbuilt_bim.ifc.write.copy import write_asbuilt
from asbuilt_bim.progress.completion.forecast import forecast
from asbuilt_bim.progress.completion.moments import late_days
from asbuilt_bim.progress.completion.planned import late_elements
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.outputs import write_outputs
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.report.schedule.lines import schedule_lines
from asbuilt_bim.report.task_rows import late_rows, task_rows

SAMPLE = Path(__file__).parents[2] / "sample_models" / "site" / "design.ifc"
OLD = Path(__file__).parent / "result" / "result-1.3.json.gz"
Days = dict[str, tuple[str, ...]]
"""Task -> days late, days behind, day of the forecast, day seen begun, day seen complete; "" where there is none."""


def sample(tmp_path: Path) -> ProgressReport:
    """The sample's run as it was saved; its result is of version 1.3, before there was a forecast."""
    path = tmp_path / "old.json"
    path.write_bytes(gzip.decompress(OLD.read_bytes()))
    return read_result(path)


def dated(report: ProgressReport) -> ProgressReport:
    """The same with what a run of today stores of its tasks."""
    day = report.visit_date
    tasks = [
        replace(
            task,
            late_days=late_days(task.schedule_finish, task.late, day),
            forecast_finish=forecast(task, day, EVERY_DAY).finish,
            forecast_earliest=forecast(task, day, EVERY_DAY).earliest,
        )
        for task in report.tasks
    ]
    return replace(report, tasks=tuple(tasks))


def day(text: object) -> str:
    return "" if text in (None, "", "unknown") else str(text)[:10]


def number(value: object) -> str:
    return "" if value in (None, "", "unknown") else str(int(float(str(value))))


def of_result(path: Path) -> Days:
    tasks = json.loads(path.read_text(encoding="utf-8"))["tasks"]
    return {
        t["progress"]["name"]: (
            number(t["late_days"]), number(t["behind_days"]), day(t["forecast_finish"]), day(t["actual_start"]),
            day(t["actual_finish"]),
        )
        for t in tasks
    }  # fmt: skip


def of_csv(path: Path) -> Days:
    rows = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8-sig")))
    return {
        r["Name"]: (r["Late_days"], r["Behind_days"], day(r["ForecastFinish"]), r["SeenBegun"], r["SeenComplete"])
        for r in rows
    }


def of_workbook(path: Path) -> Days:
    head, *rows = openpyxl.load_workbook(path)["Tasks"].iter_rows(values_only=True)
    found: list[dict[str, Any]] = [dict(zip(map(str, head), row, strict=True)) for row in rows]
    return {
        str(r["Task"]): (
            number(r["Days late"]), number(r["Days behind schedule"]), day(r["Forecast finish"]), day(r["Seen begun"]),
            day(r["Seen complete"]),
        )
        for r in found
    }  # fmt: skip


def of_ifc(path: Path) -> Days:
    file = ifcopenshell.open(str(path))
    found = {}
    for task in file.by_type("IfcTask"):
        ours = ifcopenshell.util.element.get_psets(task).get("AsBuilt_Progress")
        if ours is not None:
            time = task.TaskTime
            found[task.Name] = (
                number(ours.get("DaysLate")), number(ours.get("DaysBehind")), day(ours.get("ForecastFinish")),
                day(time.ActualStart), day(time.ActualFinish),
            )  # fmt: skip
            assert day(time.StatusTime) in ("2026-03-16", "")
    return found


def of_xml(path: Path, task: str, finish: str, begun: str, complete: str, status: str) -> dict[str, tuple[str, ...]]:
    """Task -> day of the finish as it is now, day begun, day complete."""
    root = ET.parse(path).getroot()
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    assert day(root.findtext(f".//{status}")) == "2026-03-16"
    return {
        one.findtext("Name", ""): (day(one.findtext(finish)), day(one.findtext(begun)), day(one.findtext(complete)))
        for one in root.iter(task)
    }


@pytest.mark.parametrize("stored", [True, False], ids=["of today", "of a result from before there was a forecast"])
def test_late_forecast_and_finish_are_the_same_in_every_file_of_a_run(tmp_path: Path, stored: bool) -> None:
    report = dated(sample(tmp_path)) if stored else sample(tmp_path)
    write_outputs(report, tmp_path, tmp_path)
    write_asbuilt(SAMPLE, report, tmp_path / "copy.ifc")
    write_result(report, tmp_path / "result.json")
    tasks = of_csv(tmp_path / "tasks.csv")
    assert len(tasks) == 8
    assert tasks["Walls ground floor, east"] == ("1", "15", "2026-03-31", "2026-03-02", "")
    assert of_workbook(tmp_path / "quantities.xlsx") == tasks
    assert of_ifc(tmp_path / "copy.ifc") == tasks
    if stored:
        assert of_result(tmp_path / "result.json") == tasks
    dates = {name: row[2:] for name, row in tasks.items()}
    msp = of_xml(tmp_path / "schedule.msp.xml", "Task", "Finish", "ActualStart", "ActualFinish", "StatusDate")
    p6 = of_xml(
        tmp_path / "schedule.p6.xml", "Activity", "FinishDate", "ActualStartDate", "ActualFinishDate", "DataDate"
    )
    assert p6 == dates
    assert {name: row for name, row in msp.items() if name in dates} == dates
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for row in task_rows(report):
        assert row.forecast_finish is not None
        label = "Seen complete" if row.seen_complete else "Forecast finish"
        assert f'data-label="{label}"><span class="date">{row.forecast_finish:%Y-%m-%d}</span>' in page


def test_the_best_case_of_a_forecast_is_the_same_in_every_file_and_never_after_the_forecast(tmp_path: Path) -> None:
    report = dated(sample(tmp_path))
    write_outputs(report, tmp_path, tmp_path)
    known = {row.name: (row.forecast_earliest, row.forecast_finish) for row in task_rows(report)}
    rows = list(csv.DictReader(io.StringIO((tmp_path / "tasks.csv").read_text(encoding="utf-8-sig"))))
    assert {row["Name"]: day(row["ForecastEarliest"]) for row in rows} == {n: day(one) for n, (one, _) in known.items()}
    head, *cells = openpyxl.load_workbook(tmp_path / "quantities.xlsx")["Tasks"].iter_rows(values_only=True)
    column = head.index("Forecast finish, best case")
    assert {row[0]: day(row[column]) for row in cells} == {name: day(one) for name, (one, _) in known.items()}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    apart = [(one, end) for one, end in known.values() if one and end and one.date() != end.date()]
    assert apart and all(one < end and f"best case {one:%Y-%m-%d}" in page for one, end in apart)


def test_an_element_is_as_many_days_late_as_the_last_task_that_makes_it(tmp_path: Path) -> None:
    report = dated(sample(tmp_path))
    late = {task.progress.name: task for task in report.tasks if task.late}
    found = late_elements(report)
    assert found and {one.task for one in found} <= {task.progress.name for task in report.tasks}
    for one in found:
        if one.task in late:
            assert one.late_days == late[one.task].late_days == 1
    assert {row.late_days for row in late_rows(report) if row.task in late} == {1}


def test_no_forecast_lies_before_the_visit_but_of_what_was_seen_complete(tmp_path: Path) -> None:
    report = dated(sample(tmp_path))
    later = replace(report, visit_date=date(2026, 5, 1))  # when every planned finish has passed
    for line in schedule_lines(later):
        if line.task is not None and line.verdict is not None and line.verdict.share is not None:
            ended = line.task.actual_finish is not None
            finish = forecast(line.task, later.visit_date, EVERY_DAY).finish
            assert finish is not None and (ended or finish.date() > later.visit_date)
