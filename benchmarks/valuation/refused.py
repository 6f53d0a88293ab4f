"""Workbooks and maps that must be refused by name; and one with many rows."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import openpyxl
import xlsxwriter
from openpyxl.styles import Protection
from openpyxl.worksheet.formula import ArrayFormula

from asbuilt_bim.progress.report import ProgressReport
from benchmarks.valuation.books import write_map


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """A workbook that can't be filled, and a word that the message must have."""

    name: str
    path: Path
    map: Path
    report: ProgressReport
    says: str


def plain(path: Path, result: ProgressReport) -> Any:
    """Return a workbook of ten rows by GlobalId that can be filled, with its sheet."""
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.append(["GlobalId", "Built", "Note"])
    for element in result.elements[:9]:
        sheet.append([element.global_id, 0.0, "x"])
    return book, sheet


def refused_books(folder: Path, result: ProgressReport) -> Iterator[Refused]:
    """Yield them all."""
    folder.mkdir(parents=True)
    mapping = write_map(folder / "map.yaml", "Sheet", "{global_id: A}", "{B: built_area_lower_m2}")
    good = folder / "good.xlsx"
    plain(good, result)[0].save(good)
    data = good.read_bytes()
    yield from _sorts(folder, result, mapping, data)
    yield from _cells(folder, result, mapping)
    yield from _keys(folder, result, mapping)
    yield from _parts(folder, result, mapping, good)


