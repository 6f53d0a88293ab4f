"""What of a face could ever be seen: its surface less where other solids touch it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.affinity import translate
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from asbuilt_bim.bim.mesh import Mesh, pieces, section
from asbuilt_bim.bim.model import BimElement, DesignFace, Obstacle
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Rings, area, bounds, enclosed, grown, region_from, rings_area, shape_of
from asbuilt_bim.geometry.transform import cross

LIFT_M = 0.005
"""The face is moved out by this before it is cut with its neighbours: joints narrower than that count as contact."""
NEAR_M = 0.01
SLIVER_M = 0.01
"""A strip narrower than this beside a contact is a modeller's tolerance, and no pixel will ever decide it."""
STRIPS = 48
"""A full lateral surface is cut along this many flat strips (7.5 degrees: 1 mm off at a radius of half a metre)."""

_BROKEN = (ArithmeticError, LookupError, RuntimeError, ValueError, ShapelyError)
_TOUCH_M = 1e-9  # what rounding may add: a floor that reaches no further over a face's border ends under it
_AT_ONCE = 1024  # windows asked for at once: bounds the memory where everything is near everything


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Windows:
    """Rectangles (W,) that faces are cut in: a flat face has one in its plane, a cylinder a strip for each tangent.

    `origin_m`, `u`, `v`, `normal` (W, 3) are the planes' frames, `box_uv_m` (W, 4) is (u0, v0, u1, v1) in them.
    `shift_m` (W,) is the lateral surface's u less the strip's, `first` (F + 1,) where each face's windows begin.
    """

    origin_m: FloatArray
    u: FloatArray
    v: FloatArray
    normal: FloatArray
    box_uv_m: FloatArray
    shift_m: FloatArray
    first: NDArray[np.intp]

    def corners_m(self, some: slice) -> FloatArray:
        """Return the corners (n, 4, 3) of some windows, moved out by `LIFT_M`."""
        u, v = self.box_uv_m[some][:, [0, 2, 2, 0], None], self.box_uv_m[some][:, [1, 1, 3, 3], None]
        origin, lift = self.origin_m[some][:, None], LIFT_M * self.normal[some][:, None]
        corners: FloatArray = origin + u * self.u[some][:, None] + v * self.v[some][:, None] + lift
        return corners

    def frame(self, number: int) -> PlaneFrame:
        """Return the frame of one window."""
        return PlaneFrame(origin_m=self.origin_m[number], u=self.u[number], v=self.v[number])


def _windows(faces: Sequence[DesignFace]) -> _Windows:
    """Return what faces are cut along: a lateral surface by flat strips that touch it, each for its own piece of u."""
    rows = [_strips(face, face.frame) if isinstance(face.frame, CylinderFrame) else _flat(face) for face in faces]
    columns = zip(*rows, strict=True) if rows else [[np.zeros((0, n))] for n in (3, 3, 3, 4, 1)]
    origin, u, v, box, shift = (np.concatenate(list(column)) for column in columns)
    count = [len(row[0]) for row in rows]
    return _Windows(
        origin_m=origin,
        u=u,
        v=v,
        normal=cross(u, v),
        box_uv_m=box,
        shift_m=shift.reshape(-1),
        first=np.cumsum([0, *count]),
    )


def _flat(face: DesignFace) -> tuple[FloatArray, ...]:
    assert isinstance(face.frame, PlaneFrame)
    frame = face.frame
    return frame.origin_m[None], frame.u[None], frame.v[None], np.array([bounds(face.rings_uv_m)]), np.zeros((1, 1))


def _strips(face: DesignFace, frame: CylinderFrame) -> tuple[FloatArray, ...]:
    """Return the planes tangent to a lateral surface along the middles of its strips, with the same v."""
    u0, v0, u1, v1 = bounds(face.rings_uv_m)
    start = np.arange(u0, u1 - 1e-9, 2.0 * np.pi * frame.radius_m / STRIPS)
    end = np.minimum(start + 2.0 * np.pi * frame.radius_m / STRIPS, u1)
    half, middle = (end - start) / 2.0, (start + end) / 2.0
    out = frame.outward(middle[:, None])
    box = np.column_stack([-half, np.full(len(half), v0), half, np.full(len(half), v1)])
    v = np.tile(frame.axis, (len(out), 1))
    return frame.origin_m + frame.radius_m * out, cross(frame.axis, out), v, box, middle[:, None]


