"""Assembles one site at one visit from its seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asbuilt_synthetic.background import background
from asbuilt_synthetic.building import STOREYS, Building
from asbuilt_synthetic.clutter import Plan, clutter
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.meshes import Part, transform
from asbuilt_synthetic.model import Body, DesignFaceTruth, ElementTruth, FloatArray, Light, Scene
from asbuilt_synthetic.progress import Progress, progress
from asbuilt_synthetic.reinforcement import reinforcement
from asbuilt_synthetic.rig import rig_truth
from asbuilt_synthetic.solids import poured, side_area_m2, sides
from asbuilt_synthetic.stations import StationFinder
from asbuilt_synthetic.surface import cell_built, cells
from asbuilt_synthetic.tags import Tags, place_tags
from asbuilt_synthetic.tracer import Tracer

STATIONS = 5
PLACES_TRIED = 1200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """What stays the same through the visits of a seed, with the plans of what ground is taken."""

    building: Building
    tags: Tags
    ground: Plan
    upper: Plan


def site(seed: int) -> Site:
    """Design a site and fix its tags; the plans are fresh, for a visit to strew things on."""
    building = design(seed)
    ground, upper = Plan(building), Plan(building)
    tags = place_tags(building, ground, upper)
    return Site(building=building, tags=tags, ground=ground, upper=upper)


@lru_cache(maxsize=4)
def scene(
    seed: int, visit: int = 0, stations: int = STATIONS, tries: int = PLACES_TRIED, *, shuttered: bool = False
) -> Scene:
    """Build the site of a seed at a visit (0 the first, a fortnight between), with its stations.

    Raises:
        RuntimeError: when no stations that see tags and target can be found.
    """
    here = site(seed)
    building, state = here.building, progress(here.building, visit, shuttered=shuttered)
    rng = np.random.default_rng([seed, 9, visit])
    parts = [
        *_poured(building, state),
        *background(building),
        *reinforcement(building, state, rng),
        *here.tags.bodies(visit),
        *clutter(building, state, here.ground, rng),
    ]
    bodies = tuple(p.placed(building.world_from_local) for p in parts)
    origin = building.world_from_local[:3, 3].round(1)
    markers, rig = here.tags.markers(building), rig_truth(seed)
    there = {t.tag_id for t in here.tags.tags if t.since_visit <= visit}
    finder = StationFinder(
        building,
        state,
        rig,
        Tracer(origin, bodies),
        tuple(m for m in markers if m.tag_id in there),
        (here.ground, here.upper),
    )
    return Scene(
        seed=seed,
        visit=visit,
        day=state.day,
        origin_m=origin,
        bodies=bodies,
        decals=here.tags.decals(building, visit),
        faces=_faces(building),
        elements=_elements(building, state),
        markers=markers,
        rig=rig,
        stations=finder.find(stations, rng, tries),
        light=_light(rng, building),
        storeys=STOREYS,
    )


def first_face(building: Building) -> dict[str, int]:
    """Return the index into `Scene.faces` of each element's first face, by GlobalId."""
    out, n = {}, 0
    for e in building.vertical:
        out[e.global_id] = n
        n += len(sides(e))
    return out


def _poured(building: Building, state: Progress) -> list[Part]:
    first = first_face(building)
    return [
        poured(e, state.fraction[e.global_id] * e.height_m, first.get(e.global_id, -1), i * 7919 % 65521)
        for i, e in enumerate(building.elements)
        if state.stands(e)
    ]


def _faces(building: Building) -> tuple[DesignFaceTruth, ...]:
    out = []
    for e in building.vertical:
        m: FloatArray = building.world_from_local @ e.local_from_element
        for s in sides(e):
            at = np.zeros(3) if s.kind == "cylinder" else s.origin_m
            out.append(
                DesignFaceTruth(
                    element=e.global_id,
                    kind=s.kind,
                    origin_m=transform(m, at[None])[0],
                    normal=m[:3, :3] @ s.normal,
                    radius_m=s.radius_m,
                    design_area_m2=side_area_m2(e, s),
                    name=s.name,
                )
            )
    return tuple(out)


def _elements(building: Building, state: Progress) -> tuple[ElementTruth, ...]:
    return tuple(
        ElementTruth(
            global_id=e.global_id,
            ifc_class=e.ifc_class,
            name=e.name,
            storey=STOREYS[e.storey],
            built_height_fraction=state.fraction[e.global_id],
            cells=cells(e),
            cell_built=cell_built(e, state.fraction[e.global_id]),
        )
        for e in building.vertical
    )


def _light(rng: np.random.Generator, building: Building) -> Light:
    azimuth, height = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(28, 55))
    sun = building.world_from_local[:3, :3] @ np.array(
        [np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)]
    )
    strength = float(rng.choice([0.15, 0.5, 0.8, 1.0]))
    sky = (168, 190, 220) if strength > 0.4 else (196, 202, 210)
    return Light(towards_sun=sun, sun_strength=strength, sky_srgb=sky, exposure=float(rng.uniform(0.9, 1.1)))


def bodies_of(scene_: Scene, element: str) -> tuple[Body, ...]:
    """Return the bodies poured of an element."""
    return tuple(b for b in scene_.bodies if b.element == element)
