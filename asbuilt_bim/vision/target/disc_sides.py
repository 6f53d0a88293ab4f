"""What lies to both sides of a red disc's outline: is the inside red, and the outside less so."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.vision.target.disc_patch import NOTHING_RED, Patch
from asbuilt_bim.vision.target.edge_model import COLOUR_BLUR_PX
from asbuilt_bim.vision.target.ellipse import Ellipse

_EDGE_SPACING_PX = 1.2
_MAX_EDGE_POINTS = 180
_LOOKED_AT = 0.6  # of the reach to both sides of an outline: what is there says whether inside and outside are red
_CLEAR_OF_BLUR = 1.5  # sigmas: nearer to the edge, blur mixes sky into a dark disc, and no red is left of that
_REDDER = 1.15  # times: noise makes no more of a rim that is a cover's, a print's rim is half as red again
_FULLY_CLEAR = 2.0  # sigmas: here a disc before sky is as red as ever; but narrow covers of its rim end before


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sides:
    """Of each point (N,) of an outline: is the `inside` red, is the `outside` less so, is it red `deeper` inside."""

    inside: BoolArray
    outside: BoolArray
    deeper: BoolArray

    @property
    def differ(self) -> BoolArray:
        """Say where both are so."""
        return self.inside & self.outside


def points_round(ellipse: Ellipse) -> int:
    """Return how many points of an outline are looked at."""
    return int(np.clip(ellipse.perimeter_px / _EDGE_SPACING_PX, 32, _MAX_EDGE_POINTS))


def outline_of(ellipse: Ellipse) -> tuple[FloatArray, FloatArray]:
    """Return the points (N, 2) of an outline that are looked at, and its outward normals (N, 2) there."""
    return ellipse.outline(points_round(ellipse))


def sides_of(
    patch: Patch, points: FloatArray, outward: FloatArray, reach: float, least: float, blur_px: float
) -> Sides:
    """Say of which points (N, 2) of an outline the inside is red and the outside less so.

    What has `least` times the redness that is typical next to the outline, and more, is red.
    """
    mixed_px = float(np.hypot(blur_px, COLOUR_BLUR_PX))
    near = min(max(_LOOKED_AT * reach, _CLEAR_OF_BLUR * mixed_px), reach)
    just_inside = _at(patch.red, points - patch.corner - near * outward)
    just_outside = _at(patch.red, points - patch.corner + _LOOKED_AT * reach * outward)
    well_inside = _at(patch.red, points - patch.corner - max(near, _FULLY_CLEAR * mixed_px) * outward)
    is_red, deeper = (some > least * median(some) for some in (just_inside, well_inside))
    if least > NOTHING_RED:
        # a disc that is dimmed by what is behind looks like a reddish cover; a print's rim is redder than the print
        is_red &= deeper | (just_inside > _REDDER * well_inside)
    return Sides(inside=is_red, outside=just_outside < 0.8 * just_inside, deeper=deeper)


def _at(picture: Float32Array, points: FloatArray) -> FloatArray:
    x, y = points.astype(np.float32).T
    values = cv2.remap(
        picture, x[:, None].copy(), y[:, None].copy(), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.0
    )
    return np.asarray(values, dtype=np.float64).ravel()
