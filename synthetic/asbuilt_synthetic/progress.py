"""Says how much of each element stands at each visit, and which absent ones have formwork or a rebar cage."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, timedelta

import numpy as np

from asbuilt_synthetic.building import Building, Element

FIRST_DAY = date(2026, 3, 2)
DAYS_BETWEEN_VISITS = 14


PLY_M = 0.021
PANEL_M = (0.04, 0.10)
"""How thick formwork stands before the faces: bare sheets, and framed or beam panels of a shuttered site."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """The formwork of an absent element: "formwork_ply" or "formwork_steel", this thick before its faces."""

    material: str
    panel_m: float = PLY_M


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """The state of a site at one visit."""

    visit: int
    day: date
    fraction: dict[str, float]  # GlobalId -> poured share of the height
    formwork: dict[str, Form]  # GlobalId -> what stands round an absent element
    cages: frozenset[str]  # GlobalIds of absent elements whose full rebar cage stands

    def stands(self, element: Element) -> bool:
        """Tell whether anything of the element has been poured."""
        return self.fraction[element.global_id] > 0


def progress(building: Building, visit: int, *, shuttered: bool = False) -> Progress:
    """Work out the state at a visit; what stands at one visit stands at the next.

    On a shuttered site formwork of thick panels stands round every absent element that has its slab.
    """
    fraction: dict[str, float] = {}
    for group in _groups(building):
        fraction.update(_group_fractions(building.seed, group, visit))
    for e in building.elements:
        if e.ifc_class == "IfcSlab":
            fraction[e.global_id] = 1.0 if e.storey == 0 or visit >= 1 + e.zone else 0.0
    absent = [e for e in building.vertical if fraction[e.global_id] == 0.0 and _has_slab_below(e, visit)]
    rng = np.random.default_rng([building.seed, 3, visit])
    formwork, cages = {}, set()
    for e in absent:
        draw = rng.random()
        if draw < 0.3 or shuttered:
            steel = rng.random() < 0.4 and e.shape != "round"
            panel_m = float(rng.uniform(*PANEL_M)) if shuttered else PLY_M
            formwork[e.global_id] = Form(material="formwork_steel" if steel else "formwork_ply", panel_m=panel_m)
        elif draw < 0.5:
            cages.add(e.global_id)
    return Progress(
        visit=visit,
        day=FIRST_DAY + timedelta(days=DAYS_BETWEEN_VISITS * visit),
        fraction=fraction,
        formwork=formwork,
        cages=frozenset(cages),
    )


def _groups(building: Building) -> list[list[Element]]:
    """Split columns and walls by storey, zone and class, so that every group gets its mix of states."""
    keys = sorted({(e.storey, e.zone, e.ifc_class) for e in building.vertical})
    return [[e for e in building.vertical if (e.storey, e.zone, e.ifc_class) == k] for k in keys]


def _has_slab_below(e: Element, visit: int) -> bool:
    return e.storey == 0 or visit >= 1 + e.zone


def _group_fractions(seed: int, group: list[Element], visit: int) -> dict[str, float]:
    """Pour a group in a random order: what is early is complete first; one in the middle is part poured."""
    first = group[0]
    rng = np.random.default_rng([seed, 2, first.storey, first.zone, int(first.ifc_class == "IfcWall")])
    order = rng.permutation(len(group))
    part_height = rng.uniform(0.25, 0.85, len(group))
    # the share of the group that is done at the visits since the group could start
    start = rng.uniform(0.45, 0.68) if first.zone == 0 else rng.uniform(0.1, 0.9)
    shares = np.array([start, 0.4 + 0.6 * start, 1.0])
    if first.storey == 0 and first.zone == 0:
        shares[1:] = 1.0  # the slab above it is poured by visit 1
    since = visit - (first.storey + first.storey * first.zone)
    if since < 0:
        return {e.global_id: 0.0 for e in group}
    done = int(float(shares[min(since, 2)]) * len(group) + 1e-9)
    out = {}
    for place, index in enumerate(order):
        if place < done:
            f = 1.0
        elif place == done:
            f = float(np.round(part_height[index], 3))
        else:
            f = 0.0
        out[group[index].global_id] = f
    return out
