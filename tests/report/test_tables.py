import csv
import io
from dataclasses import replace

import openpyxl
import pytest
from rich.table import Table

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import Completion
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report import tables
from asbuilt_bim.report.cost_rows import cost_groups
from asbuilt_bim.report.csv import csv_text, safe_cell, write_csv
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.tables import (
    element_rows,
    lost_stations,
    photographed_of,
    program_words,
    station_doubts,
    station_rows,
)
from asbuilt_bim.report.task_rows import task_rows
from asbuilt_bim.report.wording.of_workbook.valuation_columns import COST_PARTS
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.unstated import unstated_rejection
from asbuilt_bim.report.wording.values import area_of, cut_down, cut_up, rate, share_bounds
from asbuilt_bim.report.workbook.layout import HEAD
from asbuilt_bim.report.workbook.write import workbook_bytes, write_workbook
from asbuilt_bim.terminal.summary_table import summary
from tests.report.sample_report import HOSTILE_FORMULA, UMLAUTS, renamed, sample_report


def rows() -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(csv_text(sample_report()))))


def book(report=None, *, values: bool = False):
    return openpyxl.load_workbook(io.BytesIO(workbook_bytes(report or sample_report())), data_only=values)


def test_elements_stand_by_storey_from_below():
    assert [row["Storey"] for row in rows()] == ["Ground floor"] * 5 + ["First floor"] * 3


def test_an_element_never_seen_has_empty_cells_and_no_zero():
    row = next(row for row in rows() if row["Name"] == "C-11")
    assert (row["State"], row["AsBuiltArea_m2"], row["Sigma_m2"], row["CompletionBest"]) == ("unknown", "", "", "")
    assert (row["CompletionLower"], row["CompletionUpper"], row["LastSeen"]) == ("0.0000", "1.0000", "")


def test_the_csv_begins_with_the_mark_for_utf8(tmp_path):
    write_csv(sample_report(), tmp_path / "q.csv")
    data = (tmp_path / "q.csv").read_bytes()
    assert data.startswith(b"\xef\xbb\xbf")
    assert UMLAUTS in data.decode("utf-8-sig")


@pytest.mark.parametrize(
    "text",
    ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", " =1", "\x00=1", "\u00a0=1", "＝1", "＋1", "－1", "＠SUM"],
)
def test_text_that_a_spreadsheet_would_run_gets_an_apostrophe(text):
    assert safe_cell(text).lstrip(" \u00a0").startswith("'")


@pytest.mark.parametrize("between", [",", ";", "\t", "\n", "\r\n"])
def test_a_spreadsheet_set_to_another_separator_finds_no_formula_within_a_name(between):
    for sign in "=+-@＝":
        for name in (f"W{between}{sign}1+1{between}", f"{between}{sign}1", f"W{between}{between}{sign}1"):
            parts = safe_cell(name).split(between)
            assert not [part for part in parts if part.startswith(sign)] and safe_cell(name).replace("'", "") == name
    assert safe_cell("moved by 2, -3 cm") == "moved by 2, -3 cm"


def test_a_csv_for_decimal_commas_holds_the_same_with_semicolons_and_leaves_texts_their_points():
    report = replace(renamed(sample_report(), 0, name="Wall 1.5; =1+1"), csv="semicolon")
    told = list(csv.DictReader(io.StringIO(csv_text(report)), delimiter=";"))
    plain = list(csv.DictReader(io.StringIO(csv_text(replace(report, csv="comma")))))
    texts = {"Storey", "GlobalId", "Class", "Name", "State", "Visit", "LastSeen", "Stations", "Notes"}
    for row, was in zip(told, plain, strict=True):
        assert row == {key: cell if key in texts else cell.replace(".", ",") for key, cell in was.items()}
    assert "Wall 1.5; =1+1" in {row["Name"] for row in told} and told[0]["DesignArea_m2"].count(",") == 1


