"""A straight edge found to a tenth of a pixel: gradient votes across it in both photos, then a robust line.

The right photo is read along the face's own plane, so an edge that belongs to the face shows at the same place in both,
and the background's edges don't.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.geometry.robust_least_squares import reweighted_linear, tukey
from asbuilt_bim.measure.outline.side_sigmas import side_sigmas
from asbuilt_bim.vision.stereo.warp import sample

DATA = Path(__file__).with_suffix(".json")
REACH_PX = 9.0
"""How far off a line its edge is looked for: as far as the model was fitted."""
STEP_PX = 0.25
"""Profile step: a quarter of the sensor's own blur."""
LEAST_SCATTER_PX = 0.15
"""Of single profiles about their line: less would be chance."""
SHORT_TUKEY = partial(tukey, reach=3.0)
"""A neighbouring edge is never far."""
FEW_PROFILES = np.array([1e-3, 0.0])
"""What holds the line's slope where few profiles are left, as a share of all of them."""
MOST_SAMPLES = 400
TURNED_SIGN = 0.7
"""What an edge counts that is dark to light in one photo and light to dark in the other: chance makes such ones too."""
SHARE_GREY = 2.0
"""The gradient that counts half: grain of concrete between two profiles."""
CREST_STEPS = 13
"""An edge's profile is some 3 px wide after the sensor's and our own blur."""
CREST_PX = 0.5 * (CREST_STEPS - 1) * STEP_PX
RARE = 0.01
"""A line that is the edge in fewer cases than that is no part of sigma."""
WIDE_PX = REACH_PX + 2.0 * CREST_PX
SHARED_PX = 3.0
"""Neighbouring profiles share texture over about so much."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gradients:
    """Gradients of the left and right photo along x and y, grey levels per pixel, float32 (H, W) each.

    `valid_right` float32 (H, W) is 1 where there is a right photo: elsewhere only the left one counts.
    """

    left_x: Float32Array
    left_y: Float32Array
    right_x: Float32Array
    right_y: Float32Array
    valid_right: Float32Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """A piece of straight edge in the left photo, from `start` to `stop` (2,) px; `normal` (2,) points off the face."""

    start: FloatArray
    stop: FloatArray

    @property
    def length_px(self) -> float:
        """Return the length in pixels."""
        return math.dist(self.start, self.stop)

    @property
    def direction(self) -> FloatArray:
        """Return the unit direction (2,)."""
        along: FloatArray = (self.stop - self.start) / max(self.length_px, 1e-9)
        return along

    @property
    def normal(self) -> FloatArray:
        """Return the unit normal (2,), to the right of the direction as the picture shows it."""
        ux, uy = self.direction
        return np.array([uy, -ux])

    def moved(self, start_px: float, stop_px: float) -> Line:
        """Return the line with its ends moved along the normal."""
        return Line(start=self.start + start_px * self.normal, stop=self.stop + stop_px * self.normal)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EdgeFit:
    """The edge as the photo shows it; `strength` 0..1 is the share of its length that votes for it.

    `sigma_px` is across the line; `ambiguity_px` is its part that comes of what other line it might be.
    """

    line: Line
    sigma_px: float
    ambiguity_px: float
    strength: float


def gradients(
    left_grey: Float32Array, right_grey: Float32Array, valid_right: BoolArray, blur_px: float = 0.8
) -> Gradients:
    """Differentiate both photos after a slight smoothing."""
    found: list[Float32Array] = []
    for image in (left_grey, right_grey):
        smooth = cv2.GaussianBlur(image, (0, 0), blur_px)
        found.append(np.asarray(cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)))
        found.append(np.asarray(cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)))
    inner = cv2.erode(valid_right.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=0)
    return Gradients(
        left_x=found[0], left_y=found[1], right_x=found[2], right_y=found[3], valid_right=inner.astype(np.float32)
    )


def pixel_plane(q_px: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return (p0, p1, p2) with disparity = p0 x + p1 y + p2 in pixels for q."""
    slope = q_px[:2] / camera.f_px
    return np.array([slope[0], slope[1], q_px[2] - slope[0] * camera.cx_px - slope[1] * camera.cy_px])


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeModel:
    """What a line's own evidence and its distance from where it was looked for say, as edges.json holds it.

    `clear` nats is what a line that shows plainly has over one that doesn't, and `faint` the score that gives most of
    it: how plainly says nothing more, since other things' edges show plainly, too. Half of the edges lie within
    `spread_px` of the line that was looked for, and far ones are no rarity (Cauchy).
    """

    clear: float
    faint: float
    spread_px: float

    def odds(self, score: FloatArray, off_px: FloatArray) -> FloatArray:
        """Return the log odds of lines with these scores, this far off, up to what all have in common."""
        odds: FloatArray = self.clear * -np.expm1(-score / self.faint) - np.log1p(np.square(off_px / self.spread_px))
        return odds


