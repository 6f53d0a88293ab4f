"""What a station measures of boxes, simulated: visible parts of upright faces, with noise. No photo is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.model import BimElement, BimModel, DesignFace, GridLine, Storey
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import inverse, rigid
from asbuilt_bim.measure.depth_reference import DepthReference
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import StationMeasurement

CAMERA = RectifiedCamera(
    f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip
UP = np.array([0.0, 0.0, 1.0])
SAMPLES = 61
LEAST_PX, FURTHEST_M = 12.0, 20.0
MATCHED_PX, ENDS_M = 0.05, 0.01  # what a plane's disparity and a face's ends err by


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Box:
    """A wall or column: its middle (2,), its sides (2,) in metres, how it is turned, and its foot and head."""

    middle_m: tuple[float, float]
    sides_m: tuple[float, float]
    turn_rad: float = 0.0
    foot_m: float = 0.0
    head_m: float = 3.0

    def corners(self) -> FloatArray:
        """Return the corners (4, 2), counter-clockwise."""
        half = 0.5 * np.array(self.sides_m) * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        cos, sin = np.cos(self.turn_rad), np.sin(self.turn_rad)
        corners: FloatArray = half @ np.array([[cos, sin], [-sin, cos]]) + self.middle_m
        return corners

    def mirrored(self) -> Box:
        """Return it with x counted the wrong way."""
        return replace(self, middle_m=(-self.middle_m[0], self.middle_m[1]), turn_rad=-self.turn_rad)


def wall(start_m: tuple[float, float], end_m: tuple[float, float], thick_m: float = 0.2, foot_m: float = 0.0) -> Box:
    """Return a wall whose axis runs between two points."""
    way = np.subtract(end_m, start_m)
    middle = 0.5 * np.add(start_m, end_m)
    return Box(
        middle_m=(float(middle[0]), float(middle[1])), sides_m=(float(np.linalg.norm(way)), thick_m),
        turn_rad=float(np.arctan2(way[1], way[0])), foot_m=foot_m, head_m=foot_m + 3.0,
    )  # fmt: skip


def column(middle_m: tuple[float, float], side_m: float, foot_m: float = 0.0) -> Box:
    """Return a square column."""
    return Box(middle_m=middle_m, sides_m=(side_m, side_m), foot_m=foot_m, head_m=foot_m + 3.0)


def design_of(
    boxes: Sequence[Box],
    storeys: Sequence[float] = (0.0,),
    shift: FloatArray | None = None,
    grid_lines: tuple[GridLine, ...] = (),
) -> BimModel:
    """Return a design of boxes, each an element, with storeys at these heights, shifted as a whole."""
    move = np.zeros(3) if shift is None else shift
    return BimModel(
        file_name="boxes.ifc", file_digest="0", schema="IFC4", project_name="boxes",
        storeys=tuple(
            Storey(global_id=f"S{k}", name=f"Storey {k}", elevation_m=height + float(move[2]))
            for k, height in enumerate(storeys)
        ),
        elements=tuple(_element(f"E{k}", box, move) for k, box in enumerate(boxes)), obstacles=(), tasks=(),
        cost_lines=(), notes=(), grid_lines=grid_lines,
    )  # fmt: skip


def _element(name: str, box: Box, move: FloatArray) -> BimElement:
    corners = np.column_stack([box.corners(), np.full(4, box.foot_m)]) + move
    height = box.head_m - box.foot_m
    faces = []
    for k in range(4):
        along = corners[(k + 1) % 4] - corners[k]
        length = float(np.linalg.norm(along))
        frame = PlaneFrame(origin_m=frozen(corners[k]), u=frozen(along / length), v=frozen(UP))
        ring = polygon.box(0.0, 0.0, length, height)
        faces.append(
            DesignFace(face_id=f"{name}-{k}", element=name, role="side", frame=frame, rings_uv_m=ring,
                       exposed_uv_m=ring, area_m2=length * height, exposed_area_m2=length * height)
        )  # fmt: skip
    return BimElement(
        global_id=name, ifc_class="IfcWall", kind="wall", name=name, tag="", storey="S0", is_concrete=True,
        vertices_m=frozen(np.concatenate([corners, corners + height * UP])),
        triangles=np.zeros((0, 3), dtype=np.int64), axis_from_world=frozen(np.eye(4)), length_m=box.sides_m[0],
        thickness_m=box.sides_m[1], height_m=height, volume_m3=1.0, faces=tuple(faces), qto={},
    )  # fmt: skip


def standing(x_m: float, y_m: float, bearing_deg: float = 0.0, z_m: float = 1.5) -> FloatArray:
    """Return world_from_left (4, 4) of a level camera; the bearing is clockwise from y."""
    bearing = np.radians(bearing_deg)
    ahead = np.array([np.sin(bearing), np.cos(bearing), 0.0])
    right = np.cross(ahead, UP)
    return rigid(np.column_stack([right, -UP, ahead]), np.array([x_m, y_m, z_m]))


def measured(design: BimModel, world_from_left: FloatArray, seed: int = 0, name: str = "A1") -> StationMeasurement:
    """Return what a station measures of a design that is built as it is."""
    rng = np.random.default_rng(seed)
    faces = [face for element in design.elements for face in element.faces if isinstance(face.frame, PlaneFrame)]
    segments = segments_of(design)
    seen = []
    for face in faces:
        found = _seen(face, world_from_left, segments, rng, f"{name}/{len(seen) + 1}")
        if found is not None:
            seen.append(found)
    up = world_from_left[:3, :3].T @ UP + np.append(rng.normal(0.0, 5e-4, 2), 0.0)[[0, 2, 1]]
    return StationMeasurement(
        station=name, camera=CAMERA, faces=tuple(seen), target=None, markers=(),
        depth_ref=DepthReference(png=b"", sigma_png=b"", scale=2), vertical=frozen(up / np.linalg.norm(up)),
        rejections=(), seconds={}, left_digest="", right_digest="", thumbnail_jpeg=b"",
    )  # fmt: skip


def segments_of(design: BimModel) -> FloatArray:
    """Return the flat faces of a design in plan (S, 2, 2)."""
    faces = [face for element in design.elements for face in element.faces if isinstance(face.frame, PlaneFrame)]
    return np.array([face.frame.from_uv(_ends(face))[:, :2] for face in faces]).reshape(-1, 2, 2)


def _ends(face: DesignFace) -> FloatArray:
    ring = face.rings_uv_m[0][0]
    return np.array([[ring[:, 0].min(), 0.0], [ring[:, 0].max(), 0.0]])


def _seen(
    face: DesignFace, pose: FloatArray, segments: FloatArray, rng: np.random.Generator, name: str
) -> MeasuredFace | None:
    """Return the longest part of a face that is seen, with noise; None where it is hidden, aslant or far."""
    frame = face.frame
    assert isinstance(frame, PlaneFrame)
    eye = pose[:3, 3]
    if frame.plane.distance_m(eye) <= 0.2:
        return None
    ends = _ends(face)[:, 0]
    across = np.linspace(ends[0], ends[1], SAMPLES)
    points = frame.from_uv(np.column_stack([across, np.zeros(SAMPLES)]))
    points[:, 2] = np.clip(eye[2], points[:, 2], points[:, 2] + face.rings_uv_m[0][0][:, 1].max())
    pixels = CAMERA.project((points - eye) @ pose[:3, :3])
    with np.errstate(invalid="ignore"):
        shown = (pixels[:, 0] > 10.0) & (pixels[:, 0] < CAMERA.width_px - 10.0)
    shown &= ~hidden(eye[:2], points[:, :2], segments) & (np.linalg.norm(points - eye, axis=1) < FURTHEST_M)
    start, stop = _longest(shown)
    if stop - start < 2 or abs(pixels[stop - 1, 0] - pixels[start, 0]) < LEAST_PX:
        return None
    whole = start == 0 and stop == SAMPLES
    low, high = across[start] + rng.normal(0.0, ENDS_M), across[stop - 1] + rng.normal(0.0, ENDS_M)
    return _measured(face, frame, pose, (low, high), whole, float(np.ptp(pixels[start:stop, 0])), rng, name)


def _measured(
    face: DesignFace, frame: PlaneFrame, pose: FloatArray, ends: tuple[float, float], whole: bool, width_px: float,
    rng: np.random.Generator, name: str,
) -> MeasuredFace:  # fmt: skip
    height = float(face.rings_uv_m[0][0][:, 1].max())
    middle = frame.from_uv(np.array([0.5 * (ends[0] + ends[1]), 0.5 * height]))
    left = PlaneFrame(origin_m=frozen(middle), u=frame.u, v=frame.v).moved(inverse(pose))
    depth = max(float(left.origin_m[2]), 0.5)
    sigma_m = depth**2 * MATCHED_PX / (CAMERA.f_px * CAMERA.baseline_m)
    width = max(ends[1] - ends[0], 0.02)
    turn = 2.0 * sigma_m / width
    off, yaw = rng.normal(0.0, sigma_m), rng.normal(0.0, min(turn, 0.2))
    u = np.cos(yaw) * left.u + np.sin(yaw) * left.normal
    moved = PlaneFrame(origin_m=frozen(left.origin_m + off * left.normal), u=frozen(u), v=left.v)
    tall = 0.5 * height
    ring = np.array([[-0.5 * width, -tall], [0.5 * width, -tall], [0.5 * width, tall], [-0.5 * width, tall]])
    ring[:, 1] += rng.normal(0.0, ENDS_M, 2)[[0, 0, 1, 1]]
    return MeasuredFace(
        face_id=name, label="wall", score=1.0, frame=moved, outline_uv_m=(frozen(ring),),
        outline_px=(frozen(ring),), area_m2=width * height, area_sigma_calibration_m2=0.0,
        area_sigma_image_m2=0.01, covariance=frozen(np.diag([sigma_m**2, 1e-6, turn**2])), width_m=width,
        height_m=height, width_px=width_px, distance_m=float(np.linalg.norm(left.origin_m)), cut_by_frame=not whole,
        occluded=False, flatness_rms_m=0.002, instance=0, whole_probability=0.95 if whole else 0.0,
    )  # fmt: skip


def hidden(eye: FloatArray, points: FloatArray, segments: FloatArray) -> np.ndarray:
    """Say which points (N, 2) lie behind a segment (S, 2, 2) in plan."""
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    sight = points - eye
    cross = sight[:, None, 0] * way[None, :, 1] - sight[:, None, 1] * way[None, :, 0]
    to = start - eye
    with np.errstate(divide="ignore", invalid="ignore"):
        at_sight = (to[:, 0] * way[:, 1] - to[:, 1] * way[:, 0])[None] / cross
        at_way = (to[None, :, 0] * sight[:, None, 1] - to[None, :, 1] * sight[:, None, 0]) / cross
    between = (at_sight > 0.0) & (at_sight < 1.0 - 1e-6) & (at_way > 1e-9) & (at_way < 1.0 - 1e-9)
    hidden: np.ndarray = between.any(axis=1)
    return hidden


def _longest(shown: np.ndarray) -> tuple[int, int]:
    """Return where the longest run of what is shown begins and ends."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], shown.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    if not len(runs):
        return 0, 0
    start, stop = runs[int(np.argmax(runs[:, 1] - runs[:, 0]))]
    return int(start), int(stop)
