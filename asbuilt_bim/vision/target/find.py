"""The red disc: its centres in both photos, and its distance by triangulation."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.vision.target.blur_kind import GREY_LEVELS
from asbuilt_bim.vision.target.disc import RedDisc, find_discs
from asbuilt_bim.vision.target.odds import LEAST_ODDS, SURE_ODDS, log_odds
from asbuilt_bim.vision.target.pairing import (
    Pairing,
    TargetOptions,
    clear_ones,
    is_clear,
    likeliest,
    pairings,
    sharpened,
    size_fits,
)
from asbuilt_bim.vision.target.refinement import refined
from asbuilt_bim.vision.target.rejections import absent, doubt, not_it, off_row, several, twin
from asbuilt_bim.vision.target.search import sought

__all__ = ["TargetOptions", "TargetSighting", "find_target"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetSighting:
    """The target in both rectified photos: centres (2,) sub-pixel, `depth_m` is Z of eq. 3 along the rectified axis.

    `range_m` is the distance from the left camera's centre: what a tape shows. `diameter_m` is what the
    picture says of the disc's diameter. The centres are pictures of the disc's own centre, not of the ellipses'.
    `depth_sigma_m` is the photos' part; what the rig's calibration adds comes on top.
    """

    left_px: FloatArray  # (2,)
    right_px: FloatArray  # (2,)
    radius_px: float  # semi-major axis in the left photo
    ellipse_left: tuple[float, float, float, float, float]  # cx, cy, full major, full minor, angle (rad)
    disparity_px: float
    depth_m: float
    depth_sigma_m: float
    range_m: float
    diameter_m: float


def find_target(pair: RectifiedPair, options: TargetOptions) -> tuple[TargetSighting | None, tuple[Rejection, ...]]:
    """Find the red disc in both rectified photos and triangulate its centre.

    Of several discs the given diameter decides. Of several that have it, one that isn't much paler (a reflection is),
    then the nearest of those that are surely one, or else the likeliest. Without a given diameter several are refused.

    Returns the sighting, or None with the reasons. With `required` off, a target that is simply not there gives no
    reason; two discs, or one in a single photo, still do. A sighting may come with reasons why other discs aren't it.

    Reference: Perez & Tah 2023, eq. 2 (D = u_L - u_R) and eq. 3 (Z = f b / D).
    """
    lefts, rights = find_discs(pair.left), find_discs(pair.right)
    found = pairings(lefts, rights, pair.camera, options.diameter_m)
    level = [p for p in found if abs(p.left.ellipse.y_px - p.right.ellipse.y_px) <= options.row_limit_px]
    off_all_rows = bool(found) and not level
    is_knocked = off_all_rows and any(is_clear(p) for p in found)
    right_size = _of_right_size(pair, (lefts, rights), level, is_knocked, options)
    if right_size:
        likely = likeliest([p for _, p in right_size])
        if options.diameter_m is None:
            likely = [p for p in likely if is_clear(p)] or likely
        if len(likely) > 1 and options.diameter_m is None:
            return None, (several(pair, likely, options),)
        # a mirror's picture of the disc lies further off than the disc
        sure = [p for how_likely, p in right_size if how_likely > SURE_ODDS and p in likely]
        chosen = max(sure, key=lambda p: p.circle.disparity_px) if sure else likely[0]
        twins = tuple(twin(pair, p, chosen) for _, p in right_size if p is not chosen and (p in likely or is_clear(p)))
        clear = [p for p in level if is_clear(p) and _is_apart(p, chosen)]
        others = tuple(not_it(pair, p, options) for p in clear if not size_fits(p.circle, options))
        return _sighting(chosen, pair.camera, options), (*doubt(pair, chosen, options), *twins, *others)
    wrong_size = [p for p in level if not size_fits(p.circle, options)]
    if wrong_size:
        return None, tuple(not_it(pair, p, options) for p in wrong_size)
    if off_all_rows:
        return None, (off_row(pair, found[0], options),)
    return None, absent(pair, clear_ones(lefts), clear_ones(rights), options)


def _of_right_size(
    pair: RectifiedPair,
    discs: tuple[tuple[RedDisc, ...], tuple[RedDisc, ...]],
    level: list[Pairing],
    is_knocked: bool,
    options: TargetOptions,
) -> list[tuple[float, Pairing]]:
    """Return what is likely the target and stands a second look, with the odds' logarithm, the likeliest first.

    Where none is sure the given size leads to more, and grey levels may have been blurred, not light.
    """
    nominal_m = options.diameter_m
    standing = _standing(_likely(level, options), pair.camera, options)
    if nominal_m is None or is_knocked or any(how_likely > SURE_ODDS for how_likely, _ in standing):
        return standing
    levels = [p for p in pairings(*discs, pair.camera, nominal_m, GREY_LEVELS) if p.is_soft]
    seen = [*level, *sought(pair, *discs, nominal_m), *levels]
    return _standing(_likely(seen, options), pair.camera, options)


def _standing(
    ranked: list[tuple[float, Pairing]], camera: RectifiedCamera, options: TargetOptions
) -> list[tuple[float, Pairing]]:
    """Return those that are surely a disc, or stay likely one by what a second look says of their size."""
    kept: list[tuple[float, Pairing]] = []
    for odds, one in ranked:
        again, after = refined(one, camera, options.diameter_m), LEAST_ODDS
        if again is not None:
            of_its_size = replace(one, circle=replace(one.circle, radius_m=again.circle.radius_m))
            after = log_odds(of_its_size, options.diameter_m)
        stays = again is not None and after > LEAST_ODDS and size_fits(again.circle, options)
        if stays or odds > SURE_ODDS:
            kept.append((after, again or one))
    return sorted(kept, key=lambda item: -item[0])


def _likely(found: list[Pairing], options: TargetOptions) -> list[tuple[float, Pairing]]:
    """Return those of the target's size that are likelier it than not, with the odds' logarithm, the likeliest first.

    Of several at one place the likeliest is kept.
    """
    odds = [(log_odds(p, options.diameter_m), p) for p in found if size_fits(p.circle, options)]
    kept: list[tuple[float, Pairing]] = []
    for how_likely, one in sorted(odds, key=lambda item: -item[0]):
        if how_likely > LEAST_ODDS and all(_is_apart(one, p) for _, p in kept):
            kept.append((how_likely, one))
    return kept


def _is_apart(one: Pairing, other: Pairing) -> bool:
    """Say whether one isn't at the other's place: of one outline there may be several fits."""
    return bool(np.hypot(*(one.circle.centre_px - other.circle.centre_px)) > other.left.ellipse.major_px)


def _sighting(found: Pairing, camera: RectifiedCamera, options: TargetOptions) -> TargetSighting:
    ellipse, diameter_m = found.left.ellipse, 2.0 * found.circle.radius_m
    circle = sharpened(found.circle, options, found.lean_px(options) / ellipse.major_px)
    disparity = circle.disparity_px
    depth = camera.f_px * camera.baseline_m / disparity
    ray = camera.rectified_rays(circle.centre_px)
    return TargetSighting(
        left_px=circle.centre_px,
        right_px=frozen(circle.centre_px - [disparity, 0.0]),
        radius_px=ellipse.major_px,
        ellipse_left=(ellipse.x_px, ellipse.y_px, 2 * ellipse.major_px, 2 * ellipse.minor_px, ellipse.angle_rad),
        disparity_px=disparity,
        depth_m=depth,
        depth_sigma_m=depth / disparity * found.disparity_sigma_px(circle, options),
        range_m=float(depth * np.linalg.norm(ray)),
        diameter_m=diameter_m,
    )
