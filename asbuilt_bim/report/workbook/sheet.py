"""A table on a worksheet: columns with a width and a number format, cells that can't run, unknown that can't be 0."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from xlsxwriter.format import Format
from xlsxwriter.workbook import Workbook
from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.report.wording.of_workbook.columns import Column
from asbuilt_bim.report.wording.values import UNKNOWN, plain

LINE_PT = 13.5
"""The height of a line of text."""
MAX_TEXT = 32_000  # a cell holds 32 767 characters
INK, LINE, SHADE, LOUD = "#1f2933", "#c6ccd3", "#eef1f4", "#b42318"

_KINDS: dict[str, dict[str, Any]] = {
    "text": {"align": "left", "indent": 1},
    "wrap": {"align": "left", "indent": 1, "text_wrap": True},
    "area": {"num_format": "#,##0.00", "align": "right"},
    "quantity": {"num_format": "#,##0.000", "align": "right"},
    "money": {"num_format": "#,##0.00", "align": "right"},
    "pieces": {"num_format": "General", "align": "right"},
    "money or blank": {"num_format": "#,##0.00;-#,##0.00;", "align": "right"},
    "rate": {"num_format": "#,##0.00##########", "align": "right"},
    "percent": {"num_format": "0.0%", "align": "right"},
    "percent2": {"num_format": "0.00%", "align": "right"},
    "left": {"num_format": "0", "align": "left", "indent": 1},
    "millimetres": {"num_format": "+0.0;-0.0;0.0", "align": "right"},
    "sigma": {"num_format": "0.0", "align": "right"},
    "metres": {"num_format": "0.000", "align": "right"},
    "count": {"num_format": "0", "align": "right"},
    "date": {"num_format": "yyyy-mm-dd", "align": "left", "indent": 1},
}
_STATES = {
    "complete": "#1b7f5c", "complete as far as seen": "#4c9a7d", "part": "#9a6200",
    "not started": "#3d5a80", "displaced": "#9b2c6e", "unknown": "#6b7280",
}  # fmt: skip
_ROLES: dict[str, dict[str, Any]] = {
    "body": {"bottom": 4, "bottom_color": LINE},
    "plain": {},
    "total": {"bold": True, "top": 1, "top_color": INK, "bg_color": SHADE},
    "input": {"font_color": "#0b4f9e", "bottom": 4, "bottom_color": LINE},
    "person": {"font_color": "#7a4b00", "bg_color": "#fff3cd", "bottom": 4, "bottom_color": LINE},
    "warning": {"font_color": LOUD, "bold": True, "bottom": 4, "bottom_color": LINE},
    "signed by": {"bottom": 1, "bottom_color": INK, "valign": "bottom"},
    "sign": {"bg_color": "#eef5ff", "font_color": "#0b4f9e", "bottom": 1, "bottom_color": INK, "valign": "bottom"},
    "unknown": {"font_color": "#6b7280", "italic": True, "bottom": 4, "bottom_color": LINE},
    "loud": {"font_color": "#ffffff", "bg_color": LOUD, "bold": True},
    "title": {"bold": True, "font_size": 15},
    "heading": {"bold": True, "font_size": 12},
    "head": {
        "bold": True,
        "bg_color": INK,
        "font_color": "#ffffff",
        "text_wrap": True,
        "valign": "vcenter",
        "border": 1,
        "border_color": LINE,
    },
}


@dataclass(frozen=True, slots=True, eq=False)
class Formula:
    """A live formula, and the value that it has now: what a viewer shows that doesn't calculate."""

    text: str
    value: float | str


Cell = str | float | int | date | datetime | Formula | None


class Styles:
    """The workbook's formats, each made once."""

    def __init__(self, workbook: Workbook) -> None:
        self._workbook = workbook
        self._made: dict[tuple[str, str], Format] = {}

    def get(self, kind: str, role: str = "body") -> Format:
        """Return the format of a kind of cell in a role ("body", "total", "input", "loud", ..., or a state)."""
        if (kind, role) not in self._made:
            extra = (
                {"bold": True, "font_color": _STATES[role], **_ROLES["body"]}
                if role in _STATES and role != UNKNOWN
                else _ROLES[role]
            )
            base = {"font_name": "Calibri", "font_size": 10, "valign": "top", "font_color": INK}
            self._made[kind, role] = self._workbook.add_format(base | _KINDS[kind] | extra)
        return self._made[kind, role]


def write_cell(
    sheet: Worksheet, row: int, column: int, cell: Cell, kind: str, styles: Styles, role: str = "body"
) -> None:
    """Write one cell by its type: text never as a formula, None as the word `unknown`."""
    if isinstance(cell, Formula):
        sheet.write_formula(row, column, cell.text, styles.get(kind, role), cell.value)
    elif cell is None:
        sheet.write_string(row, column, UNKNOWN, styles.get(kind, "loud" if role == "loud" else "unknown"))
    elif cell == "":
        sheet.write_blank(row, column, None, styles.get(kind, role))
    elif isinstance(cell, str):
        sheet.write_string(row, column, plain(cell)[:MAX_TEXT], styles.get(kind if kind == "wrap" else "text", role))
    elif isinstance(cell, date | datetime):
        if cell.year < 1900:  # spreadsheets begin there
            sheet.write_string(row, column, cell.isoformat()[:10], styles.get("text", role))
        else:
            sheet.write_datetime(row, column, cell, styles.get("date", role))
    else:
        sheet.write_number(row, column, float(cell), styles.get(kind, role))


