"""The upright silhouettes of a round column in both photos: tangents of one circle in the level plan."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.robust_least_squares import fit
from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure.outline.edges import Gradients, Line, find_edge, pixel_plane
from asbuilt_bim.measure.outline.fit import ALONE_SIGMA_PX, ALONE_STRENGTH, LEAST_STRENGTH, image_direction
from asbuilt_bim.measure.planes.adjust import MOST_MISS_SIGMA
from asbuilt_bim.measure.workbench import Workbench

MOST_AT_FRAME = 0.3
"""A side that the photo's end cuts on this share of its rows isn't seen."""
FACE_GREY = 2.0
"""What an edge must stand out of: grain of concrete between two profiles."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Silhouette:
    """One side of a column in one photo: a ray in the level plan (x right, z forward) that touches the circle.

    `eye_m` (2,) is the camera's place; `bearing_rad` counts from forward to the right; `side` is -1 left, 1 right.
    `sigma_rad` is of this edge, `ambiguity_rad` what it may be off because the side is another line.
    """

    eye_m: FloatArray
    bearing_rad: float
    sigma_rad: float
    side: int
    ambiguity_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Touching:
    """The circle that the silhouettes in use touch, and the covariance (3, 3) of its x, z and radius.

    `misfit` is the rms of the misses over their own sigmas, 1 where nothing checks the fit.
    """

    circle: Circle
    covariance: FloatArray
    used: tuple[Silhouette, ...]
    misfit: float


def find_silhouettes(bench: Workbench, circle: Circle, mask: BoolArray) -> list[Silhouette]:
    """Look for both sides in both photos where the circle has them: a mask's border frays."""
    rows = np.flatnonzero(mask.any(axis=1))
    ends = [mask[rows].argmax(axis=1), mask.shape[1] - 1 - mask[rows, ::-1].argmax(axis=1)]
    camera, view = bench.pair.camera, bench.scene.level.view
    plane = pixel_plane(chord_plane(bench, circle), camera)
    right_plane = -plane / (1.0 - plane[0])
    eye = view.turn(np.array([camera.baseline_m, 0.0, 0.0]))[[0, 2]]
    photos = (
        (np.zeros(2), bench.slopes, plane, bench.pair.valid_left),
        (eye, _swapped(bench), right_plane, bench.pair.valid_right),
    )
    found: list[Silhouette] = []
    for side, columns in zip((-1, 1), ends, strict=True):
        if np.mean(bench.frame[rows, columns]) > MOST_AT_FRAME:
            continue
        for eye_m, slopes, along, valid in photos:
            line = expected_side(bench, circle, eye_m, mask, side)
            if not _inside(line, valid):
                continue
            settled = _settled(slopes, line, along)
            if settled is not None:
                found.append(_as_ray(bench, *settled, eye_m, side))
    return found


def touch_silhouettes(
    start: Circle, seen: Sequence[Silhouette], distance_m: float, distance_sigma_m: float
) -> Touching | None:
    """Fit the circle to its silhouettes and its distance; one that misses by over 3 sigma is left out, worst first.

    None where no two opposite sides are left.
    """
    used = list(seen)
    while {one.side for one in used} == {-1, 1}:
        circle, covariance, misses = _solve(start, used, distance_m, distance_sigma_m)
        worst = int(np.argmax(np.abs(misses[:-1])))
        spare = len(used) - 2  # observations, the distance with them, less unknowns
        rest = {one.side for k, one in enumerate(used) if k != worst}
        if abs(misses[worst]) <= MOST_MISS_SIGMA or spare < 2 or rest != {-1, 1}:
            misfit = float(np.sqrt(np.mean(misses**2))) if spare > 0 else 1.0
            # blur and chamfer move a side alike in both photos: seen twice, it counts once
            alike = len(used) / 2.0
            return Touching(
                circle=circle,
                covariance=alike * covariance,
                used=tuple(used),
                misfit=misfit,
            )
        del used[worst]
    return None


def _solve(
    start: Circle, seen: Sequence[Silhouette], distance_m: float, distance_sigma_m: float
) -> tuple[Circle, FloatArray, FloatArray]:
    """Return the circle, its covariance (3, 3), and misses over their own sigma (the distance last).

    What a side may be off as another line says nothing of which silhouettes agree; it widens what they give.
    """
    weights = 1.0 / np.array([*(one.sigma_rad for one in seen), distance_sigma_m])
    found = fit(
        lambda at: weights * _misses(at, seen, distance_m)[0],
        np.array([start.x_m, start.z_m, start.radius_m]),
        lambda at: weights[:, None] * _misses(at, seen, distance_m)[1],
    )
    covariance = found.covariance
    leverage = np.einsum("ik,kl,il->i", found.jacobian, covariance, found.jacobian)
    own: FloatArray = found.residuals / np.sqrt(np.clip(1.0 - leverage, 0.05, None))
    x, z, radius = found.parameters.tolist()
    ambiguity = weights * np.array([*(one.ambiguity_rad for one in seen), 0.0])
    moved = covariance @ (found.jacobian * ambiguity[:, None]).T
    return replace(start, x_m=x, z_m=z, radius_m=radius), covariance + moved @ moved.T, own


