"""Where the photo shows sky: further than anything, so what should stand there does not."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.photo.quality import white
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray, freeze, median
from asbuilt_bim.geometry.masks import at_pixels, nonzero
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.even_places import LIGHT, MOST_TEXTURE_GREY, WINDOW_PX, window_texture
from asbuilt_bim.vision.stereo.matching import grey

LEAST_LIGHT = 0.55
"""Sky is among the brightest in a photo by day: at least this share of its 98th percentile."""
FAR_M, FAR_SIGMAS = 65.0, 3.0
"""What was matched nearer than this is a thing, where its disparity is surely more than none."""
LEAST_PIXELS = 400
LEAST_SPREAD_GREY, MOST_SPREAD_GREY = 1.5, 4.0
"""How far a sky scatters about its own gradient: less is no camera's; more, as clouds do, vouches for nothing else."""
MOST_SAMPLES = 20_000
ALIKE = 0.9
"""Share of a piece's pixels that have the sky's colour, each within three of its spreads."""
NEIGHBOUR_PIXELS = 60
"""Sky between bars comes in pieces as small as this, at 20 px from bar to bar."""
REACH_PX = 81
"""A piece's colour is held against the sky's within half of this, as far as beyond a plank or a rail."""
MOST_OFF_GREY = 6.0
"""What a sky's colour changes by over that reach, and a photo's compression moves it by beside a bar."""
SMALLER = 4
LEAST_KNOWN = 0.25
"""Share of a piece that must be within reach of known sky."""
SPECK_PIXELS = 6
"""Fewer pixels together that have the sky's colour are chance: a bright grain of concrete is one or two wide."""
_ANY = 1e-3  # of a window: less is rounding

_Piece = NDArray[np.intp]  # flat indices of pixels


def without_sky(instance: Instance, sky: BoolArray) -> Instance:
    """Take the sky out of an instance's mask: a mask drawn by hand or by a network may run over the edge.

    One that is nothing but sky stays as it is, to be named: it has no surface.
    """
    mask: BoolArray = instance.mask & ~sky
    if not mask.any() or not (instance.mask & sky).any():
        return instance
    return replace(instance, mask=freeze(mask))


def find_sky(pair: RectifiedPair, depth: DepthMap) -> BoolArray:
    """Return the sky's pixels (H, W); conservative: what isn't plainly sky isn't.

    Demanded of each pixel: untextured, no disparity but a very small one, bright, and not warmer than neutral (blue or
    grey). It also connects to the photo's top border and ends at the edges of things, or is a piece with the colour of
    what does. Sky is seen between guard rails and under slabs as well. Between bars stereo carries their disparity over
    the gaps: there a piece may have one, if it has the colour of the sky right beside.
    """
    picture = grey(pair.left)
    mean, spread = window_texture(picture)
    blue, green, red = (cv2.blur(pair.left[..., k].astype(np.float32), (5, 5)) for k in range(3))
    valid = pair.valid_left
    if not valid.any():
        return np.zeros_like(valid)
    light = float(np.quantile(picture[valid], LIGHT))
    usual_px = median(depth.sigma_px[depth.valid]) if depth.valid.any() else 0.0
    far_px = max(depth.f_px * depth.baseline_m / FAR_M, FAR_SIGMAS * usual_px)
    near = depth.valid & (depth.disparity_px > far_px)
    even = valid & (spread < MOST_TEXTURE_GREY)
    calm = even & (mean > LEAST_LIGHT * light)
    cold = (blue >= red - 4.0) & (blue >= green - 6.0)
    colour = np.stack([blue, green, red], axis=-1)
    candidate = _opened(calm & cold & ~near)
    sky = _hanging(candidate, valid, even & ~near & ~(calm & cold))
    sky = sky | _of_its_colour(candidate & ~sky, sky, colour)
    smeared = _of_the_colour_beside(_opened(calm & cold) & ~sky, sky, colour)
    sky, near = sky | smeared, near & ~_grown(smeared)
    # untextured pixels were kept off edges by the window's half: give that back, not over what was measured
    like = np.abs(picture - _local_level(mean, sky, 31)) < 3.0 * MOST_TEXTURE_GREY
    back: BoolArray = (sky | (_grown(sky) & valid & ~near & like & cold)) & ~_grown(white(pair.left))
    return back


