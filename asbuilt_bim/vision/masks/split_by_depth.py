"""Splits a given mask by depth: an instance is the surfaces that stand together, not what lies behind or before."""

from dataclasses import replace

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, freeze
from asbuilt_bim.vision.masks.given import box_of
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.scene.geometric import GeometricOptions, IndexArray, Opinion, instance_of_pieces
from asbuilt_bim.vision.scene.read import Scene

MOST_GAP_M = 0.6
"""Between two surfaces of one wall or column in depth: walls are to 0.4 m thick, and ends err by some centimetres."""
LEAST_PIXELS = 30
HAND_SHARE = 0.015
"""Of the photo's width: how far a hand on a mouse strays from an edge."""
MOST_LOST = 0.02
BORDER_PX = 8.0
"""How far the matcher may miss a border to the ground: its window."""


def split_by_depth(instance: Instance, pair: RectifiedPair, scene: Scene, options: GeometricOptions) -> Instance:
    """Take out of a mask the upright surfaces that don't stand with most of it in depth, and round off what is left.

    So goes what is too low for a wall or a column: the edge of the slab that it stands on.

    Masks drawn by hand or by a network run over onto what is behind, or stop short of an edge; one mask is one wall or
    column. A surface that goes no further than `HAND_SHARE` beyond the mask belongs to it whole; what goes on was cut
    on purpose.
    """
    x0, y0, x1, y1 = instance.box_px
    labels, mask = scene.labels[y0:y1, x0:x1], instance.mask[y0:y1, x0:x1]
    upright = mask & (labels >= 0) & (labels < len(scene.pieces))
    numbers, counts = np.unique(labels[upright], return_counts=True)
    enough = counts >= LEAST_PIXELS
    pieces, counts = numbers[enough].astype(np.intp), counts[enough]
    if len(pieces) == 0:
        return instance
    spans = np.array([_span_m(scene, upright & (labels == piece), (y0, x0)) for piece in pieces])
    kept = _together(spans, int(np.argmax(counts)))
    kept &= _tall(pieces, kept, instance, pair, scene, options)
    rest = instance.mask & ~np.isin(scene.labels, pieces[~kept])
    rest &= ~_overrun(rest, pieces[kept], scene)
    side = 2 * round(HAND_SHARE * rest.shape[1]) + 1
    grown = cv2.dilate(instance.mask.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    for piece in pieces[kept]:
        own = scene.mask(int(piece))
        if np.count_nonzero(own & ~grown) <= MOST_LOST * np.count_nonzero(own):
            rest |= own
    if np.array_equal(rest, instance.mask):
        return instance
    freeze(rest)
    return replace(instance, mask=rest, box_px=box_of(rest))


def _overrun(mask: BoolArray, pieces: IndexArray, scene: Scene) -> BoolArray:
    """Return where a mask goes on over the ground: what hangs together there, and reaches further than a border errs.

    Nearer than that the mask may know the foot better than the matcher does.
    """
    own = np.isin(scene.labels, pieces)
    beside = mask & ~own
    away = cv2.distanceTransform((~own).astype(np.uint8), cv2.DIST_L2, 3)
    far_floor = beside & (scene.labels >= len(scene.pieces)) & (away > BORDER_PX)
    _, parts = cv2.connectedComponents(beside.astype(np.uint8), connectivity=4)
    return beside & np.isin(parts, np.unique(np.asarray(parts)[far_floor]))


def _tall(
    pieces: IndexArray,
    kept: BoolArray,
    instance: Instance,
    pair: RectifiedPair,
    scene: Scene,
    options: GeometricOptions,
) -> BoolArray:
    """Say which pieces have a wall's or a column's height; all of them where none has."""
    group = [int(piece) for piece in pieces[kept]]
    opinion = Opinion(label=instance.label, score=instance.score)
    accepted = instance_of_pieces(pair, scene, group, options, None, opinion)
    if accepted is None:
        return np.ones_like(kept)
    return np.isin(pieces, np.unique(scene.labels[accepted.mask]))


def _together(spans: FloatArray, first: int) -> BoolArray:
    """Say which spans of depth (N, 2) hang together with the one numbered `first`, from one to the next."""
    kept = np.zeros(len(spans), dtype=bool)
    kept[first] = True
    while True:
        low, high = spans[kept][:, 0], spans[kept][:, 1]
        gap = np.maximum(spans[:, None, 0] - high[None, :], low[None, :] - spans[:, None, 1]).min(axis=1)
        grown = kept | (gap <= MOST_GAP_M)
        if (grown == kept).all():
            return kept
        kept = grown


def _span_m(scene: Scene, inside: BoolArray, corner: tuple[int, int]) -> FloatArray:
    """Return the nearest and the furthest depth (2,) of measured pixels, a twentieth left out at either end."""
    rows, columns = np.nonzero(inside)
    disparity = scene.level.disparity_px[rows + corner[0], columns + corner[1]]
    known = disparity[np.isfinite(disparity) & (disparity > 0.0)]
    if known.size == 0:
        return np.array([np.inf, np.inf])
    high, low = np.quantile(known, [0.95, 0.05])
    return scene.level.view.f_px * scene.level.baseline_m / np.array([high, low])
