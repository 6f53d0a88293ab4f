"""Polygons in a plane: Green's theorem, and set operations on regions with holes.

A ring is an open (N, 2) array in metres. A polygon is a tuple of rings: the outer one first (counter-clockwise), then
its holes (clockwise). A `Region` is a tuple of polygons.
"""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen

Rings = tuple[FloatArray, ...]
Region = tuple[Rings, ...]

EMPTY: Region = ()
MIN_AREA_M2 = 1e-8
"""Slivers below this (a hundredth of a square millimetre) are what set operations leave behind, not surface."""
_SIDES_AT_ONCE = 64


def ring_area(ring: ArrayLike) -> float:
    """Return the signed area of a ring (N, 2): positive counter-clockwise.

    Reference: Perez & Tah 2023, section 3.4 (Green's theorem): A = 1/2 of the closed integral of x dy - y dx.
    """
    points = np.asarray(ring, dtype=np.float64)
    if len(points) < 3:
        return 0.0
    relative = points - points[0]
    x, y = relative.T
    next_x, next_y = np.concatenate([relative[1:], relative[:1]]).T
    return float(0.5 * np.sum(x * next_y - next_x * y))


def rings_area(rings: Sequence[ArrayLike]) -> float:
    """Return the area of one polygon: the outer ring less its holes, whichever way they turn."""
    if not rings:
        return 0.0
    outer, *holes = (abs(ring_area(ring)) for ring in rings)
    return outer - sum(holes)


def area(region: Region) -> float:
    """Return the area of a region."""
    return float(sum(rings_area(rings) for rings in region))


def union(regions: Iterable[Region]) -> Region:
    """Return what at least one of the regions covers."""
    return region_from(shapely.union_all([shape_of(region) for region in regions]))


def intersection(a: Region, b: Region) -> Region:
    """Return what both regions cover."""
    return region_from(shape_of(a).intersection(shape_of(b)))


def difference(a: Region, b: Region) -> Region:
    """Return what `a` covers and `b` doesn't."""
    return region_from(shape_of(a).difference(shape_of(b)))


def grown(region: Region, distance: float) -> Region:
    """Return the region grown (or, below zero, shrunk) by `distance` with mitred corners."""
    return region_from(shape_of(region).buffer(distance, join_style="mitre", mitre_limit=4.0))


def box(u0: float, v0: float, u1: float, v1: float) -> Region:
    """Return a rectangle as a region."""
    return ((frozen([[u0, v0], [u1, v0], [u1, v1], [u0, v1]]),),)


def boxes(u0: FloatArray, v0: FloatArray, u1: FloatArray, v1: FloatArray) -> Region:
    """Return the union of many rectangles, given by four arrays (N,)."""
    return region_from(shapely.union_all(shapely.box(u0, v0, u1, v1)))


def areas_of_boxes(region: Region, u0: FloatArray, v0: FloatArray, u1: FloatArray, v1: FloatArray) -> FloatArray:
    """Return how much (N,) of each of many rectangles, given by four arrays (N,), lies in the region."""
    shape, rectangles = shape_of(region), shapely.box(u0, v0, u1, v1)
    shapely.prepare(shape)
    found: FloatArray = shapely.area(rectangles)
    cut = ~shapely.contains_properly(shape, rectangles)
    found[cut] = 0.0
    cut &= shapely.intersects(shape, rectangles)
    found[cut] = shapely.area(shapely.intersection(shape, rectangles[cut]))
    return found


def polygon(rings: Sequence[ArrayLike]) -> Region:
    """Return one polygon as a valid region; a ring that crosses itself is repaired."""
    return region_of([rings])


def region_of(polygons: Iterable[Sequence[ArrayLike]]) -> Region:
    """Return polygons as a valid region of disjoint pieces."""
    shapes = [_polygon_shape(rings) for rings in polygons if rings and len(np.asarray(rings[0])) >= 3]
    return region_from(shapely.union_all(shapes)) if shapes else EMPTY


