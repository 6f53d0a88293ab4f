"""The cells of an element: a wall is divided over length x height, a column over height; and samples of its surface."""

from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.border_boxes import Owners, border_boxes, sample_areas
from asbuilt_bim.bim.face_grid import face_grid, inside_grid, own_lines
from asbuilt_bim.bim.model import BimElement, DesignFace
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, freeze, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import Region, centroid
from asbuilt_bim.geometry.transform import apply, rotate

WALL_CELL_M = 0.25
COLUMN_CELL_M = 0.10
MIN_WALL_CELLS = 4
MIN_WEIGHT = 0.10
"""A cell with less solid than this is an opening, and no cell."""
_MOST_SAMPLES = 1_000_000  # kept at hand, some 100 MB: each visit asks for an element's up to six times
_FINE = 5  # points along each side of a cell when its solid is measured: shares to 4 %


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """The cells of one element, (nx, nz) over length and height; `weight` (nx, nz) is the share that is solid.

    Weight 0: an opening, or a place whose surface can never be seen (every side of it touches something): no cell.
    Cell (i, k) has the number i * nz + k, and spans length i .. i+1 of nx, height k .. k+1 of nz.
    """

    element: str
    shape: tuple[int, int]
    weight: FloatArray

    @property
    def count(self) -> int:
        """Return how many real cells there are."""
        return int(np.count_nonzero(self.weight))


_LAID_OUT: WeakKeyDictionary[BimElement, Cells] = WeakKeyDictionary()
_OF_FORM: dict[tuple[object, ...], Cells] = {}
_MOST_FORMS = 4096  # kept at hand, some 10 MB


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellSamples:
    """Samples of an element's EXPOSED lateral faces, reveals left out, on a regular grid in each face.

    `points_m` and outward `normals` (N, 3) are in world. `face` (N,) is the index into `element.faces`, `uv_m` (N, 2)
    the place on that face. `cell` (N,) is the cell's number (its weight may be 0). `area_m2` (N,) sums up to each
    exposed area. `step_m` (N, 2) is the grid's spacing: the sample stands for the box uv - step/2 .. uv + step/2, and
    for what the border leaves beside it: the boxes round `past_uv_m` (M, 2), each of the sample `owner` (M,).
    `place` (N, 2) is its place in its face's grid, along u and up v.
    """

    points_m: FloatArray
    normals: FloatArray
    face: IntArray
    uv_m: FloatArray
    cell: IntArray
    area_m2: FloatArray
    step_m: FloatArray
    place: IntArray
    past_uv_m: FloatArray
    owner: Owners


def element_cells(element: BimElement) -> Cells:
    """Divide an element into cells of about 0.25 m x 0.25 m (wall, at least 4 x 4) or 0.10 m of height (column).

    They follow from the design alone, so they are laid out once for as long as the element is held, and once for all
    elements of one form: a building has its columns a hundred times.
    """
    laid_out = _LAID_OUT.get(element)
    if laid_out is None:
        key = form(element)
        known = _OF_FORM.get(key) or _cells(element)
        if len(_OF_FORM) < _MOST_FORMS:
            _OF_FORM[key] = known
        laid_out = _LAID_OUT[element] = replace(known, element=element.global_id)
    return laid_out


def form(element: BimElement) -> tuple[object, ...]:
    """Return what elements of one form have in common: their faces in their own axes, to a thousandth of a mm."""
    return (
        element.kind,
        _rounded(np.array([element.length_m, element.height_m])),
        *sorted(_form(element, f) for f in element.faces),
    )


def _form(element: BimElement, face: DesignFace) -> tuple[bytes, str]:
    frame, regions = face.frame, (face.rings_uv_m, face.exposed_uv_m)
    if isinstance(frame, CylinderFrame):
        axes, radius_m = (frame.axis, frame.zero), frame.radius_m
    else:
        axes, radius_m = (frame.u, frame.v), 0.0
    turn, shift = element.axis_from_world[:3, :3], element.axis_from_world[:3, 3]
    rings = [ring.ravel() for region in regions for rings in region for ring in rings]
    vectors = np.array([frame.origin_m, *axes]) @ turn.T
    vectors[0] += shift
    sizes = np.array([face.area_m2, face.exposed_area_m2, radius_m])
    counts = [[len(ring) for ring in rings] for region in regions for rings in region]
    return _rounded(vectors.ravel(), sizes, *rings), f"{face.role} {len(face.rings_uv_m)} {counts}"


