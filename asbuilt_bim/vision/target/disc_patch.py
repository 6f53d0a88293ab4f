"""A red disc's surroundings in a photo, and how much of its inside is red."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, median
from asbuilt_bim.vision.target.edge_model import colour_planes
from asbuilt_bim.vision.target.ellipse import Ellipse

_PATCH_MARGIN = 1.6
MARGIN = -0.3
"""Of a conic's value: blur at the outline doesn't reach so far in."""
_DEEP = -0.6  # likewise: a dark disc's rim before bright sky is paler, and nothing covers it
NOTHING_RED = 0.5  # of the inside's redness: half-way to a cover that has none
_PALER = 0.6  # of the inside's redness: noise makes no more than a few pixels so pale
_LEAST_COVERED = 0.03  # of the inside


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """A disc's surroundings: `corner` (2,) in the photo, `red` (H, W), `planes` (H, W, 3) as JPEG stores it."""

    corner: FloatArray
    red: Float32Array
    planes: Float32Array


def cut_patch(image: ByteImage, score: Float32Array, ellipse: Ellipse) -> Patch:
    """Cut the ellipse's surroundings out."""
    reach = _PATCH_MARGIN * ellipse.major_px + 10.0
    x0, y0 = np.maximum(np.floor(ellipse.centre - reach), 0).astype(int)
    x1, y1 = np.maximum(np.ceil(ellipse.centre + reach), 0).astype(int) + 1
    colours = np.ascontiguousarray(image[y0:y1, x0:x1])
    planes = colour_planes(colours) if colours.size else np.zeros((0, 0, 3), dtype=np.float32)
    return Patch(corner=np.array([x0, y0], dtype=np.float64), red=score[y0:y1, x0:x1], planes=planes)


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
    typical = median(inside) if inside.size else 0.0
    deep = patch.red[value < _DEEP]
    paler = deep[deep < _PALER * typical]
    is_covered = paler.size > _LEAST_COVERED * deep.size
    cover = median(paler) / typical if is_covered else 0.0
    return Inside(value=value, typical=typical, least=NOTHING_RED * (1.0 + cover))


def filled_share(patch: Patch, inside: Inside) -> float:
    """Return the share of an ellipse's inside, a margin off, that is red."""
    red = patch.red[inside.value < MARGIN]
    return float(np.mean(red > inside.least * inside.typical)) if red.size else 0.0


def conic_value(shape: tuple[int, ...], corner: FloatArray, ellipse: Ellipse) -> FloatArray:
    """Return how far out each pixel of a patch lies: the square of its distance in half axes, less 1."""
    x, y = np.arange(shape[1]) + corner[0], (np.arange(shape[0]) + corner[1])[:, None]
    (a, b, d), (_, c, e), (_, _, f) = ellipse.conic
    value: FloatArray = x * (a * x + 2.0 * d) + (y * (c * y + 2.0 * e) + f) + (2.0 * b * y) * x
    return value
