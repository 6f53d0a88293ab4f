"""Does a mask alone draw an outline inwards? A notch that no photo shows is where depth was lost, not where it ends."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.fit import MASK_SIGMA_PX, Outline
from asbuilt_bim.measure.outline.profile import outwards, owners, walk
from asbuilt_bim.measure.outline.ring_from_lines import pixel_area
from asbuilt_bim.measure.outline.straight import BEHIND_PX
from asbuilt_bim.measure.workbench import Workbench

LEAST_DRAWN_PX = 10.0
LEAST_SHARE = 0.02
"""What is lost at a notch is about as large as itself: less of a face is no more than its borders may err."""
BEYOND_PX = (4.0, 6.0, 8.0, 11.0)
"""Past the pixels over which the matcher's window carries the face on."""


def is_notched(bench: Workbench, outline: Outline, q_px: FloatArray) -> bool:
    """Say whether a notch of the outer ring, deeper than a mask's border errs, has a side that only a mask draws.

    Concrete's own notches, a door beside a wall's end, show their sides in the photos, or what lies behind them. What
    stereo loses of a face, in the shade at its foot or behind bars, is beside other surfaces, and these seem to prove
    that the face ends.
    """
    if not outline.rings:
        return False
    ring = outline.rings[0]
    points, normals, steps = walk(ring)
    owner = owners([edge.line for edge in outline.edges], points, normals)
    drawn = np.array([number < 0 or outline.edges[number].source == "mask" for number in owner])
    drawn &= ~_seen_through(bench, points, normals, pixel_plane(q_px, bench.pair.camera))
    for notch in _notches(ring):
        beside = [cv2.pointPolygonTest(notch, (float(x), float(y)), True) > -0.5 for x, y in points]
        if float(steps[np.array(beside) & drawn].sum()) > LEAST_DRAWN_PX:
            return True
    return False


def _seen_through(bench: Workbench, points: FloatArray, normals: FloatArray, p: FloatArray) -> BoolArray:
    """Say at which places (N,) what is measured first beyond the outline lies behind the face's plane."""
    behind, known = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for seen in outwards(bench, points, normals, p, BEYOND_PX):
        behind |= seen.measured & ~known & (seen.step_px < -BEHIND_PX)
        known |= seen.measured
    return behind


def _notches(ring: FloatArray) -> Iterator[FloatArray]:
    """Yield what lies between a ring and its convex hull and counts, each a ring of its own as float32."""
    corners = ring.astype(np.float32)
    hull = np.sort(cv2.convexHull(corners, returnPoints=False).ravel())
    least_px2 = LEAST_SHARE * abs(pixel_area(ring))
    for first, last in zip(hull, np.roll(hull, -1), strict=True):
        count = int(last - first) % len(ring)
        between = corners[(first + np.arange(count + 1)) % len(ring)]
        if count > 1 and _depth_px(between) > MASK_SIGMA_PX and abs(pixel_area(between)) > least_px2:
            yield between


def _depth_px(between: FloatArray) -> float:
    along = between[-1] - between[0]
    across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    return float(np.max(np.abs((between - between[0]) @ across)))
