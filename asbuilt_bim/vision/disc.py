"""Red discs in one photo: their outline to a fraction of a pixel, and how sure it is that they are discs."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray
from asbuilt_bim.vision.edges import edge_channels, find_edges
from asbuilt_bim.vision.ellipse import Ellipse, robust_ellipse
from asbuilt_bim.vision.red import RedBlob, red_blobs, redness

MIN_SUPPORT = 0.57
"""Share of the outline that must be seen: a disc with 30 % of its area covered shows 59 %, half a disc 50 %."""
MIN_ASPECT = 0.4
"""Minor over major axis: a disc turned by more than 66 degrees is too thin to be told from a strip."""
MIN_RADIUS_PX = 5.0
MAX_BLOBS = 12
_MAX_EDGE_POINTS = 180
_PATCH_MARGIN = 1.6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RedDisc:
    """A red disc in one photo: `edge` (N, 2) are the outline's points that were found, `rms_px` their misfit.

    `support` is the share of the outline that they make up, `filled` the share of its inside that is red.
    """

    ellipse: Ellipse
    edge: FloatArray
    rms_px: float
    support: float
    filled: float


def find_discs(image: ByteImage) -> tuple[RedDisc, ...]:
    """Find the red discs of a photo (BGR), the best supported first; half-hidden or odd shapes are left out."""
    score = redness(image)
    discs = [disc for blob in red_blobs(score, MAX_BLOBS) if (disc := _disc(image, score, blob)) is not None]
    kept: list[RedDisc] = []
    for disc in sorted(discs, key=lambda d: (-d.support, d.rms_px)):
        if all(np.hypot(*(disc.ellipse.centre - k.ellipse.centre)) > 0.5 * k.ellipse.major_px for k in kept):
            kept.append(disc)
    return tuple(kept)


def _disc(image: ByteImage, score: Float32Array, blob: RedBlob) -> RedDisc | None:
    """Follow a blob's outline with sub-pixel edges and judge the shape; None where it is no disc."""
    size = float(np.sqrt(blob.area_px / np.pi))
    started = robust_ellipse(_thinned(blob.outline), max(1.5, 0.04 * size))
    if started is None:
        return None
    ellipse = started[0]
    corner, light, red = _patch(image, score, ellipse)
    if light.size == 0 or not _plausible(ellipse, blob):
        return None
    edge, is_on = np.empty((0, 2)), np.zeros(0, dtype=bool)
    tolerance, on_outline = 0.3 + 0.015 * ellipse.major_px, 0.5 + 0.012 * ellipse.major_px
    for reach_share in (0.3, 0.15, 0.15):
        reach = float(np.clip(reach_share * ellipse.major_px, 2.5, 9.0))
        edge = _edge(light, red, corner, ellipse, reach)
        seen = edge[np.isfinite(edge[:, 0])]
        fitted = robust_ellipse(seen, max(tolerance, 0.2 * reach))
        if fitted is None or not _plausible(fitted[0], blob):
            return None
        ellipse, is_on = fitted[0], np.abs(fitted[0].distance_px(seen)) < on_outline
        edge_count, edge = len(edge), seen[is_on]
    support = len(edge) / edge_count
    if support < MIN_SUPPORT:
        return None
    filled = _filled(red, corner, ellipse)
    rms = float(np.sqrt(np.mean(ellipse.distance_px(edge) ** 2)))
    # What hides a part of the outline hides a part of the inside too; more missing than that is a print or a hole.
    if filled < 0.9 * support or rms > tolerance:
        return None
    return RedDisc(ellipse=ellipse, edge=edge, rms_px=rms, support=support, filled=filled)


def _thinned(outline: FloatArray) -> FloatArray:
    return outline[:: max(1, len(outline) // 160)]


def _plausible(ellipse: Ellipse, blob: RedBlob) -> bool:
    _, _, width, height = blob.box_px
    return (
        ellipse.minor_px >= max(MIN_RADIUS_PX * 0.6, MIN_ASPECT * ellipse.major_px)
        and ellipse.major_px >= MIN_RADIUS_PX
        and ellipse.major_px < 0.9 * max(width, height)
    )


def _patch(image: ByteImage, score: Float32Array, ellipse: Ellipse) -> tuple[FloatArray, Float32Array, Float32Array]:
    """Cut the ellipse's surroundings out: their corner (2,), linear light, redness."""
    reach = _PATCH_MARGIN * ellipse.major_px + 10.0
    x0, y0 = np.maximum(np.floor(ellipse.centre - reach), 0).astype(int)
    x1, y1 = np.maximum(np.ceil(ellipse.centre + reach), 0).astype(int) + 1
    corner = np.array([x0, y0], dtype=np.float64)
    return corner, edge_channels(np.ascontiguousarray(image[y0:y1, x0:x1])), score[y0:y1, x0:x1]


def _edge(light: Float32Array, red: Float32Array, corner: FloatArray, ellipse: Ellipse, reach: float) -> FloatArray:
    """Return edge points (N, 2) round the ellipse; NaN where the inside isn't red or the outside is just as red."""
    count = int(np.clip(ellipse.perimeter_px / 1.2, 32, _MAX_EDGE_POINTS))
    points, outward = ellipse.outline(count)
    edges = find_edges(light, points - corner, outward, reach)
    just_inside = _at(red, points - corner - 0.6 * reach * outward)
    just_outside = _at(red, points - corner + 0.6 * reach * outward)
    typical = float(np.median(just_inside))
    is_red: BoolArray = (just_inside > 0.5 * typical) & (just_outside < 0.8 * just_inside)
    return np.where(is_red[:, None], edges.points + corner, np.nan)


def _at(picture: Float32Array, points: FloatArray) -> FloatArray:
    x, y = points.astype(np.float32).T
    values = cv2.remap(
        picture, x[:, None].copy(), y[:, None].copy(), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.0
    )
    return np.asarray(values, dtype=np.float64).ravel()


def _filled(red: Float32Array, corner: FloatArray, ellipse: Ellipse) -> float:
    """Return the share of the ellipse's inside, a margin off, that is as red as its typical pixel."""
    height, width = red.shape
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2) + corner
    homogeneous = np.c_[grid, np.ones(len(grid))]
    inside = (np.sum((homogeneous @ ellipse.conic) * homogeneous, axis=-1) < -0.3).reshape(height, width)
    values = red[inside]
    return float(np.mean(values > 0.5 * np.median(values))) if values.size else 0.0
