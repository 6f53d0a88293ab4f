"""Four workbooks as people have them, made by four hands: each with its map, and what it should come to when filled."""

from __future__ import annotations

import gzip
import io
import subprocess
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import openpyxl
import xlsxwriter
from openpyxl.chart import BarChart, Reference
from openpyxl.formatting.rule import ColorScaleRule, FormulaRule
from openpyxl.styles import Font, PatternFill
from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.result.document import read_result
from benchmarks.sites import ROOT

SAVED = ROOT / "tests" / "report" / "result" / "result-1.3.json.gz"
MACRO = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(range(256)) * 40
"""Stands for a vbaProject.bin: kept or not is all that is asked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Book:
    """A workbook and its map; `total` is the cell of a formula that adds up what is filled into `column`."""

    name: str
    path: Path
    map: Path
    sheet: str
    column: str
    total: tuple[str, str]  # sheet, cell
    factor: float = 1.0  # what the total multiplies each cell with


def saved_report(folder: Path) -> ProgressReport:
    """Return the sample's run as the tests keep it, with types for its elements."""
    path = folder / "saved.json"
    path.write_bytes(gzip.decompress(SAVED.read_bytes()))
    report = read_result(path)
    return replace(report, elements=tuple(replace(e, type_name=f"Concrete {e.kind} C30/37") for e in report.elements))


def four_books(folder: Path, report: ProgressReport, *, office: bool) -> tuple[Book, ...]:
    """Write the four workbooks and their maps into a folder; without LibreOffice there are three."""
    books = [by_xlsxwriter(folder, report), by_openpyxl(folder, report), by_hand(folder, report)]
    return (*books, by_libreoffice(folder, report)) if office else tuple(books)


def write_map(path: Path, sheet: str, key: str, columns: str, more: str = "") -> Path:
    """Write a map of one table."""
    head = "format: asbuilt-bim/map\nversion: 1\ntables:\n"
    path.write_text(f"{head}  - sheet: {sheet}\n    key: {key}\n    columns: {columns}\n{more}", encoding="utf-8")
    return path


def by_xlsxwriter(folder: Path, report: ProgressReport) -> Book:
    """Write a workbook with macros, by GlobalId: a table, charts, sparklines, validations, hidden columns and more."""
    path = folder / "xlsxwriter.xlsm"
    book = xlsxwriter.Workbook(str(path))
    book.add_vba_project(io.BytesIO(MACRO), is_stream=True)
    sheet, summary = book.add_worksheet("Bill of quantities"), book.add_worksheet("Summary")
    money, title = book.add_format({"num_format": "#,##0.00", "bg_color": "#fff2cc"}), book.add_format({"bold": True})
    sheet.merge_range("A1:H2", "Cost control, Gewerk 13 – Beton", title)
    heads = ("GlobalId", "Element", "Storey", "Rate", "Planned m³", "Built m³", "Value", "Rest")
    last = 4 + len(report.elements)
    for number, element in enumerate(report.elements):
        row = 4 + number
        sheet.write_row(row, 0, (element.global_id, element.name, element.storey, 240.5))
        sheet.write_number(row, 4, element.design_volume_m3, money)
        if number % 3:  # every third cell isn't there yet
            sheet.write(row, 5, "tbd" if number % 2 else 1.5, money)
        sheet.write_formula(row, 6, f"=ROUND(D{row + 1}*F{row + 1},2)", money, 99.0)
        sheet.write_formula(row, 7, f"=E{row + 1}-F{row + 1}", money, 99.0)
    columns = [{"header": head} for head in heads]
    sheet.add_table(3, 0, last - 1, 7, {"columns": columns, "name": "Bill", "style": "Table Style Light 9"})
    _dressing(sheet, last)
    chart = book.add_chart({"type": "column"})
    chart.add_series({"values": f"='Bill of quantities'!$F$5:$F${last}"})
    summary.insert_chart("D2", chart)
    summary.write_formula("A1", f"=SUM('Bill of quantities'!F5:F{last})", None, 12345.0)
    summary.write_formula("A2", "=SUM(Bill[Value])", None, 12345.0)
    summary.write_formula("A3", '="as of "&TEXT(A1,"0.00")', None, "old")
    summary.write_formula("A4", "=6*7", None, 42)
    book.define_name("BuiltVolume", "=Summary!$A$1")
    summary.hide_gridlines(2)
    book.close()
    mapped = write_map(
        folder / "xlsxwriter.yaml", "Bill of quantities", "{global_id: A}", "{F: built_volume_lower_m3}",
        "    first_row: 5\n",
    )  # fmt: skip
    return Book(name="xlsxwriter, .xlsm", path=path, map=mapped, sheet="Bill of quantities", column="F",
                total=("Summary", "A1"))  # fmt: skip


