"""The target by its given size: an outline in one photo says how far away it is, and so where the other shows it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray
from asbuilt_bim.vision.target.circle import SpaceCircle, guessed_circles, outlines_of
from asbuilt_bim.vision.target.disc import MIN_ASPECT, MIN_RADIUS_PX, RedDisc
from asbuilt_bim.vision.target.disc_patch import cut_patch
from asbuilt_bim.vision.target.ellipse import Ellipse, robust_ellipse
from asbuilt_bim.vision.target.pairing import Pairing, follow
from asbuilt_bim.vision.target.red import red_blobs, redness

_STRETCHES = (0.5, 0.35)
"""Of a blob's outline: a disc that half of it belongs to shows one arc of a third at least."""
_ONE_ARC = 0.95  # of a stretch's points lie on one ellipse
_OUTLINE_PX = 1.5  # how well a blob's outline is known: it is found in a reduced picture
_POINTS = 160  # of an outline are looked at
_SAME = 0.06  # of the major half axis: guesses as near as that lead to one place


def sought(
    pair: RectifiedPair, lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], nominal_m: float
) -> list[Pairing]:
    """Return the discs of the given diameter that outlines of one photo, or parts of outlines, lead to in both."""
    scores = redness(pair.left), redness(pair.right)
    found: list[Pairing] = []
    tried: list[FloatArray] = []
    for circle in _guesses(pair, scores, (lefts, rights), nominal_m):
        guides = outlines_of(circle, pair.camera)
        if guides[0] is None or guides[1] is None:
            continue
        place = np.array([*guides[0].centre, circle.disparity_px, guides[0].minor_px, guides[1].minor_px])
        if any(np.abs(place - other).max() < _SAME * guides[0].major_px for other in tried):
            continue
        tried.append(place)
        patches = cut_patch(pair.left, scores[0], guides[0]), cut_patch(pair.right, scores[1], guides[1])
        if min(patches[0].red.size, patches[1].red.size) == 0:
            continue
        again = follow(patches, circle, pair.camera, 0.5 * nominal_m)
        if again is not None:
            found.append(again)
    return found


def _guesses(
    pair: RectifiedPair,
    scores: tuple[Float32Array, Float32Array],
    discs: tuple[tuple[RedDisc, ...], tuple[RedDisc, ...]],
    nominal_m: float,
) -> Iterator[SpaceCircle]:
    """Give circles of the given size about the outlines of either photo: so large an outline is so far away."""
    for side in (0, 1):
        for ellipse in (*(disc.ellipse for disc in discs[side]), *_arcs((pair.left, pair.right)[side], scores[side])):
            expected = 2.0 * pair.camera.baseline_m * ellipse.major_px / nominal_m
            left = ellipse if side == 0 else replace(ellipse, x_px=ellipse.x_px + expected)
            yield from guessed_circles(left, expected, 0.5 * nominal_m, pair.camera)


def _arcs(image: ByteImage, score: Float32Array) -> Iterator[Ellipse]:
    """Give the ellipses of single arcs of the red blobs' outlines, looked at a stretch at a time.

    A disc before something as red has grown together with it: most of the outline may be the other thing's, but a
    stretch of it is the disc's alone.
    """
    for blob in red_blobs(score):
        outline = blob.outline[:: max(1, len(blob.outline) // _POINTS)]
        size = float(np.sqrt(blob.area_px / np.pi))
        for share in _STRETCHES:
            length = int(share * len(outline))
            for start in range(0, len(outline), max(length // 4, 1)):
                stretch = outline[np.arange(start, start + length) % len(outline)]
                fitted = robust_ellipse(stretch, _OUTLINE_PX)
                if fitted is None or np.mean(fitted[1]) < _ONE_ARC:
                    continue
                ellipse = fitted[0]
                if ellipse.minor_px >= MIN_ASPECT * ellipse.major_px and MIN_RADIUS_PX < ellipse.major_px < 2.0 * size:
                    yield ellipse
