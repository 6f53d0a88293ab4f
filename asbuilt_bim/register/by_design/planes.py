"""Upright faces and round columns in plan: those that a station measured, those that are designed on a storey."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import cross, rigid, unit
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.options import FURTHEST_M

UPRIGHT = 0.1  # of a normal's upward part
SHORTEST_M = 0.05
"""Of a length in plan: what is narrower has no direction."""
FLUSH_M, FLUSH_RAD, MEETING_M = 0.01, float(np.radians(0.5)), 0.05
"""Faces as near to one line and one another as this are one, as far as photos tell."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Upright:
    """N upright faces in plan. Of a round one `middles_m` is the axis, `halves_m` the radius, the normal means nothing.

    What a station measured is in its level frame: x right, y ahead, z up, from the left camera.
    """

    normals: FloatArray  # (N, 2) unit vectors, out of the concrete
    middles_m: FloatArray  # (N, 2)
    halves_m: FloatArray  # (N,) of the length in plan
    heights_m: FloatArray  # (N, 2) lower and upper end
    round: BoolArray  # (N,)
    elements: NDArray[np.intp]  # (N,) which element of the design, which face of a station

    @property
    def along(self) -> FloatArray:
        """Return the directions (N, 2) along the faces: their normals, a quarter turn on."""
        return np.stack([-self.normals[:, 1], self.normals[:, 0]], axis=-1)

    @property
    def angles_rad(self) -> FloatArray:
        """Return the normals' directions (N,), counter-clockwise from x."""
        angles: FloatArray = np.arctan2(self.normals[:, 1], self.normals[:, 0])
        return angles


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """What a station measured: its upright faces, with sigmas; `level_from_left` (3, 3) is the turn to its level frame.

    `by_disparity_m` (N, 2) is by how much a face moves with a pixel of disparity that the rig is off by, `eyes_m`
    (N, 2) is where the camera stood that saw it: stations that are tied to each other see together.
    """

    faces: Upright
    offset_sigma_m: FloatArray  # (N,)
    angle_sigma_rad: FloatArray  # (N,)
    whole: FloatArray  # (N,) how likely both its sides are the face's ends
    by_disparity_m: FloatArray
    eyes_m: FloatArray
    level_from_left: FloatArray


def level_from_left(up: FloatArray) -> FloatArray:
    """Return the turn (3, 3) into right, ahead and up of a camera, of what is plumb in its frame: `up` (3,)."""
    up = unit(up)
    ahead = np.array([0.0, 0.0, 1.0])
    ahead = unit(ahead - (ahead @ up) * up)
    return np.stack([cross(ahead, up), ahead, up])


def seen_faces(station: StationMeasurement) -> Seen:
    """Return what a station measured, no face where it doesn't know what is plumb."""
    level = level_from_left(np.array([0.0, -1.0, 0.0]) if station.vertical is None else station.vertical)
    turn = rigid(level, np.zeros(3))
    level_faces = station.faces if station.vertical is not None else ()
    rows = [row for face in level_faces if (row := _seen(face, turn)) is not None]
    camera = station.camera
    kept = [face for _, face in rows]
    per_px = np.array([_depth_m(face) / (camera.f_px * camera.baseline_m) for face in kept])
    faces = upright([row for row, _ in rows])
    return Seen(
        faces=faces,
        offset_sigma_m=np.array([np.sqrt(max(float(face.covariance[0, 0]), 0.0)) for face in kept], dtype=np.float64),
        angle_sigma_rad=np.array([np.sqrt(max(float(face.covariance[2, 2]), 0.0)) for face in kept], dtype=np.float64),
        whole=np.array([face.whole_probability if face.whole else 0.0 for face in kept], dtype=np.float64),
        by_disparity_m=faces.middles_m * per_px[:, None],
        eyes_m=np.zeros_like(faces.middles_m),
        level_from_left=level,
    )


def _depth_m(face: MeasuredFace) -> float:
    return float(np.mean(face.frame.from_uv(np.concatenate(face.outline_uv_m))[:, 2]))


_Row = tuple[FloatArray, FloatArray, float, tuple[float, float], bool, int]


def _seen(face: MeasuredFace, turn: FloatArray) -> tuple[_Row, MeasuredFace] | None:
    if face.distance_m > FURTHEST_M or not face.outline_uv_m:
        return None
    row = _row(face.frame.moved(turn), np.concatenate(face.outline_uv_m), np.zeros(2), 0)
    return None if row is None else (row, face)


