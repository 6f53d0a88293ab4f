"""Does a planned visit show what it promises, and can a person stand where it says?

python benchmarks/visit/plan.py --check --json figures.json     the sample and eleven generated buildings
python benchmarks/visit/plan.py --quick                         the sample and one

The truth is the generator's: its solids, its cameras, its ray caster, and points of every face 5 cm apart. Everything
that is due stands. A face keeps its promise where both photos show nine tenths of what is promised of it. Every place
that may be stood on is judged, not only the chosen ones; each slab has an opening cut into it.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.unit
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_synthetic.building import Building, Element
from asbuilt_synthetic.ifc_file import write_ifc
from asbuilt_synthetic.in_view import points_in_view
from asbuilt_synthetic.layout import design as building_of
from asbuilt_synthetic.model import CameraTruth, RigTruth, Station
from asbuilt_synthetic.rig import rig_truth
from asbuilt_synthetic.solids import poured
from asbuilt_synthetic.surface import Samples, samples
from asbuilt_synthetic.tracer import Tracer

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.ifc.apart import read_design, read_floors
from asbuilt_bim.progress.visits.places import EYE_M, standing_places
from asbuilt_bim.progress.visits.plan_visit import PlannedVisit, plan_visit
from asbuilt_bim.progress.visits.squares import SIDE_M
from benchmarks.table import Line, line, options, quantiles, report, told

SEEDS = (7, 20, 31, 201, 202, 203, 204, 205, 206, 207, 208, 209)
"""The sample's own first, then those that other benchmarks look at, then nine that nobody does."""
STEP_M = 0.05
KEPT = 0.9
"""Of what is promised of a face, in both photos."""
OPENING_M = (2.0, 1.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """What one building gave: faces promised, how much of each is seen, places, and those that are bad."""

    seed: int
    shares: tuple[float, ...]
    stations: int
    seen_m2: float
    wanted_m2: float
    places: int
    inside: int
    off_slab: int
    in_opening: int
    seconds: float


def rig_from(truth: RigTruth) -> StereoRig:
    """Return the true rig as the program has it."""

    def camera(one: CameraTruth) -> Intrinsics:
        return Intrinsics(K=one.K, distortion=one.distortion, width_px=one.width_px, height_px=one.height_px)

    return rig_of_unknown_sigma(camera(truth.left), camera(truth.right), truth.right_from_left)


def with_openings(path: Path, building: Building, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Cut an opening into each slab of a file; return their middles in the slabs' own frames, by GlobalId."""
    file = ifcopenshell.open(str(path))
    unit = float(ifcopenshell.util.unit.calculate_unit_scale(file))
    sizes = {one.global_id: (one.length_m, one.width_m) for one in building.elements if one.ifc_class == "IfcSlab"}
    body = next(one for one in file.by_type("IfcShapeRepresentation") if one.RepresentationIdentifier == "Body")
    middles: dict[str, tuple[float, float]] = {}
    for slab in file.by_type("IfcSlab"):
        length, width = sizes[slab.GlobalId]
        at = tuple(float(rng.uniform(-0.3, 0.3) * side) for side in (length, width))
        middles[slab.GlobalId] = at

        def point(*xs: float) -> object:
            return file.createIfcCartesianPoint([x / unit for x in xs])

        profile = file.createIfcRectangleProfileDef(
            "AREA", None, file.createIfcAxis2Placement2D(point(*at)), *(side / unit for side in OPENING_M)
        )
        up = file.createIfcDirection([0.0, 0.0, 1.0])
        place = file.createIfcAxis2Placement3D(point(0.0, 0.0, -1.0))
        solid = file.createIfcExtrudedAreaSolid(profile, place, up, 2.0 / unit)
        shape = file.createIfcShapeRepresentation(body.ContextOfItems, "Body", "SweptSolid", [solid])
        own = file.createIfcLocalPlacement(slab.ObjectPlacement, file.createIfcAxis2Placement3D(point(0.0, 0.0, 0.0)))
        opening = file.create_entity(
            "IfcOpeningElement", GlobalId=ifcopenshell.guid.new(), ObjectPlacement=own,
            Representation=file.createIfcProductDefinitionShape(None, None, [shape]),
        )  # fmt: skip
        file.create_entity(
            "IfcRelVoidsElement", GlobalId=ifcopenshell.guid.new(), RelatingBuildingElement=slab,
            RelatedOpeningElement=opening,
        )  # fmt: skip
    file.write(str(path))
    return middles


def judge(seed: int, folder: Path) -> Site:
    """Plan a visit of a building where everything is due, and judge it by the generator's truth."""
    building, truth = building_of(seed), rig_truth(seed)
    path = folder / f"{seed}.ifc"
    write_ifc(building, path)
    middles = with_openings(path, building, np.random.default_rng([seed, 77]))
    design, floors, rig = read_design(path), read_floors([path]), rig_from(truth)
    wanted = {one.global_id for one in design.elements}
    start = time.process_time()
    plan = plan_visit(design, floors, rig, wanted, {})
    seconds = time.process_time() - start
    shares = promised(building, truth, plan)
    eyes = []
    for storey in design.storeys:
        found = standing_places(design, storey.global_id, wanted, floors)
        eyes += [] if found is None else list(found.eyes_m)
    bad = [bad_place(building, eye, middles) for eye in eyes]
    return Site(
        seed=seed,
        shares=tuple(shares),
        stations=len(plan.stations),
        seen_m2=plan.seen_m2,
        wanted_m2=plan.wanted.total_m2,
        places=len(eyes),
        inside=bad.count("inside"),
        off_slab=bad.count("off slab"),
        in_opening=bad.count("opening"),
        seconds=seconds,
    )


def promised(building: Building, truth: RigTruth, plan: PlannedVisit) -> list[float]:
    """Return of each face that a plan promises the share of what is promised that both photos show."""
    solids = [poured(e, e.height_m, 0, 0).placed(building.world_from_local) for e in building.elements]
    tracer = Tracer(building.world_from_local[:3, 3].round(1), solids)
    points = {e.global_id: samples(building, e, 1.0, STEP_M) for e in building.vertical}
    due: dict[tuple[str, int], np.ndarray] = {}
    seen: dict[tuple[str, int], np.ndarray] = {}
    squares = plan.wanted
    for one in plan.stations:
        station = Station(name="", world_from_left=one.world_from_left, disc=None)
        owner = squares.element[squares.square]
        for number in np.unique(owner[one.patches]):
            element = squares.elements[number].global_id
            mine = one.patches & (owner == number)
            s = points[element]
            near = beside(s, squares.points_m[mine], squares.normals[mine])
            shown = near.copy()
            for side in ("left", "right"):
                shown &= points_in_view((tracer,), truth, station, side, s)
            for face in np.unique(s.side[near]):
                key = (element, int(face))
                due[key] = due.get(key, np.zeros(len(near), bool)) | (near & (s.side == face))
                seen[key] = seen.get(key, np.zeros(len(near), bool)) | (shown & (s.side == face))
    return [float(seen[key].sum() / due[key].sum()) for key in due]


def beside(s: Samples, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Say which exposed samples (N,) lie in the boxes round patches (P, 3)."""
    found = np.zeros(len(s.points_m), bool)
    for point, normal in zip(points_m, normals, strict=True):
        away = s.points_m - point
        across = np.cross([0.0, 0.0, 1.0], normal)
        box = (np.abs(away @ across) < 0.45 * SIDE_M) & (np.abs(away[:, 2]) < 0.45 * SIDE_M)
        found |= box & (np.abs(away @ normal) < 0.1) & (s.normals @ normal > 0.8)
    return found & s.exposed


def bad_place(building: Building, eye_m: np.ndarray, middles: dict[str, tuple[float, float]]) -> str:
    """Return what is wrong with a place, by the building's own drawings; "" where nothing is."""
    local = (np.linalg.inv(building.world_from_local) @ np.append(eye_m, 1.0))[:3]
    floor = local[2] - EYE_M
    if any(_is_in(one, local, floor) for one in building.vertical):
        return "inside"
    for slab in (one for one in building.elements if one.ifc_class == "IfcSlab"):
        own = (np.linalg.inv(slab.local_from_element) @ np.append(local, 1.0))[:2]
        top = slab.z_m + slab.height_m
        if abs(top - floor) < 0.05 and np.all(np.abs(own) <= 0.5 * np.array([slab.length_m, slab.width_m])):
            hole = np.abs(own - middles[slab.global_id]) <= 0.5 * np.array(OPENING_M)
            return "opening" if hole.all() else ""
    return "off slab"


def _is_in(e: Element, local_m: np.ndarray, floor_m: float) -> bool:
    if e.z_m > floor_m + 1.8 or e.z_m + e.height_m < floor_m + 0.2:
        return False
    x, y = (np.linalg.inv(e.local_from_element) @ np.append(local_m, 1.0))[:2]
    if e.shape == "round":
        return bool(np.hypot(x, y) <= 0.5 * e.length_m)
    low, high = e.x_range_m
    return bool(low <= x <= high and abs(y) <= 0.5 * e.width_m)


def main() -> int:
    """Judge every site, and print the table."""
    args = options(__doc__ or "").parse_args()
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        sites = [judge(seed, Path(scratch)) for seed in (SEEDS[:2] if args.quick else SEEDS)]
    shares = [share for site in sites for share in site.shares]
    kept = float(np.mean([share >= KEPT for share in shares]))
    places = sum(site.places for site in sites)
    lines: list[Line] = [
        line("faces: nine tenths of what is promised are seen", f"{kept:.1%}", "90 %", len(shares), kept >= 0.9),
        told("what is promised and seen, of all", f"{np.mean(shares):.1%}", len(shares)),
    ]
    for what, count in (
        ("places inside a wall or a column", sum(site.inside for site in sites)),
        ("places off their slab", sum(site.off_slab for site in sites)),
        ("places in an opening", sum(site.in_opening for site in sites)),
    ):
        lines.append(line(what, str(count), "0", places, count == 0))
    share = sum(site.seen_m2 for site in sites) / sum(site.wanted_m2 for site in sites)
    lines.append(told("of what is due, planned to be seen", f"{share:.1%}", len(sites)))
    mean = np.mean([site.stations for site in sites])
    lines.append(told("stations a visit of everything", f"{mean:.1f}", len(sites)))
    lines.append(told("processor seconds a plan", f"{np.mean([site.seconds for site in sites]):.1f}", len(sites)))
    figures: dict[str, object] = {
        "shares": quantiles(shares),
        "sites": {str(s.seed): [s.stations, s.places, round(s.seen_m2 / s.wanted_m2, 3)] for s in sites},
    }
    return report("a planned visit, judged by ray casting", lines, args, figures)


if __name__ == "__main__":
    sys.exit(main())