def _opened(mask: BoolArray) -> BoolArray:
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0)


def _grown(mask: BoolArray) -> BoolArray:
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((WINDOW_PX, WINDOW_PX), np.uint8)) > 0)


def _hanging(candidate: BoolArray, valid: BoolArray, faded: BoolArray) -> BoolArray:
    """Keep the parts that touch the top of the photo's own area, and end at things.

    `faded` (H, W) is as even as sky, and too dark or too warm. A wall under a lamp goes over into it without an edge.
    """
    count, parts, stats, _ = cv2.connectedComponentsWithStats(candidate.astype(np.uint8), connectivity=4)
    if count <= 1:
        return np.zeros_like(candidate)
    has = valid.any(axis=0)
    top = np.argmax(valid, axis=0)
    columns = np.flatnonzero(has)
    touching: set[int] = set()
    for below in range(2, 8):
        rows = np.minimum(top[columns] + below, candidate.shape[0] - 1)
        touching |= set(np.unique(parts[rows, columns]).tolist())
    large = [i for i in touching if i > 0 and stats[i, cv2.CC_STAT_AREA] >= LEAST_PIXELS]
    return np.isin(parts, [i for i in large if _ends_at_things(parts == i, valid & ~candidate, faded)])


def _ends_at_things(part: BoolArray, beyond: BoolArray, faded: BoolArray) -> bool:
    """Say whether an edge ends a part (H, W) all round, but for as little as may have another colour than sky's."""
    border = _grown(part) & beyond
    return bool(np.count_nonzero(border & faded) <= (1.0 - ALIKE) * np.count_nonzero(border))


def _of_its_colour(candidate: BoolArray, sky: BoolArray, colour: np.ndarray) -> BoolArray:
    """Return the pieces of the candidates (H, W) whose colour (H, W, 3) continues the known sky's gradient."""

    def alike(known: BoolArray, pieces: list[_Piece]) -> list[bool]:
        gradient = _gradient(known, colour)
        if gradient is None:
            return []
        like = gradient.alike().ravel()
        return [bool(np.mean(like[piece]) >= ALIKE) for piece in pieces]

    return _gathered(_pieces(candidate, LEAST_PIXELS), sky, alike)