def _rounded(*numbers: FloatArray) -> bytes:
    return bytes((np.round(np.concatenate(numbers), 6) + 0.0).data)  # never -0.0


def _cells(element: BimElement) -> Cells:
    shape = _shape(element)
    solid = _solid_shares(element, shape)
    seen = np.zeros(shape, dtype=bool)
    for face in element.faces:
        if face.role != "reveal" and face.exposed_area_m2 > 0.0 and face.exposed_uv_m:
            seen |= _counts(element, face, face.exposed_uv_m, shape, min(WALL_CELL_M, COLUMN_CELL_M) / 4.0)[0] > 0
    weight = np.where((solid >= MIN_WEIGHT) & seen, solid, 0.0)
    return Cells(element=element.global_id, shape=shape, weight=frozen(weight))


_SAMPLES: dict[tuple[BimElement, float], CellSamples] = {}


def cell_samples(element: BimElement, spacing_m: float = 0.05) -> CellSamples:
    """Sample an element's exposed lateral surface about every `spacing_m`, each sample with its cell.

    They are laid out once for a design of usual size. Of a larger one those asked for last are kept.
    """
    key = element, spacing_m
    if key in _SAMPLES:
        _SAMPLES[key] = _SAMPLES.pop(key)  # the last in the row
        return _SAMPLES[key]
    samples = _SAMPLES[key] = _samples(element, _shape(element), spacing_m)
    while len(_SAMPLES) > 1 and sum(len(one.face) for one in _SAMPLES.values()) > _MOST_SAMPLES:
        del _SAMPLES[next(iter(_SAMPLES))]
    return samples


def _shape(element: BimElement) -> tuple[int, int]:
    if element.kind == "column":
        return 1, max(1, round(element.height_m / COLUMN_CELL_M))
    along, up = round(element.length_m / WALL_CELL_M), round(element.height_m / WALL_CELL_M)
    return max(MIN_WALL_CELLS, along), max(MIN_WALL_CELLS, up)


def _samples(element: BimElement, shape: tuple[int, int], spacing_m: float) -> CellSamples:
    none, pairs, triples = np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))
    parts: list[tuple[NDArray[Any], ...]] = [(triples, triples, none, pairs, none, pairs, pairs)]
    borders: list[tuple[NDArray[Any], ...]] = [(pairs, none)]
    count = 0
    for number, face in enumerate(element.faces):
        if face.role == "reveal" or face.exposed_area_m2 <= 0.0 or not face.exposed_uv_m:
            continue
        uv, step = _grid(face.exposed_uv_m, spacing_m)
        share = sample_areas(face.exposed_uv_m, uv, step)
        share *= face.exposed_area_m2 / share.sum()
        place = np.round((uv - uv.min(axis=0)) / step)
        parts.append((*_lifted(face, uv), np.full(len(uv), number), uv, share, np.tile(step, (len(uv), 1)), place))
        past, owner = border_boxes(face.exposed_uv_m, uv, step)
        borders.append((past, owner + count))
        count += len(uv)
    points, normals, faces, uv, share, steps, places = (np.concatenate(one) for one in zip(*parts, strict=True))
    past, owner = (np.concatenate(one) for one in zip(*borders, strict=True))
    return CellSamples(
        points_m=frozen(points),
        normals=frozen(normals),
        face=freeze(faces.astype(np.int32)),
        uv_m=frozen(uv),
        cell=freeze(cell_numbers(element, points, shape)),
        area_m2=frozen(share),
        step_m=frozen(steps),
        place=freeze(places.astype(np.int32)),
        past_uv_m=frozen(past),
        owner=freeze(owner.astype(np.intp)),
    )


def _grid(region: Region, spacing_m: float) -> tuple[FloatArray, FloatArray]:
    """Return the centres (N, 2) of the grid boxes that lie in a region, and the spacing (2,); at least one point."""
    grid, step = face_grid(region, spacing_m)
    kept = np.stack(np.meshgrid(grid.u_m, grid.v_m, indexing="ij"), axis=-1)[grid.inside]
    return (kept if len(kept) else centroid(region)[None, :]), step


