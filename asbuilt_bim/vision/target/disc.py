"""Red discs in one photo: their outline to a fraction of a pixel, and how sure it is that they are discs."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray, median
from asbuilt_bim.vision.edges import DISPLAY_GAMMA, edge_channels, find_edges
from asbuilt_bim.vision.target.disc_patch import MARGIN, Inside, Patch, cut_patch, filled_share, inside_of
from asbuilt_bim.vision.target.disc_sides import Sides, outline_of, sides_of
from asbuilt_bim.vision.target.edge_model import COLOUR_BLUR_PX, place_edges, profiles_across
from asbuilt_bim.vision.target.ellipse import Ellipse, fit_ellipse, robust_ellipse
from asbuilt_bim.vision.target.red import RedBlob, red_blobs, redness
from asbuilt_bim.vision.target.soft_edges import place_soft_edges

MIN_SUPPORT = 0.57
"""Share of the outline that must be seen: a disc with 30 % of its area covered shows 59 %, half a disc 50 %."""
MOST_COVERED = 0.41
"""Share of the outline, of both photos together: a board that covers 30 % of a disc hides 39.6 %, and blur at its ends
another point of some sixty. Of four development discs that 39 % refused the most has 40.0 %. One that leaves half of
the disc (a helmet, a sign cut in two) hides 50 %, but 40 % of the smaller circle that fits it, too: its misfit
tells."""
FIRST_SUPPORT = 0.5
"""The same before both photos have agreed on where the outline is: a cover's blurred edge bends the first one."""
MIN_ASPECT = 0.4
"""Minor over major axis: a disc turned by more than 66 degrees is too thin to be distinguished from a strip."""
MIN_RADIUS_PX = 5.0
_FIRST_ROUNDS, _FIRST_SLACK = 3, 2.0
"""Of a blob's outline, which is good to a pixel or two."""
_SOME = 2  # every second edge point says what the lens's blur is
_DISCS_IN_A_BLOB = 3
LEAST_FILLED = 0.5
"""Of the inside: a bar through the middle that hides 30 % of a disc hides 36 % of its inside.

Blur at both of the bar's edges looks like another 12 %.
"""
MOST_PRINTED = 0.06
"""Of the inside: what covers more of it hides outline, too; a print on a sign doesn't."""
MOST_INSIDE = 3.0
"""A cover hides outline where it hides inside: a bar 2.4 times as much of the inside. More is a print near the rim."""
_COVERED = 0.6  # of the inside's redness: below it something else is seen
_BLURS_REACHED, _MOST_REACHED = 1.7, 0.5
"""A profile shorter than the blur has no ends; to half the minor half axis it has nothing but the disc inside."""
_PARTED = 0.06  # of full scale: noise and a disc's dirt make less, two reds side by side make more
_NEAR = 1.0  # slack: the outline is known to a pixel, and what counts is what lies right behind it, not further off
_LEAST_REACH_PX, _BLURS_NEEDED = 2.5, 1.4
"""Of a profile: in 40 development pairs (seed 62) edges are off by 0.09 px where profiles reach so far.

They are off by 0.16 where these reach a quarter of the minor half axis. Still shorter ones win no more.
"""
_LEAST_TOLD_PX, _BLURS_TOLD = 3.0, 1.8  # of a profile that tells the blur: it has to show both of its ends
_BLURRED_ENDS = 3
"""Edge points next to a covered stretch of the outline that are left out: the cover's own edge bends them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RedDisc:
    """A red disc in one photo: `edge` (N, 2) are the outline's points that were found, `rms_px` their misfit.

    `sigma_px` (N,) is how sure each point is, against the others. `support` is the share of the outline that they make
    up.
    """

    ellipse: Ellipse
    edge: FloatArray
    sigma_px: FloatArray
    rms_px: float
    support: float
    astray: float  # share of the outline that has its edge further in, or none that fits
    further: float  # share of the outline that has it further out
    overrun: float  # share of the outline that has none: what is beyond is as red
    redness: float  # 0..1, the median of the bare inside: a disc in shade keeps it, its reflection doesn't
    uneven: float  # what the inside's redness differs by, relative
    patch: Patch

    @property
    def covered(self) -> float:
        """Return the share of the outline that isn't red inside."""
        return 1.0 - self.support - self.astray - self.further - self.overrun


