"""The sheet `Bill`: every cost line with what was certified before, now and in all; fed by `Cost by element`."""

from collections.abc import Sequence
from dataclasses import replace

from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.money import quantity_decimals, total
from asbuilt_bim.progress.valuation.bill import Bill, BillLine
from asbuilt_bim.report.cost_rows import NO_CURRENCY, possible_of, possible_quantity
from asbuilt_bim.report.wording.of_workbook.columns import Column
from asbuilt_bim.report.wording.of_workbook.valuation_columns import BILL as COLUMNS
from asbuilt_bim.report.wording.of_workbook.valuation_columns import COST_PARTS
from asbuilt_bim.report.wording.values import UNKNOWN, cut_down, plain
from asbuilt_bim.report.workbook.layout import BILL, HEAD, PARTS, PER_DESIGN, letter, letter_of
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
_PRINTED = "Check"
_INPUTS = ("Rate", "Previous quantity", "Previous amount", "Rate: why, by whom")
_SUMMED = (
    "Contract amount",
    "Previous amount",
    "This period amount",
    "Certified amount",
    "Remaining amount",
    "Possible amount",
)
MAX_ROW = 1_048_576


def write_bill(sheet: Worksheet, made: Sequence[Bill], title: str, parts_rows: int, styles: Styles) -> int:
    """Write the lines of every bill as one table, and the sums of each below; return the row of the first sum."""
    titled(sheet, title, "Bill", styles)
    write_head(sheet, HEAD, COLUMNS, styles)
    lines = [(bill, line) for bill in made for line in bill.lines]
    for index, (bill, line) in enumerate(lines):
        _line(sheet, HEAD + 1 + index, bill, line, parts_rows, styles)
    last = HEAD + len(lines)
    write_table(sheet, BILL, HEAD, last, COLUMNS, styles)
    first_sum = last + 2
    for index, bill in enumerate(made):
        _total(sheet, first_sum + index, HEAD + 2, last + 1, bill, styles)
    sheet.freeze_panes(HEAD + 1, 3)
    printed = next(i for i, column in enumerate(COLUMNS) if column.heading == _PRINTED)
    print_page(sheet, HEAD, last_row=first_sum + max(len(made) - 1, 0), last_column=printed)
    return first_sum


def _line(sheet: Worksheet, row: int, bill: Bill, line: BillLine, parts_rows: int, styles: Styles) -> None:
    """Write one line with its formulas."""
    n, given = row + 1, line.line
    c = {heading: f"{column}{n}" for heading, column in _C.items()}
    contract, certified = c["Contract quantity"], c["Certified quantity"]
    best: Cell = Formula(f'=IF(ISNUMBER({c["Best quantity"]}),ROUND({c["Best quantity"]}*{c["Rate"]},2),"{UNKNOWN}")',
                         UNKNOWN if line.best_amount is None else line.best_amount)  # fmt: skip
    cells: dict[str, Cell] = {
        "No.": line.number,
        "Item": given.identification,
        "Text": given.name,
        "Unit": given.unit,
        "Contract quantity": 0.0 if line.gone else given.planned_quantity,
        "Rate": line.rate,
        "Contract amount": Formula(f"=ROUND({contract}*{c['Rate']},2)", line.contract),
        "Previous quantity": line.previous_quantity,
        "Previous amount": line.previous,
        "This period quantity": Formula(
            f"=ROUND({certified}-{c['Previous quantity']},6)", round(line.quantity - line.previous_quantity, 6) + 0.0
        ),
        "This period amount": Formula(f"=ROUND({c['Certified amount']}-{c['Previous amount']},2)", line.period),
        "Certified quantity": Formula(_certified(c, line), line.quantity),
        "Certified amount": Formula(f"=ROUND({certified}*{c['Rate']},2)", line.amount),
        "Remaining quantity": Formula(
            f"=ROUND({contract}-{certified},6)",
            round((0.0 if line.gone else given.planned_quantity) - line.quantity, 6) + 0.0,
        ),
        "Remaining amount": Formula(
            f"=ROUND({c['Contract amount']}-{c['Certified amount']},2)", round(line.contract - line.amount, 2) + 0.0
        ),
        "Best amount": best,
        "Check": Formula(_falls(c, line), "falls" if line.falls else ""),
        "Best quantity": line.best,
        "Possible amount": Formula(
            f"=ROUND({possible_quantity(line, bill.complete_from)!r}*{c['Rate']},2)",
            possible_of(line, bill.complete_from),
        ),
        "Rate: why, by whom": line.rate_change.why if line.rate_change else "",
        "Contract rate": given.rate,
        "Sum of elements": Formula(_sum_of_elements(c, parts_rows), sum(one.certified for one in line.rows)),
        "Coverage": cut_down(given.completion.coverage),
        "Elements": len(given.elements),
        "Not measured": given.others,
        "Bill": bill.number,
        "Currency": given.currency or NO_CURRENCY,
        "In pieces": "yes" if given.measure == "count" else "",
        "Design quantity": given.design_quantity,
        PER_DESIGN: line.per_design,
        "Key": given.global_id,
    }
    columns = _in_pieces(COLUMNS) if given.measure == "count" else COLUMNS
    write_row(sheet, row, [cells[column.heading] for column in columns], columns, styles)
    for index, column in enumerate(columns):
        if column.heading in _INPUTS:
            role = "person" if column.heading.startswith("Rate") and line.rate_change else "input"
            write_cell(sheet, row, index, cells[column.heading], column.kind, styles, role)
        elif column.heading == "Check":
            write_cell(sheet, row, index, cells["Check"], "text", styles, "warning")


