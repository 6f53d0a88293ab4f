"""How sure an area is: what the photos leave open (the face's own), and what the calibration does (shared by all)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import seen_points
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply
from asbuilt_bim.vision.stereo.rig_fit import LENS_CELLS, seen_by


def polygon_area(points_m: FloatArray) -> float:
    """Return the area of a nearly flat ring (N, 3) in space: half the length of its vector area."""
    return polygon_areas(points_m[None])[0]


def polygon_areas(rings_m: FloatArray) -> list[float]:
    """Return the area of each of M nearly flat rings (M, N, 3) in space."""
    centred = rings_m - rings_m.mean(axis=1, keepdims=True)
    turning = centred.transpose(0, 2, 1) @ np.roll(centred, -1, axis=1)
    return [  # the cross products' sum is what isn't symmetric in it
        0.5 * math.hypot(yz - zy, zx - xz, xy - yx) for (_, xy, xz), (yx, _, yz), (zx, zy, _) in turning.tolist()
    ]


def rings_area_m2(rings_px: Sequence[FloatArray], q_px: FloatArray, camera: RectifiedCamera) -> float:
    """Return an outline's area (rectified px, the first ring outer) on the plane q: the outer ring less its holes."""
    areas = [polygon_area(_on_plane(ring, q_px, camera)) for ring in rings_px]
    return areas[0] - sum(areas[1:])


def area_per_pixel_m2(pixel: FloatArray, q_px: FloatArray, camera: RectifiedCamera) -> float:
    """Return the surface in m2 that one pixel at `pixel` (2,) sees of the plane q.

    A pixel's cone meets the plane n . X = h in h^2 / (f^2 (n . r)^3).
    """
    ray = camera.rectified_rays(pixel)
    height = camera.f_px * camera.baseline_m / float(np.linalg.norm(q_px))
    cosine = max(float(q_px @ ray) / float(np.linalg.norm(q_px)), 1e-3)
    return height**2 / (camera.f_px**2 * cosine**3)


def image_sigma_m2(
    rings_px: Sequence[FloatArray],
    edges: Sequence[tuple[FloatArray, float, float]],
    free_px: float,
    q_px: FloatArray,
    covariance: FloatArray,
    camera: RectifiedCamera,
) -> float:
    """Return the area's own sigma: the plane's covariance and each side's, which move it independently.

    `edges`: middle (2,) px, length px and sigma px of each straight side; `free_px` is the length without a line.
    """
    area = rings_area_m2(rings_px, q_px, camera)
    values, vectors = np.linalg.eigh(covariance)
    variance = 0.0
    for step in (vectors * np.sqrt(np.maximum(values, 0.0))).T:
        more, less = (rings_area_m2(rings_px, q_px + sign * step, camera) for sign in (1.0, -1.0))
        variance += _squared_m4(more, less, area)
    for middle, length, sigma in edges:
        variance += (length * sigma * area_per_pixel_m2(middle, q_px, camera)) ** 2
    # a ragged border errs by a pixel over runs of about 8, each on its own, and by half a pixel all along
    middle = rings_px[0].mean(axis=0)
    variance += (free_px * 8.0 + (0.5 * free_px) ** 2) * area_per_pixel_m2(middle, q_px, camera) ** 2
    return float(np.sqrt(max(variance, 0.0)))


def _squared_m4(more: float, less: float, area: float) -> float:
    """Return an area's mean squared error by one number that errs by a sigma: what +1 and -1 sigma make of the area.

    A face seen from the front only grows by a tilt, whichever way: the slope there is none, and the bend is all. Of a
    normal error the bend's square has three times the weight.
    """
    return (0.5 * (more - less)) ** 2 + 3.0 * (0.5 * (more + less) - area) ** 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigPart:
    """What the rig leaves open of one face, the same at every photo: its area, and where its plane q lies."""

    area_sigma_m2: float
    q_covariance: FloatArray  # (3, 3) px2


def calibration_sigmas_m2(
    outlines: Sequence[tuple[Sequence[FloatArray], FloatArray]],
    rig: StereoRig,
    camera: RectifiedCamera,
    rows_px: float = 0.0,
) -> FloatArray:
    """Return each area's sigma (n,) by the rig, as `rig_parts` has it."""
    return np.array([part.area_sigma_m2 for part in rig_parts(outlines, rig, camera, rows_px)])


def rig_parts(
    outlines: Sequence[tuple[Sequence[FloatArray], FloatArray]],
    rig: StereoRig,
    camera: RectifiedCamera,
    rows_px: float = 0.0,
) -> list[RigPart]:
    """Return what the rig's covariance leaves open of each face, or what a rig without one is trusted to.

    `outlines`: rings (rectified px) and q (3,) of each face. The outline's points are seen at fixed places in both
    photos; each of the rig's numbers is moved by its sigma and the points are triangulated again. `rows_px`, what
    this pair's rows lie apart, is left by the lenses along the rows, too.
    """
    if not outlines:
        return []
    is_known = bool(np.any(rig.covariance))
    turn_rad = np.zeros(5) if is_known else np.array(rig.width.turn_rad)
    lens_px = max(rig.lens_left_px, rows_px)
    by_disparity = [_by_disparity(rings, q, camera, turn_rad, lens_px) for rings, q in outlines]
    if is_known:
        by_rig = _by_covariance(outlines, rig, camera)
    else:
        by_rig = [_by_scale(rings, q, camera, rig.width.scale_share) for rings, q in outlines]
    return [_both(one, other) for one, other in zip(by_disparity, by_rig, strict=True)]


