"""Round columns: silhouettes are tangent rays and give direction and radius over distance; stereo the distance."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import ring_area
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.finish import outline_on_plane, plane_covariance
from asbuilt_bim.measure.outline.border import BorderSide, Surface, round_sides
from asbuilt_bim.measure.outline.ends import judge_ends
from asbuilt_bim.measure.round.circle import fit_circle
from asbuilt_bim.measure.round.ends import find_ends
from asbuilt_bim.measure.round.lateral_surface import surface_disparity
from asbuilt_bim.measure.round.silhouettes import chord_plane
from asbuilt_bim.measure.sigma.area import rig_parts, rings_area_m2
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.masks.segment import Instance

ARC_POINTS = 24


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoundFit:
    """A round column's circle in the level plan, with sigmas of radius and distance, and its rise below the camera."""

    circle: Circle
    radius_sigma_m: float
    distance_sigma_m: float
    top_m: float  # below the camera (negative: above)
    foot_m: float
    height_sigma_m: float
    proven: bool  # the lateral surface is seen to end on all four sides
    piece: int  # of the scene


def fit_round_column(bench: Workbench, piece: int, mask: BoolArray) -> RoundFit | None:
    """Fit a piece's circle on silhouettes and disparities; None where it has none or the mask shows no round column."""
    circle = bench.scene.pieces[piece].circle
    if circle is None or np.count_nonzero(mask) < 150:
        return None
    found = fit_circle(bench, circle, mask)
    ends = find_ends(bench, found.circle, mask)
    if ends is None:
        return None
    return RoundFit(
        circle=found.circle, radius_sigma_m=found.radius_sigma_m, distance_sigma_m=found.distance_sigma_m,
        top_m=ends.top_m, foot_m=ends.foot_m, height_sigma_m=ends.height_sigma_m, proven=found.proven and ends.proven,
        piece=piece,
    )  # fmt: skip


def round_face(
    bench: Workbench, fit: RoundFit, face_id: str, instance: Instance, number: int, mask: BoolArray, rig: StereoRig
) -> MeasuredFace:
    """Build the metric face of a round column: the visible arc times its height, on the lateral surface."""
    frame, ring = frame_of_column(bench, fit), visible_ring(fit)
    height = fit.foot_m - fit.top_m
    ring_px = bench.pair.camera.project(frame.from_uv(ring))
    area = ring_area(ring)
    sigma = float(
        np.hypot(area * fit.radius_sigma_m / fit.circle.radius_m, area * fit.height_sigma_m / max(height, 1e-6))
    )
    middle = frame.from_uv(np.array([0.0, 0.5 * height]))
    ends = judge_ends(bench, sides_of_column(ring_px, fit), lateral_surface(bench, fit))
    calibration_m2, place = _by_rig(bench, fit, float(area), rig)
    return MeasuredFace(
        face_id=face_id, label=instance.label, score=instance.score, source=instance.source,
        segmenter=instance.segmenter, frame=frame,
        outline_uv_m=(frozen(ring),),
        outline_px=(frozen(ring_px),), area_m2=float(area),
        area_sigma_calibration_m2=calibration_m2,
        area_sigma_image_m2=sigma,
        covariance=frozen(np.diag([fit.distance_sigma_m**2, 0.005**2, 0.005**2])),
        covariance_calibration=frozen(place), width_m=2.0 * fit.circle.radius_m,
        height_m=float(height), width_px=float(np.ptp(ring_px[:, 0])), distance_m=float(np.linalg.norm(middle)),
        cut_by_frame=ends.cut_by_frame, occluded=ends.occluded, open_edge=ends.open_edge,
        whole_probability=ends.probability, flatness_rms_m=_roundness(bench, fit.circle, mask),
        instance=number,
    )  # fmt: skip


