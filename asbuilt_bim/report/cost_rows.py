"""Cost lines by schedule and currency with their sums, by photos and as certified; others only write them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from asbuilt_bim.progress.money import cents, certified_quantity, total
from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import BillLine, bills
from asbuilt_bim.report.wording.values import plain

NO_CURRENCY = "(no currency)"
CENT = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class CostGroup:
    """Lines that may be added up: of one schedule and one currency."""

    name: str
    currency: str
    lines: tuple[CostProgress, ...]
    planned: float
    earned_best: float | None  # None where too little was seen of a line
    earned_lower: float
    certified: Mapping[str, float]  # by line's key; empty where persons changed nothing: then it is `earned_lower`

    @property
    def unknown(self) -> int:
        """Return of how many lines too little was seen for a best estimate."""
        return sum(line.earned_best_shown is None for line in self.lines)

    @property
    def certified_total(self) -> float:
        """Return what is certified of all lines, in cents."""
        return total(self.certified.values())


def cost_groups(report: ProgressReport) -> tuple[CostGroup, ...]:
    """Return the groups in order of schedule and currency; a schedule is named where there are several."""
    several = len({line.schedule for line in report.cost_lines}) > 1
    certified = {one.line.global_id: one.amount for bill in bills(report) for one in bill.lines}
    changed = any(certified[line.global_id] != line.earned_lower for line in report.cost_lines)
    groups = []
    for schedule, currency in sorted({(line.schedule, line.currency) for line in report.cost_lines}):
        lines = [line for line in report.cost_lines if (line.schedule, line.currency) == (schedule, currency)]
        known = [line.earned_best_shown for line in lines if line.earned_best_shown is not None]
        of_schedule = f", {plain(schedule) or 'lines of no schedule'}" if several else ""
        groups.append(
            CostGroup(
                name=f"{plain(currency) or NO_CURRENCY}{of_schedule}",
                currency=currency,
                lines=tuple(lines),
                planned=total(line.planned_value for line in lines),
                earned_best=total(known) if len(known) == len(lines) else None,
                earned_lower=total(line.earned_lower for line in lines),
                certified={line.global_id: certified[line.global_id] for line in lines} if changed else {},
            )
        )
    return tuple(groups)


def worths(line: BillLine) -> list[float]:
    """Return what each row of a line is worth when it is finished, to the cent; they add up to the line's contract.

    The row that is worth the most takes what rounding leaves. Where a line is gone, rounding isn't what is left.
    """
    own = [cents(row.quantity * line.rate) for row in line.rows]
    left = line.contract - total(own)
    if own and abs(left) <= CENT * len(own):
        most = max(range(len(own)), key=lambda index: abs(own[index]))
        own[most] = cents(own[most] + left)
    return own


def possible_share(element: ElementProgress, complete_from: float, *, pieces: bool, takes_off: bool) -> float:
    """Return the share (0..1) of an element that may stand at most; of what is taken off, at least.

    A piece may be whole where as much of it as the project asks for (`complete_from`) may stand.
    """
    done = element.completion
    if not pieces:
        return done.lower if takes_off else done.upper
    whole = element.state == "complete"
    if takes_off:
        return 1.0 if whole else 0.0
    return 1.0 if whole or done.upper >= complete_from else 0.0


def possible_of(line: BillLine, complete_from: float) -> float:
    """Return what may be earned of a line at most by photos alone, to the cent."""
    return cents(possible_quantity(line, complete_from) * line.rate)


def possible_quantity(line: BillLine, complete_from: float) -> float:
    """Return how much of a line, in its unit, may stand at most by photos alone; what isn't measured may all stand."""
    off, pieces = line.line.takes_off, line.line.measure == "count"
    shares = (
        possible_share(row.element, complete_from, pieces=pieces, takes_off=off) if row.element else float(not off)
        for row in line.rows
    )
    most = math.fsum(row.quantity * share for row, share in zip(line.rows, shares, strict=True))
    return certified_quantity(most, line.line.planned_quantity, pieces=pieces)
