"""The sheet `Cost`: cost lines in their own unit, with formulas that go on calculating."""

from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.report import CostProgress, ProgressReport
from asbuilt_bim.report.cost_rows import NO_CURRENCY, CostGroup, cost_groups
from asbuilt_bim.report.wording.values import UNKNOWN
from asbuilt_bim.report.wording.workbook_columns import COST
from asbuilt_bim.report.workbook.sheet import (
    Cell,
    Formula,
    Styles,
    finish_table,
    page_setup,
    write_cell,
    write_head,
    write_row,
)

_INPUTS = (4, 5, 8, 9)  # planned quantity, rate, completion: typed values that formulas stand on


def write_cost(sheet: Worksheet, report: ProgressReport, styles: Styles) -> None:
    """Write the cost lines by schedule and currency, each group with its sums."""
    write_head(sheet, 0, COST, styles)
    if not report.cost_lines:
        write_cell(sheet, 1, 0, "The IFC file has no cost lines for walls or columns.", "text", styles)
        page_setup(sheet)
        return
    row = 1
    for group in cost_groups(report):
        for index, line in enumerate(group.lines):
            _line(sheet, row + index, line, styles)
        _total(sheet, row + len(group.lines), row, group, styles)
        row += len(group.lines) + 2
    finish_table(sheet, 0, 0, COST, keep=2)


def _line(sheet: Worksheet, row: int, line: CostProgress, styles: Styles) -> None:
    """Write one line with its formulas."""
    n = row + 1
    best: Cell = _known(f'=IF(ISNUMBER(I{n}),I{n}*E{n},"{UNKNOWN}")', line.as_built_best)
    earned: Cell = _known(f'=IF(ISNUMBER(K{n}),ROUND(K{n}*F{n},2),"{UNKNOWN}")', line.earned_best)
    cells: tuple[Cell, ...] = (
        line.identification,
        line.name,
        len(line.elements),
        line.unit,
        line.planned_quantity,
        line.rate,
        line.currency or NO_CURRENCY,
        Formula(f"=ROUND(E{n}*F{n},2)", line.planned_value),
        line.completion.best,
        line.certain,
        best,
        Formula(f"=J{n}*E{n}", line.as_built_lower),
        earned,
        Formula(f"=ROUND(L{n}*F{n},2)", line.earned_lower),
        line.completion.coverage,
        line.others,
    )
    write_row(sheet, row, cells, COST, styles)
    for column in _INPUTS:
        if cells[column] is not None:
            write_cell(sheet, row, column, cells[column], COST[column].kind, styles, "input")


def _total(sheet: Worksheet, row: int, first: int, group: CostGroup, styles: Styles) -> None:
    """Write the sums of a group; a sum of nothing known is unknown, and its name counts the lines left out."""
    suffix = f", best without {group.unknown} unknown of {len(group.lines)} lines" if group.unknown else ""
    cells: list[Cell] = [""] * len(COST)
    cells[0] = f"Total {group.name}{suffix}"
    cells[6] = group.currency or NO_CURRENCY
    cells[7] = Formula(f"=SUM(H{first + 1}:H{row})", group.planned)
    best = f'=IF(COUNT(M{first + 1}:M{row})=0,"{UNKNOWN}",SUM(M{first + 1}:M{row}))'
    cells[12] = _known(best, group.earned_best)
    cells[13] = Formula(f"=SUM(N{first + 1}:N{row})", group.earned_lower)
    write_row(sheet, row, cells, COST, styles, "total")


def _known(text: str, value: float | None) -> Formula:
    """Return a formula whose present value may be unknown."""
    return Formula(text, UNKNOWN if value is None else value)