def _both(one: RigPart, other: RigPart) -> RigPart:
    return RigPart(
        area_sigma_m2=float(np.hypot(one.area_sigma_m2, other.area_sigma_m2)),
        q_covariance=one.q_covariance + other.q_covariance,
    )


def _by_scale(rings_px: Sequence[FloatArray], q_px: FloatArray, camera: RectifiedCamera, share: float) -> RigPart:
    """Return what a scale leaves open: an area goes with the square of lengths, q with one over them."""
    return RigPart(
        area_sigma_m2=2.0 * share * rings_area_m2(rings_px, q_px, camera), q_covariance=share**2 * np.outer(q_px, q_px)
    )


def _by_covariance(
    outlines: Sequence[tuple[Sequence[FloatArray], FloatArray]], rig: StereoRig, camera: RectifiedCamera
) -> list[RigPart]:
    steps = np.sqrt(np.maximum(np.diag(rig.covariance), 1e-20))
    points = [[_left_points(ring, q, camera) for ring in rings] for rings, q in outlines]
    flat = [ring for rings in points for ring in rings]
    ends = np.cumsum([len(ring) for ring in flat])[:-1]
    in_left = np.concatenate(flat)
    in_right = apply(rig.right_from_left, in_left)
    seen = seen_points(rig, *(at[:, :2] / at[:, 2:] for at in (in_left, in_right)))
    to_plane = [np.linalg.pinv(outer @ camera.rectified_from_left.T) for outer, *_ in points]
    areas, planes = np.zeros((len(outlines), len(steps))), np.zeros((len(outlines), 3, len(steps)))
    for k, change in enumerate(np.diag(steps)):
        for sign in (1.0, -1.0):
            moved = iter(np.split(midpoints(*seen.rays(sign * change)), ends))
            for i, (rings, q) in enumerate(outlines):
                outer, *holes = (next(moved) for _ in rings)
                area = polygon_area(outer) - sum(map(polygon_area, holes))
                areas[i, k] += sign * 0.5 * area / steps[k]
                # q . X is the same for all X of a plane: where X moves, q turns against it
                planes[i, :, k] -= sign * 0.5 * to_plane[i] @ (outer @ camera.rectified_from_left.T @ q) / steps[k]
    variance = np.einsum("ik,kl,il->i", areas, rig.covariance, areas)
    return [
        RigPart(area_sigma_m2=float(np.sqrt(max(one, 0.0))), q_covariance=by_rig @ rig.covariance @ by_rig.T)
        for one, by_rig in zip(variance, planes, strict=True)
    ]


def _by_disparity(
    rings_px: Sequence[FloatArray], q_px: FloatArray, camera: RectifiedCamera, turn_rad: FloatArray, lens_px: float
) -> RigPart:
    """Return what a turn (5,) and the lenses leave open by the disparity that they leave over the frame."""
    modes = [left_of_disparity_px(ring, q_px, camera, turn_rad, lens_px) for ring in rings_px]
    area, variance = rings_area_m2(rings_px, q_px, camera), 0.0
    signed = [np.concatenate([mode.T, -mode.T]) for mode in modes]
    rings = [polygon_areas(_on_plane(ring, q_px, camera, px)) for ring, px in zip(rings_px, signed, strict=True)]
    moved = [outer - sum(holes) for outer, *holes in zip(*rings, strict=True)]
    for more, less in zip(moved[: len(moved) // 2], moved[len(moved) // 2 :], strict=True):
        variance += _squared_m4(more, less, area)
    planes = np.linalg.pinv(camera.rectified_rays(rings_px[0])) @ modes[0]
    return RigPart(area_sigma_m2=float(np.sqrt(variance)), q_covariance=planes @ planes.T)


def left_of_disparity_px(
    pixels: FloatArray, q_px: FloatArray, camera: RectifiedCamera, turn_rad: FloatArray, lens_px: float
) -> FloatArray:
    """Return what a rig leaves of disparity at pixels (N, 2) of a plane, (N, 24 and more) in px.

    Each column is one independent error of one sigma: the turn's five numbers where they aren't zero, and the lenses'
    at each cell of the frame, between which they change smoothly.
    """
    columns = [lens_px * hats(pixels, camera)]
    points = _on_plane(pixels, q_px, camera)
    for turn in np.diag(turn_rad)[turn_rad > 0.0]:
        left, right = seen_by(points, turn, camera)
        columns.append((camera.f_px * (left[:, 0] - right[:, 0]) - camera.rectified_rays(pixels) @ q_px)[:, None])
    return np.concatenate(columns, axis=1)


def hats(pixels: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return (N, cells): how much of each cell's value a pixel has, linear between the cells' middles."""
    weights = []
    for along, count, size in zip(pixels.T, LENS_CELLS, (camera.width_px, camera.height_px), strict=True):
        at = np.clip((along + 0.5) * count / size - 0.5, 0.0, count - 1.0)
        weights.append(np.maximum(1.0 - np.abs(at[:, None] - np.arange(count)), 0.0))
    hats: FloatArray = (weights[1][:, :, None] * weights[0][:, None, :]).reshape(len(pixels), -1)
    return hats


def _on_plane(
    ring: FloatArray, q_px: FloatArray, camera: RectifiedCamera, more_px: FloatArray | float = 0.0
) -> FloatArray:
    rays = camera.rectified_rays(ring)
    disparity = np.maximum(rays @ q_px + more_px, 1e-3)
    points: FloatArray = rays * (camera.f_px * camera.baseline_m / disparity)[..., None]
    return points


def _left_points(ring: FloatArray, q_px: FloatArray, camera: RectifiedCamera) -> FloatArray:
    points: FloatArray = _on_plane(ring, q_px, camera) @ camera.rectified_from_left
    return points
