from __future__ import annotations

import pytest

from asbuilt_bim.report.fill.references import MAX_COLUMN, MAX_ROW, Area, area_of, cell_name, cell_of, column_number
from asbuilt_bim.report.fill.stale import reads_of


@pytest.mark.parametrize(
    ("formula", "areas"),
    [
        ("B5*2", [("S", "B5")]),
        ("SUM($F$5:F20)", [("S", "F5:F20")]),
        ("'Cost, 2nd'!A1&\"B7\"", [("Cost, 2nd", "A1")]),
        ("'It''s \"x\"'!A1+F5", [('It\'s "x"', "A1"), ("S", "F5")]),
        ("Bill!F7+Größe!B2", [("Bill", "F7"), ("Größe", "B2")]),
        ("[1]Other!A1+'[1]Other'!A1", None),
        ("'[1]Other'!A1+B1", [("S", "B1")]),
        ("IF(F5>1,TRUE,#N/A)", [("S", "F5")]),
        ("LOG10(A1)*1E+5", [("S", "A1")]),
    ],
)
def test_a_formula_reads_the_cells_that_it_names(formula: str, areas: list[tuple[str, str]] | None) -> None:
    found = reads_of(formula, "S")
    assert found == (None if areas is None else tuple((name, area_of(area)) for name, area in areas))


def test_whole_columns_and_rows_are_areas_too() -> None:
    assert reads_of("SUM(Bill!F:F)", "S") == (("Bill", Area(1, 6, MAX_ROW, 6)),)
    assert reads_of("SUM(5:7)", "S") == (("S", Area(5, 1, 7, MAX_COLUMN)),)


def test_a_shared_formula_moves_what_has_no_dollar() -> None:
    assert reads_of("SUM($F$5:F20)", "S", (2, 1)) == (("S", area_of("F5:G22")),)


@pytest.mark.parametrize(
    "formula",
    [
        *("Rate*F5", "Bill[Value]", 'INDIRECT("F5")', "OFFSET(A1,4,5)", "SUM(Jan:Mar!A1)", "F5:INDEX(A:A,3)"),
        *("Bill!F5:Bill!F20", "SUMIF(A1:A9,1,F1)", "LAMBDA(x,x+1)(F5)", "ZZZZ1+1"),
    ],
)
def test_a_formula_that_may_read_more_than_it_names_counts_as_dependent(formula: str) -> None:
    assert reads_of(formula, "S") is None


@pytest.mark.parametrize(
    ("name", "place"), [("A1", (1, 1)), ("$XFD$1048576", (MAX_ROW, MAX_COLUMN)), ("aa10", (10, 27))]
)
def test_cells_are_called_as_spreadsheets_call_them(name: str, place: tuple[int, int]) -> None:
    assert cell_of(name) == place
    assert cell_name(*place) == name.replace("$", "").upper()


@pytest.mark.parametrize("name", ["A0", "XFE1", "A1048577", "1A", "", "Ä1", "AAAA1"])
def test_what_no_cell_is_called_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="is no c"):
        cell_of(name)


def test_a_column_is_letters_only() -> None:
    with pytest.raises(ValueError, match="is no column"):
        column_number("B7")