def triangles_region(triangles: ArrayLike) -> Region:
    """Return the union of triangles (N, 3, 2), one at least, as a valid region.

    Triangles that share their corners, as nearly all meshes' do, are joined along their sides, a fifth of the work.
    """
    corners = np.asarray(triangles, dtype=np.float64)
    if len(corners) == 2 and (quadrangle := _two_joined(corners)) is not None:
        return quadrangle
    shapes = shapely.polygons(corners)
    broken = ~shapely.is_valid(shapes)
    if not broken.any() and (joined := _joined(shapes)) is not None:
        return region_from(joined)
    shapes[broken] = shapely.make_valid(shapes[broken])
    return region_from(shapely.union_all(shapes))


def _two_joined(triangles: FloatArray) -> Region | None:
    """Return two triangles that share one side as a quadrangle, None where it isn't clear: most faces are one.

    It begins at the first triangle's corner off that side, as Shapely's does where that isn't the first corner.
    """
    first, second = ([(u, v) for u, v in triangle] for triangle in triangles.tolist())
    own, others = set(first) - set(second), set(second) - set(first)
    if len(own) != 1 or len(others) != 1 or first[0] in own:
        return None
    at = 1 if first[1] in own else 2
    (u, v), (au, av), (bu, bv), (cu, cv) = first[at], first[at - 2], *others, first[at - 1]
    one_m2 = 0.5 * ((au - u) * (cv - v) - (av - v) * (cu - u))
    other_m2 = 0.5 * ((cu - bu) * (av - bv) - (cv - bv) * (au - bu))
    if min(abs(one_m2), abs(other_m2)) <= MIN_AREA_M2 or (one_m2 > 0.0) != (other_m2 > 0.0):
        return None
    ring = [(u, v), (au, av), (bu, bv), (cu, cv)]
    return ((frozen(ring if one_m2 > 0.0 else [ring[0], *ring[:0:-1]]),),)


def _joined(shapes: Sequence[BaseGeometry]) -> Polygon | None:
    """Return triangles joined along the sides that they share, None where they overlap or don't share them whole."""
    try:
        joined = shapely.coverage_union_all(shapes)
    except shapely.errors.GEOSException:  # it notices some overlaps by itself
        return None
    overlap = abs(float(shapely.area(shapes).sum() - joined.area))
    return joined if isinstance(joined, Polygon) and overlap < MIN_AREA_M2 and shapely.is_valid(joined) else None