@lru_cache(maxsize=1)
def model() -> EdgeModel:
    """Read the fitted model that lies in the package."""
    held = json.loads(DATA.read_text(encoding="utf-8"))
    return EdgeModel(**{name: held[name] for name in ("clear", "faint", "spread_px")})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Profiles:
    """What both photos show across a line: gradients (S, T) and how far each place votes for an edge, 0..1 (S, T).

    `along` (S,) and `across` (T,) px are the profiles' places on the line and the places off it. `paired` (S, T) says
    where there is a right photo.
    """

    left: FloatArray
    right: FloatArray
    paired: BoolArray
    votes: FloatArray
    along: FloatArray
    across: FloatArray
    length_px: float

    def scores(self) -> tuple[FloatArray, FloatArray]:
        """Return per place across the share of profiles that vote for a line there (T,), and its score in nats (T,).

        Chance is what the lines here have in common (the median): grain of concrete votes, too. Profiles that are
        independent vote like coins: a score is their number times the divergence of a line's share from chance's.
        """
        share = self.votes.mean(axis=0)
        within = np.abs(self.across) <= REACH_PX
        return share, self.length_px / SHARED_PX * _divergence(share, median(share[within]))


def profiles(both: Gradients, line: Line, disparity: FloatArray | None, texture_grey: float) -> Profiles | None:
    """Read both photos across a line, the left one alone without a `disparity`; None for less than 8 px of line."""
    length = line.length_px
    if length < 8.0:
        return None
    trim = min(4.0, 0.15 * length)
    along = np.linspace(trim, length - trim, int(np.clip(length - 2 * trim, 8, MOST_SAMPLES)))
    across = np.arange(-np.ceil(WIDE_PX / STEP_PX), np.ceil(WIDE_PX / STEP_PX) + 1) * STEP_PX
    left, right, paired = _gradients_across(both, line, disparity, along, across)
    votes = _votes(left, np.where(paired, right, left), texture_grey)
    return Profiles(
        left=left, right=right, paired=paired, votes=votes, along=along, across=across, length_px=length
    )  # fmt: skip


def find_edge(
    both: Gradients,
    line: Line,
    disparity: FloatArray,
    texture_grey: float,
    least_strength: float,
    alone: bool = False,
) -> EdgeFit | None:
    """Find the likeliest edge along `line`, up to 9 px off; None where less than `least_strength` of it votes for one.

    `disparity` (3,) is the face's plane in pixels, d = p0 x + p1 y + p2. `texture_grey` is the usual gradient on the
    face: an edge must stand out of it. `alone`: ask the left photo only, where the right one may have a background
    behind the edge that looks like the face.
    """
    read = profiles(both, line, None if alone else disparity, texture_grey)
    best = _likeliest(read) if read is not None else None
    if read is None or best is None or best.strength < least_strength:
        return None
    fit_left = _subpixel(read, read.left, best.offset_px)
    if fit_left is None:
        return None
    shift, slope, sigma = fit_left
    return EdgeFit(
        line=line.moved(shift - 0.5 * slope * read.length_px, shift + 0.5 * slope * read.length_px),
        sigma_px=float(np.hypot(sigma, best.ambiguity_px)),
        ambiguity_px=best.ambiguity_px,
        strength=best.strength,
    )