def test_no_text_cell_of_the_csv_runs():
    numbers = {"Offset_mm", "OffsetSigma_mm"}
    for row in rows():
        assert all(
            not value.startswith(("=", "+", "-", "@", "\t", "\r")) for k, value in row.items() if k not in numbers
        )


def test_no_name_becomes_a_formula_in_the_workbook():
    sheet = book()["Elements"]
    cell = next(c for row in sheet.iter_rows() for c in row if c.value == HOSTILE_FORMULA)
    assert cell.data_type == "s"


def test_the_money_of_the_lines_adds_up_to_the_total_to_the_cent_on_the_page():
    report = sample_report()
    thirds = [replace(line, planned_quantity=1.0, rate=0.335, earned_best=0.34, earned_lower=0.34, currency="EUR")
              for line in report.cost_lines]  # fmt: skip
    thirds = [replace(line, completion=replace(line.completion, best=0.5, coverage=0.8)) for line in thirds]
    (group,) = cost_groups(replace(report, cost_lines=tuple(thirds)))
    assert (group.planned, group.earned_best, group.earned_lower) == (1.36, 1.36, 1.36)


def test_the_workbook_has_the_design_area_of_the_photographed_sides_and_the_pages_words():
    report = sample_report()
    book = openpyxl.load_workbook(io.BytesIO(workbook_bytes(report)))
    heads = {name: [cell.value for cell in row] for name, row in (("Elements", book["Elements"][1]),)}
    lines = list(book["Summary"].iter_rows(values_only=True))
    at = next(index for index, row in enumerate(lines) if row[0] == "Storey")
    heads["Summary"] = list(lines[at])
    for found in heads.values():
        assert {"At least", "Possibly", "Best estimate", "Seen"} <= set(found)
        area = found.index("As-built area [m²], of the sides photographed")
        assert found[area - 1] == "Design area [m²], of the sides photographed"
    group = report.storeys[0]
    row = dict(zip(heads["Summary"], lines[at + 1], strict=True))
    assert row["Design area [m²], of the sides photographed"] == pytest.approx(photographed_of(group, report))
    assert area_of(group.as_built_area_m2, group.as_built_sigma_m2, photographed_of(group, report)) in page_html(
        report, {}
    ).replace("&nbsp;", " ")
    bounds = cut_down(group.completion.lower), cut_up(group.completion.upper)
    assert (row["At least"], row["Possibly"]) == pytest.approx(bounds)


@pytest.mark.parametrize(
    ("value", "text"), [(4.785, "4.79"), (2.755, "2.76"), (2.465, "2.47"), (0.725 * 3.4, "2.47"), (-0.001, "0.00")]
)
def test_halves_of_areas_read_as_the_workbooks_number_format_shows_them(value: float, text: str) -> None:
    assert area_of(value, None, value) == f"{text} of {text} m²"


def test_each_sheet_shows_bounds_as_the_notes_of_schedules_do_and_money_counts_with_the_exact_ones() -> None:
    bounds = Completion(best=0.7, lower=0.682758621, upper=0.705445, coverage=0.499961)
    report = sample_report()
    elements = tuple(replace(e, state="part", completion=bounds) for e in report.elements)
    storeys = tuple(replace(one, completion=bounds) for one in report.storeys)
    tasks = tuple(replace(one, progress=replace(one.progress, completion=bounds)) for one in report.tasks)
    report = replace(report, elements=elements, storeys=storeys, tasks=tasks)
    assert "at least 68.2 % (lower bound), possibly 70.6 %" in task_rows(report)[0].note
    made = book(report)
    wanted = {"At least": "68.2", "Possibly": "70.6", "Seen": "49.9"}
    for name, above in (("Summary", "Storey"), ("Elements", "Storey"), ("Tasks", "Task"), ("Late", "Storey")):
        lines = list(made[name].iter_rows(values_only=True))
        at = next(index for index, row in enumerate(lines) if row[0] == above)
        row = dict(zip(lines[at], lines[at + 1], strict=True))
        shown = {heading: f"{row[heading] * 100.0:.1f}" for heading in wanted if heading in row}
        assert shown and shown.items() <= wanted.items(), name
    exact = {row.measured for bill in bills(report) for line in bill.lines for row in line.rows if row.element}
    column = next(index for index, one in enumerate(COST_PARTS) if one.heading == "Certain")
    assert bounds.lower in exact
    assert {row[column] for row in made["Cost by element"].iter_rows(min_row=HEAD + 2, values_only=True)} >= exact