def crossings(rings: Sequence[ArrayLike], most: int, most_points: int) -> int:
    """Return how often the rings of a polygon cross or touch each other or themselves; counting ends above `most`.

    0 where the polygon is valid. One that isn't and has more than `most_points` counts as `most` + 1, uncounted.
    """
    given = [np.asarray(ring, dtype=np.float64) for ring in rings]
    if Polygon(given[0], given[1:]).is_valid:
        return 0
    if sum(map(len, given)) > most_points:
        return most + 1
    moved = [ring[np.any(ring != np.roll(ring, 1, axis=0), axis=1)] for ring in given]
    sides = shapely.linestrings(np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], 1) for ring in moved]))
    tree, twice = shapely.STRtree(sides), 0
    for first in range(0, len(sides), _SIDES_AT_ONCE):
        some = sides[first : first + _SIDES_AT_ONCE]
        twice += tree.query(some, predicate="intersects").shape[1] - 3 * len(some)  # itself and its two neighbours
        if twice > 2 * most:
            break
    return max(1, twice // 2)


def hull_of(points: FloatArray) -> FloatArray:
    """Return the convex hull (N, 2); worked out near zero, since OpenCV's hull is in single precision."""
    origin = points.mean(axis=0)
    near = cv2.convexHull((points - origin).astype(np.float32))
    hull: FloatArray = np.asarray(near, dtype=np.float64).reshape(-1, 2) + origin
    return hull


def within_margin(ring: FloatArray, point: FloatArray, margin: float) -> bool:
    """Say whether a point (2,) lies in a ring (N, 2), or no further from it than `margin`."""
    near = (ring - point).astype(np.float32).reshape(-1, 1, 2)
    return bool(cv2.pointPolygonTest(near, (0.0, 0.0), True) >= -margin)


def contains(region: Region, points: ArrayLike) -> BoolArray:
    """Say for each point (..., 2) whether it lies in the region."""
    xy = np.asarray(points, dtype=np.float64)
    shape = shape_of(region)
    shapely.prepare(shape)
    inside: BoolArray = shapely.contains_xy(shape, xy[..., 0], xy[..., 1])
    return inside


def bounds(region: Region) -> tuple[float, float, float, float]:
    """Return (u0, v0, u1, v1) of a region that isn't empty."""
    outer = np.concatenate([rings[0] for rings in region])
    (u0, v0), (u1, v1) = outer.min(axis=0), outer.max(axis=0)
    return float(u0), float(v0), float(u1), float(v1)


def centroid(region: Region) -> FloatArray:
    """Return the centre of mass (2,) of a region that isn't empty."""
    point = shape_of(region).centroid
    return np.array([point.x, point.y])


def enclosed(segments: ArrayLike) -> BaseGeometry:
    """Return what segments (N, 2, 2) enclose, even-odd, as a shapely geometry."""
    rounded = np.asarray(segments, dtype=np.float64).round(7)
    if (loop := _one_loop(rounded)) is not None and (simple := Polygon(loop)).is_valid:
        return simple
    pieces = shapely.get_parts(shapely.polygonize([shapely.node(shapely.union_all(shapely.linestrings(rounded)))]))
    if len(pieces) == 0:
        return Polygon()
    depth = np.zeros(len(pieces), dtype=int)
    outers = shapely.polygons([shapely.get_exterior_ring(piece) for piece in pieces])
    insides = shapely.point_on_surface(pieces)
    for index, inside in enumerate(insides):
        depth[index] = int(np.count_nonzero(shapely.contains(outers, inside)))
    return shapely.union_all(pieces[depth % 2 == 1])


def _one_loop(segments: FloatArray) -> list[tuple[float, float]] | None:
    """Return the corners of segments that are one closed loop: what nearly every section of a solid is."""
    ends: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for (ax, ay), (bx, by) in segments.tolist():
        a, b = (ax, ay), (bx, by)
        if a != b:
            ends.setdefault(a, []).append(b)
            ends.setdefault(b, []).append(a)
    if len(ends) < 3 or any(len(others) != 2 for others in ends.values()):
        return None
    start = next(iter(ends))
    loop, before, here = [start], start, ends[start][0]
    while here != start and len(loop) < len(ends):
        loop.append(here)
        first, second = ends[here]
        before, here = here, second if first == before else first
    return loop if here == start and len(loop) == len(ends) else None


def _polygon_shape(rings: Sequence[ArrayLike]) -> BaseGeometry:
    outer, *holes = (np.where(np.abs(ring) < np.finfo(float).tiny, 0.0, ring) for ring in rings)  # less, GEOS errs
    shape = shapely.polygons(outer, holes=[shapely.linearrings(hole) for hole in holes if len(hole) >= 3] or None)
    return shape if shapely.is_valid(shape) else shapely.make_valid(shape)


def shape_of(region: Region) -> BaseGeometry:
    """Return a region as a shapely geometry."""
    if not region:
        return Polygon()
    shapes = [_polygon_shape(rings) for rings in region]
    return shapes[0] if len(shapes) == 1 else shapely.union_all(shapes)


def region_from(shape: BaseGeometry) -> Region:
    """Return a shapely geometry's polygons as a region, slivers below `MIN_AREA_M2` left out."""
    parts = (
        [shape]
        if isinstance(shape, Polygon)
        else [part for part in getattr(shape, "geoms", ()) if isinstance(part, Polygon | MultiPolygon)]
    )
    flat = [one for part in parts for one in (part.geoms if isinstance(part, MultiPolygon) else [part])]
    return tuple(_rings(one) for one in flat if one.area > MIN_AREA_M2)


def _rings(shape: Polygon) -> Rings:
    holes = [shapely.get_interior_ring(shape, number) for number in range(shapely.get_num_interior_rings(shape))]
    return (_ring(shapely.get_exterior_ring(shape), ccw=True), *(_ring(hole, ccw=False) for hole in holes))


def _ring(closed: BaseGeometry, ccw: bool) -> FloatArray:
    """Return the points (N, 2) of a closed ring, turned as asked for and open."""
    points = shapely.get_coordinates(closed)
    return frozen(points[:-1] if shapely.is_ccw(closed) == ccw else points[:0:-1])