def _sorts(folder: Path, result: ProgressReport, mapping: Path, data: bytes) -> Iterator[Refused]:
    ole = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600)
    for name, content, says in (
        ("old.xls", ole, "old .xls"),
        ("encrypted.xlsx", ole + "EncryptedPackage".encode("utf-16-le"), "encrypted"),
        ("text.xlsx", b"a,b\r\n1,2\r\n", "no .xlsx"),
        ("cut.xlsx", data[: len(data) // 2], "damaged"),
        ("empty.xlsx", b"", "no .xlsx"),
    ):
        path = folder / name
        path.write_bytes(content)
        yield Refused(name=name, path=path, map=mapping, report=result, says=says)


def _cells(folder: Path, result: ProgressReport, mapping: Path) -> Iterator[Refused]:
    def made(name: str, says: str, book: Any) -> Refused:
        path = folder / f"{name}.xlsx"
        book.save(path)
        return Refused(name=name, path=path, map=mapping, report=result, says=says)

    book, sheet = plain(folder, result)
    sheet["B4"] = "=1+1"
    yield made("formula", "B4 holds a formula (=1+1)", book)
    book, sheet = plain(folder, result)
    sheet["B4"] = ArrayFormula("B4:B6", "=C4:C6*2")
    yield made("array", "B5 belongs to an array formula", book)
    book, sheet = plain(folder, result)
    sheet.merge_cells("B4:B5")
    yield made("merged", "B5 is merged", book)
    book, sheet = plain(folder, result)
    sheet.protection.sheet = True
    sheet["B3"].protection = Protection(locked=False)
    yield made("locked", "B4 is locked", book)
    book, sheet = plain(folder, result)
    sheet.title = "Other"
    yield made("no such sheet", "there is no sheet 'Sheet'", book)
    book, _ = plain(folder, result)
    book.create_chartsheet("Chart")
    chart = write_map(folder / "chart.yaml", "Chart", "{global_id: A}", "{B: built_area_lower_m2}")
    yield replace(made("chart sheet", "without cells", book), map=chart)


def _keys(folder: Path, result: ProgressReport, mapping: Path) -> Iterator[Refused]:
    def made(name: str, says: str, book: Any, more: Path = mapping, of: ProgressReport = result) -> Refused:
        path = folder / f"{name}.xlsx"
        book.save(path)
        return Refused(name=name, path=path, map=more, report=of, says=says)

    book, sheet = plain(folder, result)
    sheet["A5"] = sheet["A2"].value
    yield made("key twice", "row 5: has the key of row 2 again", book)
    book, sheet = plain(folder, result)
    sheet["A5"] = "=A2"
    yield made("key is a formula without a value", "a formula without a value", book)
    codes = write_map(folder / "codes.yaml", "Sheet", "{cost_code: A}", "{B: as_built_lower}", "    unit: C\n")
    twice = replace(result, cost_lines=(*result.cost_lines, replace(result.cost_lines[0], schedule="Tender")))
    book, sheet = plain(folder, result)
    sheet["A2"], sheet["C2"] = result.cost_lines[0].identification, result.cost_lines[0].unit
    yield made("two lines of one code", "2 cost lines have the code", book, codes, twice)
    sheet["A2"] = 1.1
    yield made("a number for a code", "holds the number 1.1", book, codes)
    sheet["A2"], sheet["C2"] = result.cost_lines[0].identification, "hours"
    yield made("another unit", "has the unit 'hours'", book, codes)
    groups = write_map(folder / "groups.yaml", "Sheet", "{ifc_class: A, storey: B, type_name: C}", "{D: elements}")
    book, sheet = plain(folder, result)
    storeys = tuple(replace(storey, name="Same") for storey in result.storeys)
    kind = result.elements[0]
    sheet["A2"], sheet["B2"], sheet["C2"] = kind.ifc_class, "Same", kind.type_name
    yield made("storeys of one name", "storeys are called 'Same'", book, groups, replace(result, storeys=storeys))
    old = replace(result, elements=tuple(replace(one, type_name="") for one in result.elements))
    yield made("a result without types", "no types of elements", book, groups, old)
    for name, text, says in (
        ("unknown quantity", "{B: built_volume}", "known here"),
        ("no column", "{B7: state}", "is no column"),
        ("fills its key", "{A: state}", "can't be a key"),
    ):
        bad = write_map(folder / f"{name}.yaml", "Sheet", "{global_id: A}", text)
        yield made(name, says, plain(folder, result)[0], bad)


def _parts(folder: Path, result: ProgressReport, mapping: Path, good: Path) -> Iterator[Refused]:
    def made(name: str, says: str, **changed: bytes) -> Refused:
        path = folder / f"{name}.xlsx"
        new = {key.replace("__", "/").replace("_dot_", "."): value for key, value in changed.items()}
        with zipfile.ZipFile(good) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for part in old.namelist():
                archive.writestr(part, new.pop(part, old.read(part)))
            for part, content in new.items():
                archive.writestr(part, content)
        return Refused(name=name, path=path, map=mapping, report=result, says=says)

    with zipfile.ZipFile(good) as archive:
        sheet = archive.read("xl/worksheets/sheet1.xml")
    bomb = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>' + sheet
    yield made("entities", "document type", xl__worksheets__sheet1_dot_xml=bomb)
    yield made("another encoding", "isn't UTF-8", xl__worksheets__sheet1_dot_xml=sheet.decode().encode("utf-16"))
    yield made("half a sheet", "damaged XML", xl__worksheets__sheet1_dot_xml=sheet[:-40])
    yield made("deep", "nested deeper", xl__worksheets__sheet1_dot_xml=b"<a>" * 500 + b"</a>" * 500)
    yield made("signed", "is signed", _xmlsignatures__sig1_dot_xml=b"<Signature/>")
    yield made("opendocument", "OpenDocument", mimetype=b"application/vnd.oasis.opendocument.spreadsheet")
    yield made("binary", "binary workbook", xl__workbook_dot_bin=b"\0")
    yield made("no workbook", "no workbook", _rels___dot_rels=b"<Relationships/>")


def many(folder: Path, result: ProgressReport, count: int) -> tuple[Path, Path, ProgressReport]:
    """Write a bill of many rows, each with two formulas, and return it with its map and a result."""
    folder.mkdir(parents=True)
    base = result.elements[0]
    elements = tuple(replace(base, global_id=f"{number:022d}") for number in range(count))
    path = folder / "many.xlsx"
    book = xlsxwriter.Workbook(str(path), {"constant_memory": False})
    sheet = book.add_worksheet("Bill")
    for row, element in enumerate(elements, 1):
        sheet.write_row(row, 0, (element.global_id, f"Element {row}", 200.0, 0.0))
        sheet.write_formula(row, 4, f"=ROUND(C{row + 1}*D{row + 1},2)", None, 1.0)
        sheet.write_formula(row, 5, f"=F{row}+E{row + 1}" if row > 1 else "=E2", None, 1.0)
    book.close()
    mapping = write_map(folder / "many.yaml", "Bill", "{global_id: A}", "{D: built_area_lower_m2}")
    return path, mapping, replace(result, elements=elements)
