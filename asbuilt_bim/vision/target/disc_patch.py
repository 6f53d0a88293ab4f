"""A red disc's surroundings in a photo: the channel that shows its edge best, and how much of its inside is red."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray
from asbuilt_bim.vision.target.edge_model import colour_planes
from asbuilt_bim.vision.target.ellipse import Ellipse

_PATCH_MARGIN = 1.6
_TONE = 1.8
"""A lens blurs light (exponent 2.2), JPEG's halved colour blurs grey levels (1): edges of both kinds meet between."""
_JPEG_BLUR_PX = 1.0  # brightness is blurred as colour is, so that both pass one half in one place
MARGIN = -0.3
"""Of a conic's value: blur at the outline doesn't reach so far in."""
_DEEP = -0.6  # likewise: a dark disc's rim before bright sky is paler, and nothing covers it
NOTHING_RED = 0.5  # of the inside's redness: half-way to a cover that has none
_PALER = 0.6  # of the inside's redness: noise makes no more than a few pixels so pale
_LEAST_COVERED = 0.03  # of the inside
_PRINTS_REDNESS = (0.5, 0.6, 0.7)
"""Of the inside's redness: blurred, a print's white has some of it. Taken for a cover's it would raise the limit so far
that a blurred rim falls below it too and joins the print to what is outside. Of 212 development discs, the blurred and
the covered first, none has a hole of over 2 % at any of these. Of five signs that were taken or nearly so four have 8
to 14 %."""
_CUT_SHORT = 0.1  # of the inside's redness: so much a bar that is thinner than the blur differs by along its length
_SENSOR = 2e-5  # of linear light squared: noise that two rings of a patch may not show


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """A disc's surroundings: `corner` (2,) in the photo, `light` (H, W, 1) that shows the edge best, `red` (H, W).

    `planes` (H, W, 3) is the photo as JPEG stores it.
    """

    corner: FloatArray
    light: Float32Array
    red: Float32Array
    planes: Float32Array


def cut_patch(image: ByteImage, score: Float32Array, ellipse: Ellipse) -> Patch:
    """Cut the ellipse's surroundings out, and mix the colours into the one channel that shows its edge best."""
    reach = _PATCH_MARGIN * ellipse.major_px + 10.0
    x0, y0 = np.maximum(np.floor(ellipse.centre - reach), 0).astype(int)
    x1, y1 = np.maximum(np.ceil(ellipse.centre + reach), 0).astype(int) + 1
    colours = np.ascontiguousarray(image[y0:y1, x0:x1])
    red, corner = score[y0:y1, x0:x1], np.array([x0, y0], dtype=np.float64)
    empty = np.zeros((0, 0), dtype=np.float32)
    if colours.size == 0:
        return Patch(corner=corner, light=empty, red=empty, planes=empty)
    planes = colour_planes(colours)
    split = planes.copy()
    split[..., 0] = cv2.GaussianBlur(split[..., 0], (0, 0), _JPEG_BLUR_PX)
    light = np.asarray(np.clip(cv2.cvtColor(split, cv2.COLOR_YCrCb2BGR), 0.0, 1.0) ** _TONE, dtype=np.float32)
    mixed = light @ _best_mix(light, red, corner, ellipse)
    light = np.ascontiguousarray(mixed[..., None], dtype=np.float32)
    return Patch(corner=corner, light=light, red=red, planes=planes)


def _best_mix(light: Float32Array, red: Float32Array, corner: FloatArray, ellipse: Ellipse) -> Float32Array:
    """Return the mix of linear blue, green and red (3,) that parts the disc from what is round it.

    What is behind a disc differs from photo to photo and along its outline; brightness moves an edge with it. The mix
    weighs each colour by how evenly disc and surroundings keep to theirs.
    Reference: Fisher 1936, the linear discriminant.
    """
    value = conic_value(red.shape, corner, ellipse)
    inside, outside = (value > -0.85) & (value < -0.35), (value > 0.5) & (value < 1.8)
    level = np.median(red[inside]) if inside.any() else 0.0
    inside, outside = inside & (red > 0.5 * level), outside & (red < 0.5 * level)
    if inside.sum() < 12 or outside.sum() < 12:
        return np.array([-0.5, -0.5, 1.0], dtype=np.float32)
    one, other = light[inside].astype(np.float64), light[outside].astype(np.float64)
    spread = np.cov(one.T) + np.cov(other.T) + _SENSOR * np.eye(3)
    mix = np.linalg.solve(spread, one.mean(axis=0) - other.mean(axis=0))
    return np.asarray(mix / np.linalg.norm(mix), dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inside:
    """An ellipse's inside in a patch: `value` (H, W) of its conic, -1 in the middle and 0 on the outline.

    `typical` is its redness; what has less than `least` times as much of that is something else.
    """

    value: FloatArray
    typical: float
    least: float


def inside_of(patch: Patch, ellipse: Ellipse) -> Inside:
    """Look at an ellipse's inside: how red it is, and half-way to what a part of it is covered with.

    A cover may be reddish itself (timber, rust): blurred, its narrow end then hides an outline by less than half.
    """
    value = conic_value(patch.red.shape, patch.corner, ellipse)
    inside = patch.red[value < MARGIN]
    typical = float(np.median(inside)) if inside.size else 0.0
    deep = patch.red[value < _DEEP]
    paler = deep[deep < _PALER * typical]
    is_covered = paler.size > _LEAST_COVERED * deep.size
    cover = float(np.median(paler)) / typical if is_covered else 0.0
    return Inside(value=value, typical=typical, least=NOTHING_RED * (1.0 + cover))


def filled_share(patch: Patch, inside: Inside) -> tuple[float, float]:
    """Return the share of an ellipse's inside, a margin off, that is red; and that of the holes in it.

    A hole is a patch that is less red, at whatever limit it shows most, and doesn't reach the outline.
    """
    within = inside.value < MARGIN
    if not within.any():
        return 0.0, 0.0
    missing = float(np.mean(patch.red[within] <= inside.least * inside.typical))
    return 1.0 - missing, max(_holes(patch, inside, level) for level in {inside.least, *_PRINTS_REDNESS})


def _holes(patch: Patch, inside: Inside, level: float) -> float:
    """Return the share of an ellipse's inside, a margin off, in holes that have less than `level` of its redness.

    What reaches the outline at a little more than that level is no hole: so does a thin bar, that noise cuts short.
    """
    within = inside.value < MARGIN
    missing = within & (patch.red <= level * inside.typical)
    if not missing.any():
        return 0.0
    paler = within & (patch.red <= (level + _CUT_SHORT) * inside.typical)
    labels = np.asarray(cv2.connectedComponents(paler.astype(np.uint8), connectivity=8)[1])
    at_rim = np.unique(labels[paler & (inside.value > -0.5)])
    return float(np.sum(missing & ~np.isin(labels, at_rim)) / within.sum())


def conic_value(shape: tuple[int, ...], corner: FloatArray, ellipse: Ellipse) -> FloatArray:
    """Return how far out each pixel of a patch lies: the square of its distance in half axes, less 1."""
    x, y = np.arange(shape[1]) + corner[0], (np.arange(shape[0]) + corner[1])[:, None]
    (a, b, d), (_, c, e), (_, _, f) = ellipse.conic
    value: FloatArray = x * (a * x + 2.0 * d) + (y * (c * y + 2.0 * e) + f) + (2.0 * b * y) * x
    return value