def find_discs(image: ByteImage) -> tuple[RedDisc, ...]:
    """Find the red discs of a photo (BGR), the best supported first; half-hidden or odd shapes are left out."""
    score = redness(image)
    discs = [disc for blob in red_blobs(score) if (disc := _disc(image, score, blob)) is not None]
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

    A disc before something as red has grown together with it. What most of the outline fits may be the other thing, so
    its points are taken off and the rest is fitted again.
    """
    size = float(np.sqrt(blob.area_px / np.pi))
    outline = _thinned(blob.outline)
    for _ in range(_DISCS_IN_A_BLOB):
        started = robust_ellipse(outline, max(1.5, 0.04 * size))
        if started is None:
            return None
        disc = _disc_at(image, score, blob, started[0])
        if disc is not None:
            return disc
        outline = outline[~started[1]]
    return None


def _disc_at(image: ByteImage, score: Float32Array, blob: RedBlob, ellipse: Ellipse) -> RedDisc | None:
    """Follow the edge of a blob from a first ellipse on, as both photos' is followed later."""
    if not _plausible(ellipse, blob):
        return None
    patch = cut_patch(image, score, ellipse)
    if patch.red.size == 0:
        return None
    (x, y), (height, width) = patch.corner.astype(int).tolist(), patch.red.shape
    channels = edge_channels(np.ascontiguousarray(image[y : y + height, x : x + width]))
    least = inside_of(patch, ellipse).least
    for _ in range(_FIRST_ROUNDS):
        (points, outward), reach = outline_of(ellipse), reach_px(ellipse)
        edge = find_edges(channels, points - patch.corner, outward, reach).points
        is_discs = sides_of(patch, points, outward, reach, least, COLOUR_BLUR_PX).differ & np.isfinite(edge[:, 0])
        seen = edge[is_discs] + patch.corner
        fitted = robust_ellipse(seen, _tolerance_px(ellipse))
        if fitted is None or not _plausible(fitted[0], blob):
            return None
        ellipse = fitted[0]
    disc = followed(patch, ellipse, COLOUR_BLUR_PX, _FIRST_SLACK, FIRST_SUPPORT)
    better = None if disc is None else fit_ellipse(disc.edge, disc.sigma_px**-2)
    if disc is None or better is None:
        return None
    # blur that isn't known yet may hold an edge off its place: then it is a start, and no clear disc
    near = followed(patch, better, COLOUR_BLUR_PX, 1.0, FIRST_SUPPORT)
    return near or replace(disc, ellipse=better, support=FIRST_SUPPORT)


def followed(
    patch: Patch,
    ellipse: Ellipse,
    blur_px: float,
    slack: float,
    least: float,
    gamma: float = DISPLAY_GAMMA,
    is_soft: bool = False,
) -> RedDisc | None:
    """Follow a disc's outline along an ellipse that both photos agree on; None where less than `least` of it is there.

    Points as far off as `slack` times what an outline may show count still: the ellipse isn't sure at first.
    `is_soft`: what is behind is taken for unknown up to the edge (see `place_soft_edges`). `gamma` is as in
    `linear_light`.
    """
    reach = max(reach_px(ellipse), min(_BLURS_REACHED * blur_px, _MOST_REACHED * ellipse.minor_px))
    if slack <= _NEAR:
        blur = float(np.hypot(blur_px, COLOUR_BLUR_PX))
        reach = min(max(_LEAST_REACH_PX, _BLURS_NEEDED * blur), reach)
    inside = inside_of(patch, ellipse)
    points, outward = outline_of(ellipse)
    bend = ellipse.bend(len(points))
    placed = (
        place_soft_edges(patch.planes, points - patch.corner, outward, blur_px, bend, gamma)
        if is_soft
        else place_edges(patch.planes, points - patch.corner, outward, reach, blur_px, bend, gamma)
    )
    sides = sides_of(patch, points, outward, reach, inside.least, blur_px)
    # two reds in one light differ in brightness: a disc before something as red still has an outline
    sides = replace(sides, outside=sides.outside | (placed.contrast > _PARTED))
    edge = np.where(((sides.inside | sides.deeper) & sides.outside)[:, None], placed.points + patch.corner, np.nan)
    is_on = _on_outline(edge, ellipse, slack)
    # blur mixes what is behind into the rim: where the edge is where it should be, red deeper inside is enough
    sides = replace(sides, inside=sides.inside | (sides.deeper & is_on))
    return _judged(ellipse, edge, is_on, sides, patch, inside, least, slack, placed.sigma_px)


