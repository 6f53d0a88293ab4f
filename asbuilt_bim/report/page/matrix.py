"""Storeys by trades: what is certain of the walls, of the columns, and what each bill owes."""

from collections.abc import Sequence
from dataclasses import dataclass

from asbuilt_bim.progress.completion.rollup import weighted
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.tables import NO_STOREY, storey_names


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """The elements of one class on one storey; only their bounds and coverage are shown."""

    completion: Completion
    elements: int
    late: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A storey with a cell a class, None where it has no such element."""

    storey: str
    cells: tuple[Cell | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """Storeys from below; the last row is of all of them."""

    classes: tuple[str, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """What a bill owes for the period, with retention and tax, as the valuation has it."""

    name: str  # of its cost schedule, where there are several
    currency: str
    due: float
    certified: float  # in all, before retention and tax
    contract: float


def matrix_of(report: ProgressReport, late: frozenset[str]) -> Matrix | None:
    """Return the matrix; None where it would say no more than the storeys do. `late` are GlobalIds."""
    classes = tuple(sorted({element.ifc_class for element in report.elements}))
    if len(classes) < 2:
        return None
    names = storey_names(report)
    keys = [*names, *({element.storey for element in report.elements} - names.keys())]
    rows = []
    for key in keys:
        inside = [element for element in report.elements if element.storey == key]
        if inside:
            rows.append(Row(storey=names.get(key, NO_STOREY), cells=_cells(inside, classes, late)))
    if len(rows) > 1:
        rows.append(Row(storey="", cells=_cells(report.elements, classes, late)))
    return Matrix(classes=classes, rows=tuple(rows))


def money_due(report: ProgressReport) -> tuple[Due, ...]:
    """Return what each bill owes; none where the design has no cost lines."""
    made = [bill for bill in bills(report) if bill.lines]
    return tuple(
        Due(
            name=bill.schedule if len(made) > 1 else "",
            currency=bill.currency,
            due=bill.period.payable,
            certified=bill.cumulative.gross,
            contract=bill.contract,
        )
        for bill in made
    )


def _cells(
    elements: Sequence[ElementProgress], classes: Sequence[str], late: frozenset[str]
) -> tuple[Cell | None, ...]:
    """Return a cell a class, weighted by exposed design area as storeys are."""
    cells: list[Cell | None] = []
    for one in classes:
        own = [element for element in elements if element.ifc_class == one]
        done = weighted(own, [element.design_area_m2 for element in own], ProgressOptions()) if own else None
        count = sum(element.global_id in late for element in own)
        cells.append(None if done is None else Cell(completion=done, elements=len(own), late=count))
    return tuple(cells)