def _dressing(sheet: Worksheet, last: int) -> None:
    """Give a sheet what other programs lose when they write a workbook again."""
    area = f"F5:F{last}"
    for rule in (
        {"type": "data_bar"},
        {"type": "3_color_scale"},
        {"type": "icon_set", "icon_style": "3_traffic_lights"},
    ):
        sheet.conditional_format(area, rule)
    sheet.conditional_format(area, {"type": "formula", "criteria": "=$F5>$E5"})
    sheet.set_column("C:C", None, None, {"hidden": True})
    sheet.set_row(5, None, None, {"hidden": True})
    sheet.set_row(7, 30, None, {"level": 1})
    sheet.data_validation(area, {"validate": "decimal", "criteria": ">=", "value": 0, "ignore_blank": True})
    sheet.add_sparkline("J5", {"range": f"'Bill of quantities'!{area}"})
    sheet.write_comment("F6", "measured by asbuilt-bim")
    sheet.freeze_panes(4, 2)
    sheet.set_landscape()
    sheet.repeat_rows(3)


def by_openpyxl(folder: Path, report: ProgressReport) -> Book:
    """Write a workbook by cost code, with units, rules, a chart and merged cells; it holds no value of any formula."""
    path = folder / "openpyxl.xlsx"
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.title = "LV"
    sheet.append(["Pos", "Text", "Einheit", "EP", "Menge", "Betrag", "%"])
    for number, line in enumerate(report.cost_lines):
        row = 2 + number
        sheet.append([line.identification, line.name, line.unit, line.rate, 0, f"=D{row}*E{row}", None])
        sheet.cell(row, 5).font = Font(italic=True)
    end = 1 + len(report.cost_lines)
    sheet.cell(end + 1, 5, f"=SUM(E2:E{end})").fill = PatternFill("solid", start_color="DDDDDD")
    sheet.merge_cells(f"A{end + 1}:C{end + 1}")
    sheet.conditional_formatting.add(f"E2:E{end}", ColorScaleRule("min", None, "FFFFFF", "max", None, "00AA00"))
    sheet.conditional_formatting.add(
        f"G2:G{end}", FormulaRule(["$G2<0.5"], fill=PatternFill("solid", end_color="FFCCCC"))
    )
    sheet.column_dimensions["D"].hidden = True
    chart = BarChart()
    chart.add_data(Reference(sheet, min_col=5, min_row=1, max_row=end), titles_from_data=True)
    sheet.add_chart(chart, "I2")
    book.save(path)
    columns = "{E: as_built_lower, G: completion_certain}"
    mapped = write_map(folder / "openpyxl.yaml", "LV", "{cost_code: A}", columns, "    unit: C\n")
    return Book(name="openpyxl", path=path, map=mapped, sheet="LV", column="E", total=("LV", f"E{end + 1}"))


def by_libreoffice(folder: Path, report: ProgressReport) -> Book:
    """Have LibreOffice write a workbook by class, storey and type; a storey is merged over its rows."""
    source = folder / "libreoffice-source.xlsx"
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.title = "Übersicht"
    sheet.append(["Storey", "Class", "Type", "Concrete m³", "×2"])
    storeys = [storey.name for storey in report.storeys]
    for number, (storey, kind) in enumerate((s, k) for s in storeys for k in ("wall", "column")):
        row = 2 + number
        named = storey if kind == "wall" else None
        sheet.append([named, f"Ifc{kind.title()}", f"Concrete {kind} C30/37", 1, f"=D{row}*2"])
    for number in range(len(storeys)):
        sheet.merge_cells(f"A{2 + 2 * number}:A{3 + 2 * number}")
    end = 1 + 2 * len(storeys)
    sheet.cell(end + 2, 4, f"=SUM(E2:E{end})")
    book.save(source)
    libreoffice(source, folder / "libreoffice", "xlsx")
    path = (folder / "libreoffice" / source.name).rename(folder / "libreoffice.xlsx")
    key = "{ifc_class: B, storey: A, type_name: C}"
    mapped = write_map(folder / "libreoffice.yaml", "Übersicht", key, "{D: built_volume_lower_m3}")
    return Book(name="LibreOffice", path=path, map=mapped, sheet="Übersicht", column="D",
                total=("Übersicht", f"D{end + 2}"), factor=2.0)  # fmt: skip


