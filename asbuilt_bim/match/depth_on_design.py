"""What depth shows of elements: which of them are where they are designed, and how much of one it sees past."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.bim.cells import CellSamples, cell_samples
from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.geometry.transform import apply, inverse, rotate
from asbuilt_bim.measure.depth_reference import unpack
from asbuilt_bim.register.pose import PlacedStation


def elements_shown(
    stations: Sequence[PlacedStation], design: BimModel, reach_m: float, band_m: float, least_share: float
) -> frozenset[str]:
    """Return the elements (GlobalIds) of which one station's depth lies on a face: on `least_share` of it and more.

    Depth lies on a face within `band_m` of its plane. Elements that are further off than `reach_m` aren't asked.
    """
    shown: set[str] = set()
    for placed in stations:
        disparity, _, scale = unpack(placed.measurement.depth_ref)
        for element in _near(placed, design, reach_m):
            samples = cell_samples(element)
            there = samples.area_m2 * (np.abs(_before_m(placed, disparity, scale, samples)) <= band_m)
            on = np.bincount(samples.face, weights=there, minlength=len(element.faces))
            of = np.bincount(samples.face, weights=samples.area_m2, minlength=len(element.faces))
            if np.any(on >= least_share * of, where=of > 0.0):
                shown.add(element.global_id)
    return frozenset(shown)


def seen_past_m2(
    stations: Iterable[PlacedStation], element: BimElement, move_m: FloatArray, top_m: float, band_m: float
) -> float:
    """Return how much of an element (m2), moved and as high as `top_m`, stations see past: `band_m` behind it and more.

    Each station's depth counts. Where something stands before it, or nothing was measured, none of it does.
    """
    samples = cell_samples(element)
    samples = replace(samples, points_m=samples.points_m + move_m)
    stands, past_m2 = samples.points_m[:, 2] <= top_m, 0.0
    for placed in stations:
        disparity, _, scale = unpack(placed.measurement.depth_ref)
        is_past = _before_m(placed, disparity, scale, samples) < -band_m
        past_m2 += float(samples.area_m2[stands & is_past].sum())
    return past_m2


def _near(placed: PlacedStation, design: BimModel, reach_m: float) -> Iterator[BimElement]:
    """Give the elements of which a corner is within reach."""
    eye = placed.pose.world_from_left[:3, 3]
    for element in design.elements:
        if len(element.vertices_m) and np.linalg.norm(element.vertices_m - eye, axis=1).min() < reach_m:
            yield element


def _before_m(placed: PlacedStation, disparity: Float32Array, scale: int, samples: CellSamples) -> FloatArray:
    """Return how far the measured surface stands before samples (N,) of another, along its normal.

    Minus infinity where there is sky, NaN where nothing was measured, or where the sample isn't in view.
    """
    camera, left_from_world = placed.measurement.camera, inverse(placed.pose.world_from_left)
    points, facing = apply(left_from_world, samples.points_m), rotate(left_from_world, samples.normals)
    towards = np.sum(points * facing, axis=1)  # negative: the surface faces the station
    height, width = disparity.shape
    with np.errstate(invalid="ignore"):
        at = np.floor((camera.project(points) + 0.5) / scale)
        inside = np.all((at >= 0) & (at < [width, height]), axis=1) & (towards < 0.0)
    column, row = np.where(inside[:, None], at, 0).astype(int).T
    measured = np.where(inside, disparity[row, column], np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        designed = camera.f_px * camera.baseline_m / (points @ camera.rectified_from_left[2])
        stretched = designed / measured  # the measured point is the sample's times this
        before_m: FloatArray = (stretched - 1.0) * towards
    return before_m
