"""Red discs in one photo: their outline to a fraction of a pixel, and how sure it is that they are discs."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray
from asbuilt_bim.vision.edges import find_edges
from asbuilt_bim.vision.ellipse import Ellipse, robust_ellipse
from asbuilt_bim.vision.red import RedBlob, red_blobs, redness

MIN_SUPPORT = 0.57
"""Share of the outline that must be seen: a disc with 30 % of its area covered shows 59 %, half a disc 50 %."""
MIN_ASPECT = 0.4
"""Minor over major axis: a disc turned by more than 66 degrees is too thin to be told from a strip."""
MIN_RADIUS_PX = 5.0
MAX_BLOBS = 16
_MAX_EDGE_POINTS = 180
_PATCH_MARGIN = 1.6
_THINGS_IN_A_BLOB = 3
LEAST_FILLED = 0.6
"""Of the inside: 30 % may be covered, and blur at the cover's edges looks like cover."""
MOST_HOLE = 0.06
"""Of the inside: what is covered reaches the outline; a hole that doesn't is a print on a sign."""
MOST_INSIDE = 4.0
"""A cover hides outline where it hides inside: a bar twice as much of the inside, so more is a print near the rim."""
_BLURRED_ENDS = 3
"""Edge points next to a covered stretch of the outline that are left out: the cover's own edge bends them."""
_TONE = 1.8
"""A lens blurs light (exponent 2.2), JPEG's halved colour blurs grey levels (1): edges of both kinds meet between."""
_JPEG_BLUR_PX = 1.0  # brightness is blurred as colour is, so that both pass one half in one place
_SENSOR = 2e-5  # of linear light squared: noise that two rings of a patch may not show


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """A disc's surroundings: `corner` (2,) in the photo, `light` (H, W, 1) that shows the edge best, `red` (H, W)."""

    corner: FloatArray
    light: Float32Array
    red: Float32Array


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
    redness: float  # 0..1, the median of the inside: a disc in shade keeps it, its reflection doesn't
    patch: Patch


def find_discs(image: ByteImage) -> tuple[RedDisc, ...]:
    """Find the red discs of a photo (BGR), the best supported first; half-hidden or odd shapes are left out."""
    score = redness(image)
    discs = [disc for blob in red_blobs(score, MAX_BLOBS) if (disc := _disc(image, score, blob)) is not None]
    kept: list[RedDisc] = []
    for disc in sorted(discs, key=lambda d: (-d.support, d.rms_px)):
        if not any(_is_same(disc.ellipse, other.ellipse) for other in kept):
            kept.append(disc)
    return tuple(kept)


def _is_same(one: Ellipse, other: Ellipse) -> bool:
    """Say whether two ellipses are one: a piece of a disc that a bar cuts off is round too, and smaller."""
    apart = float(np.hypot(*(one.centre - other.centre)))
    return (
        apart < 0.5 * other.major_px
        and abs(np.log(one.major_px * one.minor_px / other.major_px / other.minor_px)) < 0.2
    )


def _disc(image: ByteImage, score: Float32Array, blob: RedBlob) -> RedDisc | None:
    """Follow a blob's outline with sub-pixel edges and judge the shape; None where it is no disc.

    A disc before something as red has grown together with it: what most of the outline fits may be the other thing, so
    its points are taken off and the rest is asked again.
    """
    size = float(np.sqrt(blob.area_px / np.pi))
    outline = _thinned(blob.outline)
    for _ in range(_THINGS_IN_A_BLOB):
        started = robust_ellipse(outline, max(1.5, 0.04 * size))
        if started is None:
            return None
        disc = _disc_at(image, score, blob, started[0])
        if disc is not None:
            return disc
        outline = outline[~started[1]]
    return None


def _disc_at(image: ByteImage, score: Float32Array, blob: RedBlob, ellipse: Ellipse) -> RedDisc | None:
    """Follow the edge of a blob from a first ellipse on."""
    if not _plausible(ellipse, blob):
        return None
    patch = _patch(image, score, ellipse)
    if patch.light.size == 0:
        return None
    edge, is_on = np.empty((0, 2)), np.zeros(0, dtype=bool)
    tolerance = _tolerance_px(ellipse)
    for reach_share in (0.3, 0.3, 0.25):
        edge = _edge(patch, ellipse, reach_px(ellipse, reach_share))
        is_seen = np.isfinite(edge[:, 0])
        fitted = robust_ellipse(edge[is_seen], max(tolerance, 0.2 * reach_px(ellipse, reach_share)))
        if fitted is None or not _plausible(fitted[0], blob):
            return None
        ellipse = fitted[0]
        is_on = _on_outline(edge, ellipse)
    return _judged(ellipse, edge, is_on, patch)


