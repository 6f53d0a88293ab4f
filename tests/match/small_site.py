"""A hand-made site for tests: boxes and a lateral surface as elements, one camera, depth by exact ray casting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from asbuilt_bim.bim.model import BimElement, BimModel, CostLine, DesignFace, ElementClass, FaceRole, Storey, Task
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.geometry.transform import inverse, rigid
from asbuilt_bim.measure.depth_reference import pack
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.pose import PlacedStation, Placement, StationPose
from asbuilt_bim.vision.stereo.depth import DepthMap

FAR = np.array([512_300.0, 5_412_800.0, 430.0])
UP = np.array([0.0, 0.0, 1.0])
BOX_TRIANGLES = np.array(
    [[a, b, c] for a, b, c, d in (
        (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
    ) for a, b, c in ((a, b, c), (a, c, d))], dtype=np.int32,
)  # fmt: skip
"""Of corners in the order of x, y, z, each low and high."""
Box = tuple[FloatArray, FloatArray]  # low and high corner, metres from FAR

CAMERA = RectifiedCamera(
    f_px=525.0, cx_px=320.0, cy_px=240.0, baseline_m=0.25, width_px=640, height_px=480,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip


def box(x: float, y: float, z: float, dx: float, dy: float, dz: float) -> Box:
    """Return a box by its low corner and size."""
    low = np.array([x, y, z])
    return low, low + np.array([dx, dy, dz])


def looking(eye: Sequence[float], at: Sequence[float]) -> FloatArray:
    """Return world_from_left of a level camera; eye and aim in metres from FAR."""
    forward = np.asarray(at, float) - np.asarray(eye, float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, UP)
    right /= np.linalg.norm(right)
    return rigid(np.column_stack([right, np.cross(forward, right), forward]), FAR + np.asarray(eye, float))


def element(name: str, kind: ElementClass, shape: Box, exposed: dict[int, Region] | None = None) -> BimElement:
    """Return a box-shaped element: four lateral faces, in the order -y, +x, +y, -x; a wall's length runs along x."""
    low, high = shape[0] + FAR, shape[1] + FAR
    size = high - low
    corners = [low + size * np.array(at) for at in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))]
    faces = []
    for index in range(4):
        along = corners[(index + 1) % 4] - corners[index]
        length = float(np.linalg.norm(along))
        frame = PlaneFrame(origin_m=frozen(corners[index]), u=frozen(along / length), v=frozen(UP))
        ring = polygon.box(0.0, 0.0, length, float(size[2]))
        role: FaceRole = "end" if kind == "wall" and index in (1, 3) else "side"
        faces.append(_face(f"{name}-{index}", name, role, frame, ring, (exposed or {}).get(index, ring)))
    return _element(name, kind, tuple(faces), low, size)


def round_column(name: str, x: float, y: float, radius: float, height: float) -> BimElement:
    """Return a round column that stands on FAR's level."""
    frame = CylinderFrame(
        origin_m=frozen(FAR + np.array([x, y, 0.0])), axis=frozen(UP), zero=frozen([1.0, 0, 0]), radius_m=radius
    )
    ring = polygon.box(-np.pi * radius, 0.0, np.pi * radius, height)
    face = _face(f"{name}-0", name, "side", frame, ring, ring)
    low = FAR + np.array([x - radius, y - radius, 0.0])
    return _element(name, "column", (face,), low, np.array([2 * radius, 2 * radius, height]))


def model(
    elements: Sequence[BimElement], tasks: tuple[Task, ...] = (), cost_lines: tuple[CostLine, ...] = ()
) -> BimModel:
    """Return a design of one storey."""
    return BimModel(
        file_name="small.ifc", file_digest="0", schema="IFC4", project_name="small",
        storeys=(Storey(global_id="S", name="Ground", elevation_m=430.0),), elements=tuple(elements), obstacles=(),
        tasks=tasks, cost_lines=cost_lines, notes=(),
    )  # fmt: skip


