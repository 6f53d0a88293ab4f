"""The sheet `Cost by element`: what each element brings to each line, and where a surveyor overrides it."""

from collections.abc import Sequence

from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.valuation.bill import Bill, BillLine, BillRow
from asbuilt_bim.report.cost_rows import NO_CURRENCY
from asbuilt_bim.report.tables import NO_STOREY
from asbuilt_bim.report.wording.of_workbook.valuation_columns import BILL as BILL_COLUMNS
from asbuilt_bim.report.wording.of_workbook.valuation_columns import COST_PARTS as COLUMNS
from asbuilt_bim.report.wording.of_workbook.valuation_columns import PARTS_TITLE
from asbuilt_bim.report.wording.of_workbook.valuation_notes import lost_words
from asbuilt_bim.report.workbook.layout import BILL, HEAD, letter, letter_of
from asbuilt_bim.report.workbook.sheet import (
    Cell,
    Formula,
    Styles,
    print_page,
    titled,
    write_cell,
    write_head,
    write_row,
    write_table,
)

_C = {column.heading: letter_of(index) for index, column in enumerate(COLUMNS)}
_INPUTS = ("Override", "Reason", "By", "Date")
_PRINTED = "Amount"


def rows_of(made: Sequence[Bill]) -> list[tuple[Bill, BillLine, BillRow]]:
    """Return the rows that feed the bill, in its order."""
    return [(bill, line, row) for bill in made for line in bill.lines for row in line.rows]


def write_parts(
    sheet: Worksheet, made: Sequence[Bill], title: str, storeys: dict[str, str], counts: bool, styles: Styles
) -> None:
    """Write a row for each element of each line, and one for what isn't measured of a line."""
    titled(sheet, title, PARTS_TITLE, styles)
    write_head(sheet, HEAD, COLUMNS, styles)
    lines = sum(len(bill.lines) for bill in made)
    rows, amounts = rows_of(made), [pair for bill in made for line in bill.lines for pair in line.amounts()]
    context = counts, lines, len(rows)
    for index, ((bill, line, row), money) in enumerate(zip(rows, amounts, strict=True)):
        _row(sheet, HEAD + 1 + index, bill, line, row, storeys, context, money, styles)
    last = HEAD + len(rows)
    write_table(sheet, "CostByElement", HEAD, last, COLUMNS, styles)
    if rows:
        share = {
            "validate": "decimal",
            "criteria": "between",
            "minimum": 0,
            "maximum": 1,
            "error_title": "Override",
            "error_message": "A percentage from 0 % to 100 %. What goes beyond the contract is a variation.",
        }
        column = next(i for i, one in enumerate(COLUMNS) if one.heading == "Override")
        sheet.data_validation(HEAD + 1, column, last, column, share)
    sheet.freeze_panes(HEAD + 1, 3)
    print_page(sheet, HEAD, last_row=last, last_column=next(i for i, c in enumerate(COLUMNS) if c.heading == _PRINTED))


def _row(
    sheet: Worksheet,
    number: int,
    bill: Bill,
    line: BillLine,
    row: BillRow,
    storeys: dict[str, str],
    context: tuple[bool, int, int],
    money: tuple[float, float],
    styles: Styles,
) -> None:
    counts, lines, parts = context
    n, element, given = number + 1, row.element, row.override
    c = {heading: f"{column}{n}" for heading, column in _C.items()}
    unmeasured = f"(not measured here: {row.others} more)" if row.others else "(nothing measured here)"
    unmeasured = f"({lost_words(len(line.left), sum(line.left.values()))})" if row.lost else unmeasured
    rate, whole = (_of_line(c, heading, lines) for heading in ("Rate", "Certified amount"))
    takes = row is line.rows[line.rounding_row]
    cells: dict[str, Cell] = {
        "No.": line.number,
        "Item": line.line.identification,
        "Element": element.name or element.global_id if element else unmeasured,
        "Storey": storeys.get(element.storey, NO_STOREY) if element else "",
        "State": element.shown_state if element else "",
        "Unit": line.line.unit,
        "Quantity": row.quantity,
        "Certain": row.measured,
        "Best": element.completion.best_shown if element else None,
        "Seen by a person": row.observed.observation.share if row.observed else "",
        "Override": given.share if given else "",
        "Reason": given.reason if given else "",
        "By": given.by if given else "",
        "Date": given.day or "" if given else "",
        "Counts": Formula(_counts(c, line, counts), row.share),
        "Quantity certified": Formula(f"={c['Quantity']}*{c['Counts']}", row.certified),
        "Amount": Formula(_rounded(c, whole, parts) if takes else f"={c['Before the line']}", money[1]),
        "Beside photos": row.observed.share if row.observed else "",
        "Before the line": Formula(f"=ROUND({c['Quantity certified']}*{rate},2)", money[0]),
        "GlobalId": row.global_id,
        "Cost line": line.line.name,
        "Currency": bill.currency or NO_CURRENCY,
    }
    write_row(sheet, number, [cells[column.heading] for column in COLUMNS], COLUMNS, styles)
    for index, column in enumerate(COLUMNS):
        if column.heading in _INPUTS:
            write_cell(sheet, number, index, cells[column.heading], column.kind, styles, "person" if given else "input")
        elif column.heading == "Seen by a person" and row.observed:
            write_cell(sheet, number, index, cells[column.heading], column.kind, styles, "person")


def _of_line(c: dict[str, str], heading: str, lines: int) -> str:
    """Look up what Bill says of the row's line."""
    values, first, last = letter(BILL_COLUMNS, heading), HEAD + 2, HEAD + 1 + lines
    return f"INDEX({BILL}!${values}${first}:${values}${last},MATCH({c['No.']},{BILL}!$A${first}:$A${last},0))"


def _rounded(c: dict[str, str], whole: str, parts: int) -> str:
    """Return the formula of the amount that takes what the line's rounding adds: the column adds up to Bill."""
    first, last = HEAD + 2, HEAD + 1 + parts
    number, own = _C["No."], _C["Before the line"]
    others = f"SUMIF(${number}${first}:${number}${last},{c['No.']},${own}${first}:${own}${last})"
    return f"=ROUND({c['Before the line']}+{whole}-{others},2)"


def _counts(c: dict[str, str], line: BillLine, counts: bool) -> str:
    """Return the formula of what counts: an override, else (where it counts) what a person saw, else certain."""
    seen = c["Beside photos"]
    rest = f"IF(ISNUMBER({seen}),{seen},{c['Certain']})" if counts else c["Certain"]
    share = f"IF(ISNUMBER({c['Override']}),MIN(1,MAX(0,{c['Override']})),{rest})"
    if line.line.measure != "count":
        return f"={share}"
    return f"=-INT(-{share})" if line.line.takes_off else f"=INT({share})"
