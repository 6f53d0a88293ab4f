"""Tables that somebody typed: read the same as CSV and as .xlsx, doubtful numbers refused, hostile files bounded."""

from __future__ import annotations

import io
import zipfile
from datetime import date
from pathlib import Path

import openpyxl
import pytest

from asbuilt_bim.errors import CostError
from asbuilt_bim.storage import xlsx_file
from asbuilt_bim.storage.table_file import TableFile, day_in, number_in, read_table, share_in
from asbuilt_bim.storage.xlsx_file import read_xlsx

COLUMNS = {"item": ("pos",), "quantity": ("qty",), "day": ()}


def table(path: Path, text: str | bytes) -> TableFile:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, COLUMNS, ("item",), CostError)


def book(path: Path, *rows: list[object]) -> Path:
    made = openpyxl.Workbook()
    for row in rows:
        made.active.append(row)  # type: ignore[union-attr]
    made.save(path)
    return path


def test_the_same_table_reads_the_same_as_csv_and_as_xlsx(tmp_path: Path) -> None:
    as_csv = table(tmp_path / "a.csv", "\ufeffPos.,Qty [m3],Day\n1.1,12.5,2026-03-02\n,,\n2,0.1,\n")
    path = book(tmp_path / "a.xlsx", ["Pos.", "Qty [m3]", "Day"], ["1.1", 12.5, date(2026, 3, 2)], [], [2, 0.1])
    as_xlsx = read_table(path, COLUMNS, ("item",), CostError)
    for found in (as_csv, as_xlsx):
        first, second = found.rows
        assert (first.text("item"), number_in(first, "quantity", found), day_in(first, "day")) == (
            "1.1", 12.5, date(2026, 3, 2),
        )  # fmt: skip
        assert (second.text("item"), number_in(second, "quantity", found), day_in(second, "day")) == ("2", 0.1, None)
        assert second.number == 4


@pytest.mark.parametrize(
    ("text", "value"),
    [("1234.5", 1234.5), ("1,234.50", 1234.5), ("-3", -3.0), ("1e3", 1000.0), ("0.500", 0.5), ("", None)],
)
def test_numbers_with_a_decimal_point(tmp_path: Path, text: str, value: float | None) -> None:
    found = table(tmp_path / "a.csv", f'item,qty\n1,"{text}"\n')
    assert number_in(found.rows[0], "quantity", found) == value


@pytest.mark.parametrize(("text", "value"), [("12,5", 12.5), ("1.234,50", 1234.5), ("7", 7.0)])
def test_numbers_with_a_decimal_comma(tmp_path: Path, text: str, value: float) -> None:
    found = table(tmp_path / "a.csv", f"item;qty\n1;{text}\n2;0,25\n")
    assert number_in(found.rows[0], "quantity", found) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.234,500", 1234.5), ("1,234.500", 1234.5), ("1.234.567", 1234567.0), ("-1,234,567", -1234567.0),
     ("0,500", 0.5), ("1.234.567,125", 1234567.125)],
)  # fmt: skip
@pytest.mark.parametrize("sign", [";", "\t"])
def test_two_signs_within_a_number_say_which_of_them_is_the_decimal_one(
    tmp_path: Path, text: str, value: float, sign: str
) -> None:
    found = table(tmp_path / "a.csv", f"item{sign}qty\n1{sign}{text}\n")
    assert number_in(found.rows[0], "quantity", found) == value


@pytest.mark.parametrize("text", ["1\u00a0234,50", "1\u202f234,50", "1'234,50", "1\u2019234,50", "1 234,50"])
def test_what_parts_thousands_in_any_country_is_read(tmp_path: Path, text: str) -> None:
    found = table(tmp_path / "a.csv", f"item;qty\n1;{text}\n")
    assert number_in(found.rows[0], "quantity", found) == 1234.5


@pytest.mark.parametrize("text", ["1.234", "12.500", "-310.125"])
def test_thousands_of_a_german_spreadsheet_are_no_decimals_between_tabs_nor_as_text_in_a_workbook(
    tmp_path: Path, text: str
) -> None:
    sheet = read_table(book(tmp_path / "a.xlsx", ["item", "qty"], ["1", text]), COLUMNS, ("item",), CostError)
    tabs = table(tmp_path / "a.csv", f"item\tqty\n1\t{text}\n".encode("utf-16"))
    for found in (sheet, tabs):
        with pytest.raises(ValueError, match=f"two ways; write {text.replace('.', '')}, or {text}0$"):
            number_in(found.rows[0], "quantity", found)


@pytest.mark.parametrize("other", ["12.5", "0.278", "1234.567", "1,234.50"])
def test_a_point_is_decimal_where_another_number_of_its_column_says_so(tmp_path: Path, other: str) -> None:
    sheet = read_table(
        book(tmp_path / "a.xlsx", ["item", "qty"], ["1", "1.234"], ["2", other]), COLUMNS, ("item",), CostError
    )
    for found in (sheet, table(tmp_path / "a.csv", f"item\tqty\n1\t1.234\n2\t{other}\n")):
        assert number_in(found.rows[0], "quantity", found) == 1.234


