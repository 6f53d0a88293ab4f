"""Where a blurred edge lies before a background that changes: what is beyond it is unknown, and is weighed out.

`edge_model` takes each side of an edge for one colour, seen at its profile's ends. Where the lens is out of focus those
ends lie so near the edge that another colour there is another place of the edge. Then the place that the search began
at is found again: an outline that began half a pixel off stays there. Here both sides may change all along, in linear
light as random walks: the inside by as little, the outside by as much as they are seen to. No colour at the edge itself
is taken for likelier than another. Of every place it is asked how likely the whole profile is with an edge there, over
all that may lie beyond it, by its covariance. Colours count by what noise, JPEG and texture leave of them: concrete's
brightness changes, its hue hardly does.

Reference: Rasmussen & Williams 2006, Gaussian processes, eq. 2.30 (marginal likelihood).
"""

import math
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.vision.edges import DISPLAY_GAMMA
from asbuilt_bim.vision.target.edge_model import (
    BETWEEN_PIXELS_PX,
    JPEG_PX,
    STEP_PX,
    PlacedEdges,
    linear_light,
    profiles_across,
    share_of_inside,
    straightened,
)

_STRIDE = 2  # of the profiles' samples, half a pixel apart: what is blurred needs no closer ones
_SEARCH_PX = 2.5
_TAIL = 3.0  # blurs: a bell ends there
_WITHIN, _BEYOND = 3.0, 3.0  # blurs: how far a profile reaches to both sides
_CLEAR = 1.5  # blurs: further off nearly nothing of the other side is seen
_JPEG_COLOUR = 0.06  # of the contrast: what halved colours are off by next to an edge
_LEAST_CHANGE = 0.03  # of the contrast, for each root of a pixel: no background is one colour
_LEAST_WITHIN = 0.1  # of that, inside: paint is
_COMMON = 0.5  # of how much an outside changes the whole outline tells, its own ten samples the rest
_NEVER_STILL = 1e-7  # linear light squared, for each pixel: the inverse stays finite
_NEIGHBOURS = 2  # to both sides: as far as blur reaches
_ANY_COLOUR = 1e4  # noise's variances: what a side's colour at the edge may be
_LEAST_NOISE = 0.006  # of full scale: a sharp photo's, by daylight
_READ_NOISE = 0.67  # of a pixel's noise is left where it is read between pixels
_LEAST_LIGHT = 0.004  # linear: the tone curve's slope ends there
_BGR_OF_PLANES = np.array([[1.0, 1.0, 1.0], [0.0, -0.714, 1.403], [1.773, -0.344, 0.0]])
"""What brightness and both colour differences (JPEG's Y, Cr, Cb) add to blue, green and red."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Seen:
    """Profiles as three mixes of colours (N, S, 3), their `noise` (N, S, 3), what the sides change by for each pixel.

    Variances all; `inside` (3,) one for all profiles, `outside` (N, 3). The mixes are such that noise and texture of
    one say nothing of another's.
    """

    at_px: FloatArray  # (S,)
    values: FloatArray
    noise: FloatArray
    inside: FloatArray
    outside: FloatArray


def place_soft_edges(
    planes: Float32Array,
    points: FloatArray,
    outward: FloatArray,
    blur_px: float,
    bend: FloatArray,
    gamma: float = DISPLAY_GAMMA,
) -> PlacedEdges:
    """Place the edge near each of `points` (N, 2), in order round an outline, along `outward` (N, 2).

    `planes` are those of `colour_planes`, `bend` (N,) is as in `place_edges`. For a blur of 1 px and more: the light
    is compared, and JPEG's halved colours only count as noise. A `gamma` of 1 tells that grey levels were blurred, as
    a resampler or a noise filter does it, and not light.
    """
    sigma_px = float(np.hypot(blur_px, BETWEEN_PIXELS_PX))
    seen, contrast = _seen(planes, points, outward, sigma_px, gamma)
    places = np.arange(-_SEARCH_PX, _SEARCH_PX + 0.5 * STEP_PX, STEP_PX)
    cost = np.stack([_unlikely(seen, float(place), sigma_px) for place in places], axis=-1)
    row, best = np.arange(len(cost)), np.clip(np.argmin(cost, axis=1), 1, len(places) - 2)
    before, at, after = cost[row, best - 1], cost[row, best], cost[row, best + 1]
    curve = np.maximum(before - 2.0 * at + after, 1e-9)
    aside = 0.5 * (before - after) / curve
    offset = np.where(np.abs(aside) <= 1.0, places[best] + aside * STEP_PX, np.nan)
    sigma = np.hypot(JPEG_PX, np.sqrt(2.0 / curve) * STEP_PX)
    offset = offset + straightened(blur_px, bend)
    return PlacedEdges(points=points + offset[:, None] * outward, sigma_px=sigma, contrast=contrast)


def _seen(
    planes: Float32Array, points: FloatArray, outward: FloatArray, sigma_px: float, gamma: float
) -> tuple[_Seen, FloatArray]:
    """Read the profiles and say how much noise they have and by how much both sides change; and the contrast (N,)."""
    reach = math.ceil(_BEYOND * sigma_px + _SEARCH_PX)
    shown = profiles_across(planes, points, outward, reach)[:, ::_STRIDE]
    at_px = np.arange(-reach, reach + 1.0)
    kept = at_px >= -np.ceil(_WITHIN * sigma_px + 1.0)
    shown, at_px = shown[:, kept], at_px[kept]
    inside, outside = at_px <= -_CLEAR * sigma_px, at_px >= _CLEAR * sigma_px
    light = linear_light(shown, gamma)
    apart = shown[:, outside].mean(axis=1) - np.median(shown[:, inside], axis=(0, 1))
    colour = np.mean(apart**2, axis=0) * np.array([0.0, _JPEG_COLOUR**2, _JPEG_COLOUR**2])
    of_planes = _shown_noise(shown[:, inside, 0]) ** 2 + colour
    within, beyond = np.median(light[:, inside], axis=(0, 1)), light[:, outside].mean(axis=(0, 1))
    between = light[:, outside].mean(axis=1) - within
    least = _LEAST_CHANGE**2 * between.T @ between / len(between) + _NEVER_STILL * np.eye(3)
    inner = _change(light[:, inside], _noise(within, of_planes, gamma), sigma_px) + _LEAST_WITHIN * least
    outer = _change(light[:, outside], _noise(beyond, of_planes, gamma), sigma_px) + least
    mix = _independent(_noise(0.5 * (within + beyond), of_planes, gamma), outer)
    noise = np.einsum("ac,nsab,bc->nsc", mix, _noise(light, of_planes, gamma), mix)
    near = _change_near(light[:, outside] @ mix, noise[:, outside], sigma_px)
    common, floor = np.diag(mix.T @ outer @ mix), np.diag(mix.T @ least @ mix)
    seen = _Seen(
        at_px=at_px, values=light @ mix, noise=noise, inside=np.diag(mix.T @ inner @ mix),
        outside=(1.0 - _COMMON) * near + _COMMON * common + floor,
    )  # fmt: skip
    return seen, np.linalg.norm(shown[:, outside].mean(axis=1) - shown[:, inside].mean(axis=1), axis=1)


def _unlikely(seen: _Seen, place_px: float, sigma_px: float) -> FloatArray:
    """Return how unlikely (N,) the profiles are with their edges at a place: minus twice the logarithm.

    A side's walk begins at the edge: its covariance is what each step of it adds, as the lens shows it.
    """
    at = seen.at_px
    line, place, tail = (
        np.rint(at / STEP_PX).astype(int),
        round(place_px / STEP_PX),
        round(_TAIL * sigma_px / STEP_PX),
    )
    steps = np.arange(line[0] - tail, line[-1] + tail + 1)
    middle = len(steps)
    table = 1.0 - share_of_inside(middle, 1.0, sigma_px)
    share, edge = table[line[:, None] - steps + middle], table[line - place + middle]
    after, before = share[:, steps > place], 1.0 - share[:, steps < place]
    any_colour = _ANY_COLOUR * (np.outer(edge, edge) + np.outer(1.0 - edge, 1.0 - edge))
    within = any_colour + STEP_PX * seen.inside[:, None, None] * (before @ before.T)
    beyond = STEP_PX * (after @ after.T)
    count, size = len(seen.values), len(at)
    # one Cholesky gives both: in a matrix bordered with the values, the last pivot is what the quadratic form leaves
    whole = np.empty((count, 3, size + 1, size + 1))
    whole[..., :size, :size] = within + seen.outside[:, :, None, None] * beyond
    values, noise = seen.values.transpose(0, 2, 1), seen.noise.transpose(0, 2, 1)
    diagonal = np.arange(size)
    whole[..., diagonal, diagonal] += noise
    whole[..., size, :size] = whole[..., :size, size] = values
    corner = 1.0 + 2.0 * np.sum(values**2 / noise, axis=-1)
    whole[..., size, size] = corner
    pivots = np.diagonal(np.linalg.cholesky(whole), axis1=-2, axis2=-1)
    left = np.sum(2.0 * np.log(pivots[..., :size]), axis=-1)
    return np.asarray(np.sum(corner - pivots[..., size] ** 2 + left, axis=1), dtype=np.float64)


def _shown_noise(brightness: FloatArray) -> float:
    """Return the noise, of full scale, that samples (N, S) of a blurred side show: blur leaves it alone a bend."""
    bend = brightness[:, 2:] - 2.0 * brightness[:, 1:-1] + brightness[:, :-2]
    spread = robust_sigma(bend.ravel()) / math.sqrt(6.0)
    return max(spread / _READ_NOISE, _LEAST_NOISE)


def _noise(light: FloatArray, planes_noise: FloatArray, gamma: float) -> FloatArray:
    """Return the noise's covariance (..., 3, 3) in linear light (..., 3): bright pixels have more of it."""
    slope = gamma * np.maximum(light, _LEAST_LIGHT) ** (1.0 - 1.0 / gamma)
    each = slope[..., None, :] * (_BGR_OF_PLANES * np.sqrt(planes_noise)[:, None])
    return np.asarray(np.swapaxes(each, -1, -2) @ each, dtype=np.float64)