def cast(world_from_left: FloatArray, boxes: Sequence[Box]) -> FloatArray:
    """Return disparity (H, W) in pixels of boxes before a sky, 0 where there is sky."""
    pixels = np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), axis=-1)
    rays = CAMERA.rays(pixels) @ world_from_left[:3, :3].T
    eye = world_from_left[:3, 3] - FAR
    depth = np.full(rays.shape[:2], np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in boxes:
            one, other = (low - eye) / rays, (high - eye) / rays
            near, far = np.nanmax(np.minimum(one, other), axis=-1), np.nanmin(np.maximum(one, other), axis=-1)
            depth = np.where((near < far) & (near > 0.0), np.minimum(depth, near), depth)
        disparity: FloatArray = np.where(np.isfinite(depth), CAMERA.f_px * CAMERA.baseline_m / depth, 0.0)
    return disparity


def station(
    name: str,
    world_from_left: FloatArray,
    boxes: Sequence[Box],
    faces: Sequence[MeasuredFace] = (),
    unmeasured: FloatArray | None = None,
    picture: FloatArray | None = None,
    beyond: Sequence[Box] | None = None,
) -> PlacedStation:
    """Return a placed station that sees these boxes, and past thin things those `beyond`.

    `unmeasured` (H, W) says where depth has no value.
    """
    disparity = cast(world_from_left, boxes)
    valid = disparity > 0.0 if unmeasured is None else (disparity > 0.0) & ~unmeasured.astype(bool)
    depth = DepthMap(
        disparity_px=disparity.astype(np.float32), sigma_px=np.full(disparity.shape, 0.2, np.float32), valid=valid,
        f_px=CAMERA.f_px, baseline_m=CAMERA.baseline_m, method="stereo",
    )  # fmt: skip
    sky = (disparity == 0.0) & (True if unmeasured is None else ~unmeasured.astype(bool))
    past = None if beyond is None else cast(world_from_left, beyond).astype(np.float32)
    jpeg = b"" if picture is None else bytes(cv2.imencode(".jpg", picture.astype(np.uint8))[1])
    measurement = StationMeasurement(
        station=name, camera=CAMERA, faces=tuple(faces), target=None, markers=(), depth_ref=pack(depth, sky, past),
        vertical=None, rejections=(), seconds={}, left_digest="", right_digest="", thumbnail_jpeg=jpeg,
    )  # fmt: skip
    pose = StationPose(
        station=name, world_from_left=world_from_left, covariance=np.diag([1e-7] * 3 + [1e-5] * 3), residual_px=0.3,
        markers_used=(1, 2), method="markers",
    )  # fmt: skip
    return PlacedStation(measurement=measurement, pose=pose)


def measured(
    face_id: str,
    world_from_left: FloatArray,
    frame: PlaneFrame | CylinderFrame,
    region: Region,
    label: ElementClass = "wall",
    tilt_sigma_rad: float = 0.001,
) -> MeasuredFace:
    """Return a face as measured, from its frame in the world and its region there."""
    own = frame.moved(inverse(world_from_left))
    rings = region[0]
    area = polygon.area(region)
    centre = own.from_uv(polygon.centroid(region))
    (u0, v0, u1, v1) = polygon.bounds(region)
    return MeasuredFace(
        face_id=face_id, label=label, score=1.0, frame=own, outline_uv_m=rings,
        outline_px=tuple(CAMERA.project(own.from_uv(ring)) for ring in rings), area_m2=area,
        area_sigma_calibration_m2=0.002 * area, area_sigma_image_m2=0.01 * area,
        covariance=frozen(np.diag([0.005**2, tilt_sigma_rad**2, tilt_sigma_rad**2])), width_m=u1 - u0, height_m=v1 - v0,
        width_px=100.0, distance_m=float(np.linalg.norm(centre)), cut_by_frame=False, occluded=False,
        flatness_rms_m=0.001, instance=0,
    )  # fmt: skip


def placement(*stations: PlacedStation) -> Placement:
    """Return stations as placed."""
    return Placement(stations=stations, rejections=())


def shifted(frame: PlaneFrame, by_m: float) -> PlaneFrame:
    """Return a plane's frame moved along its normal."""
    return replace(frame, origin_m=frozen(frame.origin_m + by_m * frame.normal))


def turned(frame: PlaneFrame, angle_rad: float) -> PlaneFrame:
    """Return a plane's frame turned about its v through its origin."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return replace(frame, u=frozen(cos * frame.u - sin * frame.normal))


def _face(
    face_id: str, owner: str, role: FaceRole, frame: PlaneFrame | CylinderFrame, rings: Region, exposed: Region
) -> DesignFace:
    return DesignFace(
        face_id=face_id, element=owner, role=role, frame=frame, rings_uv_m=rings, exposed_uv_m=exposed,
        area_m2=polygon.area(rings), exposed_area_m2=polygon.area(exposed),
    )  # fmt: skip


def _element(
    name: str, kind: ElementClass, faces: tuple[DesignFace, ...], low: FloatArray, size: FloatArray
) -> BimElement:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size + low
    return BimElement(
        global_id=name, ifc_class="IfcWall" if kind == "wall" else "IfcColumn", kind=kind, name=name, tag="",
        storey="S", is_concrete=True, vertices_m=corners, triangles=BOX_TRIANGLES,
        axis_from_world=rigid(np.eye(3), -low), length_m=float(size[0]), thickness_m=float(size[1]),
        height_m=float(size[2]), volume_m3=float(np.prod(size)), faces=faces, qto={},
    )  # fmt: skip
