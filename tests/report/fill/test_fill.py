"""Workbooks of others, filled: the four of the benchmark that need no LibreOffice, and what must be refused."""

from __future__ import annotations

import csv
import io
import os
import stat
import zipfile
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import openpyxl
import pytest
import xlsxwriter
from click.testing import CliRunner, Result

from asbuilt_bim.cli import app
from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import FillError, Rejection
from asbuilt_bim.progress.report import NOTHING_SEEN, Completion, ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import RateChange, ValuationInputs
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.report.fill.quantities import OF_GROUPS
from asbuilt_bim.report.fill.write import LEFT_S, Filled, fill_workbook, read_map, save_filled
from asbuilt_bim.report.result.document import write_result
from asbuilt_bim.report.workbook.write import write_workbook
from benchmarks.valuation.books import MACRO, Book, by_hand, by_openpyxl, by_xlsxwriter, saved_report, write_map
from benchmarks.valuation.fill import differences
from benchmarks.valuation.refused import Refused, plain, refused_books
from tests.report.workbook.saved import at, run_folder, typed

NOT_READ = pytest.mark.filterwarnings("ignore:.*extension is not supported")
"""What openpyxl says of a workbook that it can't keep whole."""
WHEN = datetime(2026, 3, 17, 8, 30, tzinfo=UTC)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> ProgressReport:
    return saved_report(tmp_path_factory.mktemp("saved"))


def filled(book: Book, result: ProgressReport) -> Filled:
    return fill_workbook(book.path, read_map(book.map), result)


def small(tmp_path: Path, result: ProgressReport) -> tuple[Path, Path]:
    """A workbook of nine rows by GlobalId, with its map."""
    path = tmp_path / "small.xlsx"
    plain(path, result)[0].save(path)
    return path, write_map(tmp_path / "map.yaml", "Sheet", "{global_id: A}", "{B: built_area_lower_m2, D: state}")


@pytest.mark.parametrize("make", [by_xlsxwriter, by_openpyxl, by_hand])
def test_only_mapped_cells_differ_in_any_workbook(make: Any, tmp_path: Path, result: ProgressReport) -> None:
    book = make(tmp_path, result)
    found = filled(book, result)
    assert found.data is not None
    assert found.plan.changes
    faults, compared = differences(book.path.read_bytes(), found.data, found)
    assert faults == []
    assert compared > 25


def test_the_comparison_finds_a_cell_a_style_and_a_part_that_changed(tmp_path: Path, result: ProgressReport) -> None:
    book = by_openpyxl(tmp_path, result)
    found = filled(book, result)
    assert found.data is not None
    before = book.path.read_bytes()
    spoiled = openpyxl.load_workbook(io.BytesIO(found.data))
    spoiled["LV"]["B3"] = "other"
    spoiled.save(tmp_path / "spoiled.xlsx")
    assert differences(before, (tmp_path / "spoiled.xlsx").read_bytes(), found)[0]


@NOT_READ
def test_values_are_those_of_the_result_and_macros_stay(tmp_path: Path, result: ProgressReport) -> None:
    book = by_xlsxwriter(tmp_path, result)
    save_filled(filled(book, result), WHEN)
    with zipfile.ZipFile(book.path) as archive:
        assert archive.read("xl/vbaProject.bin") == MACRO
        assert b'fullCalcOnLoad="1"' in archive.read("xl/workbook.xml")
    sheet = openpyxl.load_workbook(book.path, keep_vba=True)[book.sheet]
    for number, element in enumerate(result.elements):
        assert sheet[f"A{5 + number}"].value == element.global_id
        wanted = element.completion.lower * element.design_volume_m3
        assert sheet[f"F{5 + number}"].value == pytest.approx(wanted, abs=1e-12)
        assert sheet[f"F{5 + number}"].number_format in ("#,##0.00", "General")


