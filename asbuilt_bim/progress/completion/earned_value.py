"""Money: the as-built quantity of each cost line in its own unit, and what it has earned."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from asbuilt_bim.bim.model import BimElement, CostLine
from asbuilt_bim.progress.completion.rollup import weighted, with_unmeasured
from asbuilt_bim.progress.money import cents, certified_quantity
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import NOTHING_SEEN, SHARE_DECIMALS, Completion, CostProgress, ElementProgress


def cost_progress(
    line: CostLine,
    design: Mapping[str, BimElement],
    elements: Mapping[str, ElementProgress],
    options: ProgressOptions,
) -> CostProgress:
    """Return a cost line's progress: completion x planned quantity, in the line's OWN unit, best and lower bound.

    The lower bound is the certificate's: what wasn't seen is not paid. What else the line pays for is never seen.
    """
    known = [key for key in line.elements if key in elements]
    weights = [_weight(line, design[key]) for key in known]
    others = line.others + len(line.elements) - len(known)
    measured = _measured_share(line, weights, others)
    seen = weighted([elements[key] for key in known], weights, options) if known else NOTHING_SEEN
    total = sum(weights)
    parts = {key: measured * weight / total for key, weight in zip(known, weights, strict=True)} if total > 0.0 else {}
    completion = with_unmeasured(seen, measured) if known else NOTHING_SEEN
    made = earned(line, completion, parts, {key: elements[key] for key in known})
    if line.unit_scale <= 0.0:
        return made
    designs = {key: weight / line.unit_scale for key, weight in zip(known, weights, strict=True)}
    return replace(made, design_quantity=total / line.unit_scale, designs=designs)


def earned(
    line: CostLine | CostProgress,
    completion: Completion,
    parts: Mapping[str, float],
    elements: Mapping[str, ElementProgress],
) -> CostProgress:
    """Return what a completion earns of a cost line, in cents; from the shares as the result holds them.

    A sheet that calculates with what it shows then comes to the same cent. A line may take money off. Then its certain
    value counts all that may be built, so that the sum of certain values is no more than what has been earned.
    """
    pieces, takes_off = line.measure == "count", line.planned_quantity * line.rate < 0.0
    shares = {key: certain_share(elements[key], pieces=pieces, takes_off=takes_off) for key in parts}
    lower = certain_quantity(line.planned_quantity, parts, shares, pieces=pieces, takes_off=takes_off)
    best = None
    if completion.best is not None:
        share = round(completion.best, SHARE_DECIMALS)
        best = certified_quantity(share * line.planned_quantity, line.planned_quantity, pieces=pieces)
        best = lower if pieces and abs(best) < abs(lower) and not takes_off else best
    return CostProgress(
        global_id=line.global_id,
        name=line.name,
        identification=line.identification,
        elements=line.elements,
        others=line.others,
        schedule=line.schedule,
        unit=line.unit,
        measure=line.measure,
        planned_quantity=line.planned_quantity,
        rate=line.rate,
        currency=line.currency,
        completion=completion,
        as_built_best=best,
        as_built_lower=lower,
        earned_best=None if best is None else cents(best * line.rate),
        earned_lower=cents(lower * line.rate),
        parts=dict(parts),
    )


def certain_share(element: ElementProgress, *, pieces: bool, takes_off: bool) -> float:
    """Return the share (0..1) of an element that a certificate counts: the lower bound; the upper of what is taken off.

    Of what is counted in pieces an element counts whole or not at all: whole where it was seen complete, and not only
    as far as it was seen.
    """
    if not pieces:
        return round(element.completion.upper if takes_off else element.completion.lower, SHARE_DECIMALS)
    if takes_off:
        return 1.0 if element.completion.upper > 0.0 else 0.0
    return 1.0 if element.shown_state == "complete" else 0.0


def certain_quantity(
    planned: float, parts: Mapping[str, float], shares: Mapping[str, float], *, pieces: bool, takes_off: bool
) -> float:
    """Return the certain quantity of a line from its elements' parts of it and their certain shares.

    What isn't measured of it counts as not built, and all of it where the line takes money off.
    """
    rows = [planned * part * shares[key] for key, part in parts.items()]
    rows.append(planned * unmeasured_part(parts) if takes_off else 0.0)
    return certified_quantity(math.fsum(rows), planned, pieces=pieces, up=takes_off)


def unmeasured_part(parts: Mapping[str, float]) -> float:
    """Return the part (0..1) of a line that no measured element stands for; rounding leaves none."""
    left = 1.0 - math.fsum(parts.values())
    return left if left > 1e-9 else 0.0


def _measured_share(line: CostLine, weights: Sequence[float], others: int) -> float:
    """Return what share (0..1) of a line its measured elements are: by their number, by their quantity, the lesser.

    One slab may be more concrete than twenty columns, and a quantity may be planned with waste: neither is certain.
    Of a unit that no body has (t, a lump sum), nobody can say how much of it the slab is.
    """
    if not others:
        return 1.0
    if line.measure == "other":
        return 0.0
    by_number = len(weights) / (len(weights) + others)
    planned = line.planned_quantity * line.unit_scale
    if line.measure == "count" or planned <= 0.0:
        return by_number
    return min(by_number, sum(weights) / planned)


def _weight(line: CostLine, element: BimElement) -> float:
    if line.measure in ("volume", "other"):  # tonnes of steel go with the concrete
        return element.volume_m3
    if line.measure == "area":
        return element.exposed_area_m2
    if line.measure == "length":
        return element.height_m if element.kind == "column" else element.length_m
    return 1.0
