"""A face's outline: each side of its contour put on the edge that the photos show, corners where sides meet."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import unit
from asbuilt_bim.measure.outline.contour import Course, Side, contours, sides
from asbuilt_bim.measure.outline.edges import REACH_PX, EdgeFit, Line, find_edge, pixel_plane
from asbuilt_bim.measure.outline.face_cost import OFF_PX
from asbuilt_bim.measure.outline.ring_from_lines import close_ring, pixel_area
from asbuilt_bim.measure.outline.side_sigmas import side_sigmas
from asbuilt_bim.measure.outline.straight import LEAST_KNOWN_SHARE, Surroundings, straight_sides
from asbuilt_bim.measure.planes.crossing import Crossing, between, crossing_near

Source = Literal["photo", "left", "planes", "mask", "frame"]

LEAST_STRENGTH = 0.22
"""Under a quarter of a side's length showing an edge, the edge is another body's, or no edge."""
ALONE_STRENGTH, ALONE_SIGMA_PX = 0.4, 0.4
"""One photo alone must show the edge on most of its length: the background has edges too, and they may lie near."""
MASK_SIGMA_PX = 3.0
"""How well the matcher's own border lies on an edge that no photo shows."""
SLANT_DEG = 12.0
"""A segment within this of plumb or level runs plumb or level: contours wiggle by that over a few tens of pixels."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceEdge:
    """One straight side of an outline as it was settled, and by what."""

    line: Line
    sigma_px: float
    source: Source
    course: Course
    neighbour: int  # label beyond it, -1 nothing
    fit: EdgeFit | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outline:
    """Rings (N, 2) in rectified left pixels (the outer one first), and the straight sides they are made of."""

    rings: tuple[FloatArray, ...]
    edges: tuple[FaceEdge, ...]


def find_outline(mask: BoolArray, label: int, around: Surroundings, ends: FloatArray | None = None) -> Outline | None:
    """Draw the outline of the face `label` whose pixels are `mask` (H, W); None where nothing with an area is left.

    Straight borders, plumb or level, where they explain the mask; its own contour where they don't. `ends` (2, 2) px:
    top and foot of the edge that it shares with a wider face of the same pour.
    """
    q = around.planes[label]
    straight = straight_sides(mask, label, around, ends)
    if straight is not None:
        return _drawn([(found, found[0].points) for found in straight], label, around)
    rings = [ring for i, ring in enumerate(contours(mask)) if i == 0 or _seen_through(ring, around)]
    ragged = [(sides(ring, lambda a, b: _course(a, b, q, around)), ring) for ring in rings]
    return _drawn(ragged, label, around)


def _seen_through(ring: FloatArray, around: Surroundings) -> bool:
    """Say whether a gap in a mask is an opening: what is measured in it lies behind. A dark spot is no opening."""
    canvas = np.zeros(around.labels.shape, dtype=np.uint8)
    cv2.fillPoly(canvas, [np.round(ring).astype(np.int32)], 1)
    off = around.off_px[canvas > 0]
    known = off[np.isfinite(off)]
    return bool(known.size > LEAST_KNOWN_SHARE * off.size and np.median(known) < -OFF_PX)


def shared_ends(outline: Outline, label: int) -> FloatArray | None:
    """Return top and foot (2, 2) px of the upright side that an outline shares with the face `label`."""
    shared = [edge for edge in outline.edges if edge.course == "upright" and edge.neighbour == label]
    if not shared:
        return None
    line = max(shared, key=lambda edge: edge.line.length_px).line
    ring = outline.rings[0]
    on_it = ring[np.abs((ring - line.start) @ line.normal) < 4.0]
    if len(on_it) < 2:
        return None
    return np.stack([on_it[np.argmin(on_it[:, 1])], on_it[np.argmax(on_it[:, 1])]])


def _drawn(found: list[tuple[list[Side], FloatArray]], label: int, around: Surroundings) -> Outline | None:
    """Settle the sides of each ring and close it; a ring without sides keeps its points."""
    rings: list[FloatArray] = []
    edges: list[FaceEdge] = []
    for ring_sides, ring in found:
        settled = [_settle(side, label, around) for side in ring_sides]
        closed = (
            close_ring([e.line if e is not None else None for e in settled], ring_sides) if len(settled) >= 3 else ring
        )
        if len(closed) >= 3 and abs(pixel_area(closed)) > 30.0:
            rings.append(closed)
            edges += [edge for edge in settled if edge is not None]
        elif not rings:
            return None
    return Outline(rings=tuple(rings), edges=tuple(edges)) if rings else None


def _course(start: FloatArray, stop: FloatArray, q: FloatArray, around: Surroundings) -> tuple[Course, FloatArray]:
    """Say how a contour segment runs on the plane q, and the exact direction (2,) of that course there."""
    chord = stop - start
    length = float(np.linalg.norm(chord))
    if length < 6.0:
        return "free", unit(chord)
    middle = 0.5 * (start + stop)
    slack = np.radians(SLANT_DEG) + np.arctan2(1.5, length)
    best: tuple[Course, FloatArray] = ("slant" if length > 24.0 else "free", unit(chord))
    best_angle = slack
    courses: tuple[tuple[Course, FloatArray], ...] = (("upright", around.down), ("level", np.cross(q, around.down)))
    for course, axis in courses:
        direction = image_direction(axis, middle, around.camera)
        cosine = float(direction @ unit(chord))
        angle = float(np.arccos(min(1.0, abs(cosine))))
        if angle < best_angle:
            best, best_angle = (course, direction * np.sign(cosine)), angle
    return best


def image_direction(axis: FloatArray, pixel: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return the unit direction (2,) in the picture, at `pixel` (2,), of a line along `axis` (3,) in space."""
    ray = (pixel - np.array([camera.cx_px, camera.cy_px])) / camera.f_px
    return unit(axis[:2] - ray * axis[2])


