"""Every file of a run but its result says one thing of a best estimate, and of what is complete as far as seen."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import ifcopenshell
import ifcopenshell.util.element
import openpyxl
import pytest

from asbuilt_bim.ifc.write.copy import write_asbuilt
from asbuilt_bim.progress.report import Completion, ProgressReport
from asbuilt_bim.report.fill.quantities import OF_COST_LINES, OF_ELEMENTS, OF_GROUPS
from asbuilt_bim.report.flat.exchange import ifccsv_text
from asbuilt_bim.report.flat.write import write_tables
from asbuilt_bim.report.outputs import write_outputs
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.report.wording.completion import count_words
from asbuilt_bim.report.wording.notes import note_words
from tests.report.test_one_meaning import SAMPLE, sample

LITTLE = Completion(best=1.0, lower=0.3, upper=1.0, coverage=0.3)
"""All that was seen of it is built, and that is under a third."""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> ProgressReport:
    """The sample's run, as if each element were complete as far as seen, and a third of everything had been seen."""
    made = sample(tmp_path_factory.mktemp("result"))
    elements = [replace(one, state="complete", as_far_as_seen=True, completion=LITTLE) for one in made.elements]
    count = {"part": 0, "not_started": 0, "unknown": 0, "displaced": 0, "completion": LITTLE}
    storeys = [replace(one, **count, complete=(n := len(one.elements)), as_far_as_seen=n) for one in made.storeys]
    tasks = []
    for task in made.tasks:
        n = len(task.progress.elements)
        progress = replace(task.progress, **count, complete=n, as_far_as_seen=n)
        tasks.append(replace(task, progress=progress, behind_days=1, behind_least_days=0, behind_most_days=9))
    lines = [replace(one, completion=LITTLE, as_built_best=9.0, earned_best=99.0) for one in made.cost_lines]
    return replace(made, elements=tuple(elements), storeys=tuple(storeys), tasks=tuple(tasks), cost_lines=tuple(lines))


@pytest.fixture(scope="module")
def folder(report: ProgressReport, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("out")
    write_outputs(report, made, made)
    write_tables((report,), made / "tables")
    write_asbuilt(SAMPLE, report, made / "copy.ifc", earlier=(report,), words=note_words)
    return made


def table(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8-sig"))))


def psets(path: Path, ifc_class: str) -> list[dict[str, object]]:
    file = ifcopenshell.open(str(path))
    found = (ifcopenshell.util.element.get_psets(one).get("AsBuilt_Progress") for one in file.by_type(ifc_class))
    return [ours for ours in found if ours is not None]


@pytest.mark.parametrize("name", ["quantities.csv", "tasks.csv"])
def test_no_table_beside_the_page_has_a_best_estimate_of_what_was_seen_too_little(folder: Path, name: str) -> None:
    rows = table(folder / name)
    assert rows and {row["CompletionBest"] for row in rows} == {""}
    assert {row["CompletionLower"] for row in rows} == {"0.3000"}


@pytest.mark.parametrize("name", ["elements", "storeys", "tasks", "cost_lines"])
def test_no_flat_table_has_one(folder: Path, name: str) -> None:
    rows = table(folder / "tables" / f"{name}.csv")
    assert rows and {row["completion_best"] for row in rows} == {""}
    for column in ("as_built_best", "earned_best", "behind_days"):
        assert {row[column] for row in rows if column in row} <= {""}


def test_neither_exchange_nor_a_workbook_to_fill_gets_one(report: ProgressReport) -> None:
    assert {row["AsBuilt_Progress.CompletionBest"] for row in csv.DictReader(io.StringIO(ifccsv_text(report)))} == {"-"}
    element, line = report.elements[0], report.cost_lines[0]
    for name in ("completion_best", "built_area_best_m2", "built_volume_best_m3"):
        assert OF_ELEMENTS[name](element) is None
    for name in ("completion_best", "as_built_best", "earned_best"):
        assert OF_COST_LINES[name](line) is None
    assert OF_ELEMENTS["state"](element) == "complete as far as seen"


@pytest.mark.parametrize("ifc_class", ["IfcWall", "IfcColumn", "IfcBuildingStorey", "IfcTask", "IfcCostItem"])
def test_the_ifc_copy_has_none_nor_its_history_nor_its_words(folder: Path, ifc_class: str) -> None:
    found = psets(folder / "copy.ifc", ifc_class)
    assert found
    for ours in found:
        assert "CompletionBest" not in ours and "DaysBehind" not in ours
        assert "best estimate is" not in str(ours.get("Basis", "")) and "; best " not in str(ours.get("Basis", ""))
    file = ifcopenshell.open(str(folder / "copy.ifc"))
    assert "CompletionLower" in (names := {one.Name for one in file.by_type("IfcIrregularTimeSeries")})
    assert "CompletionBest" not in names


@pytest.mark.parametrize("name", ["schedule.msp.xml", "schedule.p6.xml"])
def test_a_schedule_says_that_too_little_was_seen(folder: Path, name: str) -> None:
    words = (folder / name).read_text(encoding="utf-8")
    assert "not enough seen for a best estimate" in words and "best estimate 100" not in words


def test_the_result_keeps_it_for_programs_that_judge_by_themselves(report: ProgressReport, tmp_path: Path) -> None:
    write_result(report, tmp_path / "result.json")
    again = read_result(tmp_path / "result.json")
    assert again.cost_lines[0].as_built_best == 9.0 and again.elements[0].completion.best == 1.0


def test_complete_and_complete_as_far_as_seen_are_counted_apart(folder: Path, report: ProgressReport) -> None:
    storey = report.storeys[0]
    count = len(storey.elements)
    assert count_words(storey).startswith(f"0 complete, {count} complete as far as seen")
    row = next(row for row in table(folder / "tables" / "storeys.csv") if row["storey_id"] == storey.key)
    assert (row["elements_complete"], row["elements_as_far_as_seen"]) == ("0", str(count))
    task = table(folder / "tasks.csv")[0]
    assert (task["Complete"], task["CompleteAsFarAsSeen"]) == ("0", task["Elements"])
    rows = openpyxl.load_workbook(folder / "quantities.xlsx")["Summary"].iter_rows(values_only=True)
    assert next(row for row in rows if row[0] == storey.name)[1:4] == (count, 0, count)
    members = [one for one in report.elements if one.storey == storey.key]
    assert (OF_GROUPS["elements_complete"](members), OF_GROUPS["elements_as_far_as_seen"](members)) == (0, count)
    in_ifc = psets(folder / "copy.ifc", "IfcBuildingStorey")[0]
    assert (in_ifc["ElementsComplete"], in_ifc["ElementsCompleteAsFarAsSeen"]) == (0, count)