def followed(disc: RedDisc, ellipse: Ellipse) -> RedDisc | None:
    """Follow a disc's outline again, along an ellipse that both photos agree on; None where it isn't there."""
    edge = _edge(disc.patch, ellipse, reach_px(ellipse, 0.25))
    return _judged(ellipse, edge, _on_outline(edge, ellipse), disc.patch)


def reach_px(ellipse: Ellipse, share: float) -> float:
    """Return how far to both sides of an outline its edge is looked for."""
    return float(np.clip(share * ellipse.minor_px, 2.5, 8.0))


def _judged(ellipse: Ellipse, edge: FloatArray, is_on: BoolArray, patch: Patch) -> RedDisc | None:
    """Return the disc where enough of its outline and inside is seen, None otherwise."""
    support = float(np.mean(is_on))
    if support < MIN_SUPPORT:
        return None
    edge = edge[_without_ends(is_on)]
    filled, hole = _filled(patch, ellipse)
    rms = float(np.sqrt(np.mean(ellipse.distance_px(edge) ** 2)))
    is_printed = hole > MOST_HOLE or 1.0 - filled > MOST_HOLE + MOST_INSIDE * (1.0 - support)
    if filled < LEAST_FILLED or is_printed or rms > _tolerance_px(ellipse):
        return None
    inside = patch.red[_conic_value(patch.red.shape, patch.corner, ellipse) < -0.3]
    return RedDisc(
        ellipse=ellipse, edge=edge, rms_px=rms, support=support, filled=filled, redness=float(np.median(inside)),
        patch=patch,
    )  # fmt: skip


def _tolerance_px(ellipse: Ellipse) -> float:
    return 0.3 + 0.015 * ellipse.major_px


def _on_outline(edge: FloatArray, ellipse: Ellipse) -> BoolArray:
    """Say which edge points (N, 2), NaN where there is none, lie on an ellipse."""
    is_seen = np.isfinite(edge[:, 0])
    off = np.abs(ellipse.distance_px(np.where(is_seen[:, None], edge, 0.0)))
    is_on: BoolArray = is_seen & (off < 0.5 + 0.012 * ellipse.major_px)
    return is_on


def _without_ends(is_on: BoolArray) -> BoolArray:
    """Leave out the points next to stretches of three and more that are not on the outline, but keep most."""
    gaps = ~is_on & np.roll(~is_on, 1) & np.roll(~is_on, -1)
    near = gaps.copy()
    for shift in range(1, _BLURRED_ENDS + 2):
        near |= np.roll(gaps, shift) | np.roll(gaps, -shift)
    kept: BoolArray = is_on & ~near
    return kept if kept.sum() >= 0.7 * is_on.sum() else is_on


