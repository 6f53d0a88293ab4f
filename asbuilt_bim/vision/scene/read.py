"""One photo read as surfaces: upright planes, round columns and floors, and which pixel belongs to which."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, freeze
from asbuilt_bim.geometry.floors import Floor, grow_floors
from asbuilt_bim.geometry.grow import GrowOptions, Piece, grow_pieces, upright_pixels
from asbuilt_bim.geometry.level import LevelledMap, level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.masks import box_of, nonzero
from asbuilt_bim.vision.scene.footing import footed
from asbuilt_bim.vision.scene.roundness import flat_if_flatter
from asbuilt_bim.vision.scene.vertical import Vertical, find_vertical
from asbuilt_bim.vision.stereo.depth import DepthMap

NOTHING = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneOptions:
    """How pixels are given to surfaces."""

    tolerance_px: float = 0.8  # a pixel lies on a surface within this, or within 3 of its own sigmas
    most_tolerance_px: float = 1.5
    margin_px: float = 8.0  # a piece may reach this far beyond its last voting column
    least_pixels: int = 150  # what is smaller carries no measurable edge
    grow: GrowOptions = GrowOptions()  # noqa: RUF009 - frozen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Surfaces of one photo; `labels` int16 (H, W): the upright piece, len(pieces) + i for floor i, -1 nothing.

    `bars_label` stands for bars, which are no surface, where they were told from concrete.
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
    tolerance = np.clip(3.0 * sigma, options.tolerance_px, options.most_tolerance_px)
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
    labels[better] = number
    best[better] = miss[better]


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
        small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] < least_pixels)
        small = small[small > 0]
        if count > 1 and small.size:
            mask[np.isin(parts, small)] = 1 - value
    return mask