def _change(light: FloatArray, noise: FloatArray, sigma_px: float) -> FloatArray:
    """Return by how much (3, 3) a side (N, S, 3) changes for each pixel, blur and noise taken off."""
    step = _step(light.shape[1], sigma_px)
    apart = (light[:, step:] - light[:, :-step]).reshape(-1, 3)
    size = np.sum(apart**4, axis=1)
    usual = apart[size <= np.quantile(size, 0.95)]
    values, vectors = np.linalg.eigh((usual.T @ usual / len(usual) - 2.0 * noise) / _walked(step, sigma_px))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T, dtype=np.float64)


def _change_near(values: FloatArray, noise: FloatArray, sigma_px: float) -> FloatArray:
    """Return by how much (N, 3) what is next to each point changes for each pixel, of mixes (N, S, 3)."""
    step = _step(values.shape[1], sigma_px)
    own = np.mean((values[:, step:] - values[:, :-step]) ** 2, axis=1)
    near = np.mean([np.roll(own, k, axis=0) for k in range(-_NEIGHBOURS, _NEIGHBOURS + 1)], axis=0)
    return np.asarray(np.maximum(near - 2.0 * noise.mean(axis=1), 0.0) / _walked(step, sigma_px), dtype=np.float64)


def _step(count: int, sigma_px: float) -> int:
    """Return how far apart samples are compared: beyond the blur's reach, as far as there are so many."""
    return int(np.clip(round(_CLEAR * sigma_px), 1, count - 1))


def _walked(step: int, sigma_px: float) -> float:
    """Return the variance between two places of a blurred random walk that changes by one for each pixel."""
    u = step / (2.0 * sigma_px)
    return float(step * math.erf(u) - 2.0 * sigma_px / math.sqrt(math.pi) * (1.0 - math.exp(-u * u)))


def _independent(noise: FloatArray, change: FloatArray) -> FloatArray:
    """Return the mixes (3, 3), as columns, in which noise is one and neither it nor the change is shared."""
    values, vectors = np.linalg.eigh(noise)
    whiten = vectors / np.sqrt(values)
    _, turn = np.linalg.eigh(whiten.T @ change @ whiten)
    return np.asarray(whiten @ turn, dtype=np.float64)
