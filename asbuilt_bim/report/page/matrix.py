"""Storeys by trades, or by classes: what is certain, what the plan wants, what is late; and what each bill owes."""

from collections.abc import Sequence
from dataclasses import dataclass

from asbuilt_bim.progress.completion.rollup import weighted
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, bills
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS
from asbuilt_bim.progress.valuation.notes import of_money
from asbuilt_bim.report.by_persons import by_persons
from asbuilt_bim.report.drawings.planned_shares import PlannedElements, planned_elements
from asbuilt_bim.report.page.trades import Trades, trades_of
from asbuilt_bim.report.tables import NO_STOREY, storey_names
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.money_words import period_words, rests_words, terms_words


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """The elements of one trade or class on one storey; only their bounds and coverage are shown."""

    completion: Completion
    elements: int
    late: int
    planned: float | None  # share that the plan wants by now, of those with planned dates


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A storey with a cell a column, None where it has no such element."""

    storey: str
    cells: tuple[Cell | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """Storeys from below; the last row is of all of them. An element of two trades stands in both columns."""

    trades: Trades
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """What a bill owes for the period, with retention and tax, as the valuation has it."""

    name: str  # of its cost schedule, where there are several
    currency: str
    due: float
    certified: float  # in all, before retention and tax
    contract: float
    since: str  # in words: when the period began
    terms: str  # in words: retention and tax, and which of them isn't set
    is_net: bool  # whether neither of them is in what is due
    persons: str  # in words: what of the work rests on persons, "" where nothing does
    asked: tuple[str, ...]  # in words: what to look at of its lines before it is paid


def matrix_of(report: ProgressReport, late: frozenset[str]) -> Matrix | None:
    """Return the matrix; None where it would say no more than the storeys do. `late` are GlobalIds."""
    trades, plan = trades_of(report), planned_elements(report)
    if len(trades.names) < 2:
        return None
    names = storey_names(report)
    keys = [*names, *({element.storey for element in report.elements} - names.keys())]
    rows = []
    for key in keys:
        inside = [element for element in report.elements if element.storey == key]
        if inside:
            rows.append(Row(storey=names.get(key, NO_STOREY), cells=_cells(inside, trades, late, plan)))
    if len(rows) > 1:
        rows.append(Row(storey="", cells=_cells(report.elements, trades, late, plan)))
    return Matrix(trades=trades, rows=tuple(rows))


def money_due(report: ProgressReport) -> tuple[Due, ...]:
    """Return what each bill owes; none where the design has no cost lines."""
    made = [bill for bill in bills(report) if bill.lines]
    inputs = report.valuation or NO_INPUTS
    last = inputs.certificates[-1] if inputs.certificates else None
    return tuple(
        Due(
            name=bill.schedule if len(made) > 1 else "",
            currency=bill.currency,
            due=bill.period.payable,
            certified=bill.cumulative.gross,
            contract=bill.contract,
            since=period_words(last, paid_before=bool(bill.previous.gross)),
            terms=terms_words(inputs.terms),
            is_net=not (inputs.terms.retention or inputs.terms.tax),
            persons=rests_words(by_persons(bill), bill.cumulative.variations, bill.currency),
            asked=_asked(report, bill),
        )
        for bill in made
    )


def _asked(report: ProgressReport, bill: Bill) -> tuple[str, ...]:
    """Return the notes on a bill, its lines and its variations that say why money rises or falls."""
    own = {line.line.global_id for line in bill.lines} | {one.variation.number for one in bill.variations}
    own.add(f"bill {bill.number}")
    return tuple(note_words(note) for note in report.notes if of_money(note) and note.subject.name in own)


def _cells(
    elements: Sequence[ElementProgress], trades: Trades, late: frozenset[str], plan: PlannedElements
) -> tuple[Cell | None, ...]:
    """Return a cell a column, weighted by exposed design area as storeys are."""
    own: dict[str, list[ElementProgress]] = {name: [] for name in trades.names}
    for element in elements:
        for name in trades.by_element[element.global_id]:
            own[name].append(element)
    return tuple(_cell(inside, late, plan) if inside else None for inside in own.values())


def _cell(inside: Sequence[ElementProgress], late: frozenset[str], plan: PlannedElements) -> Cell:
    wanted = plan.wanted({element.global_id: element.design_area_m2 for element in inside})
    return Cell(
        completion=weighted(inside, [element.design_area_m2 for element in inside], ProgressOptions()),
        elements=len(inside),
        late=sum(element.global_id in late for element in inside),
        planned=wanted.by(plan.report.visit_date) / wanted.total if wanted.total > 0.0 else None,
    )
