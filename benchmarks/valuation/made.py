"""Reports of made-up visits, with the shares that are asked for: what a valuation needs, without a photo."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.progress.completion.earned_value import earned
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    ElementProgress,
    GroupProgress,
    ProgressReport,
    State,
)
from asbuilt_bim.progress.valuation.inputs import Observation, ValuationInputs
from asbuilt_bim.progress.valuation.notes import with_valuation

FIRST = date(2026, 3, 2)
UNITS = (("m3", "volume"), ("m2", "area"), ("m", "length"), ("pcs", "count"), ("t", "other"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What photos say of an element: certain, best (None: unknown) and possible share."""

    lower: float
    best: float | None
    upper: float

    @property
    def state(self) -> State:
        """Return the state that goes with it."""
        if self.best is None:
            return "unknown"
        return "complete" if self.best >= 0.97 else "not started" if self.best <= 0.02 else "part"


UNSEEN = Seen(lower=0.0, best=None, upper=1.0)


def some_seen(dice: random.Random) -> Seen:
    """Return what photos may say: nothing, all of it, none of it, or something between."""
    kind = dice.random()
    if kind < 0.25:
        return UNSEEN
    if kind < 0.5:
        return Seen(lower=round(dice.uniform(0.6, 1.0), 9), best=1.0, upper=1.0)
    if kind < 0.6:
        return Seen(lower=0.0, best=0.0, upper=round(dice.uniform(0.0, 0.4), 9))
    lower, best, upper = sorted(round(dice.random(), 9) for _ in range(3))
    return Seen(lower=lower, best=best, upper=upper)


def element(key: str, seen: Seen, day: date, kind: str = "wall") -> ElementProgress:
    """Make an element."""
    known = seen != UNSEEN
    return ElementProgress(
        global_id=key,
        ifc_class="IfcWall" if kind == "wall" else "IfcColumn",
        kind=kind,
        name=f"{kind.capitalize()} {key[-6:]}",
        storey="storey",
        state=seen.state,
        completion=Completion(
            best=seen.best, lower=seen.lower, upper=seen.upper, coverage=1.0 - (seen.upper - seen.lower)
        ),
        cells_built=10.0 * seen.lower,
        cells_open=10.0 * (1.0 - seen.upper),
        cells_unknown=10.0 * (seen.upper - seen.lower),
        cells_conflict=0.0,
        surface_coverage=1.0 - (seen.upper - seen.lower),
        design_area_m2=10.0,
        design_volume_m3=1.0,
        built_area_m2=10.0 * seen.lower,
        as_built_area_m2=None,
        as_built_sigma_m2=None,
        offset_m=None,
        offset_sigma_m=None,
        tilt_rad=None,
        stations=("A1",) if known else (),
        last_seen=day if known else None,
        notes=(),
        as_far_as_seen=seen.state == "complete" and seen.lower < ProgressOptions().nearly_all,
    )


def cost_line(key: str, unit: int, quantity: float, rate: float, elements: Sequence[str], others: int = 0) -> CostLine:
    """Make a cost line."""
    sign, measure = UNITS[unit]
    return CostLine(
        global_id=f"costs:{key}",
        name=f"Line {key}",
        identification=key,
        elements=tuple(elements),
        unit=sign,
        measure=measure,  # type: ignore[arg-type]
        planned_quantity=quantity,
        rate=rate,
        currency="EUR",
        schedule="boq.csv",
        others=others,
    )


def cost_progress(line: CostLine, elements: Mapping[str, ElementProgress]) -> CostProgress:
    """Return a line's progress; its elements have equal parts of it, and what isn't measured one, too."""
    known = [elements[key] for key in line.elements if key in elements]
    share = 1.0 / max(len(line.elements) + line.others, 1)
    parts = {one.global_id: share for one in known}
    lower = sum(share * one.completion.lower for one in known)
    left = 1.0 - share * len(known)
    upper = sum(share * one.completion.upper for one in known) + left
    bests = [one.completion.best for one in known if one.completion.best is not None]
    best = sum(bests) / len(bests) if bests and not line.others and len(known) == len(line.elements) else None
    if best is not None:
        best = min(max(best, lower), upper)
    coverage = sum(share * one.completion.coverage for one in known)
    completion = Completion(best=best, lower=min(lower, 1.0), upper=min(upper, 1.0), coverage=min(coverage, 1.0))
    return earned(line, completion, parts, elements)


def made_report(
    seen: Mapping[str, Seen],
    lines: Sequence[CostLine],
    day: date,
    inputs: ValuationInputs,
    observations: Sequence[Observation] = (),
) -> ProgressReport:
    """Make a visit's report with its valuation."""
    elements = {key: element(key, one, day) for key, one in seen.items()}
    nothing = Completion(best=None, lower=0.0, upper=1.0, coverage=0.5)
    whole = GroupProgress(
        key="", name="Whole", elements=tuple(elements), completion=nothing, complete=0, part=0, not_started=0,
        unknown=0, design_area_m2=1.0, as_built_area_m2=0.0, as_built_sigma_m2=0.0,
    )  # fmt: skip
    report = ProgressReport(
        project_name="Made",
        visit_date=day,
        earlier_visits=(),
        elements=tuple(elements.values()),
        storeys=(GroupProgress(
            key="storey", name="Level 1", elements=tuple(elements), completion=nothing, complete=0, part=0,
            not_started=0, unknown=0, design_area_m2=1.0, as_built_area_m2=0.0, as_built_sigma_m2=0.0,
        ),),
        whole=whole,
        tasks=(),
        cost_lines=tuple(cost_progress(line, elements) for line in lines),
        faces=(),
        stations=(),
        rejections=(),
        unmatched=(),
        unobserved=(),
        notes=(),
        observations=tuple(observations),
    )  # fmt: skip
    return with_valuation(report, inputs)