def write_head(sheet: Worksheet, row: int, columns: Sequence[Column], styles: Styles) -> None:
    """Write the headings and set the widths."""
    sheet.set_row(row, 32)
    for index, column in enumerate(columns):
        sheet.set_column(index, index, column.width)
        sheet.write_string(row, index, column.heading, styles.get(column.kind, "head"))


def write_row(
    sheet: Worksheet, row: int, cells: Sequence[Cell], columns: Sequence[Column], styles: Styles, role: str = "body"
) -> None:
    """Write one row of cells; a state gets its colour."""
    for index, (cell, column) in enumerate(zip(cells, columns, strict=True)):
        coloured = isinstance(cell, str) and cell in _STATES and column.heading == "State" and cell != UNKNOWN
        write_cell(sheet, row, index, cell, column.kind, styles, str(cell) if coloured else role)
    wrapped = [(str(cell), column.width) for cell, column in zip(cells, columns, strict=True) if column.kind == "wrap"]
    if wrapped and (height := max(row_height(plain(text), width) for text, width in wrapped)) > LINE_PT + 2.0:
        sheet.set_row(row, height)


def titled(sheet: Worksheet, title: str, what: str, styles: Styles) -> None:
    """Write what stands above a sheet's table: of which project and visit, and what it holds."""
    sheet.set_row(0, 20)
    write_cell(sheet, 0, 0, title, "text", styles, "heading")
    write_cell(sheet, 1, 0, what, "text", styles, "plain")


def write_paragraph(
    sheet: Worksheet, row: int, last_column: int, text: str | Formula, width: float, styles: Styles
) -> None:
    """Write a sentence over several columns, in a row that is high enough for it; `width` in characters.

    A formula says something later: two lines are kept for it.
    """
    shown = text if isinstance(text, Formula) else plain(text)[:MAX_TEXT]
    if last_column:
        sheet.merge_range(row, 0, row, last_column, "", styles.get("wrap", "plain"))
    write_cell(sheet, row, 0, shown, "wrap", styles, "plain")
    sheet.set_row(row, row_height("\n" if isinstance(shown, Formula) else shown, width))


def row_height(text: str, width: float) -> float:
    """Return the height in points of a row that holds a wrapped text in a column so many characters wide."""
    lines = sum(max(1, math.ceil(1.05 * len(line) / max(width - 2.0, 1.0))) for line in text.split("\n"))
    return min(LINE_PT * lines + 2.0, 400.0)


def write_table(
    sheet: Worksheet,
    name: str,
    head: int,
    last: int,
    columns: Sequence[Column],
    styles: Styles,
    formulas: Mapping[str, str] | None = None,
) -> None:
    """Make a table of rows, so that other workbooks can name its columns; one without rows is none.

    `formulas` are those by heading that a spreadsheet program gives each row that is added. They are written into the
    rows that are there, too: write these afterwards.
    """
    if last > head:
        headers = [
            {
                "header": one.heading,
                "header_format": styles.get(one.kind, "head"),
                "formula": (formulas or {}).get(one.heading),
            }
            for one in columns
        ]
        sheet.add_table(
            head, 0, last, len(columns) - 1, {"name": name, "columns": headers, "style": None, "header_row": True}
        )


def finish_table(
    sheet: Worksheet,
    head: int,
    last: int,
    columns: Sequence[Column],
    *,
    styles: Styles,
    keep: int = 0,
    name: str = "",
    printed: int = 0,
) -> None:
    """Freeze the headings (and `keep` columns), make a table of it, and print its first `printed` columns (0: all)."""
    sheet.freeze_panes(head + 1, keep)
    if name:
        write_table(sheet, name, head, last, columns, styles)
    print_page(sheet, head, last_row=max(last, head), last_column=(printed or len(columns)) - 1)


def print_page(sheet: Worksheet, head: int | None, *, last_row: int, last_column: int, landscape: bool = True) -> None:
    """Set what is printed: A4, one page wide, headings on every page, page numbers."""
    page_setup(sheet)
    if not landscape:
        sheet.set_portrait()
    sheet.print_area(0, 0, max(last_row, 0), last_column)
    if head is not None:
        sheet.repeat_rows(head)


def page_setup(sheet: Worksheet) -> None:
    """Set A4 across, one page wide, with page numbers."""
    sheet.set_landscape()
    sheet.set_paper(9)
    sheet.fit_to_pages(1, 0)
    sheet.set_margins(left=0.4, right=0.4, top=0.5, bottom=0.6)
    sheet.set_footer("&L&8&F · &A&R&8&P / &N")
    sheet.hide_gridlines(2)
