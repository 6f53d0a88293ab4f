"""One photo read as surfaces: upright planes, round columns and floors, and which pixel belongs to which."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, freeze, median
from asbuilt_bim.geometry.grow import GrowOptions, Piece, grow_pieces, upright_pixels
from asbuilt_bim.geometry.level import Floor, LevelledMap, grow_floors, level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.masks import box_of, nonzero
from asbuilt_bim.geometry.polyline import fit_line
from asbuilt_bim.geometry.round_piece import circle_between
from asbuilt_bim.vision.scene.vertical import Vertical, find_vertical
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import grey
from asbuilt_bim.vision.stereo.warp import sample

NOTHING = -1
BENEATH_PX = 0.4
"""How far both planes may be off in disparity together: some 2 to 3 rows at the foot."""
MOST_CARRIED_PX = 4.0
"""The matcher carries a surface some 25 rows at the most, over which a floor comes nearer by this. What lies further
behind a floor's plane stands lower, and is seen past that floor's end."""
CARRIED_SHARE = 0.95
BELOW_PX = (3, 12)
LEAST_FLOOR = 0.3
"""Of what lies just below must be that floor: else the piece doesn't stand on it."""
LEAST_BELOW_CAMERA_M = 0.3
"""A floor at the camera's own height is seen edge-on: its plane's picture is a line."""
MOST_PIXELS = 12_000
CORE_SHARE = 0.8
"""The outer tenth on each side is where the matcher bends every surface round."""
LEAST_SURE = 3.0
"""A round surface must leave less difference by 3 sigma: a matcher's bend is no evidence, pictures are."""
BAND_PX = 8
OFF_PX = 1.5
"""Further than this a pixel lies on no surface, however unsure it is."""
SHIFTS_PX = (-0.2, -0.1, 0.0, 0.1, 0.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneOptions:
    """How pixels are given to surfaces."""

    tolerance_px: float = 0.8  # a pixel lies on a surface within this, or within 3 of its own sigmas
    margin_px: float = 8.0  # a piece may reach this far beyond its last voting column
    least_pixels: int = 150  # what is smaller carries no measurable edge
    grow: GrowOptions = GrowOptions()  # noqa: RUF009 - frozen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Surfaces of one photo; `labels` int16 (H, W): the upright piece, len(pieces) + i for floor i, -1 nothing.

    `bars_label` stands for bars, which are no surface, where they were separated from concrete.
    """

    vertical: Vertical | None
    level: LevelledMap
    pieces: tuple[Piece, ...]
    floors: tuple[Floor, ...]
    labels: NDArray[np.int16]
    sizes: NDArray[np.int64]  # pixels of each upright piece

    @property
    def bars_label(self) -> int:
        """Return the label of starter bars and cages: the first that no surface has."""
        return len(self.pieces) + len(self.floors)

    def mask(self, piece: int) -> BoolArray:
        """Return the pixels (H, W) of one upright piece."""
        return np.asarray(self.labels == piece)

    def pixels(self, piece: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of one upright piece's pixels."""
        return nonzero(self.mask(piece))


def read_scene(pair: RectifiedPair, depth: DepthMap, options: SceneOptions | None = None) -> Scene:
    """Grow the surfaces of a pair and give each measured pixel to the one that explains its disparity best.

    Where no upright edges are seen the camera is taken to be held level, and `vertical` is None.
    """
    chosen = options or SceneOptions()
    camera = pair.camera
    vertical = find_vertical(pair)
    up = vertical.up if vertical is not None else np.array([0.0, -1.0, 0.0])
    rays = pixel_rays(camera.width_px, camera.height_px, camera.f_px, camera.cx_px, camera.cy_px)
    disparity = np.where(depth.valid, depth.disparity_px, np.float32(np.nan))
    level = levelled_map(disparity, depth.sigma_px, level_view(up, camera.f_px), rays, camera.baseline_m)
    upright, slope = upright_pixels(level)
    pieces = [flat_if_flatter(piece, level, pair) for piece in grow_pieces(level, upright, chosen.grow)]
    floors = grow_floors(level, slope)
    labels = footed(_label(level, pieces, floors, chosen), level, pieces, floors)
    freeze(labels)
    sizes = np.bincount(labels[(labels >= 0) & (labels < len(pieces))], minlength=len(pieces))
    return Scene(vertical=vertical, level=level, pieces=tuple(pieces), floors=tuple(floors), labels=labels, sizes=sizes)


def q_of_piece(piece: Piece, level: LevelledMap) -> FloatArray:
    """Return q (3,) in the rectified frame of a flat upright piece."""
    return level.view.q_upright(piece.slope, piece.offset_px)


def _label(level: LevelledMap, pieces: list[Piece], floors: list[Floor], options: SceneOptions) -> NDArray[np.int16]:
    height, width = level.d_px.shape
    best = np.full((height, width), 1.0, dtype=np.float32)
    labels = np.full((height, width), NOTHING, dtype=np.int16)
    sigma = np.nan_to_num(level.sigma_px, nan=1.0, posinf=1.0)
    tolerance = np.clip(3.0 * sigma, options.tolerance_px, OFF_PX)
    for number, piece in enumerate(pieces):
        columns = _columns(level, piece, options.margin_px)
        if columns.stop <= columns.start:
            continue
        x = level.x_px[:, columns]
        miss = np.abs(level.d_px[:, columns] - piece.at(x)) / tolerance[:, columns]
        inside = (x >= piece.x0_px - options.margin_px) & (x <= piece.x1_px + options.margin_px)
        _take(labels[:, columns], best[:, columns], np.where(inside, miss, np.inf), number)
    for number, floor in enumerate(floors, start=len(pieces)):
        miss = np.abs(level.disparity_px - level.rays @ floor.q_px) / tolerance
        _take(labels, best, miss, number)
    _cut_seams(labels, level, pieces)
    return _tidy(labels, len(pieces), options.least_pixels)


def _cut_seams(labels: NDArray[np.int16], level: LevelledMap, pieces: list[Piece]) -> None:
    """Give the pixels of two faces that meet in a convex edge to the one that lies behind the other's plane there."""
    for number, piece in enumerate(pieces[:-1]):
        if not piece.convex_next:
            continue
        columns = _columns(level, replace(piece, x1_px=pieces[number + 1].x1_px), 12.0)
        part, x = labels[:, columns], level.x_px[:, columns]
        both = (part == number) | (part == number + 1)
        part[both] = np.where(piece.at(x[both]) <= pieces[number + 1].at(x[both]), number, number + 1)


def _take(labels: NDArray[np.int16], best: NDArray[np.float32], miss: FloatArray, number: int) -> None:
    with np.errstate(invalid="ignore"):
        better = miss < best  # never where nothing was measured: NaN
    np.copyto(labels, number, where=better)
    np.copyto(best, miss, where=better)


def _columns(level: LevelledMap, piece: Piece, margin: float) -> slice:
    """Return the image columns that can show a piece: the level view's x shears a little over the photo's height."""
    some = level.x_px[:: max(1, len(level.x_px) // 16)]
    hit = np.flatnonzero(((some >= piece.x0_px - margin) & (some <= piece.x1_px + margin)).any(axis=0))
    return slice(max(0, int(hit[0]) - 2), int(hit[-1]) + 3) if hit.size else slice(0, 0)


def _tidy(labels: NDArray[np.int16], uprights: int, least_pixels: int) -> NDArray[np.int16]:
    """Smooth each upright label's mask and drop crumbs; small holes (pores, unmeasured spots) are filled."""
    tidy = np.where(labels >= uprights, labels, NOTHING).astype(np.int16)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    for number in range(uprights):
        own = np.asarray(labels == number).view(np.uint8)
        if cv2.countNonZero(own) < least_pixels:
            continue
        rows, columns = box_of(own.view(bool))
        window = (slice(max(0, rows.start - 8), rows.stop + 8), slice(max(0, columns.start - 8), columns.stop + 8))
        smooth = cv2.morphologyEx(cv2.morphologyEx(own[window], cv2.MORPH_CLOSE, kernel), cv2.MORPH_OPEN, kernel)
        mask = _without_crumbs(np.asarray(smooth, dtype=np.uint8), least_pixels)
        # where a floor's plane runs through an upright one, both explain a strip of a few px: it mustn't cut a column
        no_upright = (tidy[window] == NOTHING) | (tidy[window] >= uprights)
        free = (mask > 0) & ((labels[window] == number) | no_upright)
        tidy[window][free] = number
    return tidy


def _without_crumbs(mask: NDArray[np.uint8], least_pixels: int) -> NDArray[np.uint8]:
    """Drop pieces under `least_pixels` and fill holes under it."""
    for value in (1, 0):
        count, parts, stats, _ = cv2.connectedComponentsWithStats((mask == value).astype(np.uint8), connectivity=4)
        small = (stats[:, cv2.CC_STAT_AREA] < least_pixels) & (np.arange(count) > 0)
        mask[small[parts]] = 1 - value
    return mask


def footed(
    labels: NDArray[np.int16], level: LevelledMap, pieces: Sequence[Piece], floors: Sequence[Floor]
) -> NDArray[np.int16]:
    """Give the floor back what of a flat upright piece is labelled (H, W) beneath the floor that it stands on."""
    found = labels.copy()
    standing = [(len(pieces) + k, floor) for k, floor in enumerate(floors) if floor.below_m > LEAST_BELOW_CAMERA_M]
    for number, piece in enumerate(pieces):
        if piece.circle is not None:
            continue
        own = np.asarray(found == number)
        rows, columns = box_of(own)
        box = (slice(rows.start, rows.stop + BELOW_PX[1]), columns)
        rays = level.rays[box]
        upright = rays @ level.view.q_upright(piece.slope, piece.offset_px)
        for label, floor in standing:
            behind = rays @ floor.q_px - upright
            beneath = (found[box] == number) & (behind > BENEATH_PX)
            if beneath.any() and _stands_on(beneath, behind, found[box], number, label):
                found[box][beneath] = label
    return found


def _stands_on(
    beneath: BoolArray, behind: NDArray[np.float64], labels: NDArray[np.int16], number: int, label: int
) -> bool:
    """Say whether a piece stands on the floor `label`: it lies below most of what is `beneath`, and that isn't far."""
    if float(np.quantile(behind[beneath], CARRIED_SHARE)) > MOST_CARRIED_PX:
        return False
    columns = np.flatnonzero(beneath.any(axis=0))
    lowest = len(beneath) - 1 - np.argmax(beneath[::-1, columns], axis=0)
    rows = np.minimum(lowest[:, None] + np.arange(*BELOW_PX), len(beneath) - 1)
    below = labels[rows, columns[:, None]]
    below = below[below != number]
    return bool(below.size and np.mean(below == label) > LEAST_FLOOR)


def flat_if_flatter(piece: Piece, level: LevelledMap, pair: RectifiedPair) -> Piece:
    """Return the piece, or a flat one in its place where the photos agree as well on a plane."""
    if piece.circle is None:
        return piece
    middle, half = 0.5 * (piece.x0_px + piece.x1_px), 0.5 * CORE_SHARE * (piece.x1_px - piece.x0_px)
    with np.errstate(invalid="ignore"):
        near = np.abs(level.d_px - piece.at(level.x_px)) < 1.0
    rows, columns = np.nonzero((np.abs(level.x_px - middle) < half) & near)
    step = max(1, rows.size // MOST_PIXELS)
    rows, columns = rows[::step], columns[::step]
    if rows.size < 100:
        return piece
    x, d = level.x_px[rows, columns], level.d_px[rows, columns]
    slope, offset = fit_line(x, d, 0.1)
    flat = replace(piece, circle=None, slope=slope, offset_px=offset)
    left, right = grey(pair.left), grey(pair.right)
    seen = left[rows, columns].astype(np.float64)
    forward = level.forward[rows, columns]

    def best(surface: Piece) -> FloatArray:
        # each surface may shift a little in depth: its best of a few is compared
        there = surface.at(x)
        tries = [_miss(seen, right, rows, columns, (there + shift) * forward) for shift in SHIFTS_PX]
        return min(tries, key=lambda miss: float(miss.sum()))

    # the matcher flattens a column in its middle, and bends it at its sides: where it ends says how wide it is
    spanning = replace(piece, circle=circle_between(piece.circle, piece.x0_px, piece.x1_px))
    rounds = [(best(one), one) for one in (piece, spanning)]
    miss, rounder = min(rounds, key=lambda one: float(one[0].sum()))
    return rounder if _sureness(best(flat) - miss, rows) > LEAST_SURE else flat


def _sureness(gain: FloatArray, rows: np.ndarray) -> float:
    """Return how many of its own sigmas a gain per pixel is above zero; bands of rows are independent of each other."""
    bands = np.bincount((rows - rows.min()) // BAND_PX, weights=gain)
    return float(bands.sum() / max(np.sqrt(np.sum((bands - bands.mean()) ** 2)), 1e-9))


def _miss(
    seen: FloatArray, right: np.ndarray, rows: np.ndarray, columns: np.ndarray, disparity: FloatArray
) -> FloatArray:
    """Return the squared difference of grey levels (N,) along a disparity, none above the worst tenth's limit."""
    width = 2048
    pad = (-len(seen)) % width
    at = np.pad((columns - disparity).astype(np.float32), (0, pad)).reshape(-1, width)
    there = sample(right, at, np.pad(rows.astype(np.float32), (0, pad)).reshape(-1, width)).ravel()[: len(seen)]
    apart = np.square(seen - there - median(seen - there))
    limited: FloatArray = np.minimum(apart, np.quantile(apart, 0.9))
    return limited
