"""Sides of a face that run plumb and level, drawn straight on. A ragged mask doesn't matter, openings are cut out."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray
from asbuilt_bim.measure.outline.contour import Course, Side, contours
from asbuilt_bim.measure.outline.edges import Gradients, Line
from asbuilt_bim.measure.outline.face_cost import FOREIGN, OFF_PX, ON_PX, OPEN, bridged, chroma_of, face_cost
from asbuilt_bim.measure.outline.steps import edge_votes, straight_region
from asbuilt_bim.measure.planes.raster import FaceRaster, face_raster
from asbuilt_bim.vision.scene.bars import GAP_M, THIN_M

MOST_APART = 0.12
RAGGED_PX = 3.0
"""Mask and straight region may differ by this share of their area and, all round, by what a mask is ragged.

Past that, the face has no right angles.
"""
MOST_UNPROVEN = 0.4
"""The share of a straight region that may be unmeasured: over half must be seen to lie on its plane."""
LOW_M = 0.26
"""No lift is lower; rubble at the foot is."""
NARROW_PX = 24
SAME_POUR = -0.1
MOST_AGAINST = 0.1
LEAST_OPENING_PX = 10
LEAST_KNOWN_SHARE = 0.3
"""Of a gap's pixels must be measured before it may be called an opening."""
OPENING_COST = 0.3
SURE_ODDS = 100.0
"""The odds at which a place without depth counts as one that is measured."""
LEAST_OPENING_SHARE = 0.008
"""A form-tie cone is no opening; a window is over 1 % of its wall."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """What an outline is searched in: both photos, their gradients, the labels and the planes behind them.

    `planes` holds q (3,) by label. `frame` (H, W) is True within a few px of the left photo's end. `off_px` (H, W) is
    the measured disparity less the face's own plane, NaN where not measured.
    """

    colour: ByteImage  # the left photo
    left_grey: Float32Array
    right_grey: Float32Array
    gradients: Gradients
    labels: NDArray[np.int16]
    planes: Mapping[int, FloatArray]
    frame: BoolArray
    valid_right: BoolArray
    marks: BoolArray  # (H, W) print on boards
    off_px: Float32Array
    camera: RectifiedCamera
    down: FloatArray  # (3,) rectified
    texture_grey: float = 1.5
    meets: tuple[int, ...] = ()  # the labels of the faces that it meets in a convex edge
    apart: Mapping[int, FloatArray] = field(
        default_factory=dict
    )  # by label, the covariance (3, 3) of own q less that one's


def straight_sides(
    mask: BoolArray, label: int, around: Surroundings, ends: FloatArray | None = None
) -> list[list[Side]] | None:
    """Return the sides of the face's rings (outer one first), plumb and level; None where those don't explain the mask.

    `ends` (2, 2): top and foot, in the photo, of the edge shared with a wider neighbour. One pour has one top and one
    foot, so a narrow face goes no further.
    """
    raster = face_raster(mask, around.planes[label], around.camera, around.down)
    if raster is None:
        return None
    own = raster.lay(mask.view(np.uint8), nearest=True) > 0
    off = raster.lay(around.off_px, nearest=True).astype(np.float32)
    labels = raster.lay(around.labels, nearest=True)
    colour = raster.lay(around.colour).astype(np.uint8)
    other = (labels >= 0) & (labels != label)
    meets = np.isin(labels, around.meets)
    gap = int(np.clip(round(GAP_M / raster.step_m[0]), 3, 81))
    chroma = chroma_of(colour)
    own = _stout(bridged(own, meets, other, off, colour, chroma, gap), raster)
    if np.count_nonzero(own) < 60:
        return None
    left = raster.lay(around.left_grey).astype(np.float32)
    right = raster.lay(around.right_grey, right=True).astype(np.float32)
    paired = raster.lay(around.valid_right.view(np.uint8), right=True, nearest=True) > 0
    ended = raster.lay(around.frame.view(np.uint8), nearest=True) > 0
    cost = face_cost(own, other, off, left - right, paired, chroma, ended)
    across, along = edge_votes(left, np.where(paired, right, left), around.texture_grey)
    if ends is not None:
        _limit(cost, own, other | (off < -OFF_PX), raster, ends)
    clear = raster.lay(around.marks.view(np.uint8), nearest=True) == 0
    across, along = across * clear, along * clear
    region = straight_region(cost, across, along, own)
    region &= ~_openings(region, off, across, along)
    against = other | (np.abs(off) > OFF_PX)
    if not _explains(region, own, against):
        return None
    rings = [_sides_of(ring, raster) for ring in contours(region)]
    kept = [ring for ring in rings if len(ring) >= 4]
    return kept if kept and len(rings[0]) >= 4 else None


def _limit(cost: Float32Array, own: BoolArray, against: BoolArray, raster: FaceRaster, ends: FloatArray) -> None:
    """Make every row above the upper and below the lower of `ends` foreign, in place.

    A face's mask often breaks off where the matcher failed on it: rows between the ends count for it, of a wider face
    where nothing is `against` them.
    """
    rows = np.sort(raster.from_photo(ends)[:, 1])
    top, foot = (int(np.clip(round(row), 0, raster.height)) for row in rows)
    if foot - top < 8:
        return
    for beyond in (slice(0, top), slice(foot, raster.height)):
        cost[beyond] = FOREIGN
        own[beyond] = False
    rows_of_it = np.asarray(own.any(axis=1), dtype=bool)
    if not rows_of_it.any():
        return
    usual = np.flatnonzero(own[rows_of_it].mean(axis=0) > 0.4)
    bare = top + np.flatnonzero(~rows_of_it[top:foot])
    wide = cv2.boundingRect(own.view(np.uint8))[2] >= NARROW_PX
    if not usual.size or (wide and (not bare.size or np.mean(against[np.ix_(bare, usual)]) > MOST_AGAINST)):
        return
    own[np.ix_(bare, usual)] = True
    cost[np.ix_(bare, usual)] = SAME_POUR


def _stout(own: BoolArray, raster: FaceRaster) -> BoolArray:
    """Drop what is thinner than concrete: starter bars, props and tripod legs that were labelled with the face."""
    thin, low = THIN_M / raster.step_m[0], LOW_M / raster.step_m[1]
    if cv2.boundingRect(own.view(np.uint8))[2] < NARROW_PX:  # a mask's ragged border would break it up
        low = THIN_M / raster.step_m[1]
    across, along = int(np.clip(round(thin), 3, 61)), int(np.clip(round(low), 3, 121))
    whole = own.view(np.uint8)
    opened = cv2.morphologyEx(whole, cv2.MORPH_OPEN, np.ones((1, across), np.uint8))
    opened = cv2.morphologyEx(opened, cv2.MORPH_OPEN, np.ones((along, 1), np.uint8))
    count, parts, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    if count <= 1:
        return own
    area = stats[:, cv2.CC_STAT_AREA]
    return np.take((area >= 0.2 * area[1:].max()) & (np.arange(count) > 0), np.asarray(parts, dtype=np.intp))


def _explains(region: BoolArray, own: BoolArray, against: BoolArray) -> bool:
    """Say whether the straight region is the mask, but for its ragged border and what could not be measured.

    A dark or even piece of a face has no disparity: that is no evidence for or `against` it.
    """
    _, _, width, height = cv2.boundingRect(region.view(np.uint8))
    apart = np.count_nonzero((own & ~region) | (region & ~own & against))
    unproven = np.count_nonzero(region & ~own & ~against)
    rags = RAGGED_PX * 2.0 * (width + height)
    small = MOST_APART * np.count_nonzero(region | own) + rags
    return bool(apart <= small and unproven <= MOST_UNPROVEN * np.count_nonzero(region) + rags)


def _openings(region: BoolArray, off: Float32Array, across: Float32Array, along: Float32Array) -> BoolArray:
    """Return what lies behind the face within its region, with straight borders of its own."""
    known = np.isfinite(off)
    behind = known & (off < -OFF_PX) & region
    if not behind.any():
        return np.zeros_like(region)
    on = known & (np.abs(off) < ON_PX)
    unknown = ~known & region
    cost_unknown = -OPENING_COST * _unknown_speaks_for_open(unknown, behind, on & region)
    seen = behind | unknown if cost_unknown < 0.0 else behind
    kernel = np.ones((LEAST_OPENING_PX // 2 * 2 - 3,) * 2, np.uint8)
    clean = cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_OPEN, kernel)
    clean = cv2.morphologyEx(clean, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    count, parts, stats, _ = cv2.connectedComponentsWithStats(clean, connectivity=4)
    found = np.zeros_like(region)
    least = max(LEAST_OPENING_SHARE * np.count_nonzero(region), LEAST_OPENING_PX**2)
    for part in range(1, count):
        box = stats[part]
        small = min(box[cv2.CC_STAT_WIDTH], box[cv2.CC_STAT_HEIGHT]) < LEAST_OPENING_PX
        if small or box[cv2.CC_STAT_AREA] < least:
            continue
        own = parts == part
        if np.count_nonzero(own & behind) < max(least, LEAST_KNOWN_SHARE * box[cv2.CC_STAT_AREA]):
            continue
        cost = np.where(on, OPENING_COST, np.where(unknown, cost_unknown, OPEN))
        cost = np.where(own & ~unknown, -OPENING_COST, cost).astype(np.float32)
        # the rim that hides behind the face's border was matched to the face: an opening is no smaller than seen
        found |= straight_region(cost, across, along, own)
    return found & region


def _unknown_speaks_for_open(unknown: BoolArray, behind: BoolArray, on: BoolArray) -> float:
    """Return -1..1: how a place without depth speaks for an opening, by how often openings and this face have such.

    A place without depth counts to the nearest that has one. Beside a jamb one photo alone sees what lies behind: on a
    wall with texture nothing else has no depth. A plain wall is full of such places.
    """
    _, nearest = cv2.distanceTransformWithLabels(
        (~(behind | on)).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_label = np.zeros(int(nearest.max()) + 1, dtype=bool)
    of_label[nearest[behind]] = True
    open_here = of_label[nearest]
    share_open, share_face = (
        (np.count_nonzero(unknown & side) + 1) / (np.count_nonzero((unknown | seen) & side) + 2)
        for side, seen in ((open_here, behind), (~open_here, on))
    )
    return float(np.clip(np.log(share_open / share_face) / np.log(SURE_ODDS), -1.0, 1.0))


def _sides_of(ring: FloatArray, raster: FaceRaster) -> list[Side]:
    """Cut a ring of a rectilinear raster region at its corners and carry the pieces to the photo."""
    flat = np.ascontiguousarray(ring[:, None, :], dtype=np.float32)
    corners = np.asarray(cv2.approxPolyDP(flat, 1.5, True), dtype=np.float64).reshape(-1, 2)
    found: list[Side] = []
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        run = stop - start
        level = abs(run[0]) > abs(run[1])
        course: Course = "level" if level else "upright"
        # the ring's corners are cut by the pixel's diagonal: draw the side exactly plumb or level
        middle = 0.5 * (start + stop)
        ends = (
            np.array([[start[0], middle[1]], [stop[0], middle[1]]])
            if level
            else np.array([[middle[0], start[1]], [middle[0], stop[1]]])
        )
        points = raster.to_photo(ends[0] + np.linspace(0.0, 1.0, 25)[:, None] * (ends[1] - ends[0]))
        found.append(Side(course=course, line=Line(start=points[0], stop=points[-1]), points=points))
    return found
