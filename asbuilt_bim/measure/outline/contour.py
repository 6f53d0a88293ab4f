"""A mask's contour as straight pieces: what runs upright or level on the face is one piece, however it wiggles."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.outline.edges import Line

Course = Literal["upright", "level", "slant", "free"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Side:
    """One side of a contour: its course on the face, the straight line drawn for it, the contour points (N, 2) px."""

    course: Course
    line: Line
    points: FloatArray


def contours(mask: BoolArray) -> list[FloatArray]:
    """Return the mask's rings (N, 2) px around pixel AREAS, the outer one first, then its holes the other way round.

    Only the largest part is taken. Pixel centres are integers, so a lone pixel's ring has the area 1.
    """
    height, width = mask.shape
    doubled = cv2.resize(mask.astype(np.uint8), (2 * width, 2 * height), interpolation=cv2.INTER_NEAREST)
    rings, tree = cv2.findContours(doubled, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if len(rings) == 0:
        return []
    areas = [cv2.contourArea(ring) if tree[0][i][3] < 0 else -1.0 for i, ring in enumerate(rings)]
    outer = int(np.argmax(areas))
    picked = [outer] + [i for i in range(len(rings)) if tree[0][i][3] == outer]
    return [_around(np.asarray(rings[i], dtype=np.float64).reshape(-1, 2), hole=i != outer) for i in picked]


def _around(ring: FloatArray, hole: bool) -> FloatArray:
    """Move a ring of half-pixel centres out to the pixel's edge (in, for a hole), and turn it the same way round."""
    points = (ring - 0.5) / 2.0
    signed = 0.5 * float(np.sum(points[:, 0] * np.roll(points[:, 1], -1) - np.roll(points[:, 0], -1) * points[:, 1]))
    if signed < 0.0:
        points = points[::-1]
    ahead = np.roll(points, -2, axis=0) - np.roll(points, 2, axis=0)
    out = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    moved = points + (-0.25 if hole else 0.25) * out
    return moved[::-1] if hole else moved


def sides(
    ring: FloatArray, course_of: Callable[[FloatArray, FloatArray], tuple[Course, FloatArray]], wiggle_px: float = 4.0
) -> list[Side]:
    """Cut a ring (N, 2) into sides.

    `course_of(start, stop)` says how a segment runs on the face and gives the image direction (2,) of an exactly
    upright or level line there. Segments that run alike and lie within `wiggle_px` of one line become one side.
    """
    corners = _corners(ring, wiggle_px)
    if len(corners) < 3:
        return []
    pieces: list[tuple[Course, FloatArray, FloatArray]] = []
    for first, last in zip(corners, [*corners[1:], corners[0] + len(ring)], strict=True):
        points = ring[np.arange(first, last + 1) % len(ring)]
        course, direction = course_of(points[0], points[-1])
        pieces.append((course, direction, points))
    pieces = _merged(pieces, wiggle_px)
    return [Side(course=course, line=_line(points, direction), points=points) for course, direction, points in pieces]


def _corners(ring: FloatArray, wiggle_px: float) -> list[int]:
    """Return the indices of the ring's corners, by Douglas and Peucker."""
    flat = np.ascontiguousarray(ring[:, None, :], dtype=np.float32)
    poly = np.asarray(cv2.approxPolyDP(flat, wiggle_px, True)).reshape(-1, 2)
    index = [int(np.argmin(np.sum((ring - p) ** 2, axis=1))) for p in poly]
    return sorted(set(index))


def _merged(
    pieces: list[tuple[Course, FloatArray, FloatArray]], wiggle_px: float
) -> list[tuple[Course, FloatArray, FloatArray]]:
    """Join neighbours of one course that lie on one line; a crumb between two joined ones goes with them."""
    changed = True
    while changed and len(pieces) > 3:
        changed = False
        for i in range(len(pieces)):
            for reach in (1, 2):
                j = (i + reach) % len(pieces)
                one, other = pieces[i], pieces[j]
                if j == i or one[0] != other[0] or one[0] not in ("upright", "level"):
                    continue
                between = pieces[(i + 1) % len(pieces)][2] if reach == 2 else None
                if between is not None and np.linalg.norm(between[-1] - between[0]) > 4.0 * wiggle_px:
                    continue
                if one[1] @ other[1] < 0.0 or _apart(one, other) > 1.5 * wiggle_px:
                    continue
                middle = [between] if between is not None else []
                joined = (one[0], one[1], np.concatenate([one[2], *middle, other[2]]))
                gone = {i, j, (i + 1) % len(pieces)} if reach == 2 else {i, j}
                pieces = [joined if k == i else piece for k, piece in enumerate(pieces) if k == i or k not in gone]
                changed = True
                break
            if changed:
                break
    return pieces


def _apart(one: tuple[Course, FloatArray, FloatArray], other: tuple[Course, FloatArray, FloatArray]) -> float:
    normal = np.array([one[1][1], -one[1][0]])
    return abs(float(np.median(one[2] @ normal) - np.median(other[2] @ normal)))


def _line(points: FloatArray, direction: FloatArray) -> Line:
    """Draw the line through the points' median, in the given direction, over their extent."""
    normal = np.array([direction[1], -direction[0]])
    offset = float(np.median(points @ normal))
    along = points @ direction
    low, high = float(along.min()), float(along.max())
    return Line(start=low * direction + offset * normal, stop=high * direction + offset * normal)
