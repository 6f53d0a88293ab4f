"""CSV as tools of others take it: ifccsv writes it into an IFC file, ifc5d's csv2ifc makes a cost schedule of it."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping

from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.report.wording.values import plain

NULL = "-"
"""What ifccsv takes for no value (its own default in Python, `--null=-` on its command line)."""
_OF_ELEMENTS: Mapping[str, Callable[[ElementProgress], object]] = {
    "GlobalId": lambda e: e.global_id,
    "AsBuilt_Progress.State": lambda e: e.shown_state,
    "AsBuilt_Progress.CompletionBest": lambda e: e.completion.best_shown,
    "AsBuilt_Progress.CompletionLower": lambda e: e.completion.lower,
    "AsBuilt_Progress.CompletionUpper": lambda e: e.completion.upper,
    "AsBuilt_Progress.Coverage": lambda e: e.completion.coverage,
}
_OF_COST_LINES: Mapping[str, Callable[[CostProgress], object]] = {
    "Index": lambda line: 1,  # the level in its outline
    "Identification": lambda line: plain(line.identification),
    "Name": lambda line: plain(line.name) or plain(line.identification) or line.global_id,
    "Unit": lambda line: plain(line.unit),
    "Quantity": lambda line: certain_quantity(line),
    "Value": lambda line: line.rate,
}


def certain_quantity(line: CostProgress) -> float:
    """Return a line's certain quantity, of what is counted whole pieces: csv2ifc cuts off what is behind the point."""
    if line.measure != "count":
        return line.as_built_lower
    even = 1e-9 * max(1.0, abs(line.as_built_lower))
    whole = math.ceil(line.as_built_lower - even) if line.takes_off else math.floor(line.as_built_lower + even)
    return float(whole)


def ifccsv_text(report: ProgressReport) -> str:
    """Return the elements' newest state: columns are called as ifccsv calls properties."""
    rows = ([_cell(value(one), NULL) for value in _OF_ELEMENTS.values()] for one in report.elements)
    return _table(_OF_ELEMENTS, rows)


def csv2ifc_text(report: ProgressReport) -> str:
    """Return the cost lines with their certain quantities and their rates."""
    rows = ([_cell(value(line), "") for value in _OF_COST_LINES.values()] for line in report.cost_lines)
    return _table(_OF_COST_LINES, rows)


def _cell(value: object, null: str) -> str:
    return null if value is None else str(value)


def _table(head: Iterable[str], rows: Iterable[list[str]]) -> str:
    """Return a table without a byte mark, which neither tool knows."""
    out = io.StringIO(newline="")
    table = csv.writer(out, lineterminator="\n")
    table.writerow(head)
    table.writerows(rows)
    return out.getvalue()
