from __future__ import annotations

import builtins
import csv
import io
import json
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from asbuilt_bim.cli import app
from asbuilt_bim.errors import MissingExtraError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.csv import csv_text
from asbuilt_bim.report.flat.columns import KEYS, TABLES, Table
from asbuilt_bim.report.flat.exchange import certain_quantity, csv2ifc_text, ifccsv_text
from asbuilt_bim.report.flat.rows import flat_tables
from asbuilt_bim.report.flat.write import description, write_tables
from asbuilt_bim.report.result.document import write_result
from asbuilt_bim.report.wording.of_workbook.columns import ELEMENTS
from asbuilt_bim.storage.schemas import schema
from tests.report.sample_report import EARLIER, HOSTILE_FORMULA, global_id, sample_report

UNITS = ("_m", "_m2", "_m3", "_px", "_rad", "_days", "_date")


def both() -> tuple[ProgressReport, ProgressReport]:
    """Two visits of the sample."""
    report = sample_report()
    return replace(report, visit_date=EARLIER, earlier_visits=()), report


def read(folder: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((folder / f"{name}.csv").read_text(encoding="utf-8-sig"))))


def test_there_is_one_row_of_each_element_and_visit_and_one_visit_is_the_newest(tmp_path: Path) -> None:
    write_tables(both(), tmp_path)
    rows = read(tmp_path, "elements")
    count = len(sample_report().elements)
    assert len(rows) == 2 * count
    assert {(row["visit_date"], row["newest"]) for row in rows} == {("2026-03-02", "false"), ("2026-03-16", "true")}
    assert sum(row["newest"] == "true" for row in rows) == count


def test_what_is_complete_as_far_as_seen_is_called_so_in_tables_and_exchange(tmp_path: Path) -> None:
    report = sample_report()
    element = replace(report.elements[0], state="complete", as_far_as_seen=True)
    report = replace(report, elements=(element, *report.elements[1:]))
    write_tables((report,), tmp_path)
    row = next(row for row in read(tmp_path, "elements") if row["global_id"] == element.global_id)
    assert row["state"] == "complete as far as seen"
    assert f"{element.global_id},complete as far as seen," in ifccsv_text(report)


def test_an_elements_zones_stand_in_its_row(tmp_path: Path) -> None:
    report = sample_report()
    first = replace(report.elements[0], zones=("Pour 1", "Lot B"))
    write_tables((replace(report, elements=(first, *report.elements[1:])),), tmp_path)
    rows = {row["global_id"]: row["zones"] for row in read(tmp_path, "elements")}
    assert rows[first.global_id] == "Pour 1; Lot B" and rows[report.elements[1].global_id] == ""


def test_a_measured_area_has_the_design_area_of_the_sides_photographed_beside_it(tmp_path: Path) -> None:
    write_tables((sample_report(),), tmp_path)
    for row in read(tmp_path, "elements"):
        assert bool(row["as_built_area_m2"]) == bool(row["photographed_design_area_m2"])
    head, *rows = list(csv.reader(io.StringIO(csv_text(sample_report()))))
    at = head.index("AsBuiltArea_m2")
    assert head[at - 1] == "PhotographedDesignArea_m2"
    assert all(bool(row[at]) == bool(row[at - 1]) for row in rows)
    assert any(column.heading.endswith("of the sides photographed") for column in ELEMENTS)


@pytest.mark.parametrize("name", TABLES)
def test_no_two_rows_have_the_same_key_and_what_is_always_there_is(name: Table) -> None:
    columns = TABLES[name]
    rows = flat_tables(both())[name]
    assert rows
    places = [[one.name for one in columns].index(key) for key in KEYS[name]]
    keys = [tuple(row[place] for place in places) for row in rows]
    assert len(set(keys)) == len(keys)
    for number, column in enumerate(columns):
        assert not column.always or all(row[number] is not None for row in rows), column.name


def test_every_column_of_a_length_an_area_or_an_angle_names_its_unit() -> None:
    for columns in TABLES.values():
        for column in columns:
            measures = ("area", "sigma", "offset", "tilt", "width", "height", "volume", "range", "depth", "residual")
            if column.kind == "number" and any(word in column.name for word in measures):
                assert column.name.endswith(UNITS), column.name
            if column.kind == "date":
                assert column.name.endswith("_date")


def test_unknown_is_an_empty_cell_and_never_0(tmp_path: Path) -> None:
    write_tables([sample_report()], tmp_path)
    rows = {row["global_id"]: row for row in read(tmp_path, "elements")}
    unseen = next(one for one in sample_report().elements if one.completion.best is None)
    row = rows[unseen.global_id]
    assert (row["completion_best"], row["as_built_area_m2"], row["completion_lower"]) == ("", "", "0.0")