def _in_pieces(columns: Sequence[Column]) -> list[Column]:
    """Return columns that show quantities as whole pieces."""
    return [replace(one, kind="pieces") if one.kind == "quantity" else one for one in columns]


def _sum_of_elements(c: dict[str, str], parts_rows: int) -> str:
    """Add up the line's rows of Cost by element by the line's number: sorting either sheet changes nothing."""
    first, last = HEAD + 2, max(HEAD + 1 + parts_rows, HEAD + 2)
    number, quantity = (letter(COST_PARTS, heading) for heading in ("No.", "Quantity certified"))
    sheet = f"'{PARTS}'"
    return (
        f"=SUMIF({sheet}!${number}${first}:${number}${last},{c['No.']},{sheet}!${quantity}${first}:${quantity}${last})"
    )


def _certified(c: dict[str, str], line: BillLine) -> str:
    """Return the formula of `money.certified_quantity`."""
    total, most = c["Sum of elements"], c["Contract quantity"]
    if line.line.measure == "count":
        away = "UP" if line.line.takes_off else "DOWN"
        amount = f"ROUND{away}(ROUND(ABS({total}),6),0)"
    else:
        amount = f"ROUND(ABS({total}),{quantity_decimals(line.line.planned_quantity)})"
    return f"=IF(ROUND(ABS({total}),9)>=ROUND(ABS({most}),9),{most},SIGN({most})*MIN(ABS({most}),{amount}))"


def _falls(c: dict[str, str], line: BillLine) -> str:
    """Say where less is certified than before; of a line that takes money off nothing falls."""
    if line.line.takes_off and not line.gone:
        return '=""'
    return f'=IF({c["This period amount"]}<0,"falls","")'


def _total(sheet: Worksheet, row: int, first: int, last: int, bill: Bill, styles: Styles) -> None:
    """Write the sums of a bill over its own lines."""
    values = {
        "Contract amount": bill.contract,
        "Previous amount": bill.previous.work,
        "This period amount": bill.period.work,
        "Certified amount": bill.cumulative.work,
        "Remaining amount": round(bill.contract - bill.cumulative.work, 2) + 0.0,
        "Possible amount": total(possible_of(line, bill.complete_from) for line in bill.lines),
    }
    name = f"Total of bill {bill.number}, {plain(bill.currency) or NO_CURRENCY}"
    cells: dict[str, Cell] = {"No.": "", "Text": name, "Bill": bill.number, "Currency": bill.currency or NO_CURRENCY}
    own = f"${_C['Bill']}${first}:${_C['Bill']}${last},{bill.number}"
    for heading in _SUMMED:
        column = _C[heading]
        amounts = f"{column}${first}:{column}${last}"
        cells[heading] = Formula(f"=ROUND(SUMIF({own},{amounts}),2)", values[heading])
    best, needed = _C["Best amount"], sum(not line.gone for line in bill.lines)
    known = f'COUNTIFS({own},{best}${first}:{best}${last},">-1E+300")'
    cells["Best amount"] = Formula(
        f'=IF({known}<{max(needed, 1)},"{UNKNOWN}",ROUND(SUMIF({own},{best}${first}:{best}${last}),2))',
        UNKNOWN if bill.best is None else bill.best,
    )
    if left := bill.without_best:
        cells["Check"] = f"best: {left} unknown"
    write_row(sheet, row, [cells.get(column.heading, "") for column in COLUMNS], COLUMNS, styles, "total")