def _thinned(outline: FloatArray) -> FloatArray:
    return outline[:: max(1, len(outline) // 160)]


def _plausible(ellipse: Ellipse, blob: RedBlob) -> bool:
    _, _, width, height = blob.box_px
    return (
        ellipse.minor_px >= max(MIN_RADIUS_PX * 0.6, MIN_ASPECT * ellipse.major_px)
        and ellipse.major_px >= MIN_RADIUS_PX
        and ellipse.major_px < 0.9 * max(width, height)
    )


def _patch(image: ByteImage, score: Float32Array, ellipse: Ellipse) -> Patch:
    """Cut the ellipse's surroundings out, and mix the colours into the one channel that shows its edge best."""
    reach = _PATCH_MARGIN * ellipse.major_px + 10.0
    x0, y0 = np.maximum(np.floor(ellipse.centre - reach), 0).astype(int)
    x1, y1 = np.maximum(np.ceil(ellipse.centre + reach), 0).astype(int) + 1
    colours = np.ascontiguousarray(image[y0:y1, x0:x1])
    red, corner = score[y0:y1, x0:x1], np.array([x0, y0], dtype=np.float64)
    empty = np.zeros((0, 0), dtype=np.float32)
    if colours.size == 0:
        return Patch(corner=corner, light=empty, red=empty)
    split = cv2.cvtColor(colours.astype(np.float32) / np.float32(255.0), cv2.COLOR_BGR2YCrCb)
    split[..., 0] = cv2.GaussianBlur(split[..., 0], (0, 0), _JPEG_BLUR_PX)
    light = np.asarray(np.clip(cv2.cvtColor(split, cv2.COLOR_YCrCb2BGR), 0.0, 1.0) ** _TONE, dtype=np.float32)
    mixed = light @ _best_mix(light, red, corner, ellipse)
    return Patch(corner=corner, light=np.ascontiguousarray(mixed[..., None], dtype=np.float32), red=red)


def _best_mix(light: Float32Array, red: Float32Array, corner: FloatArray, ellipse: Ellipse) -> Float32Array:
    """Return the mix of linear blue, green and red (3,) that parts the disc from what is round it.

    What is behind a disc differs from photo to photo and along its outline; brightness moves an edge with it. The mix
    weighs each colour by how evenly disc and surroundings keep to theirs.
    Reference: Fisher 1936, the linear discriminant.
    """
    value = _conic_value(red.shape, corner, ellipse)
    inside, outside = (value > -0.85) & (value < -0.35), (value > 0.5) & (value < 1.8)
    level = np.median(red[inside]) if inside.any() else 0.0
    inside, outside = inside & (red > 0.5 * level), outside & (red < 0.5 * level)
    if inside.sum() < 12 or outside.sum() < 12:
        return np.array([-0.5, -0.5, 1.0], dtype=np.float32)
    one, other = light[inside].astype(np.float64), light[outside].astype(np.float64)
    spread = np.cov(one.T) + np.cov(other.T) + _SENSOR * np.eye(3)
    mix = np.linalg.solve(spread, one.mean(axis=0) - other.mean(axis=0))
    return np.asarray(mix / np.linalg.norm(mix), dtype=np.float32)


def _edge(patch: Patch, ellipse: Ellipse, reach: float) -> FloatArray:
    """Return edge points (N, 2) round the ellipse; NaN where the inside isn't red or the outside is just as red."""
    count = int(np.clip(ellipse.perimeter_px / 1.2, 32, _MAX_EDGE_POINTS))
    points, outward = ellipse.outline(count)
    edges = find_edges(patch.light, points - patch.corner, outward, reach)
    just_inside = _at(patch.red, points - patch.corner - 0.6 * reach * outward)
    just_outside = _at(patch.red, points - patch.corner + 0.6 * reach * outward)
    typical = float(np.median(just_inside))
    is_red: BoolArray = (just_inside > 0.5 * typical) & (just_outside < 0.8 * just_inside)
    return np.where(is_red[:, None], edges.points + patch.corner, np.nan)


def _at(picture: Float32Array, points: FloatArray) -> FloatArray:
    x, y = points.astype(np.float32).T
    values = cv2.remap(
        picture, x[:, None].copy(), y[:, None].copy(), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.0
    )
    return np.asarray(values, dtype=np.float64).ravel()


def _filled(patch: Patch, ellipse: Ellipse) -> tuple[float, float]:
    """Return the share of the ellipse's inside, a margin off, that is as red as its typical pixel; the holes' share.

    A hole is a patch that isn't red and doesn't reach the outline.
    """
    value = _conic_value(patch.red.shape, patch.corner, ellipse)
    inside = value < -0.3
    if not inside.any():
        return 0.0, 0.0
    missing = inside & (patch.red <= 0.5 * np.median(patch.red[inside]))
    count, labels = cv2.connectedComponents(missing.astype(np.uint8), connectivity=8)
    at_rim = np.unique(np.asarray(labels)[missing & (value > -0.5)])
    holes = missing & ~np.isin(labels, at_rim) if count > 1 else np.zeros_like(missing)
    return 1.0 - float(missing.sum() / inside.sum()), float(holes.sum() / inside.sum())


def _conic_value(shape: tuple[int, ...], corner: FloatArray, ellipse: Ellipse) -> FloatArray:
    """Return how far out each pixel of a patch lies: the square of its distance in half axes, less 1."""
    x, y = np.arange(shape[1]) + corner[0], (np.arange(shape[0]) + corner[1])[:, None]
    (a, b, d), (_, c, e), (_, _, f) = ellipse.conic
    value: FloatArray = x * (a * x + 2.0 * d) + (y * (c * y + 2.0 * e) + f) + (2.0 * b * y) * x
    return value
