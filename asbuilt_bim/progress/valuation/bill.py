"""The bill of a visit: each line with what was certified before, now, in all, and what remains. Pure arithmetic."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from asbuilt_bim.progress.completion.earned_value import certain_share, unmeasured_part
from asbuilt_bim.progress.money import cents, certified_quantity, total
from asbuilt_bim.progress.report import NOTHING_SEEN, CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.held import held_per_design
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, Override, Paid, RateChange, Variation
from asbuilt_bim.progress.valuation.known_again import bill_places, paid_lines
from asbuilt_bim.progress.valuation.observed import Observed, observed_elements

_LEAST_PART = 1e-9
BEFORE = " (before)"
"""What the key of a line that is gone ends with, where other work has its key now."""
LOST = "(not in the design)"
"""What stands in the place of a GlobalId where a row stands for what the design lost since it was signed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BillRow:
    """An element's part of a line, or (`element` None) the part of the line that isn't measured here."""

    element: ElementProgress | None
    quantity: float  # of the contract, in the line's unit
    measured: float  # the certain share (0..1) by photos alone
    observed: Observed | None
    override: Override | None
    share: float  # that counts
    others: int = 0  # elements that this row stands for, where it stands for what isn't measured
    lost: bool = False  # it stands for what a signed design had, and this one has not

    @property
    def global_id(self) -> str:
        """Return the element's GlobalId, "" for what isn't measured, `LOST` for what the design lost."""
        if self.element:
            return self.element.global_id
        return LOST if self.lost else ""

    @property
    def certified(self) -> float:
        """Return what of the quantity counts, not rounded."""
        return self.quantity * self.share

    @property
    def rests_on_a_person(self) -> bool:
        """Say whether what a person saw counts here, and is another share than photos make certain."""
        return self.override is None and self.observed is not None and self.share != self.measured


@dataclass(frozen=True, slots=True, kw_only=True)
class BillLine:
    """A line of the bill; amounts in cents."""

    number: int  # from 1, its own in the workbook
    bill: int
    line: CostProgress
    rows: tuple[BillRow, ...]
    rate: float
    rate_change: RateChange | None
    contract: float
    quantity: float  # certified in all
    amount: float
    paid: Paid | None
    gone: bool = False  # it was certified before, and isn't in the costs any more
    best: float | None = None
    replaced_by: str = ""  # of a line that is gone: what its number stands for now
    left: Mapping[str, bool] = field(default_factory=dict)  # by GlobalId of what it covered: is it still in the design

    @property
    def elements(self) -> dict[str, ElementProgress]:
        """Return the walls and columns that it covers, by GlobalId."""
        return {row.element.global_id: row.element for row in self.rows if row.element}

    @property
    def previous_quantity(self) -> float:
        """Return what the last certificate held."""
        return self.paid.quantity if self.paid else 0.0

    @property
    def previous(self) -> float:
        """Return what the last certificate held, in cents."""
        return self.paid.amount if self.paid else 0.0

    @property
    def per_design(self) -> float:
        """Return how much of the contract stands for one of the design's, which is the most from now on; 0: unknown."""
        return 0.0 if self.gone else held_per_design(self.line)

    @property
    def period(self) -> float:
        """Return what this valuation adds, in cents; less than nothing where the certified amount falls."""
        return cents(self.amount - self.previous)

    @property
    def falls(self) -> bool:
        """Say whether less is certified than before; of a line that takes money off, whether more is taken."""
        return self.period < 0.0 and not (self.line.takes_off and not self.gone)

    @property
    def rounding_row(self) -> int:
        """Return which of the rows takes what the line's rounding adds: the first of those that bring the most."""
        return max(range(len(self.rows)), key=lambda i: abs(self.rows[i].certified), default=0)

    def amounts(self) -> tuple[tuple[float, float], ...]:
        """Return each row's amount in cents, by itself and with the line's rounding; the latter add up to `amount`."""
        own = [cents(row.certified * self.rate) for row in self.rows]
        left, taker = self.amount - total(own), self.rounding_row
        return tuple((one, cents(one + left) if i == taker else one) for i, one in enumerate(own))

    @property
    def best_amount(self) -> float | None:
        """Return what the best estimate is worth."""
        return None if self.best is None else cents(self.best * self.rate)


