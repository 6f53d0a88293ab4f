"""Holds each line's contract quantity to what the design had of it when a valuation was signed.

A contract quantity is shared out among the walls and columns of a line. Where the design loses some of them, or they
become smaller, the rest would get their part, and be paid more, though nothing was built. So one unit of the design
never stands for more of the contract than it did at the last signature. What is left over is the line's lost part.
Where the design gains some, or they become larger, they would take a part of the rest, and what was certified would
fall, though nothing was torn down. So what was there keeps the part that it was signed with. What is new gets what is
left of the contract; what it needs beyond that is a variation, or a larger contract.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal

from asbuilt_bim.progress.completion.earned_value import earned, unmeasured_part
from asbuilt_bim.progress.completion.rollup import weighted, with_unmeasured
from asbuilt_bim.progress.money import quantity_decimals
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import CostProgress, ElementProgress
from asbuilt_bim.progress.valuation.inputs import Paid

ROUNDING = 1e-6
"""A share of the contract quantity that sums of shares may differ by."""


def held_line(line: CostProgress, paid: Paid | None, elements: Mapping[str, ElementProgress]) -> CostProgress:
    """Return a line with as much of the contract on its design as when it was certified; what nobody has is lost."""
    wanted, room = _wanted(line, paid)
    parts = {key: (kept + room * more) / abs(line.planned_quantity) for key, (kept, more) in wanted.items()}
    if not parts or (not line.lost and all(abs(part - line.parts[key]) < ROUNDING for key, part in parts.items())):
        return line
    known = {key: elements[key] for key in parts if key in elements}
    seen = weighted(list(known.values()), [parts[key] for key in known], ProgressOptions())
    on_design = 1.0 - unmeasured_part(parts)
    completion = with_unmeasured(seen, on_design)
    if seen.best is not None and not line.others:  # of what the design lost nothing is wanted any more
        completion = replace(completion, best=seen.best * on_design)
    made = replace(earned(line, completion, parts, known), designs=line.designs, design_quantity=line.design_quantity)
    lost = math.fsum(line.parts.values()) + line.lost - math.fsum(parts.values())
    return replace(made, lost=lost if lost > ROUNDING else 0.0)


def without_contract(line: CostProgress, paid: Paid | None) -> dict[str, float]:
    """Return by GlobalId what the design gained since it was signed, and the contract has no room for, in its unit."""
    wanted, room = _wanted(line, paid)
    return {key: more * (1.0 - room) for key, (_, more) in wanted.items() if more * (1.0 - room) > _step(line)}


def _wanted(line: CostProgress, paid: Paid | None) -> tuple[dict[str, tuple[float, float]], float]:
    """Return by GlobalId what of the contract was an element's and what is new, and for what share of that is room.

    One unit of the design stands for what the contract has for it now, but for no less and no more than was signed,
    or than that as the contract fell or rose since.
    """
    design, contract = designs(line), abs(line.planned_quantity)
    had = {key: abs(one) for key, one in paid.quantities.items()} if paid else {}
    if contract <= 0.0 or math.fsum(design.values()) <= 0.0:
        return {}, 1.0
    there = contract * (math.fsum(line.parts.values()) + line.lost)
    each, signed = there / math.fsum(design.values()), signed_per_design(line, paid)
    changed = contract / abs(paid.contract) if paid and paid.contract else 1.0
    if signed > 0.0:
        each = min(max(each, signed * min(changed, 1.0)), signed * max(changed, 1.0))
    found: dict[str, tuple[float, float]] = {}
    for key, one in design.items():
        more = each * one - min(changed, 1.0) * had.get(key, 0.0)
        more = more if more > _step(line) / 2.0 else 0.0  # what was signed was read rounded
        found[key] = (each * one - more, more)
    kept, new = (math.fsum(column) for column in zip(*found.values(), strict=True))
    if kept > contract:  # what was rounded adds up to more
        found = {key: (one * contract / kept, more) for key, (one, more) in found.items()}
    return found, min(max((there - kept) / new, 0.0), 1.0) if new > 0.0 else 1.0


def _step(line: CostProgress) -> float:
    return float(Decimal(1).scaleb(-quantity_decimals(line.planned_quantity)))


def designs(line: CostProgress) -> Mapping[str, float]:
    """Return by GlobalId what the design has of each element of a line; older results tell it by their parts alone."""
    if line.designs:
        return line.designs
    shares = math.fsum(line.parts.values())
    return {key: line.design_quantity * part / shares for key, part in line.parts.items()} if shares > 0.0 else {}


def held_per_design(line: CostProgress) -> float:
    """Return the most of the contract quantity that stands for one of the design's as the line is held; 0 for none."""
    contract, design = abs(line.planned_quantity), designs(line)
    return max((contract * line.parts.get(key, 0.0) / one for key, one in design.items() if one > 0.0), default=0.0)


def signed_per_design(line: CostProgress, paid: Paid | None) -> float:
    """Return how much of it stood for one of the design's when it was signed; 0 where nobody knows.

    A workbook of before this was kept has the elements' quantities alone: then those that are still there tell it.
    """
    if paid is None:
        return 0.0
    if paid.per_design > 0.0:
        return paid.per_design
    both = paid.quantities.keys() & line.parts.keys()
    then = math.fsum(abs(paid.quantities[key]) for key in both)
    now = math.fsum(designs(line).get(key, 0.0) for key in both)
    return then / now if now > 0.0 else 0.0