@NOT_READ
def test_values_that_follow_from_filled_cells_are_taken_away_and_others_stay(
    tmp_path: Path, result: ProgressReport
) -> None:
    book = by_xlsxwriter(tmp_path, result)
    save_filled(filled(book, result), WHEN)
    summary = openpyxl.load_workbook(book.path, data_only=True)["Summary"]
    assert [summary[cell].value for cell in ("A1", "A2", "A3", "A4")] == [None, None, None, 42]


def test_where_no_formula_depends_on_it_the_workbook_part_stays(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    found = fill_workbook(path, read_map(mapping), result)
    assert found.data is not None and found.stale == 0
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(io.BytesIO(found.data)) as new:
        assert old.read("xl/workbook.xml") == new.read("xl/workbook.xml")


def test_filling_twice_changes_nothing_the_second_time(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    save_filled(fill_workbook(path, read_map(mapping), result), WHEN)
    again = fill_workbook(path, read_map(mapping), result)
    assert again.data is None
    assert again.plan.same == 18


def test_the_workbook_as_it_was_is_kept_and_never_written_over(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    before = path.read_bytes()
    path.chmod(0o640)
    (tmp_path / "small.before-20260317T083000Z.xlsx").write_bytes(b"mine")
    backup = save_filled(fill_workbook(path, read_map(mapping), result), WHEN)
    assert backup.name == "small.before-20260317T083000Z-2.xlsx"
    assert backup.read_bytes() == before
    assert (tmp_path / "small.before-20260317T083000Z.xlsx").read_bytes() == b"mine"
    if os.name != "nt":
        assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_what_a_killed_process_left_is_taken_away_and_what_is_being_written_is_not(
    tmp_path: Path, result: ProgressReport
) -> None:
    path, mapping = small(tmp_path, result)
    for name, age_s in ((".asbuilt-old.part", 2 * LEFT_S), (".asbuilt-new.part", 1.0)):
        (tmp_path / name).write_bytes(b"half")
        os.utime(tmp_path / name, (WHEN.timestamp() - age_s,) * 2)
    save_filled(fill_workbook(path, read_map(mapping), result), WHEN)
    assert [one.name for one in tmp_path.glob(".asbuilt-*")] == [".asbuilt-new.part"]


@pytest.mark.parametrize("lock", ["~$small.xlsx", ".~lock.small.xlsx#"])
def test_a_workbook_that_is_open_elsewhere_is_left_alone(tmp_path: Path, result: ProgressReport, lock: str) -> None:
    path, mapping = small(tmp_path, result)
    before = path.read_bytes()
    found = fill_workbook(path, read_map(mapping), result)
    (tmp_path / lock).touch()
    with pytest.raises(FillError, match="open in another program"):
        save_filled(found, WHEN)
    assert path.read_bytes() == before


def test_a_workbook_that_was_changed_meanwhile_is_left_alone(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    found = fill_workbook(path, read_map(mapping), result)
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(FillError, match="changed while"):
        save_filled(found, WHEN)
    assert not list(tmp_path.glob("*.before-*"))


def test_unknown_is_an_empty_cell_or_a_word_and_never_0(tmp_path: Path, result: ProgressReport) -> None:
    first = result.elements[0]
    blind = replace(result, elements=(replace(first, as_built_area_m2=None), *result.elements[1:]))
    path, _ = small(tmp_path, result)
    for more, shown in (("", None), ("unknown: word\n", "unknown")):
        mapping = write_map(tmp_path / "area.yaml", "Sheet", "{global_id: A}", "{B: as_built_area_m2}", more)
        found = fill_workbook(path, read_map(mapping), blind)
        assert found.data is not None
        assert openpyxl.load_workbook(io.BytesIO(found.data))["Sheet"]["B2"].value == shown
        assert [text for text in found.plan.unknown if text.startswith("Sheet!B2")]


def test_a_row_that_the_result_does_not_know_stays_and_is_named(tmp_path: Path, result: ProgressReport) -> None:
    path = tmp_path / "strange.xlsx"
    book, sheet = plain(path, result)
    sheet["A4"], sheet["B4"] = "2Nobody", 77.0
    book.save(path)
    mapping = write_map(tmp_path / "map.yaml", "Sheet", "{global_id: A}", "{B: built_area_lower_m2}")
    found = fill_workbook(path, read_map(mapping), result)
    assert found.plan.strangers == ["Sheet, row 4: 2Nobody"]
    assert found.data is not None
    assert openpyxl.load_workbook(io.BytesIO(found.data))["Sheet"]["B4"].value == 77.0
    assert len(found.plan.missing) == len(result.elements) - 8


def test_a_row_with_the_globalid_of_an_earlier_export_gets_what_its_element_has_now(
    tmp_path: Path, result: ProgressReport
) -> None:
    path, mapping = small(tmp_path, result)
    element, *others = result.elements
    moved = replace(result, elements=(replace(element, global_id="new", former_ids=(element.global_id,)), *others))
    plan = fill_workbook(path, read_map(mapping), moved).plan
    assert not plan.strangers and not any(name.startswith(element.name) for name in plan.missing)
    with xlsxwriter.Workbook(str(tmp_path / "both.xlsx")) as book:
        sheet = book.add_worksheet("Sheet")
        sheet.write("A2", element.global_id)
        sheet.write("A3", "new")
    with pytest.raises(FillError, match=r"row 3: has the key of row 2 again \(new\)"):
        fill_workbook(tmp_path / "both.xlsx", read_map(mapping), moved)


def test_groups_add_up_over_class_storey_and_type(tmp_path: Path, result: ProgressReport) -> None:
    path = tmp_path / "groups.xlsx"
    book = openpyxl.Workbook()
    sheet: Any = book.active
    storey, kind = result.storeys[0], "Concrete wall C30/37"
    sheet.append(["x"])
    sheet.append(["wall", f"  {storey.name} ", kind])
    book.save(path)
    columns = "{D: elements, E: built_area_lower_m2, F: elements_complete}"
    mapping = write_map(tmp_path / "map.yaml", "Sheet", "{ifc_class: A, storey: B, type_name: C}", columns)
    found = fill_workbook(path, read_map(mapping), result)
    assert found.data is not None
    row = openpyxl.load_workbook(io.BytesIO(found.data))["Sheet"][2]
    walls = [one for one in result.elements if one.storey == storey.key and one.kind == "wall"]
    assert walls
    wanted = sum(one.completion.lower * one.design_area_m2 for one in walls)
    assert [cell.value for cell in row[3:]] == [
        len(walls),
        pytest.approx(wanted),
        sum(one.state == "complete" for one in walls),
    ]


def test_a_group_has_a_best_estimate_where_half_of_it_was_seen_whatever_was_seen_of_one_of_them(
    result: ProgressReport,
) -> None:
    seen, unseen = result.elements[:2]
    seen = replace(seen, completion=Completion(best=0.8, lower=0.7, upper=0.9, coverage=1.0))
    unseen = replace(unseen, completion=NOTHING_SEEN, best_when_seen=None)
    for amount, name in (("design_area_m2", "built_area_best_m2"), ("design_volume_m3", "built_volume_best_m3")):
        two = [replace(seen, **{amount: 6.0}), replace(unseen, **{amount: 4.0})]
        assert OF_GROUPS[name](two) == pytest.approx(0.8 * 10.0), "as the completion of a storey is: 60 % were seen"
        two[1] = replace(two[1], **{amount: 8.0})
        assert OF_GROUPS[name](two) is None, "6 of 14 were seen"


def bill_book(tmp_path: Path, result: ProgressReport) -> tuple[Path, Path]:
    """A workbook with the first cost line's code, with its map."""
    path = tmp_path / "bill.xlsx"
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.append(["Code"])
    sheet.append([result.cost_lines[0].identification])
    book.save(path)
    columns = "{B: certified_quantity, C: certified_amount, D: previous_amount, E: period_amount}"
    return path, write_map(tmp_path / "map.yaml", "Sheet", "{cost_code: A}", columns)


def test_a_cost_code_gets_what_the_valuation_certifies_with_a_changed_rate(
    tmp_path: Path, result: ProgressReport
) -> None:
    first = result.cost_lines[0]
    path, mapping = bill_book(tmp_path, result)
    change = RateChange(line=first.global_id, rate=1000.0, why="agreed")
    changed = replace(result, valuation=ValuationInputs(rates=(change,)))
    (line,) = [one for bill in bills(changed) for one in bill.lines if one.line is first]
    found = fill_workbook(path, read_map(mapping), changed)
    assert [one.new for one in found.plan.changes] == [line.quantity, line.amount, 0.0, line.amount]
    assert line.amount == pytest.approx(1000.0 * line.quantity, abs=0.006)


def changed_by_a_person(folder: Path, report: ProgressReport) -> ProgressReport:
    """Sign the workbook of a run's folder, once a rate was changed in it; return what it says."""
    copy = run_folder(folder, report)
    change = RateChange(line=report.cost_lines[0].global_id, rate=1000.0, why="agreed")
    says = with_valuation(report, replace(report.valuation or ValuationInputs(), rates=(change,)))
    write_workbook(says, copy)
    typed(copy, {("", "signed_by"): "Ann", ("", "signed_on"): date(2026, 3, 20)})
    return says


def test_fill_and_tables_take_the_amounts_of_the_signed_workbook_that_lies_in_the_folder(
    tmp_path: Path, result: ProgressReport
) -> None:
    said = changed_by_a_person(tmp_path / "out", result)
    lines = {one.line.global_id: one for bill in bills(said) for one in bill.lines}
    line = lines[result.cost_lines[0].global_id]
    path, mapping = bill_book(tmp_path, result)
    done = run(path, "--map", mapping, "--result", tmp_path / "out")
    assert done.exit_code == 0 and "was changed since the run; its amounts count" in " ".join(done.output.split())
    row = [cell.value for cell in openpyxl.load_workbook(path).worksheets[0][2]]
    assert row[1:] == [line.quantity, line.amount, 0.0, line.amount] and line.amount != 0.0
    assert line.amount != next(one for bill in bills(result) for one in bill.lines).amount
    words = ["tables", str(tmp_path / "out"), "--out", str(tmp_path / "tables")]
    assert CliRunner().invoke(app, words).exit_code == 0
    with (tmp_path / "tables" / "cost_lines.csv").open(encoding="utf-8-sig") as file:
        assert {one["line_id"]: float(one["certified_amount"]) for one in csv.DictReader(file)} == {
            key: one.amount for key, one in lines.items()
        }


def test_a_workbook_in_the_folder_that_was_not_calculated_fills_nothing_and_says_what_to_do(
    tmp_path: Path, result: ProgressReport
) -> None:
    copy = run_folder(tmp_path / "out", result)
    typed(copy, {at(copy, "Bill", "Rate", 0): 1000.0})
    path, mapping = bill_book(tmp_path, result)
    before = path.read_bytes()
    for words in (["fill", path, "--map", mapping, "--result", tmp_path / "out"],
                  ["tables", tmp_path / "out", "--out", tmp_path / "tables"]):  # fmt: skip
        refused = CliRunner().invoke(app, [*map(str, words)])
        said = " ".join(refused.output.split())
        assert refused.exit_code == 1 and "is certified, and this run's result with what you wrote comes to" in said
        assert "Ctrl+Shift+F9" in said
    assert path.read_bytes() == before and not (tmp_path / "tables").exists()


def test_text_goes_in_as_text_and_runs_nowhere(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    hostile: Any = '=HYPERLINK("http://x","<&>\x00")'
    bad = replace(result, elements=(replace(result.elements[0], state=hostile), *result.elements[1:]))
    found = fill_workbook(path, read_map(mapping), bad)
    assert found.data is not None
    cell = openpyxl.load_workbook(io.BytesIO(found.data))["Sheet"]["D2"]
    assert (cell.value, cell.data_type) == (hostile.replace("\x00", "\ufffd"), "s")


def test_an_unlocked_cell_of_a_protected_sheet_is_filled(tmp_path: Path, result: ProgressReport) -> None:
    path = tmp_path / "protected.xlsx"
    with xlsxwriter.Workbook(str(path)) as book:
        sheet = book.add_worksheet("Sheet")
        sheet.protect()
        sheet.write("A2", result.elements[0].global_id)
        sheet.write_blank("B2", None, book.add_format({"locked": False}))
    mapping = write_map(tmp_path / "map.yaml", "Sheet", "{global_id: A}", "{B: built_area_lower_m2}")
    assert len(fill_workbook(path, read_map(mapping), result).plan.changes) == 1


def cases(tmp_path: Path, result: ProgressReport) -> dict[str, Refused]:
    return {case.name: case for case in refused_books(tmp_path / "refused", result)}


def test_what_cannot_be_filled_is_refused_by_name_and_left_alone(tmp_path: Path, result: ProgressReport) -> None:
    found = cases(tmp_path, result)
    assert len(found) >= 28
    for case in found.values():
        before = case.path.read_bytes()
        with pytest.raises(FillError) as refusal:
            fill_workbook(case.path, read_map(case.map), case.report)
        assert case.says in str(refusal.value), case.name
        assert case.path.read_bytes() == before


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["fill", *map(str, words)])


def test_the_command_lists_without_writing_and_then_writes_and_names_the_backup(
    tmp_path: Path, result: ProgressReport
) -> None:
    path, mapping = small(tmp_path, result)
    write_result(result, tmp_path / "result.json")
    before = path.read_bytes()
    words = (path, "--map", mapping, "--result", tmp_path / "result.json")
    listed = run(*words, "--dry-run")
    assert listed.exit_code == 0
    changes = fill_workbook(path, read_map(mapping), result).plan.changes
    assert len(changes) > 15
    for change in changes:
        assert f"{change.cell}: " in listed.output
    assert f"{len(changes)} cells would change" in listed.output
    assert path.read_bytes() == before and not list(tmp_path.glob("*.before-*"))
    done = run(*words)
    assert done.exit_code == 0
    (backup,) = tmp_path.glob("*.before-*")
    assert backup.read_bytes() == before
    assert backup.name in done.output
    assert "nothing to change" in run(*words).output


def test_a_result_that_is_in_doubt_fills_nothing(tmp_path: Path, result: ProgressReport) -> None:
    path, mapping = small(tmp_path, result)
    values = {"seen": 4, "agree_mirrored": 4, "agree": 0}
    fault = Rejection(code=Reason.SURVEY_MIRRORED, subject=Subject(kind=SubjectKind.SURVEY), values=values)
    write_result(replace(result, rejections=(fault,)), tmp_path / "result.json")
    before = path.read_bytes()
    done = run(path, "--map", mapping, "--result", tmp_path / "result.json")
    assert (done.exit_code, path.read_bytes()) == (1, before)
    assert "nobody should be paid" in done.output


def test_a_map_says_all_that_is_wrong_with_it_with_its_lines(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(
        "format: asbuilt-bim/map\nversion: 1\ntables:\n  - sheet: A\n    key: {global_id: A, storey: B}\n"
        "    columns: {C: state}\n  - sheet: B\n    key: {cost_code: A}\n    columns: {C: nonsense}\n    first_row: 9\n"
        "    last_row: 3\n"
    )
    with pytest.raises(FillError) as refusal:
        read_map(path)
    text = str(refusal.value)
    assert "line 5, tables[0].key" in text
    assert "'nonsense' is none" in text
    assert "rows 9 to 3" in text


def test_without_a_run_in_out_fill_says_which_option_names_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = CliRunner().invoke(app, ["fill", "COST.xlsx", "--map", "map.yaml"])
    assert asked.exit_code == 1 and "--result FOLDER" in asked.output