def _gradients_across(
    both: Gradients, line: Line, disparity: FloatArray | None, along: FloatArray, across: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the gradient across the line (S, T) in the left photo and, read along the plane, in the right one.

    The third answer says where there is a right photo to read; without a `disparity` it isn't read.
    """
    nx, ny = line.normal
    base = line.start + along[:, None] * line.direction
    x = base[:, :1] + across * nx
    y = base[:, 1:] + across * ny
    left = np.asarray(sample(both.left_x, x, y) * nx + sample(both.left_y, x, y) * ny, dtype=np.float64)
    if disparity is None:
        return left, left, np.zeros(left.shape, dtype=bool)
    at = x - (disparity[0] * x + disparity[1] * y + disparity[2])
    right = sample(both.right_x, at, y) * nx + sample(both.right_y, at, y) * ny
    paired = (sample(both.valid_right, at, y) > 0.9) & (at > 1.0)
    return left, np.asarray(right, dtype=np.float64), paired


def agreement(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the weaker of two gradients; an outer edge has another background in each photo and may turn its sign."""
    weaker = np.minimum(np.abs(left), np.abs(right))
    same: FloatArray = np.where(left * right > 0.0, weaker, TURNED_SIGN * weaker)
    return same


def edge_share(left: Float32Array, right: Float32Array) -> FloatArray:
    """Return, per place across (T,), the share of profiles (S, T) where both photos' gradients vote for an edge."""
    share: FloatArray = _votes(left.astype(np.float64), right.astype(np.float64), SHARE_GREY).mean(axis=0)
    return share


def _votes(left: FloatArray, right: FloatArray, texture_grey: float) -> FloatArray:
    """Return 0..1 per profile place: the weaker gradient of both photos, against the face's texture."""
    agreed = agreement(left, right)
    # a strong edge is wide above any threshold: only its crest may vote
    crest = cv2.dilate(agreed.astype(np.float32), np.ones((1, CREST_STEPS), np.uint8))
    sharp = np.square(agreed / np.maximum(crest, 1e-6))
    votes: FloatArray = sharp * agreed**2 / (agreed**2 + texture_grey**2)
    return votes


@dataclass(frozen=True, slots=True, kw_only=True)
class _Likeliest:
    """The likeliest line: how far off it lies, and the share of profiles that vote for it.

    `ambiguity_px` is what it may be off because the edge is another line: the root of what all others are off, squared,
    by how likely they are.
    """

    offset_px: float
    strength: float
    ambiguity_px: float


def _likeliest(read: Profiles) -> _Likeliest | None:
    """Return the likeliest line through the profiles; it runs as the line that was looked for does."""
    share, score = read.scores()
    near = np.flatnonzero(np.abs(read.across) <= REACH_PX)
    if not share[near].max() > 0.0:
        return None
    odds = model().odds(score[near], read.across[near])
    top = int(np.argmax(odds))
    crest = np.flatnonzero(np.abs(read.across[near] - read.across[near[top]]) <= CREST_PX)
    top = int(crest[np.argmax(share[near[crest]])])  # odds level off: the same edge's flank is as likely
    chances = np.exp(odds - odds.max())
    off = np.abs(read.across[near] - read.across[near[top]])
    return _Likeliest(
        offset_px=float(read.across[near[top]]),
        strength=float(share[near[top]]),
        ambiguity_px=_ambiguity_px(off, chances / chances.sum()),
    )


def _ambiguity_px(off_px: FloatArray, chances: FloatArray) -> float:
    """Return the root mean square of how far off other lines lie, by their chances; less the farthest that are rare.

    What is nearer than a crest is the same edge: its place is fitted. What happens in one of a hundred is a blunder,
    not what a sigma tells of.
    """
    far_first = np.argsort(-off_px)
    kept = np.diff(np.maximum(np.cumsum(chances[far_first]) - RARE, 0.0), prepend=0.0)
    others = np.where(off_px > CREST_PX, np.square(off_px), 0.0)[far_first]
    return float(np.sqrt(kept @ others))


def _divergence(share: FloatArray, chance: float) -> FloatArray:
    """Return how far shares of votes lie over what chance gives, in nats (Kullback, Leibler 1951); 0 below it."""
    p, q = np.clip(share, 1e-6, 1.0 - 1e-6), min(max(chance, 1e-3), 0.999)
    apart: FloatArray = np.where(p > q, p * np.log(p / q) + (1.0 - p) * np.log((1.0 - p) / (1.0 - q)), 0.0)
    return apart


def _subpixel(read: Profiles, profile: FloatArray, centre_px: float) -> tuple[float, float, float] | None:
    """Fit a line to each profile's own peak near `centre_px`: offset at the middle, slope, sigma."""
    across, rows = read.across, np.arange(len(read.along))[:, None]
    place_near = np.flatnonzero(np.abs(across - centre_px) <= CREST_PX)
    peak = np.clip(place_near[np.argmax(np.abs(profile[:, place_near]), axis=1)], 1, len(across) - 2)
    before, top, after = np.abs(profile[rows, peak[:, None] + np.array([-1, 0, 1])]).T
    bend = before - 2.0 * top + after
    inner = (bend < -1e-9) & (np.abs(across[peak] - centre_px) < 1.45)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = across[peak] + STEP_PX * np.where(inner, 0.5 * (before - after) / bend, 0.0)
    weight = read.votes[rows[:, 0], peak][inner] + 1e-3
    if len(weight) < 6 or weight.sum() < 1e-2:
        return None
    s = read.along[inner] / read.length_px - 0.5
    line = np.stack([s, np.ones_like(s)], axis=-1)
    fit = reweighted_linear(line, (place - centre_px)[inner], LEAST_SCATTER_PX, weight, SHORT_TUKEY, FEW_PROFILES)
    slope, shift = fit.parameters.tolist()
    total = float(fit.weights.sum())
    independent = max(total**2 / float(fit.weights @ fit.weights) / SHARED_PX, 2.0)
    sigma = float(np.hypot(np.sqrt(fit.cost / total / independent), side_sigmas().edge))
    return centre_px + shift, float(slope / read.length_px), sigma