@dataclass(frozen=True, slots=True, kw_only=True)
class VariationLine:
    """A variation with what was certified of it before and now, in cents."""

    variation: Variation
    amount: float  # of all of it
    certified: float
    previous: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sums:
    """One column of a bill's summary, in cents."""

    work: float
    variations: float
    retention: float
    tax: float

    @property
    def gross(self) -> float:
        """Return work and variations."""
        return cents(self.work + self.variations)

    @property
    def net(self) -> float:
        """Return what is due before tax."""
        return cents(self.gross - self.retention)

    @property
    def payable(self) -> float:
        """Return what is due with tax."""
        return cents(self.net + self.tax)

    def minus(self, other: "Sums") -> "Sums":
        """Return the difference of two columns."""
        return Sums(
            work=cents(self.work - other.work),
            variations=cents(self.variations - other.variations),
            retention=cents(self.retention - other.retention),
            tax=cents(self.tax - other.tax),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bill:
    """The lines that may be added up, of one cost schedule and currency, with their variations and sums."""

    number: int  # from 1
    schedule: str
    currency: str
    lines: tuple[BillLine, ...]
    variations: tuple[VariationLine, ...]
    previous: Sums
    period: Sums
    cumulative: Sums
    best: float | None  # None where less than half of a line was seen: a sum without it is no estimate of all
    complete_from: float  # of the project: from this share on a piece may be whole

    @property
    def contract(self) -> float:
        """Return what all lines are worth when they are done."""
        return total(line.contract for line in self.lines)

    @property
    def without_best(self) -> int:
        """Return how many lines have no best estimate: less than half of them was seen."""
        return sum(line.best is None for line in self.lines if not line.gone)


def bills(report: ProgressReport) -> tuple[Bill, ...]:
    """Return a report's bills, in the order of schedule and currency; none where it has no cost lines."""
    inputs = report.valuation or NO_INPUTS
    elements = {element.global_id: element for element in report.elements}
    seen = observed_elements(report.observations, elements, report.visit_date)
    groups = sorted({(line.schedule, line.currency) for line in report.cost_lines})
    if not groups and inputs.paid:
        groups = [("", next((one.currency for one in inputs.before), ""))]
    paid = paid_lines(report.cost_lines, inputs.paid)
    places, known = bill_places(groups, report.cost_lines, inputs, paid), {one.line for one in inputs.paid}
    made: list[Bill] = []
    number = 0
    for place, (schedule, currency) in enumerate(groups, 1):
        own = [line for line in report.cost_lines if (line.schedule, line.currency) == (schedule, currency)]
        lines: list[BillLine] = []
        for line in own:
            number += 1
            was = paid.get(line.global_id)
            keys = ({line.global_id} - known) | ({was.line} if was else set())  # not those of other work
            lines.append(_bill_line(number, place, line, elements, seen, report, was, keys))
        for lost in _gone(inputs.paid, paid, place, places):
            number += 1
            lines.append(_gone_line(number, (place, schedule, currency), lost, own, report.cost_lines))
        made.append(_bill(place, places, schedule, currency, lines, report))
    return tuple(made)


def _gone(paid: Sequence[Paid], found: Mapping[str, Paid], place: int, places: Callable[[int], int]) -> list[Paid]:
    """Return what was certified of lines that aren't there any more, in the bill that they stood in."""
    kept = {one.line for one in found.values()}
    lost = [one for one in paid if one.line not in kept and (one.amount or one.quantity)]
    return [one for one in lost if places(one.bill) == place]


def _gone_line(
    number: int, bill: tuple[int, str, str], paid: Paid, own: Sequence[CostProgress], every: Sequence[CostProgress]
) -> BillLine:
    """Return the line of what was certified and isn't in the costs any more: it is worth nothing now.

    `bill` is its number, schedule and currency, `own` are its lines: one of the same item is other work. Where one of
    `every` bill's has its key, it gets one of its own.
    """
    place, schedule, currency = bill
    same = (one for one in own if one.identification and one.identification == paid.identification)
    line = CostProgress(
        global_id=f"{paid.line}{BEFORE}" if any(one.global_id == paid.line for one in every) else paid.line,
        name=paid.text,
        identification=paid.identification,
        elements=(),
        unit=paid.unit,
        measure="other",
        planned_quantity=0.0,
        rate=paid.rate,
        currency=currency,
        completion=NOTHING_SEEN,
        as_built_best=None,
        as_built_lower=0.0,
        earned_best=None,
        earned_lower=0.0,
        schedule=schedule,
    )
    return BillLine(
        number=number,
        bill=place,
        line=line,
        rows=(),
        rate=paid.rate,
        rate_change=None,
        contract=0.0,
        quantity=0.0,
        amount=0.0,
        paid=paid,
        gone=True,
        replaced_by=next((f"{one.name} ({one.unit})".strip() for one in same), ""),
    )


def _bill_line(
    number: int,
    place: int,
    line: CostProgress,
    elements: Mapping[str, ElementProgress],
    seen: Mapping[str, Observed],
    report: ProgressReport,
    paid: Paid | None,
    keys: set[str],
) -> BillLine:
    inputs = report.valuation or NO_INPUTS
    change = next((one for one in inputs.rates if one.line in keys), None)
    rate = change.rate if change else line.rate
    by_element = {one.element: one for one in inputs.overrides if one.line in keys}
    pieces, off = line.measure == "count", line.planned_quantity * rate < 0.0
    rows = [
        _row(line, elements[key], part, seen.get(key), by_element.get(key), off, inputs.count_observations)
        for key, part in line.parts.items()
        if key in elements
    ]
    rows.sort(key=lambda row: (row.element.ifc_class, row.element.name, row.global_id) if row.element else ("",))
    left = unmeasured_part(line.parts)
    for part, lost in ((left - line.lost, False), (line.lost, True)):
        if part > _LEAST_PART:
            rows.append(_unmeasured(line, part, by_element.get(LOST if lost else ""), off, lost=lost))
    sure = math.fsum(row.certified for row in rows)
    quantity = certified_quantity(sure, line.planned_quantity, pieces=pieces, up=off)
    return BillLine(
        number=number,
        bill=place,
        line=line,
        rows=tuple(rows),
        rate=rate,
        rate_change=change,
        contract=cents(line.planned_quantity * rate),
        quantity=quantity,
        amount=cents(quantity * rate),
        paid=paid,
        best=line.best_quantity_shown,
        left={key: key in elements for key in paid.elements if key not in line.parts} if paid else {},
    )


def _unmeasured(line: CostProgress, part: float, override: Override | None, off: bool, *, lost: bool) -> BillRow:
    """Return the row of a part of a line that no photo can show: it counts as not built, or as all taken off."""
    pieces = line.measure == "count"
    return BillRow(
        element=None,
        quantity=line.planned_quantity * part,
        measured=float(off),
        observed=None,
        override=override,
        share=whole_share(override.share, pieces=pieces, takes_off=off) if override else float(off),
        others=0 if lost else line.others,
        lost=lost,
    )


def _row(
    line: CostProgress,
    element: ElementProgress,
    part: float,
    seen: Observed | None,
    override: Override | None,
    off: bool,
    count_observations: bool,
) -> BillRow:
    pieces = line.measure == "count"
    measured = certain_share(element, pieces=pieces, takes_off=off)
    share = measured
    if override:
        share = whole_share(override.share, pieces=pieces, takes_off=off)
    elif seen and count_observations:
        share = whole_share(seen.share, pieces=pieces, takes_off=off)
    return BillRow(
        element=element,
        quantity=line.planned_quantity * part,
        measured=measured,
        observed=seen,
        override=override,
        share=share,
    )


def whole_share(share: float, *, pieces: bool, takes_off: bool) -> float:
    """Return a person's share; of pieces all or nothing, and begun ones count only where they are taken off."""
    share = min(max(share, 0.0), 1.0)
    if not pieces:
        return share
    return float(math.ceil(share) if takes_off else math.floor(share))


def _bill(
    place: int,
    places: Callable[[int], int],
    schedule: str,
    currency: str,
    lines: Sequence[BillLine],
    report: ProgressReport,
) -> Bill:
    inputs = report.valuation or NO_INPUTS
    variations = tuple(
        VariationLine(
            variation=one,
            amount=cents(one.quantity * one.rate),
            certified=cents(cents(one.quantity * one.rate) * one.share),
            previous=inputs.paid_variations.get(one.number, 0.0),
        )
        for one in inputs.variations
        if places(one.bill) == place
    )
    before = [one for one in inputs.before if places(one.bill) == place]
    previous = Sums(
        work=total(line.previous for line in lines),
        variations=total(one.previous for one in variations),
        retention=total(one.retention for one in before),
        tax=total(one.tax for one in before),
    )
    work, more = total(line.amount for line in lines), total(one.certified for one in variations)
    retention = cents(cents(work + more) * inputs.terms.retention)
    net_now = cents(cents(work + more - retention) - previous.net)
    tax = cents(previous.tax + cents(net_now * inputs.terms.tax))
    cumulative = Sums(work=work, variations=more, retention=retention, tax=tax)
    best = [line.best_amount for line in lines if line.best_amount is not None]
    return Bill(
        number=place, schedule=schedule, currency=currency, lines=tuple(lines), variations=variations,
        previous=previous, period=cumulative.minus(previous), cumulative=cumulative,
        best=total(best) if best and len(best) == sum(not line.gone for line in lines) else None,
        complete_from=report.complete_from,
    )  # fmt: skip