def some_profiles(patch: Patch, ellipse: Ellipse, blur_px: float = 0.0) -> FloatArray:
    """Return profiles (N, S, 3) across a disc's outline, enough of them to say what the lens's blur is.

    They are no longer than a blur that is known about (0: it isn't) needs: what lies further off isn't even.
    """
    points, outward = outline_of(ellipse)
    some = slice(None, None, _SOME)
    reach = reach_px(ellipse)
    if blur_px:
        reach = min(max(_LEAST_TOLD_PX, _BLURS_TOLD * float(np.hypot(blur_px, COLOUR_BLUR_PX))), reach)
    return profiles_across(patch.planes, (points - patch.corner)[some], outward[some], reach)


def reach_px(ellipse: Ellipse) -> float:
    """Return how far to both sides of an outline its edge is looked for."""
    return float(np.clip(0.25 * ellipse.minor_px, 2.5, 8.0))


def _judged(
    ellipse: Ellipse,
    edge: FloatArray,
    is_on: BoolArray,
    sides: Sides,
    patch: Patch,
    inside: Inside,
    least_support: float,
    slack: float,
    sigma_px: FloatArray,
) -> RedDisc | None:
    """Return the disc where enough of its outline and inside is seen, None otherwise."""
    support = float(np.mean(is_on))
    if support < least_support:
        return None
    kept, whole = _without_ends(is_on), edge
    edge, sigma = edge[kept], sigma_px[kept]
    filled = filled_share(patch, inside)
    trust = 1.0 / sigma**2
    rms = float(np.sqrt(np.sum(trust * ellipse.distance_px(edge) ** 2) / np.sum(trust)))
    covered = 1.0 - float(np.mean(sides.inside))
    is_printed = 1.0 - filled > MOST_PRINTED + MOST_INSIDE * covered
    if filled < LEAST_FILLED or is_printed or rms > slack * _tolerance_px(ellipse):
        return None
    beyond = sides.inside & ~is_on & ~sides.outside
    further = sides.differ & ~is_on & (ellipse.distance_px(whole) > 0.0)
    bare = patch.red[inside.value < MARGIN]
    bare = bare[bare > _COVERED * inside.typical]
    red = median(bare)
    return RedDisc(
        ellipse=ellipse, edge=edge, sigma_px=sigma, rms_px=rms, support=support,
        astray=float(np.mean(sides.differ & ~is_on & ~further)), overrun=float(np.mean(beyond)),
        further=float(np.mean(further)),
        redness=red, uneven=median(np.abs(bare - red)) / max(red, 1e-6), patch=patch,
    )  # fmt: skip


def _tolerance_px(ellipse: Ellipse) -> float:
    return 0.3 + 0.015 * ellipse.major_px


def _on_outline(edge: FloatArray, ellipse: Ellipse, slack: float = 1.0) -> BoolArray:
    """Say which edge points (N, 2), NaN where there is none, lie on an ellipse."""
    is_seen = np.isfinite(edge[:, 0])
    off = np.abs(ellipse.distance_px(np.where(is_seen[:, None], edge, 0.0)))
    is_on: BoolArray = is_seen & (off < slack * (0.5 + 0.012 * ellipse.major_px))
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
