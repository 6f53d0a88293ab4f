"""What of a face could ever be seen: its surface less where other solids touch it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from shapely.errors import ShapelyError

from asbuilt_bim.bim.mesh import Mesh, pieces, section, welded
from asbuilt_bim.bim.model import BimElement, DesignFace, Obstacle
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import Plane, PlaneFrame
from asbuilt_bim.geometry.polygon import (
    EMPTY,
    Region,
    area,
    bounds,
    box,
    difference,
    from_segments,
    grown,
    intersection,
    union,
)

LIFT_M = 0.005
"""The face is moved out by this before it is cut with its neighbours: joints narrower than that count as contact."""
NEAR_M = 0.01
SLIVER_M = 0.01
"""A strip narrower than this beside a contact is a modeller's tolerance, and no pixel will ever decide it."""
STRIPS = 48
"""A full mantle is cut along this many flat strips (7.5 degrees: 1 mm off at a radius of half a metre)."""

_BROKEN = (ArithmeticError, LookupError, RuntimeError, ValueError, ShapelyError)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solids:
    """Connected solids of the model with their boxes (N, 2, 3)."""

    meshes: tuple[Mesh, ...]
    boxes_m: FloatArray

    def near(self, low: FloatArray, high: FloatArray, plane: Plane | None = None) -> list[Mesh]:
        """Return the solids whose boxes come within `NEAR_M` of the box low..high and, if given, meet the plane."""
        touch = (self.boxes_m[:, 0] <= high + NEAR_M).all(axis=1) & (self.boxes_m[:, 1] >= low - NEAR_M).all(axis=1)
        numbers = np.flatnonzero(touch)
        if plane is not None:
            boxes = self.boxes_m[numbers]
            reach = (boxes[:, 1] - boxes[:, 0]) @ np.abs(plane.normal) / 2.0
            numbers = numbers[np.abs(plane.distance_m(boxes.mean(axis=1))) <= reach]
        return [self.meshes[i] for i in numbers]


def expose(
    elements: tuple[BimElement, ...], obstacles: tuple[Obstacle, ...]
) -> tuple[tuple[BimElement, ...], tuple[str, ...]]:
    """Return the elements with `exposed_uv_m` of each face less the contact with everything else, and notes.

    An element's own other pieces (blocks, layers) count as others.
    """
    solids = _solids(elements, obstacles)
    done, notes = [], []
    for element in elements:
        faces = []
        for face in element.faces:
            try:
                faces.append(_exposed(face, solids))
            except _BROKEN as error:  # a neighbour's broken mesh must not cost the model: the face stays whole
                faces.append(face)
                notes.append(
                    f"{element.ifc_class} {element.name} ({element.global_id}): contact not taken off: {error}"
                )
        done.append(replace(element, faces=tuple(faces)))
        if done[-1].exposed_area_m2 <= 0.0:
            notes.append(f"{element.ifc_class} {element.name} ({element.global_id}) touches others all over: unseen")
    return tuple(done), tuple(notes)


def _solids(elements: tuple[BimElement, ...], obstacles: tuple[Obstacle, ...]) -> _Solids:
    bodies: list[BimElement | Obstacle] = [*elements, *obstacles]
    whole = [welded(Mesh(vertices_m=body.vertices_m, triangles=body.triangles)) for body in bodies]
    meshes = tuple(piece for mesh in whole for piece in pieces(mesh) if len(piece.triangles) > 3)
    return _Solids(meshes=meshes, boxes_m=np.array([mesh.bounds_m for mesh in meshes]).reshape(-1, 2, 3))


def _exposed(face: DesignFace, solids: _Solids) -> DesignFace:
    contact = _mantle_contact(face, solids) if isinstance(face.frame, CylinderFrame) else _plane_contact(face, solids)
    if not contact:
        return face
    pieces_left = difference(face.rings_uv_m, union(contact))
    left = tuple(rings for rings in pieces_left if grown((rings,), -SLIVER_M / 2.0))
    return replace(face, exposed_uv_m=left, exposed_area_m2=area(left))


def _plane_contact(face: DesignFace, solids: _Solids) -> list[Region]:
    frame = face.frame
    assert isinstance(frame, PlaneFrame)
    u0, v0, u1, v1 = bounds(face.rings_uv_m)
    corners = frame.from_uv([[u0, v0], [u1, v0], [u1, v1], [u0, v1]], height_m=LIFT_M)
    plane = Plane(normal=frame.normal, offset_m=frame.plane.offset_m + LIFT_M)
    near = solids.near(corners.min(axis=0), corners.max(axis=0), plane)
    cuts = (_cut(mesh, frame, (u0, v0, u1, v1)) for mesh in near)
    return [cut for cut in cuts if cut]


def _cut(mesh: Mesh, frame: PlaneFrame, window: tuple[float, float, float, float]) -> Region:
    """Return where a solid meets the plane moved out by `LIFT_M`, empty where that misses the window (u0 v0 u1 v1)."""
    segments = section(mesh, frame, LIFT_M)
    if len(segments) == 0:
        return EMPTY
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    u0, v0, u1, v1 = window
    if low[0] >= u1 or high[0] <= u0 or low[1] >= v1 or high[1] <= v0:
        return EMPTY
    return from_segments(segments)


def _mantle_contact(face: DesignFace, solids: _Solids) -> list[Region]:
    """Cut the neighbours with flat strips that touch the lifted mantle, each strip for its own piece of u."""
    frame = face.frame
    assert isinstance(frame, CylinderFrame)
    u0, v0, u1, v1 = bounds(face.rings_uv_m)
    reach = frame.radius_m * np.abs(np.sqrt(np.clip(1.0 - frame.axis**2, 0.0, 1.0))) + LIFT_M
    ends = frame.origin_m + np.array([[v0], [v1]]) * frame.axis
    near = solids.near(ends.min(axis=0) - reach, ends.max(axis=0) + reach)
    step = 2.0 * np.pi * frame.radius_m / STRIPS
    contact = []
    for first in np.arange(u0, u1 - 1e-9, step) if near else ():
        last = min(first + step, u1)
        strip = _tangent(frame, (first + last) / 2.0)
        half = (last - first) / 2.0
        for mesh in near:
            cut = _cut(mesh, strip, (-half, v0, half, v1))
            if cut and (piece := intersection(cut, box(-half, v0, half, v1))):
                contact.append(_shifted(piece, (first + last) / 2.0))
    return contact


def _tangent(frame: CylinderFrame, u_m: float) -> PlaneFrame:
    """Return the plane frame that touches the mantle along the line at `u_m`, its v that of the mantle."""
    out = frame.outward(np.array([u_m, 0.0]))
    return PlaneFrame(
        origin_m=frozen(frame.origin_m + frame.radius_m * out),
        u=frozen(np.cross(frame.axis, out)),
        v=frame.axis,
    )


def _shifted(region: Region, u_m: float) -> Region:
    return tuple(tuple(frozen(ring + np.array([u_m, 0.0])) for ring in rings) for rings in region)
