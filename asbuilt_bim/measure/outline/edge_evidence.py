"""Does a face end where its outline does? An edge made merely by lost depth or by shade proves nothing.

A side is proven by what is measured just beyond it: another depth, or another surface that meets the face. Where
nothing is measured a plain edge in the photos stands for it. Where the face itself goes on further out, nothing does;
nor where a strip labelled otherwise, at the face's own depth, parts it from another piece of its plane. And where a
mask alone draws an outline inwards, depth was lost: the face doesn't end there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.face_cost import OFF_PX
from asbuilt_bim.measure.outline.fit import MASK_SIGMA_PX, FaceEdge, Outline
from asbuilt_bim.measure.outline.profile import (
    LEAST_RUN_PX,
    LEAST_RUN_SHARE,
    IntArray,
    Outward,
    at_places,
    outwards,
    owners,
    walk,
)
from asbuilt_bim.measure.outline.ring_from_lines import pixel_area
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.scene.read import q_of_piece
from asbuilt_bim.vision.stereo.warp import sample

OFF_SIGMAS = 2.0
NEAR_PX = (2.0, 4.0, 6.0, 8.0, 11.0)
"""The matcher's window carries a surface up to some 8 px past its edge, and loses what lies behind for as far."""
FAR_PX = (14.0, 17.0, 20.0, 23.0, 26.0, 29.0, 32.0, 35.0, 38.0)
FATTENED_PX = 10.0
"""What is labelled as the face this near beyond its edge is the matcher's window, not the face."""
PLAIN_STRENGTH = 0.25
"""Over a quarter of a side's length must show an edge where no depth confirms it."""
MOST_UNPROVEN = 0.5
CROSSING_SHARE = 0.4
"""A side that spans this much of the face's narrow width decides on all that may lie beyond it."""
STEP_PX, STEP_RUN = 6.0, 8
"""Brightness is compared 6 px to either side, past what a mask's border errs, in means over runs of 16 px."""
STRIP_PX = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
STEP_TIMES, LEAST_STEP_GREY = 3.0, 5.0
GRAIN_TIMES, GLARE_GREY = 3.0, 250.0
WITHIN_PX = (-3.0, -6.0, -9.0)
LEAST_HELD = 0.5
"""A border that no photo shows ends a face where the face is measured on half of the strip inside it, at least."""

MISS_PX, MISS_SIGMAS = 0.5, 3.5
"""A station has some hundred sides, so three sigmas would doubt one that is sound at every few stations."""
SAME_PLANE_DEG = 12.0
"""A surface that lies on the face's plane and is turned from it by less goes on from it: a corner turns by far more."""
LEAST_KNOWN = 30

NOTCH_SHARE = 0.02
"""What is lost at a notch is about as large as itself: less of a face is no more than its borders may err."""
THROUGH_PX = (4.0, 6.0, 8.0, 11.0)
"""Past the pixels over which the matcher's window carries the face on."""

UNKNOWN, PROVEN, GOES_ON, MEETS, PARTED = range(5)


def is_open(bench: Workbench, outline: Outline, q_px: FloatArray, label: int, narrow_px: float) -> bool:
    """Say whether a side of the face `label` isn't proven to be its end: it may be larger than its outline."""
    p = pixel_plane(q_px, bench.pair.camera)
    same = _in_one_plane(bench, q_px, label)
    around = sum(float(np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum()) for ring in outline.rings)
    limit = max(LEAST_RUN_PX, min(LEAST_RUN_SHARE * around, CROSSING_SHARE * narrow_px))
    for side in _sides(bench, outline, p, label, same):
        if side.length_px > limit and side.unproven_px > MOST_UNPROVEN * side.length_px:
            return True
        if side.parted_px > limit:
            return True
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Side:
    """The length of a side, of what isn't proven of it, and where its plane goes on in another piece."""

    length_px: float
    unproven_px: float
    parted_px: float