def _settle(side: Side, label: int, around: Surroundings) -> FaceEdge | None:
    """Put one side on its edge; None for a side that has no line."""
    if side.course == "free":
        return None
    height, width = around.labels.shape
    at = np.round(side.points).astype(np.intp)
    at = np.stack([np.clip(at[:, 0], 0, width - 1), np.clip(at[:, 1], 0, height - 1)], axis=1)
    if np.mean(around.frame[at[:, 1], at[:, 0]]) > 0.5:
        return FaceEdge(
            line=side.line, sigma_px=MASK_SIGMA_PX, source="frame", course=side.course, neighbour=-1, fit=None
        )
    neighbour = _neighbour(side.line, label, around)
    crossing = _crossing(side.line, label, neighbour, around)
    start = crossing.line if crossing is not None else side.line
    plane = pixel_plane(around.planes[label], around.camera)
    fit = find_edge(around.gradients, start, plane, around.texture_grey, LEAST_STRENGTH)
    if fit is not None:
        line, sigma_px = fit.line, float(np.hypot(fit.sigma_px, side_sigmas().level * (side.course == "level")))
        if crossing is not None:
            edge = between(crossing, line, sigma_px)
            line, sigma_px = edge.line, edge.sigma_px
        return FaceEdge(line=line, sigma_px=sigma_px, source="photo", course=side.course, neighbour=neighbour, fit=fit)
    if crossing is not None:
        return FaceEdge(
            line=start, sigma_px=crossing.sigma_px, source="planes", course=side.course, neighbour=neighbour, fit=None
        )
    fit = find_edge(around.gradients, start, plane, around.texture_grey, ALONE_STRENGTH, alone=True)
    if fit is not None:
        sigma = float(np.hypot(fit.sigma_px, ALONE_SIGMA_PX))
        return FaceEdge(line=fit.line, sigma_px=sigma, source="left", course=side.course, neighbour=neighbour, fit=fit)
    return FaceEdge(
        line=start, sigma_px=MASK_SIGMA_PX, source="mask", course=side.course, neighbour=neighbour, fit=None
    )


def _neighbour(line: Line, label: int, around: Surroundings) -> int:
    """Return the label that lies 3 to 8 px beyond most of the side, -1 where none does."""
    height, width = around.labels.shape
    along = np.linspace(0.05, 0.95, 40)[:, None, None]
    beyond = np.array([3.0, 5.0, 8.0])[None, :, None]
    points = line.start + along * (line.stop - line.start) + beyond * line.normal
    x = np.round(points[..., 0]).astype(np.intp).ravel()
    y = np.round(points[..., 1]).astype(np.intp).ravel()
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    seen = around.labels[y[inside], x[inside]]
    seen = seen[(seen >= 0) & (seen != label)]
    if seen.size < 0.35 * x.size:
        return -1
    counts = np.bincount(seen)
    top = int(np.argmax(counts))
    return top if counts[top] > 0.35 * x.size else -1


def _crossing(line: Line, label: int, neighbour: int, around: Surroundings) -> Crossing | None:
    """Return where two planes meet, if it runs along this side and is better known than a mask's border."""
    if neighbour not in around.planes:
        return None
    q_apart = around.planes[label] - around.planes[neighbour]
    found = crossing_near(line, q_apart, around.apart[neighbour], around.camera, REACH_PX)
    return found if found is not None and found.sigma_px < MASK_SIGMA_PX else None
