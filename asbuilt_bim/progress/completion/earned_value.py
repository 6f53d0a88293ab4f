"""Money: the as-built quantity of each cost line in its own unit, and what it has earned."""

from collections.abc import Mapping, Sequence

from asbuilt_bim.bim.model import BimElement, CostLine
from asbuilt_bim.progress.completion.rollup import weighted, with_unmeasured
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import SHARE_DECIMALS, Completion, CostProgress, ElementProgress

_NOTHING = Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)


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
    seen = weighted([elements[key] for key in known], weights, options) if known else _NOTHING
    total = sum(weights)
    parts = {key: measured * weight / total for key, weight in zip(known, weights, strict=True)} if total > 0.0 else {}
    return earned(line, with_unmeasured(seen, measured), parts)


def earned(line: CostLine, completion: Completion, parts: Mapping[str, float]) -> CostProgress:
    """Return what a completion earns of a cost line, in cents; from the shares as the result holds them.

    A sheet that calculates with what it shows then comes to the same cent. A line may take money off. Then its certain
    value counts all that may be built, so that the sum of certain values is no more than what has been earned.
    """
    best = None if completion.best is None else round(completion.best, SHARE_DECIMALS)
    as_built = None if best is None else best * line.planned_quantity
    takes_off = line.planned_quantity * line.rate < 0.0
    certain = completion.upper if takes_off else completion.lower
    lower = round(certain, SHARE_DECIMALS) * line.planned_quantity
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
        as_built_best=as_built,
        as_built_lower=lower,
        earned_best=None if as_built is None else cents(as_built * line.rate),
        earned_lower=cents(lower * line.rate),
        parts=dict(parts),
    )


def _measured_share(line: CostLine, weights: Sequence[float], others: int) -> float:
    """Return what share (0..1) of a line its measured elements are: by their number, by their quantity, the lesser.

    One slab may be more concrete than twenty columns, and a quantity may be planned with waste: neither is certain.
    """
    if not others:
        return 1.0
    by_number = len(weights) / (len(weights) + others)
    planned = line.planned_quantity * line.unit_scale
    if line.measure == "count" or planned <= 0.0:
        return by_number
    return min(by_number, sum(weights) / planned)


def _weight(line: CostLine, element: BimElement) -> float:
    if line.measure == "volume":
        return element.volume_m3
    if line.measure == "area":
        return element.exposed_area_m2
    if line.measure == "length":
        return element.height_m if element.kind == "column" else element.length_m
    return 1.0