def test_a_sigma_in_the_workbook_has_no_sign_and_its_offset_has_one() -> None:
    sheet = book()["Elements"]
    heads = [cell.value for cell in sheet[1]]
    offset = heads.index("Offset [mm]")
    row = next(row for row in sheet.iter_rows(min_row=2) if row[offset].data_type == "n")
    assert row[offset].number_format.startswith("+")
    assert row[heads.index("Offset sigma [mm]")].number_format == "0.0"


def test_the_page_says_beside_the_formula_that_pieces_count_whole() -> None:
    page = page_html(sample_report(), {})
    cost = page[page.index('id="cost"') :]
    assert "completion × planned quantity" in cost and "whole pieces only" in cost


def test_unknown_is_a_word_in_the_workbook_never_zero():
    sheet = book()["Elements"]
    row = next(r for r in sheet.iter_rows(min_row=2) if r[1].value == "C-11")
    assert [c.value for c in row[4:7]] == ["unknown"] * 3


def test_rejected_stations_stand_on_the_summary_with_value_limit_and_remedy():
    text = "\n".join(str(c.value) for row in book()["Summary"].iter_rows() for c in row if c.value)
    assert "B2: rejected" in text
    assert "0 markers" in text and "limit 2 markers" in text and "place the red target" in text


def test_control_characters_do_not_break_the_workbook():
    sheet = book(renamed(sample_report(), 0, name="A\x01B\x0bC\ud800"))["Elements"]
    assert any(c.value == "ABC" for row in sheet.iter_rows() for c in row)


def test_a_very_long_name_does_not_break_the_workbook():
    assert book(renamed(sample_report(), 0, name="x" * 50_000))["Elements"].max_row == 9


def test_stations_that_only_stand_in_rejections_are_listed():
    found = {row.name: row.status for row in station_rows(sample_report())}
    assert found == {"A1": "placed", "A2": "placed", "Süd 3": "not placed", "B2": "rejected"}


def test_a_marker_left_out_does_not_lose_its_station():
    assert {row.name for row in lost_stations(sample_report())} == {"Süd 3", "B2"}


def test_two_storeys_of_one_name_can_be_told_apart():
    report = sample_report()
    report = replace(report, storeys=tuple(replace(s, name="Level") for s in report.storeys))
    assert {row.storey for row in element_rows(report)} == {"Level", "Level (2)"}
    assert "Level (2): " in summary(report, 80)
    wide = summary(report, 200)
    assert isinstance(wide, Table) and [str(cell) for cell in wide.columns[0].cells] == ["Level", "Level (2)", "whole"]


def test_a_report_without_cost_lines_tasks_and_stations_makes_a_workbook(tmp_path):
    report = replace(sample_report(), cost_lines=(), tasks=(), stations=(), rejections=(), provenance=None)
    write_workbook(report, tmp_path / "q.xlsx")
    assert openpyxl.load_workbook(tmp_path / "q.xlsx").sheetnames == [
        "Summary",
        "Valuation",
        "Bill",
        "Cost by element",
        "Variations",
        "Certificates",
        "Observations",
        "Elements",
        "Tasks",
        "Late",
        "Stations",
        "Notes",
    ]