def _row(frame: PlaneFrame | CylinderFrame, uv_m: FloatArray, origin: FloatArray, element: int) -> _Row | None:
    row = row_of(frame, uv_m, origin, element)
    return None if row is None or (not row[4] and 2.0 * row[2] < SHORTEST_M) else row


def row_of(frame: PlaneFrame | CylinderFrame, uv_m: FloatArray, origin: FloatArray, element: int) -> _Row | None:
    """Return a face in plan from an origin (2,), by points (N, 2) of its border; None where it isn't upright."""
    points = frame.from_uv(uv_m)
    heights = float(points[:, 2].min()), float(points[:, 2].max())
    if isinstance(frame, CylinderFrame):
        if abs(float(frame.axis[2])) < 1.0 - UPRIGHT:
            return None
        return np.array([1.0, 0.0]), frame.origin_m[:2] - origin, frame.radius_m, heights, True, element
    if abs(float(frame.normal[2])) > UPRIGHT:
        return None
    normal = frame.normal[:2] / np.linalg.norm(frame.normal[:2])
    along = np.array([-normal[1], normal[0]])
    level = points[:, :2] - origin
    low, high = float((level @ along).min()), float((level @ along).max())
    middle = float(np.median(level @ normal)) * normal + 0.5 * (low + high) * along
    return normal, middle, 0.5 * (high - low), heights, False, element


def upright(rows: Sequence[_Row]) -> Upright:
    """Return faces given one by one."""
    return Upright(
        normals=np.array([row[0] for row in rows]).reshape(-1, 2),
        middles_m=np.array([row[1] for row in rows]).reshape(-1, 2),
        halves_m=np.array([row[2] for row in rows], dtype=np.float64),
        heights_m=np.array([row[3] for row in rows]).reshape(-1, 2),
        round=np.array([row[4] for row in rows], dtype=bool),
        elements=np.array([row[5] for row in rows], dtype=np.intp),
    )


def designed_faces(design: BimModel, origin_m: FloatArray, low_m: float, high_m: float) -> Upright:
    """Return the design's upright faces between two heights, in plan from an origin (2,) in the world."""
    rows: list[_Row] = []
    for number, element in enumerate(design.elements):
        if element.vertices_m[:, 2].max() > low_m and element.vertices_m[:, 2].min() < high_m:
            rows += _faces_of(element, origin_m, number)
    return upright([*rows, *_joined(rows)])


def _joined(rows: Sequence[_Row]) -> list[_Row]:
    """Return faces that several flush ones are together: where they meet nobody may see a joint."""
    lines: dict[tuple[int, int, int], list[_Row]] = {}
    for row in rows:
        normal, middle, _, _, is_round, _ = row
        if not is_round:
            angle = round(float(np.arctan2(normal[1], normal[0])) / FLUSH_RAD)
            foot = round(float(middle @ normal) / FLUSH_M)
            for key in {(angle, foot + step, round(row[3][0])) for step in (0, 1)}:
                lines.setdefault(key, []).append(row)
    found: dict[tuple[float, ...], _Row] = {}
    for line in lines.values():
        for row in _chains(line):
            found.setdefault((*np.round(row[0], 2), *np.round(row[1], 2), round(row[2], 2), round(row[3][0], 1)), row)
    return list(found.values())


def _chains(line: Sequence[_Row]) -> list[_Row]:
    """Return what faces on one line are together, two or more of them that meet."""
    normal = line[0][0]
    along = np.array([-normal[1], normal[0]])
    order = sorted(line, key=lambda row: float(row[1] @ along) - row[2])
    found: list[_Row] = []
    chain: list[_Row] = []
    end = -np.inf
    for row in [*order, None]:
        start = np.inf if row is None else float(row[1] @ along) - row[2]
        if start > end + MEETING_M:
            if len(chain) > 1:
                low = float(chain[0][1] @ along) - chain[0][2]
                foot = float(np.mean([one[1] @ normal for one in chain]))
                heights = min(one[3][0] for one in chain), max(one[3][1] for one in chain)
                middle = foot * normal + 0.5 * (low + end) * along
                found.append((normal, middle, 0.5 * (end - low), heights, False, chain[0][5]))
            chain, end = [], -np.inf
        if row is not None:
            chain.append(row)
            end = max(end, float(row[1] @ along) + row[2])
    return found


def _faces_of(element: BimElement, origin_m: FloatArray, number: int) -> list[_Row]:
    found = []
    for face in element.faces:
        uv_m = np.concatenate([ring for region in face.rings_uv_m for ring in region])
        row = _row(face.frame, uv_m, origin_m, number)
        if row is not None:
            found.append(row)
    return found
