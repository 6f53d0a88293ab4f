"""How well a measured face fits a design face: direction, distance, overlap, kind; with the sigma of each."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from asbuilt_bim.bim.model import DesignFace, ElementClass
from asbuilt_bim.codes import Reason, Value
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.geometry.transform import cross
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.regions import Frame, design_region
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.register.pose import StationPose

APART, TURNED = 100.0, 1000.0
"""Excess of faces that don't overlap, and of faces that are turned: further from a match than any offset."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorldFace:
    """A measured face carried into the world by its station's pose; `outline` in its own (u, v) metres.

    `angle_sigma_rad` is how well its direction is known, by the photos and the pose.
    """

    face: MeasuredFace
    frame: Frame
    outline: Region
    centroid_m: FloatArray  # (3,) world
    pose: StationPose
    angle_sigma_rad: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """One measured face against one design face.

    `strict` and `loose` are the parts of the measured outline, in ITS (u, v), on the design face and within the border
    tolerance of it. `fault` is None where the pair may stand, else what failed; `excess` by how much (1: at the limit).
    """

    design: DesignFace
    strict: Region
    loose: Region
    offset_m: float
    offset_sigma_m: float
    score: float
    fault: Reason | None = None
    values: Mapping[str, Value] = field(default_factory=dict)  # of the fault
    excess: float = 0.0


def in_world(face: MeasuredFace, pose: StationPose) -> WorldFace:
    """Carry a measured face into the world."""
    frame = face.frame.moved(pose.world_from_left)
    outline = polygon.polygon(face.outline_uv_m)
    middle = polygon.centroid(outline) if outline else np.zeros(2)
    return WorldFace(
        face=face, frame=frame, outline=outline, centroid_m=frame.from_uv(middle), pose=pose,
        angle_sigma_rad=_angle_sigma(face, pose),
    )  # fmt: skip


def compare(seen: WorldFace, design: DesignFace, kind: ElementClass, options: MatchOptions) -> Comparison | None:
    """Judge a pair; None where the two are of different shape (plane, cylinder) or face away from each other."""
    if isinstance(seen.frame, PlaneFrame) and isinstance(design.frame, PlaneFrame):
        angle = _angle(seen.frame.normal, design.frame.normal)
    elif isinstance(seen.frame, CylinderFrame) and isinstance(design.frame, CylinderFrame):
        angle = _angle(seen.frame.axis, design.frame.axis)
        angle = min(angle, np.pi - angle)
    else:
        return None
    if angle > np.pi / 2:
        return None
    angle_sigma = seen.angle_sigma_rad
    widest = widest_rad(angle_sigma, options)
    if angle > widest:
        return Comparison(
            design=design, strict=polygon.EMPTY, loose=polygon.EMPTY, offset_m=0.0, offset_sigma_m=0.0,
            score=0.0, fault=Reason.FACE_TURNED,
            values={"angle_rad": angle, "limit_rad": widest}, excess=TURNED + angle / widest,
        )  # fmt: skip
    border = design_region(design, seen.frame)
    strict = polygon.intersection(seen.outline, border)
    loose = polygon.intersection(seen.outline, polygon.grown(border, options.border_m)) if border else polygon.EMPTY
    offset, sigma = _offset(seen, design, strict or loose)
    score = _score(seen.face.label == kind, angle, angle_sigma, offset, sigma, options)
    fault, values, excess = _fault(seen, design, loose, offset, float(np.hypot(sigma, _scale_sigma_m(seen))), options)
    return Comparison(
        design=design, strict=strict, loose=loose, offset_m=offset, offset_sigma_m=sigma,
        score=score, fault=fault, values=values, excess=excess,
    )  # fmt: skip


def widest_rad(angle_sigma_rad: float, options: MatchOptions) -> float:
    """Return how far a face whose direction is known so well may be turned against a design face and still be it."""
    furthest = float(np.radians(options.max_angle_deg))
    return furthest + min(options.sigmas * angle_sigma_rad, furthest)


