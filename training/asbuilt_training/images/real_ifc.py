"""Buildings that others designed, from their IFC files: parts of them, at any state of completion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import numpy as np
from asbuilt_synthetic.meshes import Part
from asbuilt_synthetic.model import FloatArray, IntArray

from asbuilt_training.classes import BACKGROUND, COLUMN, CONCRETE, OTHER, SLAB, WALL
from asbuilt_training.images.loose import strewn
from asbuilt_training.images.surroundings import surroundings
from asbuilt_training.images.things import Place, Thing, numbered

Rng = np.random.Generator
# Files whose licences allow use in what is shipped (MIT, CC BY 4.0, MPL-2.0), and that hold walls worth a look.
_FILES = (
    "bimwhale/TallBuilding.ifc",
    "schependomlaan/V_L_Constructief.ifc",
    "schependomlaan/V_L_Constructief.ifc",
    "schependomlaan/IFC-kalkzandsteen.ifc",
    "thatopen/AC20-FZK-Haus.ifc",
    "thatopen/IfcOpenHouse_IFC4.ifc",
    "thatopen/duplex.ifc",
    "thatopen/example.ifc",
)
_OF_CLASS = {
    "IfcWall": WALL, "IfcWallStandardCase": WALL, "IfcColumn": COLUMN, "IfcSlab": SLAB, "IfcBeam": SLAB,
    "IfcStair": SLAB, "IfcStairFlight": SLAB, "IfcFooting": SLAB, "IfcRailing": OTHER, "IfcRoof": OTHER,
    "IfcWindow": OTHER, "IfcDoor": OTHER, "IfcBuildingElementPart": WALL,
}  # fmt: skip
_MASONRY = ("IFC-kalkzandsteen",)  # a file of sand-lime blocks: never concrete
_REACH_M = 16.0  # a window of the building that is kept, half its side
_THINNEST_WALL_M = 0.09
_THINNEST_COLUMN_M, _LEAST_FILLED = 0.18, 0.6  # thinner ones, and open sections, are of steel
_MOST_TRIANGLES = 20_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """One product's mesh in the file's world, metres."""

    kind: int
    vertices_m: FloatArray
    triangles: IntArray


def ifc_files(folder: Path) -> tuple[Path, ...]:
    """List the files that are used, where they are there."""
    return tuple(folder / name for name in _FILES if (folder / name).is_file())


@lru_cache(maxsize=64)
def shapes(path: Path) -> tuple[Shape, ...]:
    """Mesh the products of a file; none where it cannot be read."""
    try:
        model: Any = ifcopenshell.open(str(path))
    except (RuntimeError, OSError, ifcopenshell.Error):
        return ()
    wanted: list[Any] = [
        p for p in model.by_type("IfcProduct") if p.Representation is not None and p.is_a() in _OF_CLASS
    ]
    if not wanted:
        return ()
    settings: Any = ifcopenshell.geom.settings()  # type: ignore[no-untyped-call]  # of the geometry kernel
    settings.set("use-world-coords", True)
    turn: Any = ifcopenshell.geom.iterator(settings, model, 1, include=wanted)
    out = []
    if turn.initialize():
        while True:
            made = turn.get()
            v = np.array(made.geometry.verts, np.float64).reshape(-1, 3)
            t = np.array(made.geometry.faces, np.int32).reshape(-1, 3)
            if 0 < len(t) < _MOST_TRIANGLES and np.isfinite(v).all():
                out.append(Shape(kind=_kind(_OF_CLASS[made.type], v, t), vertices_m=v, triangles=t))
            if not turn.next():
                break
    return tuple(out)


def _kind(kind: int, v: FloatArray, t: IntArray) -> int:
    """Take a class back where the shape is not such: thin skins, lying walls, steel sections are not cast."""
    if kind not in CONCRETE:
        return kind
    if np.ptp(v[:, 2]) < 0.4:
        return OTHER
    sides = _sides_m(v)
    if kind == WALL:
        return OTHER if sides.min() < _THINNEST_WALL_M else WALL
    a, b, c = (v[t[:, k]] - v.mean(0) for k in range(3))
    filled = abs((a * np.cross(b, c)).sum()) / 6 / max(sides.prod() * np.ptp(v[:, 2]), 1e-9)
    return OTHER if sides.min() < _THINNEST_COLUMN_M or filled < _LEAST_FILLED else COLUMN


def _sides_m(v: FloatArray) -> FloatArray:
    """Return the two sides (2,) of a mesh's footprint."""
    xy = v[:, :2] - v[:, :2].mean(0)
    _, _, axes = np.linalg.svd(xy, full_matrices=False)
    return np.asarray(np.ptp(xy @ axes.T, axis=0))


def ifc_place(path: Path, rng: Rng) -> Place:
    """Build a window of a file's building, some of it missing, half poured or of masonry, in surroundings."""
    own = shapes(path)
    walls = [s for s in own if s.kind == WALL]
    middle = walls[int(rng.integers(len(walls)))].vertices_m.mean(0)
    near = [s for s in own if np.abs(s.vertices_m.mean(0) - middle)[:2].max() < _REACH_M]
    floor = min(float(s.vertices_m[:, 2].min()) for s in near if s.kind == WALL)
    top = max(float(s.vertices_m[:, 2].max()) for s in near)
    built_to = float(rng.uniform(floor + 2.0, top + 1.0)) if rng.random() < 0.8 else top + 1.0
    shift = np.array([middle[0], middle[1], floor if rng.random() < 0.5 else floor + float(rng.uniform(0, 0.3))])
    skin = str(rng.choice(["concrete", "concrete", "concrete", "concrete", "brick", "blocks", "plaster"]))
    if path.stem in _MASONRY:
        skin = str(rng.choice(["blocks", "brick", "plaster"]))
    present, finishes = float(rng.uniform(0.55, 1.0)), rng.random() < 0.3
    things: list[Thing] = []
    for number, s in enumerate(near, 1):
        low = float(s.vertices_m[:, 2].min())
        if low > built_to - 0.3 or rng.random() > present or (s.kind == OTHER and not finishes):
            continue
        things.append(_stood(s, number, shift, built_to, skin, rng))
    points = np.concatenate([t.part.vertices_m for t in things])[:, :2] if things else np.zeros((2, 2))
    centre = (points.min(0) + points.max(0)) / 2
    reach = float(np.hypot(*np.ptp(points, axis=0)) / 2)
    things += strewn(things, centre, reach, rng)
    things += surroundings(centre, reach + float(rng.uniform(4, 12)), 0.0, rng)
    return Place(source="ifc", things=numbered(things))


def _stood(s: Shape, number: int, shift: FloatArray, built_to: float, skin: str, rng: Rng) -> Thing:
    middle = s.vertices_m.mean(0)
    v = middle + (s.vertices_m - middle) * (1 - rng.uniform(0.5, 5.0) * 1e-4)  # else walls share a corner's skin
    if s.kind in (WALL, COLUMN) and rng.random() < 0.3:  # poured so far
        low, high = v[:, 2].min(), v[:, 2].max()
        v[:, 2] = np.minimum(v[:, 2], low + rng.uniform(0.3, 1.0) * (high - low))
    kind, material = s.kind, "concrete"
    if kind == SLAB:
        material = "concrete_slab"
    elif kind == OTHER:
        material = str(rng.choice(["plaster", "timber", "scaffold_steel", "glass"]))
    elif kind == WALL and skin != "concrete":
        kind, material = BACKGROUND, skin
    part = Part(name="IFC", vertices_m=v - shift, triangles=s.triangles, material=material, texture_seed=number)
    return Thing(part=part, kind=kind, instance=number)
