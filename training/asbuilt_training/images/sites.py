"""Building sites of the generator that the benchmarks use, at seeds kept for training."""

from __future__ import annotations

import numpy as np
from asbuilt_synthetic.background import background
from asbuilt_synthetic.building import Building
from asbuilt_synthetic.clutter import GROUND_Z_M, Plan, clutter
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.meshes import Part
from asbuilt_synthetic.progress import Progress, progress
from asbuilt_synthetic.reinforcement import reinforcement
from asbuilt_synthetic.solids import poured

from asbuilt_training.classes import BACKGROUND, COLUMN, FORMWORK, OTHER, SLAB, WALL
from asbuilt_training.images.surroundings import surroundings
from asbuilt_training.images.things import Place, Thing, numbered

_OF_CLASS = {"IfcWall": WALL, "IfcColumn": COLUMN, "IfcSlab": SLAB}
_BACKGROUND = ("Ground", "House", "Windows", "Window frames", "Eaves", "Trunk", "Crown", "Heap")


def site_place(seed: int, rng: np.random.Generator) -> Place:
    """Build one visit of a site in its local frame, its background kept or drawn afresh."""
    building = design(seed)
    state = progress(building, int(rng.integers(0, 3)))
    strewn = np.random.default_rng([seed, 43])
    loose = reinforcement(building, state, strewn) + clutter(building, state, Plan(building), strewn)
    things = _elements(building, state) + [Thing(part=p, kind=kind_of(p)) for p in loose]
    if rng.random() < 0.5:
        things += [Thing(part=p, kind=kind_of(p)) for p in background(building)]
    else:
        (x0, y0), (x1, y1) = Plan(building).inside
        centre = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        things += surroundings(centre, float(np.hypot(x1 - x0, y1 - y0) / 2 + 3), GROUND_Z_M, rng)
    return Place(source="site", things=numbered(things))


def kind_of(part: Part) -> int:
    """Tell the class of a loose or background part by its name."""
    if part.name.startswith(_BACKGROUND):
        return BACKGROUND
    return FORMWORK if part.name.startswith(("Form ", "Walings")) else OTHER


def _elements(building: Building, state: Progress) -> list[Thing]:
    out = []
    for number, e in enumerate(building.elements, 1):
        if state.stands(e):
            part = poured(e, state.fraction[e.global_id] * e.height_m, -1, number)
            out.append(Thing(part=part, kind=_OF_CLASS[e.ifc_class], instance=number))
    return out