def _sides(bench: Workbench, outline: Outline, p: FloatArray, label: int, same: Sequence[int]) -> Iterator[_Side]:
    """Yield each straight side of the outline, and what of each ring has no line as one."""
    for ring in outline.rings:
        points, normals, steps = walk(ring)
        state = _beyond(bench, points, normals, p, label, same)
        framed = at_places(bench.frame, points)
        owner = owners([edge.line for edge in outline.edges], points, normals)
        for number in np.unique(owner):
            own = owner == number
            edge = outline.edges[number] if number >= 0 else None
            plain = edge is not None and _is_plain(edge)
            plain = plain or _looks_other(bench, points[own], normals[own])
            held = not _is_of_another(edge) and (
                _is_shown(edge) or _is_measured(bench, points[own], normals[own], label)
            )
            proven = framed | (((state == PROVEN) | ((state == UNKNOWN) & plain)) & held)
            yield _Side(
                length_px=float(steps[own].sum()), unproven_px=float(steps[own & ~proven].sum()),
                parted_px=float(steps[own & (state == PARTED)].sum()),
            )  # fmt: skip


def _is_plain(edge: FaceEdge) -> bool:
    """Say whether the photos, or the plane that the face meets there, put the edge where it is."""
    if edge.source in ("planes", "frame"):
        return True
    return edge.fit is not None and edge.source != "mask" and edge.fit.strength >= PLAIN_STRENGTH


def _is_shown(edge: FaceEdge | None) -> bool:
    """Say whether anything but a mask puts the edge where it is."""
    return edge is not None and edge.source != "mask"


def _is_measured(bench: Workbench, points: FloatArray, normals: FloatArray, label: int) -> bool:
    """Say whether stereo sees the face itself along the inside of a border.

    A mask may give the face what no stereo measured; where it does, the border of that proves nothing.
    """
    on_face = [at_places(bench.scene.labels, points + off_px * normals) == label for off_px in WITHIN_PX]
    return float(np.mean(on_face)) >= LEAST_HELD


def _is_of_another(edge: FaceEdge | None) -> bool:
    """Say whether the photos show an edge off the face's plane: that of what stands before it, or lies beyond it.

    A narrow side lit as the face is shows no edge between the two; the one that is found is its far one.
    """
    if edge is None or edge.fit is None or not np.isfinite(edge.fit.disparity_miss_px):
        return False
    return abs(edge.fit.disparity_miss_px) > max(MISS_PX, MISS_SIGMAS * edge.fit.miss_sigma_px)


def _looks_other(bench: Workbench, points: FloatArray, normals: FloatArray) -> bool:
    """Say whether brightness steps at a side by far more than anywhere near it on the face, or the grain ends there.

    A rough face hides a weak edge from votes pixel by pixel; means along the side don't. Glare has no grain either.
    """
    run = np.arange(len(points)) // STEP_RUN
    size = np.bincount(run)

    def strip(image: Float32Array, middle: float) -> FloatArray:
        at = points[:, None] + (middle + STRIP_PX[None, :, None]) * normals[:, None]
        values = sample(image, at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)).mean(axis=1)
        mean: FloatArray = np.bincount(run, weights=values) / size
        return mean

    grey = bench.grey_levels[0]
    means = {k: strip(grey, k * STEP_PX) for k in (1.0, -1.0, -2.0, -3.0, -4.0, -5.0)}
    inside = np.concatenate([means[-k] - means[-k - 2.0] for k in (1.0, 2.0, 3.0)])
    step = abs(median(means[1.0] - means[-1.0]))
    if step > max(LEAST_STEP_GREY, STEP_TIMES * float(np.sqrt(np.mean(inside**2)))):
        return True
    grain = [float(sum(strip(np.abs(s), k * STEP_PX).mean() for s in (bench.slopes.left_x, bench.slopes.left_y)))
             for k in (1.0, -1.0)]  # fmt: skip
    return bool(GRAIN_TIMES * grain[0] < grain[1] and float(means[1.0].mean()) < GLARE_GREY)


def _in_one_plane(bench: Workbench, q_px: FloatArray, label: int) -> list[int]:
    """Return the other flat pieces that lie on the face's plane: past its side the face goes on in them."""
    found: list[int] = []
    for number, (rays, disparity) in bench.samples.items():
        if number == label or len(disparity) <= LEAST_KNOWN:
            continue
        q = q_of_piece(bench.scene.pieces[number], bench.scene.level)
        cosine = float(q @ q_px) / float(np.linalg.norm(q) * np.linalg.norm(q_px))
        if cosine >= np.cos(np.radians(SAME_PLANE_DEG)) and abs(median(disparity - rays @ q_px)) < OFF_PX:
            found.append(number)
    return found


