"""What of a bill's certified work rests on photos, and what on persons: seen, overridden, or at a changed rate."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from asbuilt_bim.progress.money import cents, certified_quantity, total
from asbuilt_bim.progress.valuation.bill import Bill, BillLine, BillRow


@dataclass(frozen=True, slots=True, kw_only=True)
class ByPersons:
    """A bill's certified work in cents: the four add up to it. `seen_by`: by person, whose word counts of what."""

    photos: float
    seen: float
    overridden: float
    rates: float
    seen_by: dict[str, tuple[str, ...]]

    @property
    def is_theirs(self) -> bool:
        """Say whether anything rests on persons."""
        return bool(self.seen_by or self.overridden or self.rates)


def by_persons(bill: Bill) -> ByPersons:
    """Return what of a bill's work persons have changed, each against what would count without it."""
    known = [line for line in bill.lines if not line.gone]
    photos = total(line.line.earned_lower for line in known)
    seen = total(_amount(line, lambda row: row.measured if row.override else row.share) for line in known)
    shares = total(_amount(line, lambda row: row.share) for line in known)
    named: dict[str, dict[str, None]] = {}
    for row in (row for line in known for row in line.rows):
        if row.rests_on_a_person and row.observed and row.element:
            named.setdefault(row.observed.observation.by, {})[row.element.name or row.global_id] = None
    return ByPersons(
        photos=photos,
        seen=cents(seen - photos),
        overridden=cents(shares - seen),
        rates=cents(bill.cumulative.work - shares),
        seen_by={who: tuple(elements) for who, elements in named.items()},
    )


def _amount(line: BillLine, share: Callable[[BillRow], float]) -> float:
    """Return what a line comes to in cents at its contract rate, with other shares of its elements."""
    sure = math.fsum(replace(row, share=share(row)).certified for row in line.rows)
    given = line.line
    quantity = certified_quantity(sure, given.planned_quantity, pieces=given.measure == "count", up=given.takes_off)
    return cents(quantity * given.rate)
