"""Does a mask alone draw an outline inwards? A notch that no photo shows is where depth was lost, not where it ends."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline import MASK_SIGMA_PX, Outline
from asbuilt_bim.measure.walk import owners, walk

LEAST_DRAWN_PX = 10.0


def is_notched(outline: Outline) -> bool:
    """Say whether a notch of the outer ring, deeper than a mask's border errs, has a side that only a mask draws.

    Concrete's own notches, a door beside a wall's end, show their sides in the photos. What stereo loses of a face, in
    the shade at its foot or behind bars, is beside other surfaces too, and these seem to prove that the face ends.
    """
    if not outline.rings:
        return False
    points, normals, steps = walk(outline.rings[0])
    owner = owners([edge.line for edge in outline.edges], points, normals)
    drawn = np.array([number < 0 or outline.edges[number].source == "mask" for number in owner])
    for notch in _notches(outline.rings[0]):
        inside = np.array([cv2.pointPolygonTest(notch, (float(x), float(y)), True) > -0.5 for x, y in points])
        if float(steps[inside & drawn].sum()) > LEAST_DRAWN_PX:
            return True
    return False


def _notches(ring: FloatArray) -> Iterator[FloatArray]:
    """Yield what lies between a ring and its convex hull, each a ring of its own as float32."""
    corners = ring.astype(np.float32)
    hull = np.sort(cv2.convexHull(corners, returnPoints=False).ravel())
    for first, last in zip(hull, np.roll(hull, -1), strict=True):
        count = int(last - first) % len(ring)
        between = corners[(first + np.arange(count + 1)) % len(ring)]
        if count > 1 and _depth_px(between) > MASK_SIGMA_PX:
            yield between


def _depth_px(between: FloatArray) -> float:
    along = between[-1] - between[0]
    across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    return float(np.max(np.abs((between - between[0]) @ across)))