class _Solids:
    """The connected solids of the model, found by their boxes."""

    def __init__(self, bodies: Sequence[BimElement | Obstacle]) -> None:
        whole = [Mesh(vertices_m=body.vertices_m, triangles=body.triangles) for body in bodies]
        of_body = [(n, p) for n, mesh in enumerate(whole) for p in pieces(mesh) if len(p.triangles) > 3]
        self.owners = [number for number, _ in of_body]
        self.meshes = [piece for _, piece in of_body]
        self._boxes_m = np.array([mesh.bounds_m for mesh in self.meshes]).reshape(-1, 2, 3)
        self._tree = shapely.STRtree(_plan_boxes(self._boxes_m))

    def near(self, windows: _Windows, least_m: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return pairs (N,) of windows and solids, by window: the solid's box meets the plane and reaches into it.

        It comes within `NEAR_M` of the rectangle, and by more than `least_m` over each of its borders.
        """
        found: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = [(np.zeros(0, np.intp), np.zeros(0, np.intp))]
        for first in range(0, len(windows.origin_m), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            corners = windows.corners_m(some)
            box = np.stack([corners.min(axis=1) - NEAR_M, corners.max(axis=1) + NEAR_M], axis=1)
            which, solid = self._tree.query(_plan_boxes(box))
            low, high = self._boxes_m[solid, 0], self._boxes_m[solid, 1]
            half, middle = (high - low) / 2.0, (low + high) / 2.0
            meets = (low[:, 2] <= box[which, 1, 2]) & (high[:, 2] >= box[which, 0, 2])
            normal = windows.normal[some][which]
            height = ((middle - corners[which, 0]) * normal).sum(axis=1)
            meets &= np.abs(height) <= (half * np.abs(normal)).sum(axis=1)
            for axis, column in ((windows.u[some][which], 0), (windows.v[some][which], 1)):
                at = ((middle - windows.origin_m[some][which]) * axis).sum(axis=1)
                reach = (half * np.abs(axis)).sum(axis=1)
                borders = windows.box_uv_m[some][which]
                meets &= (at - reach < borders[:, column + 2] - least_m) & (at + reach > borders[:, column] + least_m)
            order = np.lexsort((np.arange(len(which)), which))
            order = order[meets[order]]
            found.append((which[order] + first, solid[order]))
        windows_of, solids = (np.concatenate(list(one)) for one in zip(*found, strict=True))
        return windows_of, solids


def _plan_boxes(boxes_m: FloatArray) -> FloatArray:
    return np.asarray(shapely.box(boxes_m[:, 0, 0], boxes_m[:, 0, 1], boxes_m[:, 1, 0], boxes_m[:, 1, 1]))


def expose(
    elements: tuple[BimElement, ...], obstacles: tuple[Obstacle, ...]
) -> tuple[tuple[BimElement, ...], tuple[Note, ...]]:
    """Return the elements with `exposed_uv_m` of each face less the contact with everything else, and notes.

    An element's own other pieces (blocks, layers) count as others. Meshes are welded, as `ifc` reads them.
    """
    solids = _Solids([*elements, *obstacles])
    done: list[BimElement] = []
    notes: list[Note] = []
    windows = _windows([face for element in elements for face in element.faces])
    which, solid = solids.near(windows, _TOUCH_M)
    start = iter(np.searchsorted(which, windows.first).tolist())
    begin = next(start)
    for element in elements:
        faces = []
        for face in element.faces:
            end = next(start)
            near = list(zip(which[begin:end].tolist(), solid[begin:end].tolist(), strict=True))
            begin = end
            try:
                faces.append(_exposed(face, windows, [(number, solids.meshes[mesh]) for number, mesh in near]))
            except _BROKEN as error:  # a neighbour's broken mesh must not cost the model: the face stays whole
                faces.append(face)
                notes.append(_note(Reason.CONTACT_NOT_TAKEN_OFF, element, {"error": str(error)}))
        done.append(replace(element, faces=tuple(faces)))
        if done[-1].exposed_area_m2 <= 0.0:
            notes.append(_note(Reason.TOUCHED_ALL_OVER, element, {}))
    return tuple(done), tuple(notes)


def _note(code: Reason, element: BimElement, values: Values) -> Note:
    named = {"ifc_class": element.ifc_class, "element": element.name}
    return noted(code, about(SubjectKind.ELEMENT, element.global_id), **named, **values)


def touching(elements: Sequence[BimElement], obstacles: Sequence[Obstacle]) -> frozenset[int]:
    """Return the places in `obstacles` of those that meet a face of an element: all that `expose` would take off."""
    solids = _Solids(obstacles)
    windows = _windows([face for element in elements for face in element.faces])
    near = solids.near(windows, -NEAR_M)
    found: set[int] = set()
    for window, number in zip(*(one.tolist() for one in near), strict=True):
        owner = solids.owners[number]
        if owner not in found and _section(solids.meshes[number], windows, window) is not None:
            found.add(owner)
    return frozenset(found)


def _exposed(face: DesignFace, windows: _Windows, near: Sequence[tuple[int, Mesh]]) -> DesignFace:
    """Return a face less what the solids near its windows cut from it, by the windows' numbers."""
    contact = []
    for window, mesh in _met(windows, near) if isinstance(face.frame, CylinderFrame) else near:
        cut = _cut(mesh, windows, window)
        if cut is not None and isinstance(face.frame, CylinderFrame):
            strip = shapely.box(*windows.box_uv_m[window])
            cut = translate(cut.intersection(strip), xoff=float(windows.shift_m[window]))
        if cut is not None:
            contact.append(cut)
    if not any(cut.area > 0.0 for cut in contact):
        return face
    pieces_left = region_from(shape_of(face.rings_uv_m).difference(shapely.union_all(contact)))
    left = tuple(rings for rings in pieces_left if _is_wide(rings) or grown((rings,), -SLIVER_M / 2.0))
    return replace(face, exposed_uv_m=left, exposed_area_m2=area(left))


def _is_wide(rings: Rings) -> bool:
    """Say of most polygons without holes that are no slivers that they are none, by area over girth.

    Somewhere within, the border is at least that far. Shrinking leaves all that is over four times as far from it as it
    is shrunk, by the limit of mitred corners: here a disc is left.
    """
    outer, *holes = rings
    girth_m = float(np.sqrt(((outer - np.roll(outer, 1, axis=0)) ** 2).sum(axis=1)).sum())
    return not holes and rings_area(rings) > 4.0 * SLIVER_M * girth_m


def _met(windows: _Windows, near: Sequence[tuple[int, Mesh]]) -> list[tuple[int, Mesh]]:
    """Keep the windows whose planes a solid meets: a round column's own box meets all its tangents, itself none."""
    met: list[tuple[int, Mesh]] = []
    for mesh in {id(mesh): mesh for _, mesh in near}.values():
        numbers = np.array([number for number, one in near if one is mesh])
        normals = windows.normal[numbers]
        low_high = mesh.vertices_m @ normals.T - (windows.origin_m[numbers] * normals).sum(axis=1) - LIFT_M
        there = numbers[(low_high.min(axis=0) <= 0.0) & (low_high.max(axis=0) > -1e-9)]
        met += [(number, mesh) for number in there.tolist()]
    return sorted(met, key=lambda one: one[0])


def _cut(mesh: Mesh, windows: _Windows, window: int) -> BaseGeometry | None:
    """Return where a solid meets a window's plane moved out by `LIFT_M`, None where that misses the window."""
    segments = _section(mesh, windows, window)
    return None if segments is None else enclosed(segments)


def _section(mesh: Mesh, windows: _Windows, window: int) -> FloatArray | None:
    segments = section(mesh, windows.frame(window), LIFT_M)
    if len(segments) == 0:
        return None
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    u0, v0, u1, v1 = windows.box_uv_m[window]
    misses = low[0] >= u1 or high[0] <= u0 or low[1] >= v1 or high[1] <= v0
    return None if misses else segments