def by_hand(folder: Path, report: ProgressReport) -> Book:
    """Write a workbook letter by letter, as the standard allows it and few programs do."""
    path = folder / "by-hand.xlsx"
    rows = []
    for number, element in enumerate(report.elements[:9]):
        row = number + 2
        key = f"<x:c t='inlineStr'><x:is><x:r><x:t>{element.global_id[:9]}</x:t></x:r>"
        key += f"<x:r><x:t>{element.global_id[9:]}</x:t></x:r></x:is></x:c>"  # rich text in pieces, and no cell names
        filled = "<x:c/>" if number % 2 else f"<x:c r='B{row}' s='0'\r\n t='str'><x:v>n &amp; a</x:v></x:c>"
        shared = "<x:f t='shared' ref='C2:C10' si='0'>B2*2</x:f>" if not number else "<x:f t='shared' si='0'/>"
        rows.append(f"<x:row r='{row}'>{key}{filled}<x:c r='C{row}'>{shared}<x:v>7</x:v></x:c></x:row>\r\n")
    array = "<x:c r='E2'><x:f t='array' ref='E2:E3'>B2:B3*2</x:f><x:v>1</x:v></x:c>"
    rows.append(
        "<x:row r='30'><x:c r='D30'><x:f>SUM(C2:C10)</x:f><x:v>63</x:v></x:c><x:c r='F30'><x:f>1+1</x:f><x:v>2</x:v>"
        "</x:c></x:row><!-- the end --><?keep me?>"
    )
    rows[0] = rows[0].replace("</x:row>", f"{array}</x:row>")
    rows[1] = rows[1].replace("</x:row>", "<x:c r='E3'><x:v>1</x:v></x:c></x:row>")
    main = "xmlns:x='http://schemas.openxmlformats.org/spreadsheetml/2006/main'"
    compatible = (
        "xmlns:mc='http://schemas.openxmlformats.org/markup-compatibility/2006' xmlns:q='urn:q' mc:Ignorable='q'"
    )
    sheet = f"<x:worksheet {main} {compatible} q:z='1'><x:sheetData>{''.join(rows)}</x:sheetData></x:worksheet>"
    relation = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    kind = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    parts = {
        "[Content_Types].xml": f"<Types xmlns='{package}/content-types'>"
        f"<Default Extension='rels' ContentType='application/vnd.openxmlformats-package.relationships+xml'/>"
        f"<Override PartName='/odd/book.xml' ContentType='{kind}.sheet.main+xml'/>"
        f"<Override PartName='/odd/one.xml' ContentType='{kind}.worksheet+xml'/></Types>",
        "_rels/.rels": f"<Relationships xmlns='{package}/relationships'>"
        f"<Relationship Id='a' Type='{relation}/officeDocument' Target='/odd/book.xml'/></Relationships>",
        "odd/book.xml": f"<x:workbook {main} xmlns:r='{relation}'><x:sheets>"
        "<x:sheet name='Hand &amp; foot' sheetId='1' r:id='b'/></x:sheets></x:workbook>",
        "odd/_rels/book.xml.rels": f"<Relationships xmlns='{package}/relationships'>"
        f"<Relationship Id='b' Type='{relation}/worksheet' Target='one.xml'/></Relationships>",
        "odd/one.xml": f"\ufeff<?xml version='1.0' standalone='yes'?>\r\n{sheet}",
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text.encode())
    mapped = write_map(folder / "by-hand.yaml", '"Hand & foot"', "{global_id: A}", "{B: built_area_lower_m2}")
    return Book(name="by hand", path=path, map=mapped, sheet="Hand & foot", column="B", total=("Hand & foot", "D30"),
                factor=2.0)  # fmt: skip


def libreoffice(source: Path, folder: Path, kind: str) -> Path:
    """Have LibreOffice open a file, calculate it and write it in another format; return where."""
    folder.mkdir(parents=True, exist_ok=True)
    profile = f"-env:UserInstallation={(folder / 'profile').resolve().as_uri()}"
    command = ["soffice", profile, "--headless", "--convert-to", kind, "--outdir", str(folder), str(source)]
    subprocess.run(command, check=True, capture_output=True, timeout=180)
    return folder / f"{source.stem}.{kind}"