def point_sigma_m(pose: StationPose, points_m: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the pose's share (...) in the sigma of world points (..., 3) along unit directions (..., 3), in metres."""
    arms = points_m - pose.world_from_left[:3, 3]
    jacobian = np.concatenate([cross(arms, directions), directions], axis=-1)
    sigma: FloatArray = np.sqrt(np.einsum("...i,ij,...j->...", jacobian, pose.covariance, jacobian))
    return sigma


def plane_offset_sigma_m(seen: WorldFace, at_m: FloatArray) -> float:
    """Return the standard deviation of the measured surface at a world point (3,), without the pose's part."""
    du, dv = seen.frame.to_uv(at_m) - seen.frame.to_uv(seen.centroid_m)
    if isinstance(seen.frame, CylinderFrame):
        du = 0.0
    arm = np.array([1.0, dv, -du])
    return float(np.sqrt(max(float(arm @ seen.face.place_covariance @ arm), 0.0)))


def _scale_sigma_m(seen: WorldFace) -> float:
    """Return how far off a face may lie if all that its area may be off by is one scale: so far it is looked for.

    That is further than its place is unsure at a grazing angle. What is found there says that it stands off; what is
    not, says nothing.
    """
    share = 0.5 * seen.face.area_sigma_calibration_m2 / max(seen.face.area_m2, 1e-6)
    return share * float(np.linalg.norm(seen.centroid_m - seen.pose.world_from_left[:3, 3]))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(cross(a, b)), a @ b))


def _angle_sigma(face: MeasuredFace, pose: StationPose) -> float:
    tilts = np.diag(face.place_covariance)[1:]
    turns = np.linalg.eigvalsh(pose.covariance[:3, :3])
    return float(np.sqrt(max(float(np.max(tilts)), 0.0) + max(float(turns[-1]), 0.0)))


def _offset(seen: WorldFace, design: DesignFace, where: Region) -> tuple[float, float]:
    at = seen.frame.from_uv(polygon.centroid(where)) if where else seen.centroid_m
    if isinstance(design.frame, PlaneFrame):
        normal = design.frame.normal
        offset = float(design.frame.plane.distance_m(at))
    else:
        assert isinstance(seen.frame, CylinderFrame)
        axis = design.frame.axis
        across = seen.frame.origin_m + seen.frame.axis * ((at - seen.frame.origin_m) @ seen.frame.axis)
        across = across - design.frame.origin_m
        across = across - (across @ axis) * axis
        normal = design.frame.outward(design.frame.to_uv(at))
        # Of the surface that is seen, along its normal; or of the axis, across that, where this is more. The axis along
        # the normal is no measure: it goes with the radius, which a narrow arc tells badly.
        offset = float(across @ normal) + seen.frame.radius_m - design.frame.radius_m
        sideways = float(np.linalg.norm(across - (across @ normal) * normal))
        offset = offset if abs(offset) >= sideways else float(np.copysign(sideways, offset))
    pose_part = float(point_sigma_m(seen.pose, at, normal))
    return offset, float(np.hypot(pose_part, plane_offset_sigma_m(seen, at)))


def _score(
    same_kind: bool, angle: float, angle_sigma: float, offset: float, offset_sigma: float, options: MatchOptions
) -> float:
    cost = (angle / np.hypot(np.radians(options.angle_scale_deg), angle_sigma)) ** 2
    cost += (offset / np.hypot(options.offset_scale_m, offset_sigma)) ** 2
    cost += 0.0 if same_kind else options.class_penalty
    return float(np.exp(-0.5 * cost))


def _fault(
    seen: WorldFace,
    design: DesignFace,
    loose: Region,
    offset: float,
    offset_sigma: float,
    options: MatchOptions,
) -> tuple[Reason | None, Mapping[str, Value], float]:
    if polygon.area(loose) < max(options.min_area_m2, options.min_share * seen.face.area_m2):
        return Reason.FACE_APART, {"overlap_m2": polygon.area(loose), "limit_m2": options.min_area_m2}, APART
    if isinstance(seen.frame, CylinderFrame) and isinstance(design.frame, CylinderFrame):
        share = abs(seen.frame.radius_m / design.frame.radius_m - 1.0)
        if share > options.max_radius_share:
            excess = share / options.max_radius_share
            values = {"off_share": float(share), "limit_share": options.max_radius_share}
            return Reason.FACE_OF_OTHER_RADIUS, values, excess
    furthest = options.max_offset_m + options.sigmas * offset_sigma
    if abs(offset) > furthest:
        code = Reason.FACE_BEFORE if offset > 0.0 else Reason.FACE_BEHIND
        return code, {"offset_m": abs(offset), "limit_m": furthest}, abs(offset) / furthest
    return None, {}, 0.0
