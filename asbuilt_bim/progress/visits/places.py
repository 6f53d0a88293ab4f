"""Where a person can stand with a rig: on a floor, off its edges and openings, clear of what stands there."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.bim.mesh import Mesh, section
from asbuilt_bim.bim.model import BimElement, BimModel, Obstacle
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import enclosed, hull_of, region_from

EYE_M = 1.5
"""Of the rig over the floor, held before the chest or on a tripod."""
EDGE_M = 0.6
"""From a floor's edge and from its openings: an arm's length more than a foot."""
BODY_M = 0.45
"""From walls, columns and stairs: half a person with a rig, and room to turn."""
_LEVELS_M = (0.3, 1.0, 1.7)  # over the floor: what stands at one of them stands in the way
_UNDER_TOP_M = 0.1  # over every lintel
_FOOT_M = 0.4  # a floor's top lies no further from the feet of what stands on it: screed, kickers, a raked slab
_CELL_M, _MOST_CELLS = 0.1, 4_000_000
_EVERY_M, _MOST_PLACES = 0.8, 1500
_UPRIGHT = 0.9  # cosine: a ramp of 25 degrees is no floor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StandingPlaces:
    """Eyes (N, 3) of a storey, in the world; `by_hull` where no slab is known and the floor is taken from the walls."""

    storey: str
    eyes_m: FloatArray
    by_hull: bool


def standing_places(
    design: BimModel, storey: str, standing: Collection[str], floors: Sequence[Obstacle]
) -> StandingPlaces | None:
    """Return the places of a storey (GlobalId); None where nothing is designed there.

    Without a slab at that height the floor is taken to reach as far as the storey's walls and columns do.
    """
    own = [one for one in design.elements if one.storey == storey]
    if not own:
        return None
    floor_z = float(np.median([_foot(one) for one in own]))
    tops = _tops(floors, floor_z)
    hull = not len(tops)
    if hull:
        tops = _hull(own)
    low = tops.reshape(-1, 2).min(axis=0) - 1.0
    size = tops.reshape(-1, 2).max(axis=0) + 1.0 - low
    cell = max(_CELL_M, float(np.sqrt(np.prod(size) / _MOST_CELLS)))
    floor = np.zeros(tuple(np.ceil(size[::-1] / cell).astype(int)), dtype=np.uint8)
    _fill(floor, tops, low, cell)
    blocked = np.zeros_like(floor)
    others = [one for one in design.obstacles if one.global_id not in {slab.global_id for slab in floors}]
    bodies: list[BimElement | Obstacle] = [one for one in design.elements if one.global_id in standing]
    for body in (*bodies, *others):
        _fill(blocked, _footprint(body, floor_z), low, cell)
    free = (_away(1 - floor, cell) > EDGE_M + cell) & (_away(blocked, cell) > BODY_M + cell)
    spots = _spread(free, cell)
    eyes = np.column_stack([low + (spots + 0.5) * cell, np.full(len(spots), floor_z + EYE_M)])
    return StandingPlaces(storey=storey, eyes_m=frozen(eyes), by_hull=hull)


def _foot(element: BimElement) -> float:
    return float(element.vertices_m[:, 2].min())


def _tops(floors: Sequence[Obstacle], floor_z_m: float) -> FloatArray:
    """Return the upper sides of slabs about a height, from above: triangles (N, 3, 2)."""
    found = [np.zeros((0, 3, 2))]
    for slab in floors:
        corners = slab.vertices_m[slab.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1)
        level = np.abs(normal[:, 2]) > _UPRIGHT * np.maximum(size, 1e-12)
        upper = corners[:, :, 2].mean(axis=1) > slab.vertices_m[:, 2].mean()
        at_height = np.abs(corners[:, :, 2].mean(axis=1) - floor_z_m) < _FOOT_M
        found.append(corners[level & upper & at_height][:, :, :2])
    tops: FloatArray = np.concatenate(found)
    return tops


def _hull(elements: Sequence[BimElement]) -> FloatArray:
    """Return what elements stand round, from above, as triangles (N, 3, 2)."""
    ring = hull_of(np.concatenate([one.vertices_m[:, :2] for one in elements]))
    fan: FloatArray = np.stack([np.broadcast_to(ring[0], ring[1:-1].shape), ring[1:-1], ring[2:]], axis=1)
    return fan


def _footprint(body: BimElement | Obstacle, floor_z_m: float) -> list[FloatArray]:
    """Return the rings (N, 2) of what stands in the way of a person, from above; holes count as solid.

    Nobody stands in a doorway for long: a wall or column is taken by its section under its top, too.
    """
    mesh = Mesh(vertices_m=body.vertices_m, triangles=body.triangles)
    origin = np.array([body.vertices_m[:, 0].mean(), body.vertices_m[:, 1].mean(), 0.0])
    frame = PlaneFrame(origin_m=frozen(origin), u=frozen([1.0, 0.0, 0.0]), v=frozen([0.0, 1.0, 0.0]))
    rings: list[FloatArray] = []
    levels = [floor_z_m + level for level in _LEVELS_M]
    if isinstance(body, BimElement) and body.vertices_m[:, 2].min() < levels[-1] < body.vertices_m[:, 2].max():
        levels.append(float(body.vertices_m[:, 2].max()) - _UNDER_TOP_M)
    for level in levels:
        segments = section(mesh, frame, level)
        if len(segments):
            rings += [rings_of[0] + origin[:2] for rings_of in region_from(enclosed(segments))]
            rings += list(segments + origin[:2])  # of a body that isn't closed, at least its sides
    return rings


def _fill(mask: np.ndarray, rings: Sequence[FloatArray] | FloatArray, low_m: FloatArray, cell_m: float) -> None:
    """Set to 1 what rings (N, 2) in metres cover of a mask, to a sixteenth of a cell."""
    for ring in rings:
        pixels = np.round(((ring - low_m) / cell_m - 0.5) * 16.0).astype(np.int32)
        if len(pixels) > 2:
            cv2.fillPoly(mask, [pixels], 1, shift=4)
        else:
            cv2.polylines(mask, [pixels], False, 1, shift=4)


def _away(mask: np.ndarray, cell_m: float) -> FloatArray:
    """Return how far (H, W) in metres each cell's middle is from the nearest set one's; a cell is as wide as it is."""
    framed = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    away: FloatArray = cv2.distanceTransform((framed == 0).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1] * cell_m
    return away


def _spread(free: BoolArray, cell_m: float) -> FloatArray:
    """Return cells (N, 2) as x and y, evenly spread over what is free, and no more than can be looked from."""
    every = max(_EVERY_M, float(np.sqrt(free.sum() * cell_m**2 / _MOST_PLACES)))
    step = max(1, round(every / cell_m))
    rows, columns = np.nonzero(free)
    if not len(rows):
        return np.zeros((0, 2))
    block = np.column_stack([columns // step, rows // step])
    middle = np.abs(columns % step - step // 2) + np.abs(rows % step - step // 2)
    order = np.lexsort((middle, block[:, 1], block[:, 0]))
    first = np.flatnonzero(np.any(np.diff(block[order], axis=0, prepend=-1) != 0, axis=1))
    chosen = order[first]
    spots: FloatArray = np.column_stack([columns[chosen], rows[chosen]]).astype(np.float64)
    return spots