def _beyond(
    bench: Workbench, points: FloatArray, normals: FloatArray, p: FloatArray, label: int, same: Sequence[int]
) -> IntArray:
    """Return per place (N,) what lies beyond: PROVEN to be another surface, the face that GOES_ON, PARTED from
    another piece of its plane, or UNKNOWN.

    What is taken for bars stands for no end by itself: a border of shade looks like one, and concrete ends at an edge.
    Beside a near thing lies a strip that only one photo shows, as wide as the step in disparity. Nothing is measured in
    it. What is measured past it still counts as evidence for the edge.
    """
    state = np.full(len(points), UNKNOWN, dtype=np.intp)
    for seen in outwards(bench, points, normals, p, (*NEAR_PX, *FAR_PX)):
        off = seen.measured & (np.abs(seen.step_px) > np.maximum(OFF_PX, OFF_SIGMAS * seen.sigma_px))
        of_plane = np.isin(seen.label, same)
        near = (seen.off_px <= NEAR_PX[-1]) | _in_strip(normals, seen)
        state[(state == MEETS) & seen.inside & of_plane & ~off] = PARTED
        state[((state == UNKNOWN) | (state == MEETS)) & off & near] = PROVEN
        other = seen.inside & (seen.label >= 0) & (seen.label != label) & (seen.label != bench.scene.bars_label)
        state[(state == UNKNOWN) & other & near] = MEETS
        state[(state == MEETS) & of_plane & other] = PROVEN  # at once: a joint or a gap, which the photos show
        if seen.off_px > FATTENED_PX:
            state[(state == UNKNOWN) & seen.inside & (seen.label == label)] = GOES_ON
    state[state == MEETS] = PROVEN
    return state


def _in_strip(normals: FloatArray, seen: Outward) -> BoolArray:
    """Say where a place may lie past the strip that the step in disparity hides from one photo."""
    left = (normals[:, 0] < -0.5) & (seen.off_px < -seen.step_px + NEAR_PX[-1])
    right = (normals[:, 0] > 0.5) & (seen.off_px < seen.step_px + NEAR_PX[-1])
    return np.asarray(left | right)


def is_notched(bench: Workbench, outline: Outline, q_px: FloatArray) -> bool:
    """Say whether a notch of the outer ring, deeper than a mask's border errs, has a side that only a mask draws.

    Concrete's own notches, a door beside a wall's end, show their sides in the photos, or what lies behind them. What
    stereo loses of a face, in the shade at its foot or behind bars, is beside other surfaces, and these seem to prove
    that the face ends.
    """
    if not outline.rings:
        return False
    ring = outline.rings[0]
    points, normals, steps = walk(ring)
    owner = owners([edge.line for edge in outline.edges], points, normals)
    drawn = np.array([number < 0 or outline.edges[number].source == "mask" for number in owner])
    drawn &= ~_seen_through(bench, points, normals, pixel_plane(q_px, bench.pair.camera))
    for notch in _notches(ring):
        beside = [cv2.pointPolygonTest(notch, (float(x), float(y)), True) > -0.5 for x, y in points]
        if float(steps[np.array(beside) & drawn].sum()) > LEAST_RUN_PX:
            return True
    return False


def _seen_through(bench: Workbench, points: FloatArray, normals: FloatArray, p: FloatArray) -> BoolArray:
    """Say at which places (N,) what is measured first beyond the outline lies behind the face's plane."""
    behind, known = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for seen in outwards(bench, points, normals, p, THROUGH_PX):
        behind |= seen.measured & ~known & (seen.step_px < -OFF_PX)
        known |= seen.measured
    return behind


def _notches(ring: FloatArray) -> Iterator[FloatArray]:
    """Yield what lies between a ring and its convex hull and counts, each a ring of its own as float32."""
    corners = ring.astype(np.float32)
    hull = np.sort(cv2.convexHull(corners, returnPoints=False).ravel())
    least_px2 = NOTCH_SHARE * abs(pixel_area(ring))
    for first, last in zip(hull, np.roll(hull, -1), strict=True):
        count = int(last - first) % len(ring)
        between = corners[(first + np.arange(count + 1)) % len(ring)]
        if count > 1 and _depth_px(between) > MASK_SIGMA_PX and abs(pixel_area(between)) > least_px2:
            yield between


def _depth_px(between: FloatArray) -> float:
    along = between[-1] - between[0]
    across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    return float(np.max(np.abs((between - between[0]) @ across)))