def visible_ring(fit: RoundFit) -> FloatArray:
    """Return the ring (N, 2) of the visible lateral surface, unrolled, in metres."""
    distance = float(np.hypot(fit.circle.x_m, fit.circle.z_m))
    half_arc = float(np.arccos(np.clip(fit.circle.radius_m / distance, 0.0, 1.0)))
    u = np.linspace(-half_arc, half_arc, ARC_POINTS) * fit.circle.radius_m
    height = fit.foot_m - fit.top_m
    return np.concatenate(
        [np.stack([u, np.zeros_like(u)], axis=1), np.stack([u[::-1], np.full_like(u, height)], axis=1)]
    )


def sides_of_column(ring_px: FloatArray, fit: RoundFit) -> list[BorderSide]:
    """Return the sides of a round column's outline (N, 2) px, whichever way round it runs."""
    sigma_px = fit.height_sigma_m * fit.circle.f_px / fit.circle.z_m
    return round_sides(ring_px[::-1] if ring_area(ring_px) < 0.0 else ring_px, fit.proven, sigma_px)


def lateral_surface(bench: Workbench, fit: RoundFit) -> Surface:
    """Return the lateral surface, as the sides of its outline are held against it."""
    chord = chord_plane(bench, fit.circle)
    return Surface(disparity_px=lambda at: surface_disparity(bench, fit.circle, chord, at), piece=fit.piece)


def _by_rig(bench: Workbench, fit: RoundFit, area_m2: float, rig: StereoRig) -> tuple[float, FloatArray]:
    """Return what the rig leaves open of area and place (3, 3): as of the upright plane through both tangents.

    Arc and chord grow alike with radius and distance, and the heights are the same.
    """
    camera, view = bench.pair.camera, bench.scene.level.view
    distance = float(np.hypot(fit.circle.x_m, fit.circle.z_m))
    sine = fit.circle.radius_m / distance
    forward = np.array([fit.circle.x_m, fit.circle.z_m]) / distance
    middle = forward * distance * (1.0 - sine**2)
    across = np.array([forward[1], -forward[0]]) * fit.circle.radius_m * np.sqrt(1.0 - sine**2)
    corners = [(-1.0, fit.top_m), (1.0, fit.top_m), (1.0, fit.foot_m), (-1.0, fit.foot_m)]
    level = np.array([[*(middle + side * across), below] for side, below in corners])[:, [0, 2, 1]]
    rectified = level @ view.level_from_rectified
    ring = rectified[:, :2] / rectified[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    plane = chord_plane(bench, fit.circle)
    (part,) = rig_parts([([ring], plane)], rig, camera, bench.rows_px)
    frame, (corners_uv,) = outline_on_plane([ring], plane, camera, view.down)
    place = plane_covariance(plane, part.q_covariance, frame, frame.from_uv(corners_uv.mean(axis=0)), camera)
    return area_m2 * part.area_sigma_m2 / rings_area_m2([ring], plane, camera), place


def frame_of_column(bench: Workbench, fit: RoundFit) -> CylinderFrame:
    """Return the lateral surface's frame in the LEFT frame, its zero towards the camera, its origin at the foot."""
    left_from_level = bench.pair.camera.rectified_from_left.T @ bench.scene.level.view.level_from_rectified.T
    foot = left_from_level @ np.array([fit.circle.x_m, fit.foot_m, fit.circle.z_m])
    towards = np.array([-fit.circle.x_m, 0.0, -fit.circle.z_m])
    return CylinderFrame(
        origin_m=frozen(foot),
        axis=frozen(left_from_level @ np.array([0.0, -1.0, 0.0])),
        zero=frozen(left_from_level @ (towards / np.linalg.norm(towards))),
        radius_m=fit.circle.radius_m,
    )


def _roundness(bench: Workbench, circle: Circle, mask: BoolArray) -> float:
    """Return the rms along the line of sight between the measured lateral surface and the circle, in metres."""
    level = bench.scene.level
    known = mask & level.measured
    d = level.d_px[known]
    miss = d - disparity_of_circle(circle, level.x_px[known])
    miss = miss[np.isfinite(miss) & (np.abs(miss) < 1.0)]
    if miss.size == 0:
        return 0.0
    return float(np.sqrt(np.mean(miss**2)) * circle.z_m / max(float(np.median(d)), 1e-6))
