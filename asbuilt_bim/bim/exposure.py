"""What of a face could ever be seen: its surface less where other solids touch it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from asbuilt_bim.bim.mesh import Mesh, pieces, section
from asbuilt_bim.bim.model import BimElement, DesignFace, Obstacle
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import area, bounds, enclosed, grown, region_from, shape_of

LIFT_M = 0.005
"""The face is moved out by this before it is cut with its neighbours: joints narrower than that count as contact."""
NEAR_M = 0.01
SLIVER_M = 0.01
"""A strip narrower than this beside a contact is a modeller's tolerance, and no pixel will ever decide it."""
STRIPS = 48
"""A full lateral surface is cut along this many flat strips (7.5 degrees: 1 mm off at a radius of half a metre)."""

_BROKEN = (ArithmeticError, LookupError, RuntimeError, ValueError, ShapelyError)
_AT_ONCE = 1024  # windows asked for at once: bounds the memory where everything is near everything


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Window:
    """A rectangle (u0, v0, u1, v1) in the plane that a face is cut in: a flat face's own, or a strip of a cylinder's.

    `shift_m` is the lateral surface's u less the strip's.
    """

    frame: PlaneFrame
    box_uv_m: tuple[float, float, float, float]
    shift_m: float = 0.0

    def corners_m(self) -> FloatArray:
        """Return the corners (4, 3), moved out by `LIFT_M`."""
        u0, v0, u1, v1 = self.box_uv_m
        return self.frame.from_uv([[u0, v0], [u1, v0], [u1, v1], [u0, v1]], height_m=LIFT_M)


class _Solids:
    """The connected solids of the model, found by their boxes."""

    def __init__(self, bodies: Sequence[BimElement | Obstacle]) -> None:
        whole = [Mesh(vertices_m=body.vertices_m, triangles=body.triangles) for body in bodies]
        of_body = [(n, p) for n, mesh in enumerate(whole) for p in pieces(mesh) if len(p.triangles) > 3]
        self.owners = [number for number, _ in of_body]
        self.meshes = [piece for _, piece in of_body]
        self._boxes_m = np.array([mesh.bounds_m for mesh in self.meshes]).reshape(-1, 2, 3)
        self._tree = shapely.STRtree(_plan_boxes(self._boxes_m))

    def near(self, windows: list[_Window]) -> list[list[int]]:
        """Return for each window the solids (numbers) whose boxes come within `NEAR_M` of it and meet its plane."""
        found: list[list[int]] = [[] for _ in windows]
        for first in range(0, len(windows), _AT_ONCE):
            part = windows[first : first + _AT_ONCE]
            corners = np.array([window.corners_m() for window in part])
            box = np.stack([corners.min(axis=1) - NEAR_M, corners.max(axis=1) + NEAR_M], axis=1)
            normals = np.array([window.frame.normal for window in part])
            which, solid = self._tree.query(_plan_boxes(box))
            low, high = self._boxes_m[solid, 0], self._boxes_m[solid, 1]
            reach = ((high - low) * np.abs(normals[which])).sum(axis=1) / 2.0
            height = (((low + high) / 2.0 - corners[which, 0]) * normals[which]).sum(axis=1)
            meets = (low[:, 2] <= box[which, 1, 2]) & (high[:, 2] >= box[which, 0, 2]) & (np.abs(height) <= reach)
            for window, number in zip(which[meets].tolist(), solid[meets].tolist(), strict=True):
                found[first + window].append(number)
        return found


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
    windows = [[list(_windows(face)) for face in element.faces] for element in elements]
    near = iter(solids.near([window for element in windows for face in element for window in face]))
    for element, of_element in zip(elements, windows, strict=True):
        faces = []
        for face, of_face in zip(element.faces, of_element, strict=True):
            around = [[solids.meshes[number] for number in next(near)] for _ in of_face]
            try:
                faces.append(_exposed(face, of_face, around))
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
    windows = [window for element in elements for face in element.faces for window in _windows(face)]
    found: set[int] = set()
    for window, near in zip(windows, solids.near(windows), strict=True):
        for number in near:
            if solids.owners[number] not in found and _section(solids.meshes[number], window) is not None:
                found.add(solids.owners[number])
    return frozenset(found)


def _windows(face: DesignFace) -> Iterator[_Window]:
    """Yield what a face is cut along: a lateral surface by flat strips that touch it, each for its own piece of u."""
    u0, v0, u1, v1 = bounds(face.rings_uv_m)
    if isinstance(face.frame, PlaneFrame):
        yield _Window(frame=face.frame, box_uv_m=(u0, v0, u1, v1))
        return
    step = 2.0 * np.pi * face.frame.radius_m / STRIPS
    for first in np.arange(u0, u1 - 1e-9, step):
        last = min(first + step, u1)
        half, middle = (last - first) / 2.0, (first + last) / 2.0
        yield _Window(frame=_tangent(face.frame, middle), box_uv_m=(-half, v0, half, v1), shift_m=middle)


def _exposed(face: DesignFace, windows: list[_Window], near: list[list[Mesh]]) -> DesignFace:
    contact = []
    for window, around in zip(windows, near, strict=True):
        cuts = [cut for mesh in around if (cut := _cut(mesh, window)) is not None]
        if isinstance(face.frame, CylinderFrame):
            strip = shapely.box(*window.box_uv_m)
            cuts = [translate(cut.intersection(strip), xoff=window.shift_m) for cut in cuts]
        contact += cuts
    if not any(cut.area > 0.0 for cut in contact):
        return face
    pieces_left = region_from(shape_of(face.rings_uv_m).difference(shapely.union_all(contact)))
    left = tuple(rings for rings in pieces_left if grown((rings,), -SLIVER_M / 2.0))
    return replace(face, exposed_uv_m=left, exposed_area_m2=area(left))


def _cut(mesh: Mesh, window: _Window) -> BaseGeometry | None:
    """Return where a solid meets a window's plane moved out by `LIFT_M`, None where that misses the window."""
    segments = _section(mesh, window)
    return None if segments is None else enclosed(segments)


def _section(mesh: Mesh, window: _Window) -> FloatArray | None:
    segments = section(mesh, window.frame, LIFT_M)
    if len(segments) == 0:
        return None
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    u0, v0, u1, v1 = window.box_uv_m
    misses = low[0] >= u1 or high[0] <= u0 or low[1] >= v1 or high[1] <= v0
    return None if misses else segments


def _tangent(frame: CylinderFrame, u_m: float) -> PlaneFrame:
    """Return the plane frame tangent to the lateral surface along the line at `u_m`, with the same v."""
    out = frame.outward(np.array([u_m, 0.0]))
    return PlaneFrame(
        origin_m=frozen(frame.origin_m + frame.radius_m * out),
        u=frozen(np.cross(frame.axis, out)),
        v=frame.axis,
    )
