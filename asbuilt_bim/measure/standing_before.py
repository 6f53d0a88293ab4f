"""What stands before measured faces: people among them, so that pictures can leave without them, network or not."""

from collections.abc import Iterator

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.depth_reference import unpack
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.station import StationMeasurement

SIGMAS = 3.0
LEAST_BEFORE_M = 0.1
"""Who leans on a wall stands out of it by a chest's depth; bolts, chamfers and steps of formwork don't."""
LEAST_ACROSS_M = 0.1
"""A trunk or a head is wider; bars, props and rails aren't, and nobody is known by them."""
ROUND_M = 0.06
"""Stereo ends short of hair and hands by some pixels, of a block's width."""
MOST_RINGS, SMALLEST_PX = 100, 3.0


def standing_before(station: StationMeasurement) -> tuple[FloatArray, ...]:
    """Return rings (N, 2), in rectified pixels, round what a station sees nearer than the faces that it measured.

    It is seen by depth alone, so who is flat on the wall by under 0.1 m, or further off than stereo reaches, isn't in
    them. What is narrower than 0.1 m is left out. At most the hundred largest.
    """
    if not station.depth_ref.png or not station.faces:
        return ()
    disparity, sigma, scale = unpack(station.depth_ref)
    nearer = np.zeros(disparity.shape, dtype=bool)
    for face in (one for one in station.faces if one.outline_px):
        nearer |= _nearer(face, station, disparity, sigma, scale)
    rings: list[tuple[float, FloatArray]] = []
    for body in _bodies(nearer, disparity, station, scale):
        found, _ = cv2.findContours(body.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        for ring in found:
            plain = cv2.approxPolyDP(ring, 0.75, True)[:, 0].astype(np.float64)
            if len(plain) >= 3:
                rings.append((float(cv2.contourArea(ring)), frozen((plain + 0.5) * scale - 0.5)))
    return tuple(ring for _, ring in sorted(rings, key=lambda one: -one[0])[:MOST_RINGS])


def _nearer(
    face: MeasuredFace, station: StationMeasurement, disparity: Float32Array, sigma: Float32Array, scale: int
) -> BoolArray:
    """Return where (h, w) the depth reference is nearer than a face, within its outer ring."""
    height, width = disparity.shape
    inside = np.zeros((height, width), dtype=np.uint8)
    ring = np.clip((np.asarray(face.outline_px[0]) + 0.5) / scale - 0.5, -width, 2.0 * width)
    cv2.fillPoly(inside, [np.round(ring).astype(np.int32)], 1)
    rows, columns = np.nonzero(inside)
    known = np.isfinite(disparity[rows, columns]) & (disparity[rows, columns] > 0.0)
    rows, columns = rows[known], columns[known]
    pixels = (np.stack([columns, rows], axis=-1) + 0.5) * scale - 0.5
    camera = station.camera
    met = (face.frame.plane if isinstance(face.frame, PlaneFrame) else face.frame).intersect(
        np.zeros(3), camera.rays(pixels)
    )
    depth = camera.f_px * camera.baseline_m / disparity[rows, columns].astype(np.float64)
    of_face = met @ camera.rectified_from_left[2]
    sigma_m = depth**2 / (camera.f_px * camera.baseline_m) * sigma[rows, columns]
    found = np.zeros((height, width), dtype=bool)
    found[rows, columns] = of_face - depth > np.hypot(SIGMAS * sigma_m, LEAST_BEFORE_M)  # NaN beside a cylinder: False
    return found


def _bodies(nearer: BoolArray, disparity: Float32Array, station: StationMeasurement, scale: int) -> Iterator[BoolArray]:
    """Yield each connected piece (h, w) that is wide enough, with what is round it."""
    closed = cv2.morphologyEx(nearer.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    count, labels = cv2.connectedComponents(closed)
    inner = cv2.distanceTransform(closed, cv2.DIST_L2, 3)
    for number in range(1, count):
        own = labels == number
        seen = disparity[own & nearer]
        if not len(seen):
            continue
        pixels_per_m = float(np.median(seen)) / station.camera.baseline_m / scale  # f / Z
        across_px = 2.0 * float(inner[own].max())
        if across_px >= max(SMALLEST_PX, LEAST_ACROSS_M * pixels_per_m):
            wide = 2 * max(1, round(ROUND_M * pixels_per_m)) + 1
            yield cv2.dilate(own.astype(np.uint8), np.ones((wide, wide), np.uint8)) > 0
