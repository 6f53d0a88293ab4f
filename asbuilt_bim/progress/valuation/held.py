"""Holds each line's contract quantity to what the design had of it when a valuation was signed.

A contract quantity is shared out among the walls and columns of a line. Where the design loses some of them, or they
become smaller, the rest would get their part, and be paid more, though nothing was built. So one unit of the design
never stands for more of the contract than it did at the last signature. What is left over is the line's lost part.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from asbuilt_bim.progress.completion.earned_value import earned
from asbuilt_bim.progress.completion.rollup import with_unmeasured
from asbuilt_bim.progress.report import CostProgress, ElementProgress
from asbuilt_bim.progress.valuation.inputs import Paid

ROUNDING = 1e-6
"""A share of the contract quantity that sums of shares may differ by."""


def held_line(line: CostProgress, paid: Paid | None, elements: Mapping[str, ElementProgress]) -> CostProgress:
    """Return a line with no more of the contract on its design than when it was certified; the rest is lost."""
    share, most = math.fsum(line.parts.values()), most_per_design(line, paid)
    now = per_design(line)
    if most <= 0.0 or now <= most * (1.0 + ROUNDING):
        return line
    kept = most / now
    parts = {key: part * kept for key, part in line.parts.items()}
    known = {key: elements[key] for key in parts if key in elements}
    made = earned(line, with_unmeasured(line.completion, kept), parts, known)
    return replace(made, design_quantity=line.design_quantity, lost=line.lost + share * (1.0 - kept))


def per_design(line: CostProgress) -> float:
    """Return how much of the contract quantity stands for one of the design's; 0 where the line has none."""
    if line.design_quantity <= 0.0:
        return 0.0
    return abs(line.planned_quantity) * math.fsum(line.parts.values()) / line.design_quantity


def most_per_design(line: CostProgress, paid: Paid | None) -> float:
    """Return how much of it may stand for one of the design's: what was signed, and what the contract rose by since.

    A workbook of before this was kept has the elements' quantities alone: then those that are still there tell it. 0
    where nobody knows.
    """
    if paid is None:
        return 0.0
    risen = max(1.0, abs(line.planned_quantity) / abs(paid.contract)) if paid.contract else 1.0
    if paid.per_design > 0.0:
        return paid.per_design * risen
    both = paid.quantities.keys() & line.parts.keys()
    then = math.fsum(abs(paid.quantities[key]) for key in both)
    now = abs(line.planned_quantity) * math.fsum(line.parts[key] for key in both)
    return per_design(line) * risen * then / now if now > 0.0 else 0.0