def _counts(
    element: BimElement, face: DesignFace, region: Region, shape: tuple[int, int], spacing_m: float
) -> tuple[IntArray, int]:
    """Return how many points (nx, nz) of the grid over a face's region lie in each cell, and how many do in all.

    A face whose u runs level and whose v runs up is counted line by line, any other point by point.
    """
    grid, _ = face_grid(region, spacing_m)
    lines = own_lines(face, grid, element.axis_from_world, along=shape[0] > 1) if grid.inside.any() else None
    counts = np.zeros(shape, dtype=np.int32)
    if lines is None:
        points = _lifted(face, _grid(region, spacing_m)[0])[0]
        np.add.at(counts.reshape(-1), cell_numbers(element, points, shape), 1)
        return counts, len(points)
    columns, rows = (_places(at, size, n) for at, size, n in zip(lines, _size(element), shape, strict=True))
    if grid.inside.all():
        counts[:] = np.outer(np.bincount(columns, minlength=shape[0]), np.bincount(rows, minlength=shape[1]))
        return counts, grid.inside.size
    first, low = (np.flatnonzero(np.diff(places, prepend=-1)) for places in (columns, rows))  # lines lie in order
    by_column = np.add.reduceat(grid.inside, first, axis=0, dtype=np.int32)
    counts[np.ix_(columns[first], rows[low])] = np.add.reduceat(by_column, low, axis=1)
    return counts, int(np.count_nonzero(grid.inside))


def _lifted(face: DesignFace, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points and outward normals (N, 3) in world of a face's coordinates (N, 2)."""
    if isinstance(face.frame, CylinderFrame):
        return face.frame.from_uv(uv), face.frame.outward(uv)
    return face.frame.from_uv(uv), np.tile(face.frame.normal, (len(uv), 1))


def cell_numbers(element: BimElement, points: FloatArray, shape: tuple[int, int]) -> IntArray:
    """Return the numbers i * nz + k of the pieces that points (N, 3) in world lie in, (nx, nz) over length, height."""
    own = apply(element.axis_from_world, points)
    column, row = (_places(own[:, axis], size, n) for axis, size, n in zip((0, 2), _size(element), shape, strict=True))
    numbers: IntArray = (column * shape[1] + row).astype(np.int32)
    return numbers


def _size(element: BimElement) -> tuple[float, float]:
    return max(element.length_m, 1e-9), max(element.height_m, 1e-9)


def _places(at_m: FloatArray, size_m: float, count: int) -> NDArray[np.intp]:
    """Return in which of `count` equal pieces of a size places (N,) lie."""
    places: NDArray[np.intp] = np.clip(np.floor(at_m / size_m * count).astype(np.intp), 0, count - 1)
    return places


def _solid_shares(element: BimElement, shape: tuple[int, int]) -> FloatArray:
    """Return the share (nx, nz) of each cell that is solid: by a wall's sides seen flat, by a column's girth."""
    if element.kind == "column":
        area = np.zeros(shape)
        for face in element.faces:
            counts, count = _counts(element, face, face.rings_uv_m, shape, COLUMN_CELL_M / _FINE)
            area += counts * (face.area_m2 / count)
        share = area / max(float(np.median(area[area > 0.0])) if (area > 0.0).any() else 1.0, 1e-12)
        return np.minimum(share, 1.0).reshape(shape)
    fine = (shape[0] * _FINE, shape[1] * _FINE)
    x, z = (size * (np.arange(n) + 0.5) / n for size, n in zip((element.length_m, element.height_m), fine, strict=True))
    solid = np.zeros(fine, dtype=bool)
    for face in element.faces:
        if face.role == "side":
            solid |= _covered(element, face, x, z)
    share = solid.reshape(shape[0], _FINE, shape[1], _FINE).mean(axis=(1, 3))
    return np.asarray(share, dtype=np.float64)


def _covered(element: BimElement, face: DesignFace, x: FloatArray, z: FloatArray) -> BoolArray:
    """Say which points (nx, nz) of a grid in the length-height plane a side face covers, looked at square on."""
    if isinstance(face.frame, CylinderFrame):
        points = apply(element.axis_from_world, face.frame.from_uv(np.concatenate([r[0] for r in face.rings_uv_m])))
        low, high = points.min(axis=0)[[0, 2]], points.max(axis=0)[[0, 2]]
        return np.asarray(np.outer((x >= low[0]) & (x <= high[0]), (z >= low[1]) & (z <= high[1])))
    normal = rotate(element.axis_from_world, face.frame.normal)
    if abs(normal[1]) < 0.1:
        return np.zeros((len(x), len(z)), dtype=bool)
    flat = tuple(
        tuple(apply(element.axis_from_world, face.frame.from_uv(ring))[:, [0, 2]] for ring in rings)
        for rings in face.rings_uv_m
    )
    return inside_grid(flat, x, z)