def test_items_with_points_say_nothing_of_quantities_nor_points_beside_decimal_commas(tmp_path: Path) -> None:
    for text in ("item;qty\n1.1;1.234\n", "item;qty\n1;1.234\n2;12.5\n3;12,5\n"):
        found = table(tmp_path / "a.csv", text)
        with pytest.raises(ValueError, match="two ways"):
            number_in(found.rows[0], "quantity", found)


def test_percentages_alone_show_a_decimal_comma(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "item;qty\n1;12,5 %\n2;50%\n")
    assert [share_in(row, "quantity", found) for row in found.rows] == [0.125, 0.5]


@pytest.mark.parametrize("text", ["item;qty\n1;0.278\n", "item;qty\n1;0.2780\n", "item,qty\n1,0.278\n"])
def test_a_zero_before_the_point_parts_no_thousands(tmp_path: Path, text: str) -> None:
    found = table(tmp_path / "a.csv", text)
    assert number_in(found.rows[0], "quantity", found) == 0.278


@pytest.mark.parametrize(
    ("text", "advice"),
    [("310.00", "write 310,00$"), ("1,310.50", "write 1310,50$"), ("1.310,50 €", "no number; write 1234,5, without")],
)
def test_what_is_advised_for_a_number_is_read_in_the_same_table(tmp_path: Path, text: str, advice: str) -> None:
    found = table(tmp_path / "a.csv", f"item;qty\n1;{text}\n2;0,25\n3;1234,5\n4;1310,50\n")
    with pytest.raises(ValueError, match=advice):
        number_in(found.rows[0], "quantity", found)
    assert [number_in(row, "quantity", found) for row in found.rows[1:]] == [0.25, 1234.5, 1310.5]


@pytest.mark.parametrize(
    "text", ["item;qty\n1;1.234\n", 'item,qty\n1,"1,234"\n', "item;qty\n1;1.234\n2;0,5\n", "item,qty\n1,inf\n",
             "item,qty\n1,twelve\n", "item,qty\n1,1 2 3\n", "item,qty\n1,1e999\n"]
)  # fmt: skip
def test_a_number_that_could_be_meant_two_ways_or_is_none_is_refused(tmp_path: Path, text: str) -> None:
    found = table(tmp_path / "a.csv", text)
    with pytest.raises(ValueError, match=r"two ways|no number"):
        number_in(found.rows[0], "quantity", found)


def test_a_percentage_is_one_from_0_to_100_and_half_a_percent_of_a_spreadsheet_is_refused(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "item,qty\n1,50\n2,50 %\n3,101\n4,-1\n")
    assert [share_in(row, "quantity", found) for row in found.rows[:2]] == [0.5, 0.5]
    for row in found.rows[2:]:
        with pytest.raises(ValueError, match="0 to 100"):
            share_in(row, "quantity", found)
    sheet = read_table(book(tmp_path / "a.xlsx", ["item", "qty"], [1, 0.5]), COLUMNS, ("item",), CostError)
    with pytest.raises(ValueError, match="a share or a percentage; write it as text, such as 50 %"):
        share_in(sheet.rows[0], "quantity", sheet)


@pytest.mark.parametrize(("text", "says"), [("0.5", "50 % or 0.5 %"), ("0,5", "50 % or 0.5 %"), ("1", "100 % or 1 %")])
def test_a_share_in_a_csv_table_is_refused_without_its_sign_and_read_with_it(
    tmp_path: Path, text: str, says: str
) -> None:
    found = table(tmp_path / "a.csv", f"item;qty\n1;{text}\n2;{text} %\n3;0\n4;1.5\n")
    with pytest.raises(ValueError, match=f"^'{text}' may be a share or a percentage; write {says}$"):
        share_in(found.rows[0], "quantity", found)
    wanted = float(text.replace(",", ".")) / 100.0
    assert [share_in(row, "quantity", found) for row in found.rows[1:3]] == [wanted, 0.0]


@pytest.mark.parametrize("text", ["03/02/2026", "2026-02-30", "yesterday", "1.2.26"])
def test_a_day_that_could_be_another_or_is_none_is_refused(tmp_path: Path, text: str) -> None:
    found = table(tmp_path / "a.csv", f"item,day\n1,{text}\n")
    with pytest.raises(ValueError, match="no day"):
        day_in(found.rows[0], "day")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "empty"),
        (
            b"a,b\n1,2\n",
            "no column item, but a, b; known are item, quantity, day. Nothing may stand above the headings",
        ),
        (b"item,pos\n1,2\n", "more than one column for item"),
        (b'item,qty\n"1,2\n', "isn't closed"),
        (b"\xff\xfa\x00", "UTF-8"),
        (b"PK\x03\x04", "archive"),
    ],
)
def test_what_is_no_table_is_refused_in_words(tmp_path: Path, data: bytes, reason: str) -> None:
    with pytest.raises(CostError, match=reason):
        table(tmp_path / "a.csv", data)


