"""A straight edge found to a tenth of a pixel: gradient votes across it in both photos, then a robust line.

The right photo is read along the face's own plane, so an edge that belongs to the face shows at the same place in both,
and the background's edges don't.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.geometry.robust_least_squares import reweighted_linear, robust_sigma, tukey
from asbuilt_bim.vision.stereo.warp import sample

STEP_PX = 0.25
"""Profile step: a quarter of the sensor's own blur."""
EDGE_FLOOR_PX = 0.12
"""What blur, tone curve and chamfer move a whole edge by: a tenth of a pixel however long it is."""
LEAST_SCATTER_PX = 0.15
"""Of single profiles about their line: less would be chance."""
SHORT_TUKEY = partial(tukey, reach=3.0)
"""A neighbouring edge is never far."""
FEW_PROFILES = np.array([1e-3, 0.0])
"""What holds the line's slope where few profiles are left, as a share of all of them."""
MOST_SAMPLES = 400
TURN_STEPS = 13
TURNED_SIGN = 0.7
"""What an edge counts that is dark to light in one photo and light to dark in the other: chance makes such ones too."""
SHARE_GREY = 2.0
"""The gradient that counts half: grain of concrete between two profiles."""
CREST_STEPS = 13
"""An edge's profile is some 3 px wide after the sensor's and our own blur."""
CREST_PX = 0.5 * (CREST_STEPS - 1) * STEP_PX
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
    `disparity_miss_px` is how far the right photo's edge lies from where the plane puts
    it: positive where it is nearer than the plane, NaN for edges along the rows. `miss_sigma_px` goes with it.
    """

    line: Line
    sigma_px: float
    ambiguity_px: float
    strength: float
    contrast: float
    disparity_miss_px: float
    miss_sigma_px: float


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


def find_edge(
    both: Gradients,
    line: Line,
    disparity: FloatArray,
    texture_grey: float,
    reach_px: float,
    prior_px: float,
    least_strength: float,
    alone: bool = False,
    squeezed: bool = False,
) -> EdgeFit | None:
    """Find the edge near `line`, at most `reach_px` off it; None where less than `least_strength` of it votes for one.

    `disparity` (3,) is the face's plane in pixels, d = p0 x + p1 y + p2. `texture_grey` is the usual gradient on the
    face: an edge must stand out of it. `prior_px` is how well the line was known before. `alone`: ask the left photo
    only, where the right one may have a background behind the edge that looks like the face. `squeezed`: the face turns
    away towards its edge, and its grain stands there in lines along the edge.
    """
    length = line.length_px
    if length < 8.0:
        return None
    trim = min(4.0, 0.15 * length)
    along = np.linspace(trim, length - trim, int(np.clip(length - 2 * trim, 8, MOST_SAMPLES)))
    half_turn = min(3.0, 0.12 * length)
    wide = reach_px + half_turn + 1.5
    across = np.arange(-np.ceil(wide / STEP_PX), np.ceil(wide / STEP_PX) + 1) * STEP_PX
    left, right, paired = _profiles(both, line, None if alone else disparity, along, across)
    votes = _votes(left, np.where(paired, right, left), texture_grey)
    best = _strongest(votes, along, across, length, reach_px, half_turn, prior_px, squeezed)
    if best is None or best.strength < least_strength:
        return None
    offset, turn, strength = best.offset_px, best.turn, best.strength
    centre = offset + turn * (along - 0.5 * length)
    fit_left = _subpixel(left, votes, across, along, centre, length)
    if fit_left is None:
        return None
    shift, slope, sigma, contrast = fit_left
    miss, miss_sigma = np.nan, np.inf
    nx = float(line.normal[0])
    shows_depth = abs(nx) > 0.5 and np.mean(paired) > 0.9  # an edge along the rows looks the same at any disparity
    fit_right = _subpixel(right, votes, across, along, centre, length) if shows_depth else None
    if fit_right is not None:
        # the right photo's edge sits nearer by e where its profile peaks e further along -x
        miss = -(fit_right[0] - shift) / nx
        miss_sigma = float(np.hypot(sigma, fit_right[2])) / abs(nx)
    found = line.moved(shift - 0.5 * slope * length, shift + 0.5 * slope * length)
    return EdgeFit(
        line=found,
        sigma_px=float(np.hypot(sigma, best.ambiguity_px)),
        ambiguity_px=best.ambiguity_px,
        strength=strength,
        contrast=contrast,
        disparity_miss_px=miss,
        miss_sigma_px=miss_sigma,
    )


def _profiles(
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
    """The likeliest line through the profiles: offset at its middle, turn, the share of profiles that vote for it.

    `ambiguity_px` is what it may be off because the edge is another line: the root of what all others are off, squared,
    by how likely they are.
    """

    offset_px: float
    turn: float
    strength: float
    ambiguity_px: float


def _strongest(
    votes: FloatArray,
    along: FloatArray,
    across: FloatArray,
    length: float,
    reach: float,
    half_turn: float,
    prior: float,
    squeezed: bool,
) -> _Likeliest | None:
    """Return the likeliest line through the profiles: by its votes against chance's, and by where it was looked for.

    Chance is what the lines here have in common (the median): grain of concrete votes, too. Profiles that are
    independent vote like coins, so a line's odds are their number times the divergence of its share from chance's.
    Where grain is `squeezed` into lines, their shares scatter more than coins': that scatter tells how many there are.
    """
    shifts = np.flatnonzero(np.abs(across) <= reach)
    ends = np.linspace(-half_turn, half_turn, TURN_STEPS)
    turns = 2.0 * ends / length
    moved = np.round(turns[:, None] * (along - 0.5 * length) / STEP_PX).astype(np.intp)
    starts = np.arange(len(along)) * len(across) + shifts[0] + moved  # of each profile's window, by turn
    windows = np.lib.stride_tricks.sliding_window_view(votes.ravel(), len(shifts))
    mean = windows[starts].mean(axis=1)
    if not mean.max() > 0.0:
        return None
    chance, independent = median(mean.ravel()), length / SHARED_PX
    if squeezed and (scatter := robust_sigma(mean.ravel() - chance)) > 0.0:
        independent = min(independent, chance * (1.0 - chance) / scatter**2)
    odds = independent * _divergence(mean, chance)
    odds -= 0.5 * np.square(across[shifts] / prior) + 0.5 * np.square(ends / 2.0)[:, None]
    turn, top = np.unravel_index(int(np.argmax(odds)), odds.shape)
    chances = np.exp(odds - odds[turn, top])
    off = np.abs(across[shifts] - across[shifts[top]])
    others = np.where(off > CREST_PX, np.square(off), 0.0)  # nearer is the same edge: its place is fitted
    return _Likeliest(
        offset_px=float(across[shifts[top]]),
        turn=float(turns[turn]),
        strength=float(mean[turn, top]),
        ambiguity_px=float(np.sqrt((chances @ others).sum() / chances.sum())),
    )


def _divergence(share: FloatArray, chance: float) -> FloatArray:
    """Return how far shares of votes lie over what chance gives, in nats (Kullback, Leibler 1951); 0 below it."""
    p, q = np.clip(share, 1e-6, 1.0 - 1e-6), min(max(chance, 1e-3), 0.999)
    apart: FloatArray = np.where(p > q, p * np.log(p / q) + (1.0 - p) * np.log((1.0 - p) / (1.0 - q)), 0.0)
    return apart


def _subpixel(
    profile: FloatArray, votes: FloatArray, across: FloatArray, along: FloatArray, centre: FloatArray, length: float
) -> tuple[float, float, float, float] | None:
    """Fit a line to each profile's own peak near `centre`: offset at the middle, slope, sigma, median contrast."""
    rows = np.arange(len(along))
    place_near = np.searchsorted(across, centre - CREST_PX)[:, None] + np.arange(CREST_STEPS)
    place_near = np.minimum(place_near, len(across) - 1)
    height = np.where(
        np.abs(across[place_near] - centre[:, None]) <= CREST_PX, np.abs(profile[rows[:, None], place_near]), -1.0
    )
    peak = np.clip(place_near[rows, np.argmax(height, axis=1)], 1, len(across) - 2)
    before, top, after = (np.abs(profile[rows, peak + k]) for k in (-1, 0, 1))
    bend = before - 2.0 * top + after
    inner = (bend < -1e-9) & (np.abs(across[peak] - centre) < 1.45)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = across[peak] + STEP_PX * np.where(inner, 0.5 * (before - after) / bend, 0.0)
    weight = votes[rows, peak][inner] + 1e-3
    if len(weight) < 6 or weight.sum() < 1e-2:
        return None
    s = along[inner] / length - 0.5
    line = np.stack([s, np.ones_like(s)], axis=-1)
    fit = reweighted_linear(line, (place - centre)[inner], LEAST_SCATTER_PX, weight, SHORT_TUKEY, FEW_PROFILES)
    slope, shift = fit.parameters.tolist()
    total = float(fit.weights.sum())
    independent = max(total**2 / float(fit.weights @ fit.weights) / SHARED_PX, 2.0)
    sigma = float(np.hypot(np.sqrt(fit.cost / total / independent), EDGE_FLOOR_PX))
    turn = (centre[-1] - centre[0]) / (along[-1] - along[0])
    offset = float(centre[0] - turn * (along[0] - 0.5 * length) + shift)
    return offset, float(turn + slope / length), sigma, median(top[inner])
