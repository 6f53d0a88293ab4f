"""A mesh's lateral faces, each with an id that survives export, moving and renumbering."""

import hashlib
from collections.abc import Iterator

import numpy as np

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.bim.model import DesignFace, ElementClass, FaceRole
from asbuilt_bim.geometry.arrays import FloatArray, unique_rows
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import area, bounds
from asbuilt_bim.geometry.transform import apply
from asbuilt_bim.ifc.geometry.coplanar_regions import coplanar_regions, plane_region
from asbuilt_bim.ifc.geometry.cylinders import find_cylinders
from asbuilt_bim.ifc.geometry.roles import Surface, wall_roles

MIN_AREA_M2 = 1e-4
"""A face below a square centimetre is a modeller's leftover."""
_ROUND_UP = 0.637  # of a millimetre: whole and half millimetres, which dimensions love, never fall on the border


def design_faces(
    mesh: Mesh, global_id: str, kind: ElementClass, axis_from_world: FloatArray, local_from_world: FloatArray
) -> tuple[DesignFace, ...]:
    """Return the lateral faces of an outward-turned, welded mesh in world metres; nothing is taken off as contact yet.

    `local_from_world` (4, 4) is the element's own placement: the face ids are made from geometry in that frame.
    """
    surfaces = [surface for surface in _surfaces(mesh) if surface.area_m2 > MIN_AREA_M2]
    roles: list[FaceRole] = ["side"] * len(surfaces)
    if kind == "wall":
        roles = wall_roles(mesh, surfaces, axis_from_world)
    faces: list[DesignFace] = []
    taken: set[str] = set()
    for surface, role in zip(surfaces, roles, strict=True):
        face_id = _face_id(global_id, _digest_points(surface, local_from_world), taken)
        taken.add(face_id)
        faces.append(
            DesignFace(
                face_id=face_id,
                element=global_id,
                role=role,
                frame=surface.frame,
                rings_uv_m=surface.region,
                exposed_uv_m=surface.region,
                area_m2=surface.area_m2,
                exposed_area_m2=surface.area_m2,
            )
        )
    return tuple(faces)


def _surfaces(mesh: Mesh) -> Iterator[Surface]:
    parts = coplanar_regions(mesh)
    cylinders = find_cylinders(mesh, parts)
    for round_face in cylinders:
        yield Surface(frame=round_face.frame, region=round_face.region, area_m2=area(round_face.region))
    round_ones = frozenset[int]().union(*(round_face.parts for round_face in cylinders))
    for number, part in enumerate(parts):
        if number not in round_ones and part.area_m2 > MIN_AREA_M2:
            frame, region = plane_region(mesh, part)
            yield Surface(frame=frame, region=region, area_m2=area(region))


def _digest_points(surface: Surface, local_from_world: FloatArray) -> FloatArray:
    """Return the points (N, 3), in the element's own frame, that a face is known by."""
    frame, region = surface.frame, surface.region
    if isinstance(frame, PlaneFrame):
        return apply(local_from_world, frame.from_uv(np.concatenate([_corners(r) for rings in region for r in rings])))
    u0, v0, u1, v1 = bounds(region)
    ends = frame.origin_m + np.array([[v0], [v1]]) * frame.axis
    size = np.array([[frame.radius_m, u1 - u0, 0.0]])
    return np.concatenate([apply(local_from_world, ends), size])


def _corners(ring: FloatArray) -> FloatArray:
    """Return a ring without the points that lie on its straight edges: where those are depends on the kernel."""
    closed = np.concatenate([ring[-1:], ring, ring[:1]])
    before, after = ring - closed[:-2], closed[2:] - ring
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bent = np.abs(turn) > 1e-3 * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return ring[bent] if bent.any() else ring


def _face_id(global_id: str, points_m: FloatArray, taken: set[str]) -> str:
    cells = np.floor(points_m * 1000.0 + _ROUND_UP).astype("<i8")
    rounded = cells[unique_rows(cells)[0]].tobytes()
    for twin in range(1000):
        digest = hashlib.sha256(rounded + (bytes([twin % 256, twin // 256]) if twin else b"")).hexdigest()[:8]
        if (face_id := f"{global_id}-{digest}") not in taken:
            return face_id
    raise AssertionError("a thousand equal faces")  # pragma: no cover