def test_what_our_own_tables_guard_with_an_apostrophe_reads_as_it_was(tmp_path: Path) -> None:
    assert table(tmp_path / "a.csv", "item,qty\n'=A1,2\n").rows[0].text("item") == "=A1"


def zipped(path: Path, **parts: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in parts.items():
            archive.writestr(name.replace("__", "/").replace("_xml", ".xml"), data)
    return path


def changed(path: Path, part: str, old: bytes, new: bytes) -> Path:
    """Change one part of a workbook."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    assert old in parts[part]
    parts[part] = parts[part].replace(old, new)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    return path


def refusal(path: Path) -> str:
    with pytest.raises(CostError) as caught:
        read_xlsx(path, CostError)
    return str(caught.value)


def test_a_workbook_that_unpacks_to_much_more_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xlsx_file, "MAX_UNPACKED", 1_000_000)
    assert "unpacks to" in refusal(zipped(tmp_path / "bomb.xlsx", xl__a_xml=b" " * 2_000_000))


def test_document_types_and_other_encodings_of_xml_are_refused(tmp_path: Path) -> None:
    grown = b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'
    assert "document type" in refusal(zipped(tmp_path / "a.xlsx", xl__workbook_xml=grown))
    wide = "<!DOCTYPE a><a/>".encode("utf-16")
    assert "document type" in refusal(zipped(tmp_path / "b.xlsx", xl__workbook_xml=wide))


@pytest.mark.parametrize(
    ("data", "reason"),
    [(b"\xd0\xcf\x11\xe0old", "old .xls"), (b"item,qty\n", "no .xlsx"), (b"PK\x03\x04broken", "damaged")],
)
def test_what_is_no_workbook_is_refused_in_words(tmp_path: Path, data: bytes, reason: str) -> None:
    (tmp_path / "a.xlsx").write_bytes(data)
    assert reason in refusal(tmp_path / "a.xlsx")


def test_a_workbook_cut_anywhere_is_refused_in_words(tmp_path: Path) -> None:
    data = book(tmp_path / "a.xlsx", ["item", "qty"], [1, 2]).read_bytes()
    for cut in range(4, len(data) - 1, 97):
        (tmp_path / "cut.xlsx").write_bytes(data[:cut])
        assert "damaged" in refusal(tmp_path / "cut.xlsx")


def test_a_cell_far_out_makes_no_sheet_of_that_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xlsx_file, "MAX_ROWS", 1000)
    made = openpyxl.Workbook()
    made.active["XFD1048576"] = 1  # type: ignore[index]
    made.save(tmp_path / "a.xlsx")
    assert "more than 1,000 rows" in refusal(tmp_path / "a.xlsx")


def test_a_formula_gives_what_it_gave_when_it_was_saved_and_is_never_run(tmp_path: Path) -> None:
    path = book(tmp_path / "a.xlsx", ["item", "qty"], [1, "=WEBSERVICE(A1)"], [2, "=1+1"])
    changed(path, "xl/worksheets/sheet1.xml", b"<f>1+1</f><v />", b"<f>1+1</f><v>7</v>")
    found = read_table(path, COLUMNS, ("item",), CostError)
    assert found.formulas
    assert [number_in(row, "quantity", found) for row in found.rows] == [None, 7.0]


def test_an_error_in_a_cell_is_no_text(tmp_path: Path) -> None:
    path = book(tmp_path / "a.xlsx", ["item", "qty"], [1, "#REF!"], [2, "#1 wall"])
    sheet = next(iter(read_xlsx(path, CostError).sheets.values()))
    assert sheet.rows[1] == (1,) and sheet.rows[2][1] == "#1 wall"


def test_links_to_other_workbooks_are_not_followed(tmp_path: Path) -> None:
    path = book(tmp_path / "a.xlsx", ["item", "qty"], [1, 2])
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("xl/externalLinks/externalLink1.xml", b"<externalLink/>")
    assert next(iter(read_xlsx(path, CostError).sheets.values())).rows[1] == (1, 2)


def test_named_cells_are_found_and_others_are_none(tmp_path: Path) -> None:
    made = openpyxl.Workbook()
    made.active.title = "One two"  # type: ignore[union-attr]
    made.active["C5"] = 3.5  # type: ignore[index]
    made.defined_names["here"] = openpyxl.workbook.defined_name.DefinedName("here", attr_text="'One two'!$C$5")
    made.defined_names["range"] = openpyxl.workbook.defined_name.DefinedName("range", attr_text="'One two'!$A$1:$B$2")
    data = io.BytesIO()
    made.save(data)
    (tmp_path / "a.xlsx").write_bytes(data.getvalue())
    found = read_xlsx(tmp_path / "a.xlsx", CostError)
    assert (found.at("here"), found.at("range"), found.at("nowhere")) == (3.5, None, None)
