"""A table on a worksheet: columns with a width and a number format, cells that can't run, unknown that can't be 0."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from xlsxwriter.format import Format
from xlsxwriter.workbook import Workbook
from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.report.wording.values import UNKNOWN, plain
from asbuilt_bim.report.wording.workbook_columns import Column

MAX_TEXT = 32_000  # a cell holds 32 767 characters
INK, LINE, SHADE, LOUD = "#1f2933", "#c6ccd3", "#eef1f4", "#b42318"

_KINDS: dict[str, dict[str, Any]] = {
    "text": {"align": "left", "indent": 1},
    "wrap": {"align": "left", "indent": 1, "text_wrap": True},
    "area": {"num_format": "#,##0.00", "align": "right"},
    "quantity": {"num_format": "#,##0.000", "align": "right"},
    "money": {"num_format": "#,##0.00", "align": "right"},
    "rate": {"num_format": "#,##0.00##########", "align": "right"},
    "percent": {"num_format": "0.0%", "align": "right"},
    "millimetres": {"num_format": "+0.0;-0.0;0.0", "align": "right"},
    "metres": {"num_format": "0.000", "align": "right"},
    "count": {"num_format": "0", "align": "right"},
    "date": {"num_format": "yyyy-mm-dd", "align": "left", "indent": 1},
}
_STATES = {
    "complete": "#1b7f5c", "complete as far as seen": "#4c9a7d", "part": "#9a6200",
    "not started": "#3d5a80", "displaced": "#9b2c6e", "unknown": "#6b7280",
}  # fmt: skip
_ROLES: dict[str, dict[str, Any]] = {
    "body": {},
    "total": {"bold": True, "top": 1, "top_color": INK, "bg_color": SHADE},
    "input": {"font_color": "#0b4f9e"},
    "unknown": {"font_color": "#6b7280", "italic": True},
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
            extra = {"bold": True, "font_color": _STATES[role]} if role in _STATES and role != UNKNOWN else _ROLES[role]
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


def finish_table(sheet: Worksheet, head: int, last: int, columns: Sequence[Column], *, keep: int = 0) -> None:
    """Freeze the headings (and `keep` columns), filter, and set the page for printing."""
    sheet.freeze_panes(head + 1, keep)
    if last > head:
        sheet.autofilter(head, 0, last, len(columns) - 1)
    page_setup(sheet)
    sheet.repeat_rows(head)


def page_setup(sheet: Worksheet) -> None:
    """Set A4 across, one page wide, with page numbers."""
    sheet.set_landscape()
    sheet.set_paper(9)
    sheet.fit_to_pages(1, 0)
    sheet.set_margins(left=0.4, right=0.4, top=0.5, bottom=0.6)
    sheet.set_footer("&L&8&F · &A&R&8&P / &N")
    sheet.hide_gridlines(2)