def _misses(at: FloatArray, seen: Sequence[Silhouette], distance_m: float) -> tuple[FloatArray, FloatArray]:
    """Return by how much a circle (3,) of x, z, radius misses each ray and, last, the distance; and the Jacobian."""
    misses, jacobian = np.zeros(len(seen) + 1), np.zeros((len(seen) + 1, 3))
    for k, one in enumerate(seen):
        v = at[:2] - one.eye_m
        far = float(np.hypot(*v))
        tangent = np.sqrt(max(far**2 - at[2] ** 2, 1e-9))
        misses[k] = np.arctan2(v[0], v[1]) + one.side * np.arcsin(min(at[2] / far, 0.99)) - one.bearing_rad
        nearer = -one.side * at[2] / (far * tangent)  # of the half angle, by the distance
        jacobian[k] = [v[1] / far**2 + nearer * v[0] / far, -v[0] / far**2 + nearer * v[1] / far, one.side / tangent]
    far = float(np.hypot(at[0], at[1]))
    misses[-1], jacobian[-1] = far - distance_m, [at[0] / far, at[1] / far, 0.0]
    return misses, jacobian


def expected_side(bench: Workbench, circle: Circle, eye_m: FloatArray, mask: BoolArray, side: int) -> Line:
    """Return the side of the circle as a line in the photo taken from `eye_m`, its normal pointing off the column.

    It runs as far as the mask (H, W) does in the left photo.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    camera, view = bench.pair.camera, bench.scene.level.view
    dx, dz = circle.x_m - eye_m[0], circle.z_m - eye_m[1]
    bearing = np.arctan2(dx, dz) + side * np.arcsin(min(circle.radius_m / float(np.hypot(dx, dz)), 0.9))
    row = float(np.median(rows))
    # the level ray with this bearing that meets the row
    by_rise = view.level_from_rectified[:, 1] - (row - camera.cy_px) / camera.f_px * view.level_from_rectified[:, 2]
    rise = -(by_rise[0] * np.sin(bearing) + by_rise[2] * np.cos(bearing)) / by_rise[1]
    ray = np.array([np.sin(bearing), rise, np.cos(bearing)]) @ view.level_from_rectified
    foot = ray[:2] / ray[2] * camera.f_px + [camera.cx_px, camera.cy_px]
    run = 0.46 * float(rows[-1] - rows[0]) * image_direction(view.down, foot, camera)
    line = Line(start=foot - run, stop=foot + run)
    return line if line.normal[0] * side > 0.0 else Line(start=line.stop, stop=line.start)


def _settled(slopes: Gradients, line: Line, plane: FloatArray) -> tuple[Line, float, float] | None:
    """Return the edge near `line`, its sigma across and its ambiguity: by both photos, else by this one alone."""
    for alone, least in ((False, LEAST_STRENGTH), (True, ALONE_STRENGTH)):
        fit = find_edge(slopes, line, plane, FACE_GREY, least, alone=alone)
        if fit is not None:
            own_px = np.sqrt(fit.sigma_px**2 - fit.ambiguity_px**2)
            return fit.line, float(np.hypot(own_px, ALONE_SIGMA_PX * alone)), fit.ambiguity_px
    return None


def _as_ray(
    bench: Workbench, line: Line, sigma_px: float, ambiguity_px: float, eye_m: FloatArray, side: int
) -> Silhouette:
    camera = bench.pair.camera
    rays = np.ones((2, 3))
    rays[:, :2] = (np.stack([line.start, line.stop]) - [camera.cx_px, camera.cy_px]) / camera.f_px
    level_x, _, _ = bench.scene.level.view.coordinates(rays)
    tangent = float(level_x.mean() / camera.f_px)
    rad_per_px = 1.0 / camera.f_px / (1.0 + tangent**2)
    return Silhouette(
        eye_m=eye_m, bearing_rad=float(np.arctan(tangent)), sigma_rad=sigma_px * rad_per_px, side=side,
        ambiguity_rad=ambiguity_px * rad_per_px,
    )  # fmt: skip


def _swapped(bench: Workbench) -> Gradients:
    own = bench.slopes
    return Gradients(
        left_x=own.right_x, left_y=own.right_y, right_x=own.left_x, right_y=own.left_y,
        valid_right=bench.pair.valid_left.astype(np.float32),
    )  # fmt: skip


def _inside(line: Line, valid: BoolArray) -> bool:
    """Say whether most of a line, and a few px beside it, lies in the photo."""
    height, width = valid.shape
    points = line.start + np.linspace(0.0, 1.0, 24)[:, None] * (line.stop - line.start) + 4.0 * line.normal
    x, y = np.round(points).astype(np.intp).T
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    return bool(np.mean(inside & valid[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]) > 1.0 - MOST_AT_FRAME)


def chord_plane(bench: Workbench, circle: Circle) -> FloatArray:
    """Return q (3,) of the upright plane through both tangent lines: what the silhouettes' disparity is."""
    distance = float(np.hypot(circle.x_m, circle.z_m))
    depth_m = distance * (1.0 - (circle.radius_m / distance) ** 2)
    f, b = circle.f_px, circle.baseline_m
    x, z = circle.x_m / distance, circle.z_m / distance
    return bench.scene.level.view.q_upright(b * x / depth_m, f * b * z / depth_m)