def _of_the_colour_beside(candidate: BoolArray, sky: BoolArray, colour: np.ndarray) -> BoolArray:
    """Return the pieces of the candidates (H, W) whose colour (H, W, 3) is that of the sky within reach of them.

    The sky's colour beside is looked up in a map a few times smaller: it changes little from pixel to pixel.
    """
    small = (-(-sky.shape[1] // SMALLER), -(-sky.shape[0] // SMALLER))
    smaller = cv2.resize(colour, small, interpolation=cv2.INTER_AREA)

    def alike(known: BoolArray, pieces: list[_Piece]) -> list[bool]:
        there = cv2.resize(known.astype(np.uint8), small, interpolation=cv2.INTER_NEAREST) > 0
        level = _local_level(smaller, there, REACH_PX // SMALLER)
        return [_is_of(level, colour, piece) for piece in pieces]

    return _gathered(_pieces(candidate, NEIGHBOUR_PIXELS), sky, alike)


def _gathered(
    pieces: list[_Piece], sky: BoolArray, alike: Callable[[BoolArray, list[_Piece]], list[bool]]
) -> BoolArray:
    """Return the pieces that are `alike` to the known sky; each that was found tells more of it, for the next."""
    found = np.zeros_like(sky)
    while pieces:
        yes = alike(sky | found, pieces)
        if not any(yes):
            break
        found.ravel()[np.concatenate([piece for piece, is_sky in zip(pieces, yes, strict=True) if is_sky])] = True
        pieces = [piece for piece, is_sky in zip(pieces, yes, strict=True) if not is_sky]
    return found


def _is_of(level: np.ndarray, colour: np.ndarray, piece: _Piece) -> bool:
    """Say whether a piece (flat indices) has the colour that a smaller map of the sky's has there."""
    rows, columns = np.divmod(piece, colour.shape[1])
    beside = at_pixels(level, rows // SMALLER, columns // SMALLER)
    known_beside = beside[:, 0] >= 0.0
    if known_beside.sum() < LEAST_KNOWN * len(piece):
        return False
    off = np.abs(at_pixels(colour, rows[known_beside], columns[known_beside]) - beside[known_beside]).max(axis=-1)
    return bool(np.mean(off < MOST_OFF_GREY) >= ALIKE)


def _pieces(candidate: BoolArray, least: int) -> list[_Piece]:
    """Return the candidates' connected parts of so many pixels, as flat indices."""
    count, parts, stats, _ = cv2.connectedComponentsWithStats(candidate.astype(np.uint8), connectivity=4)
    return [np.flatnonzero(parts == k) for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= least]


def coloured_like(photo: ByteImage, sky: BoolArray) -> BoolArray:
    """Return which pixels (H, W) of a photo (H, W, 3) have the sky's colour: sky between bars has, where stereo smears.

    All are left out where the sky's own colour scatters too much to vouch for anything, and specks are.
    """
    gradient = _gradient(sky, photo)
    if gradient is None:
        return np.zeros_like(sky)
    alike = gradient.alike()
    _, parts, stats, _ = cv2.connectedComponentsWithStats(alike.astype(np.uint8), connectivity=4)
    kept: BoolArray = alike & (stats[:, cv2.CC_STAT_AREA] >= SPECK_PIXELS)[parts]
    return kept


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Gradient:
    """The sky's colour by place: `slope` (3, 3) of row, column and 1, as shares of the photo; what it differs by."""

    colour: np.ndarray  # (H, W, 3)
    slope: FloatArray
    most: FloatArray  # (3,)

    def alike(self) -> BoolArray:
        """Say which pixels (H, W) have the colour that the sky has there."""
        height, width, _ = self.colour.shape
        alike = np.ones((height, width), dtype=bool)
        for channel, (down, across, level) in enumerate(self.slope.T.astype(np.float32)):
            expected = (np.arange(height, dtype=np.float32) * (down / height) + level)[:, None]
            expected = expected + np.arange(width, dtype=np.float32) * (across / width)
            alike &= np.abs(self.colour[..., channel] - expected) < self.most[channel]
        return alike


def _gradient(sky: BoolArray, colour: np.ndarray) -> _Gradient | None:
    """Fit the gradient of the colour (H, W, 3) over the sky; None where too little is known or it scatters too much."""
    rows, columns = nonzero(sky)
    if len(rows) < LEAST_PIXELS:
        return None
    some = slice(None, None, max(1, len(rows) // MOST_SAMPLES))
    rows, columns = rows[some], columns[some]
    known = at_pixels(colour, rows, columns).astype(np.float64)
    design = np.column_stack([rows / sky.shape[0], columns / sky.shape[1], np.ones(len(rows))])
    slope, *_ = np.linalg.lstsq(design, known, rcond=None)
    spread = np.array([robust_sigma(channel) for channel in (known - design @ slope).T])
    if np.any(spread > MOST_SPREAD_GREY):
        return None
    return _Gradient(colour=colour, slope=slope, most=3.0 * np.maximum(spread, LEAST_SPREAD_GREY))


def _local_level(value: np.ndarray, sky: BoolArray, window_px: int) -> np.ndarray:
    """Return a value's (H, W) or (H, W, 3) mean over the sky in a window about each pixel, -1000 where none is."""
    weight = cv2.blur(sky.astype(np.float32), (window_px, window_px))
    shape = (*sky.shape, *([1] * (value.ndim - 2)))
    total = cv2.blur(np.where(sky.reshape(shape), value, 0.0).astype(np.float32), (window_px, window_px))
    level = total / np.maximum(weight, _ANY).reshape(shape)
    return np.where((weight > _ANY).reshape(shape), level, -1e3)