def test_every_column_is_explained_on_the_notes_sheet():
    workbook = book()
    explained = {(r[0].value, r[1].value) for r in workbook["Notes"].iter_rows(min_row=2) if r[2].value}
    for name in ("Elements", "Tasks", "Stations"):
        assert {(name, cell.value) for cell in workbook[name][1]} <= explained
    for name in ("Bill", "Cost by element", "Variations", "Certificates", "Observations"):
        assert {(name, cell.value) for cell in workbook[name][4]} <= explained


@pytest.mark.parametrize(
    ("what", "subject"),
    [
        ("station A1", (SubjectKind.STATION, "A1", "A1")),
        ("station A1, marker 17", (SubjectKind.MARKER, "17", "A1")),
        ("station Haus 3, Nord, target", (SubjectKind.TARGET, "", "Haus 3, Nord")),
        ("station A1, red disc at x 3, y 4 px", (SubjectKind.DISC, "x 3, y 4 px", "A1")),
        ("station A1, wall at 300, 200 px", (SubjectKind.INSTANCE, "at 300, 200 px", "A1")),
        ("face A/1/3 (wall, 2.10 m2 at 5.0 m)", (SubjectKind.FACE, "A/1/3", "A/1")),
        ("survey", (SubjectKind.SURVEY, "", "")),
        ("board pair 03", (SubjectKind.UNSTATED, "board pair 03", "")),
        ("marker 7", (SubjectKind.UNSTATED, "marker 7", "")),
    ],
)
def test_what_a_rejection_without_a_code_is_about_and_it_reads_as_it_was_written(what, subject):
    rejection = unstated_rejection({"what": what, "reason": "r"})
    assert (rejection.subject.kind, rejection.subject.name, rejection.subject.at_station) == subject
    assert str(words_of(rejection)) == f"{what}: r"


def test_a_face_left_out_does_not_make_its_station_look_rejected():
    report = sample_report()
    left_out = Rejection(
        code=Reason.FACE_NARROW,
        subject=Subject(kind=SubjectKind.FACE, name="A1/9", station="A1"),
        values={"label": "wall", "area_m2": 0.4, "distance_m": 9.0, "width_px": 20.0, "limit_px": 40.0},
    )
    rows = station_rows(replace(report, rejections=(*report.rejections, left_out)))
    row = next(row for row in rows if row.name == "A1")
    assert (row.status, row.left_out) == ("placed", (words_of(left_out),))


def test_faces_that_could_not_be_measured_are_told_together_the_nearest_by_name():
    def uncertain(name: str, distance_m: float, share: float) -> Rejection:
        values = {"label": "wall", "area_m2": 0.4, "distance_m": distance_m, "sigma_share": share, "limit_share": 0.2}
        subject = Subject(kind=SubjectKind.FACE, name=f"A1/{name}", station="A1")
        return Rejection(code=Reason.FACE_UNCERTAIN, subject=subject, values=values)

    report = sample_report()
    lost = [
        uncertain("x1", 69.0, 26356470.46),
        uncertain("x2", 4.5, 0.21),
        *(uncertain("x3", 30.0 + i, 0.5) for i in (0, 1)),
    ]
    rows = station_rows(replace(report, rejections=(*report.rejections, *lost)))
    row = next(row for row in rows if row.name == "A1")
    assert row.faces_left_out == 4
    assert [words.at_station for words in row.left_out] == [
        "4 faces, the nearest x2 (wall at 4.5 m), x3 (wall at 30.0 m), x3 (wall at 31.0 m): seen, not measurable: too "
        "uncertain (sigma 21 % of the area or more, limit 20 %); photograph it from nearer, or more from the front"
    ]
    assert "sigma over 100 % of its area" in str(words_of(lost[0]))