def test_names_that_a_spreadsheet_would_run_are_text(tmp_path: Path) -> None:
    write_tables([sample_report()], tmp_path)
    names = {row["global_id"]: row["name"] for row in read(tmp_path, "elements")}
    assert names[global_id(2)] == f"'{HOSTILE_FORMULA}"


def test_the_schema_is_what_is_written_beside_the_tables(tmp_path: Path) -> None:
    write_tables([sample_report()], tmp_path)
    assert schema("tables-1") == description() == json.loads((tmp_path / "datapackage.json").read_text("utf-8"))
    for resource in description()["resources"]:
        head = (tmp_path / resource["path"]).read_text(encoding="utf-8-sig").splitlines()[0]
        assert head.split(",") == [field["name"] for field in resource["schema"]["fields"]]
        assert all(field["description"] for field in resource["schema"]["fields"])


def test_without_pyarrow_parquet_names_the_pip_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *words: Any, **more: Any) -> Any:
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return real(name, *words, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"pip install pyarrow"):
        write_tables([sample_report()], tmp_path / "out", "parquet")
    assert not (tmp_path / "out").exists()


def test_parquet_holds_every_cell_of_the_tables(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    write_tables(both(), tmp_path, "parquet")
    for name, rows in flat_tables(both()).items():
        table = parquet.read_table(tmp_path / f"{name}.parquet")
        assert table.column_names == [column.name for column in TABLES[name]]
        assert [tuple(row.values()) for row in table.to_pylist()] == rows


def test_ifccsv_gets_properties_by_globalid_and_a_dash_for_unknown() -> None:
    report = sample_report()
    rows = list(csv.DictReader(io.StringIO(ifccsv_text(report))))
    assert [row["GlobalId"] for row in rows] == [one.global_id for one in report.elements]
    for row, one in zip(rows, report.elements, strict=True):
        wanted = "-" if one.completion.best_shown is None else str(one.completion.best_shown)
        assert row["AsBuilt_Progress.CompletionBest"] == wanted


def test_csv2ifc_gets_certain_quantities_and_whole_pieces() -> None:
    report = sample_report()
    counted = replace(report.cost_lines[0], measure="count", as_built_lower=6.62, planned_quantity=8.0, rate=5.0)
    assert certain_quantity(counted) == 6.0
    assert certain_quantity(replace(counted, rate=-5.0)) == 7.0
    assert certain_quantity(replace(counted, as_built_lower=7.0 - 1e-12)) == 7.0
    rows = list(csv.DictReader(io.StringIO(csv2ifc_text(report))))
    assert [float(row["Quantity"]) for row in rows] == [certain_quantity(line) for line in report.cost_lines]
    assert {row["Index"] for row in rows} == {"1"}


def test_what_is_certified_stands_with_the_newest_visit_alone(tmp_path: Path) -> None:
    write_tables(both(), tmp_path)
    rows = read(tmp_path, "cost_lines")
    certified = {line.line.global_id: line for bill in bills(sample_report()) for line in bill.lines}
    assert rows
    for row in rows:
        wanted = str(certified[row["line_id"]].amount) if row["newest"] == "true" else ""
        assert row["certified_amount"] == wanted


def test_the_command_writes_tables_once_and_again_only_where_told(tmp_path: Path) -> None:
    write_result(sample_report(), tmp_path / "result.json")
    words = ["tables", str(tmp_path / "result.json"), "--out", str(tmp_path / "out")]
    first = CliRunner().invoke(app, words)
    assert first.exit_code == 0, first.output
    again = CliRunner().invoke(app, words)
    assert (again.exit_code, "--replace" in again.output) == (1, True)
    assert CliRunner().invoke(app, [*words, "--replace"]).exit_code == 0
    days = {row["visit_date"] for row in read(tmp_path / "out", "tasks")}
    assert days == {date(2026, 3, 16).isoformat()}


def test_somebody_else_s_table_of_a_name_of_ours_is_not_written_over(tmp_path: Path) -> None:
    write_result(sample_report(), tmp_path / "result.json")
    (tmp_path / "tasks.csv").write_text("the planner's own", encoding="utf-8")
    found = CliRunner().invoke(app, ["tables", str(tmp_path / "result.json"), "--out", str(tmp_path)])
    assert found.exit_code == 1 and "holds tasks.csv already" in " ".join(found.output.split())
    assert (tmp_path / "tasks.csv").read_text(encoding="utf-8") == "the planner's own"
    assert not (tmp_path / "elements.csv").exists()


def test_a_folder_that_is_not_there_is_said_to_be_none(tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["tables", str(tmp_path / "nowhere"), "--out", str(tmp_path / "out")])
    assert found.exit_code == 1
    assert "no such folder; name the --out folder of a run" in " ".join(found.output.split())
