"""The circle of a round column in the level plan: found between its two ends, fitted to four silhouettes."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.geometry.round_piece import LEAST_RADIUS_M, MOST_RADIUS_M, Circle, disparity_of_circle
from asbuilt_bim.measure.round.lateral_surface import LateralEnd, lateral_end
from asbuilt_bim.measure.round.silhouettes import (
    Touching,
    chord_plane,
    expected_side,
    find_silhouettes,
    touch_silhouettes,
)
from asbuilt_bim.measure.workbench import Workbench

MOST_CHANGE = 0.35
"""A radius that silhouettes would change by more isn't this column's."""
ROUGH_SHARE = 0.03
"""What the stereo circle's radius is worth: the matcher bends a lateral surface flatter or rounder by some per cent."""
LOOKS = 2
"""A circle drawn too wide turns away too late, and looks foreign before its end. The second look is from nearer."""
MOST_OFF_PX = 2.0
"""A silhouette holds where the lateral surface plainly ends within 2 px of it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoundCircle:
    """A round column's circle with sigmas of radius and distance; `proven` where the surface is seen to end on it."""

    circle: Circle
    radius_sigma_m: float
    distance_sigma_m: float
    proven: bool


def fit_circle(bench: Workbench, start: Circle, mask: BoolArray) -> RoundCircle:
    """Fit the circle that the silhouettes of both photos touch; the stereo circle where they don't hold one."""
    touching = _touching(bench, start, mask)
    if touching is None:
        sigma = ROUGH_SHARE * start.radius_m + 0.005
        return RoundCircle(circle=start, radius_sigma_m=sigma, distance_sigma_m=0.02, proven=False)
    circle = touching.circle
    proven = all(_holds(end) for end in _lateral_ends(bench, circle, mask))
    worse = max(1.0, touching.misfit)
    forward = np.array([circle.x_m, circle.z_m]) / np.hypot(circle.x_m, circle.z_m)
    # what isn't proven and stereo contradicts may be somebody else's edges: half the gap is doubt
    doubt = 0.0 if proven else 0.5 * abs(circle.radius_m - start.radius_m)
    return RoundCircle(
        circle=circle,
        radius_sigma_m=float(np.hypot(np.sqrt(touching.covariance[2, 2]) * worse, doubt)),
        distance_sigma_m=float(np.sqrt(forward @ touching.covariance[:2, :2] @ forward)) * worse,
        proven=proven,
    )


def _holds(end: LateralEnd | None) -> bool:
    """Say whether a lateral surface's end, looked for from the fitted circle, proves that circle's side."""
    return end is not None and end.plain and abs(end.offset_px) <= MOST_OFF_PX


def _lateral_ends(bench: Workbench, circle: Circle, mask: BoolArray) -> list[LateralEnd | None]:
    """Return where the lateral surface ends off the circle's left and right side, None where that isn't known."""
    chord = chord_plane(bench, circle)
    return [
        lateral_end(bench, circle, expected_side(bench, circle, np.zeros(2), mask, side), chord) for side in (-1, 1)
    ]


def _between(circle: Circle, ends: list[LateralEnd | None]) -> Circle:
    """Return the circle, at the same distance, whose sides lie where its lateral surface ends."""
    away = float(np.hypot(circle.x_m, circle.z_m))
    middle, half = float(np.arctan2(circle.x_m, circle.z_m)), float(np.arcsin(circle.radius_m / away))
    left, right = (
        middle + side * half + (side * end.offset_px * np.cos(middle) ** 2 / circle.f_px if end is not None else 0.0)
        for side, end in zip((-1, 1), ends, strict=True)
    )
    turned = 0.5 * (left + right)
    return replace(
        circle, x_m=away * float(np.sin(turned)), z_m=away * float(np.cos(turned)),
        radius_m=away * float(np.sin(0.5 * (right - left))),
    )  # fmt: skip


def _touching(bench: Workbench, start: Circle, mask: BoolArray) -> Touching | None:
    """Look for silhouettes where the lateral surface ends, then where the first fit has them."""
    circle, touching = start, None
    for _ in range(LOOKS):
        circle = _between(circle, _lateral_ends(bench, circle, mask))
    for _ in range(LOOKS):
        seen = find_silhouettes(bench, circle, mask)
        away = float(np.hypot(circle.x_m, circle.z_m))
        direction = float(np.arctan2(circle.x_m, circle.z_m))
        distance, sigma = _distance(bench, direction, min(circle.radius_m / away, 0.5), away, mask)
        touching = touch_silhouettes(circle, seen, distance, sigma)
        if touching is None or not LEAST_RADIUS_M < touching.circle.radius_m < MOST_RADIUS_M:
            return None
        circle = touching.circle
    return touching if abs(circle.radius_m / start.radius_m - 1.0) < MOST_CHANGE else None


def _distance(bench: Workbench, direction: float, sine: float, start_m: float, mask: BoolArray) -> tuple[float, float]:
    """Fit the axis' distance to the disparities inside, direction and radius / distance being known; with its sigma."""
    level = bench.scene.level
    known = mask & level.measured
    x, d = level.x_px[known], level.d_px[known]
    f, b = level.view.f_px, level.baseline_m
    unit = Circle(x_m=float(np.sin(direction)), z_m=float(np.cos(direction)), radius_m=sine, f_px=f, baseline_m=b)
    at_one = disparity_of_circle(unit, x)  # scales with 1 / distance
    inner = np.isfinite(at_one) & (np.abs(np.arctan(x / f) - direction) < 0.75 * np.arcsin(sine))
    if np.count_nonzero(inner) < 50:
        return start_m, 0.02
    distances = at_one[inner] / d[inner]
    middle = float(np.median(distances))
    scatter = robust_sigma(distances - middle)
    return middle, float(
        np.hypot(scatter / np.sqrt(max(inner.sum() / 150.0, 1.0)), 0.03 * middle / np.median(d[inner]))
    )