def test_lines_of_two_cost_schedules_are_never_added_up() -> None:
    report = sample_report()
    twice = [replace(line, schedule=name) for name in ("budget", "tender") for line in report.cost_lines]
    alone = cost_groups(report)
    groups = cost_groups(replace(report, cost_lines=tuple(twice)))
    assert [group.name for group in groups] == [f"{one.name}, {name}" for name in ("budget", "tender") for one in alone]
    assert [group.earned_lower for group in groups] == [one.earned_lower for one in alone] * 2


@pytest.mark.parametrize(
    ("value", "text"), [(250.0, "250.00"), (6.9376, "6.9376"), (6.25e-5, "0.0000625"), (0.0, "0.00")]
)
def test_the_price_of_a_small_unit_keeps_its_digits(value: float, text: str) -> None:
    assert rate(value) == text


def test_bounds_in_tables_are_rounded_outwards() -> None:
    assert share_bounds(0.862069, 0.862031) == ("0.8620", "0.8621")
    assert share_bounds(0.3, 1.0) == ("0.3000", "1.0000")


def test_an_elements_lower_bound_is_rounded_down_in_the_csv() -> None:
    report = sample_report()
    first = report.elements[0]
    sure = replace(first, completion=replace(first.completion, lower=0.862069, upper=0.862031))
    table = csv_text(replace(report, elements=(sure, *report.elements[1:])))
    (row,) = [row for row in csv.DictReader(io.StringIO(table)) if row["GlobalId"] == first.global_id]
    assert (row["CompletionLower"], row["CompletionUpper"]) == ("0.8620", "0.8621")


def test_a_survey_in_doubt_stands_on_the_workbooks_first_sheet_before_the_storeys():
    doubt = Rejection(
        code=Reason.SURVEY_SHIFTED_IN_HEIGHT,
        subject=Subject(kind=SubjectKind.SURVEY),
        values={"turn_rad": 0.0, "move_x_m": 0.0, "move_y_m": 0.0, "move_z_m": 3.1, "more": 24},
    )
    sheet = book(replace(sample_report(), rejections=(doubt,)))["Summary"]
    cells = [str(row[0]) for row in sheet.iter_rows(values_only=True)]
    told = next(n for n, cell in enumerate(cells) if "+3.10 m in z" in cell)
    assert "Nobody should be paid" in cells[told - 1] and told < cells.index("Storey")


def test_what_was_given_for_a_stations_place_and_left_out_is_told_where_the_station_counts() -> None:
    """Two bad clicks, or a pose 2 m off, stood on the page alone."""
    report = sample_report()
    counts = report.placed[0] if isinstance(report.placed, tuple) else sorted(report.placed)[0]

    def against(station: str) -> Rejection:
        subject = Subject(kind=SubjectKind.CONTROL_POINT, name="P4", station=station)
        return Rejection(
            code=Reason.CONTROL_POINT_CONTRADICTS, subject=subject, values={"off_sigmas": 15.0, "limit_sigmas": 3.0}
        )

    said = replace(report, rejections=(against(counts), against("nowhere")))
    assert station_doubts(said) == (against(counts),)


def test_a_station_without_colour_that_counts_is_told_since_formwork_then_counts_as_built():
    report = sample_report()
    grey = Rejection(
        code=Reason.PHOTOS_GREY, subject=Subject(kind=SubjectKind.STATION, name=sorted(report.placed)[0]), values={}
    )
    assert station_doubts(replace(report, rejections=(grey,))) == (grey,)
    assert "Formwork at its place counts as built" in words_of(grey).remedy


def test_a_report_written_again_by_another_version_names_both_and_its_own_names_one(monkeypatch):
    assert program_words(sample_report().provenance) == "asbuilt_bim 0.1.0, 2026-03-17T08:30:00+00:00"
    monkeypatch.setattr(tables, "__version__", "0.2.0")
    words = "asbuilt_bim 0.1.0, 2026-03-17T08:30:00+00:00; written again by 0.2.0"
    assert words in page_html(sample_report(), {})
    assert words in [row[2] for row in book()["Notes"].iter_rows(values_only=True)]
