"""Was a face seen whole? What touches the frame is cut, what has something nearer at its border is hidden in part."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.fit import Outline
from asbuilt_bim.measure.outline.profile import LEAST_RUN_PX, LEAST_RUN_SHARE, at_places, outwards, owners, walk
from asbuilt_bim.measure.workbench import Workbench

NEARER_PX = 1.2
"""A thing 0.15 m before a wall at 6 m; less is a joint, a chamfer, the ground rising from its edge."""
NEARER_SIGMAS = 3.0
RISE_PER_PX = 0.35
"""How fast a surface that only touches the face may come nearer off its edge: a floor, a wall at a right angle."""
PLAIN_STRENGTH = 0.5
HALF_SEEN_PX = (9.0, 14.0, 20.0, 28.0, 38.0)
"""Left of a near thing lies a strip that the right photo doesn't show: its width is the step in disparity."""
TOUCH_PX = (3.0, 4.5, 6.0)
PAST_MASK_PX = (8.0, 11.0, 14.0)
"""A border that only a mask draws errs by pixels, and the matcher loses up to a window's width beside a near thing."""
CLEAR_STEP_PX = 4.0
"""A step that no noise makes: the first place that is measured is enough for it, where two are asked for otherwise."""
LEAST_SIDE_PX, SIDE_SHARE = 16.0, 0.5
"""A side with something nearer along half of it isn't the face's end, however short it is beside the whole outline."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Whether a face was cut by a frame, or hidden in part."""

    cut_by_frame: bool
    occluded: bool


def how_seen(bench: Workbench, outline: Outline, q_px: FloatArray) -> Seen:
    """Walk along the outline and look what lies 3 to 6 px beyond it, and beyond what only one photo shows."""
    cut_px = occluded_px = total_px = 0.0
    side_occluded = False
    lines = [edge.line for edge in outline.edges]
    masked = [number for number, edge in enumerate(outline.edges) if edge.source == "mask"]
    for ring in outline.rings:
        points, normals, steps = walk(ring)
        owner = owners(lines, points, normals)
        hidden = _nearer(bench, points, normals, q_px, np.isin(owner, masked))
        cut_px += float(steps[at_places(bench.frame, points)].sum())
        occluded_px += float(steps[hidden].sum())
        total_px += float(steps.sum())
        for number in range(len(lines)):
            length, lost = float(steps[owner == number].sum()), float(steps[hidden & (owner == number)].sum())
            side_occluded |= lost > max(LEAST_SIDE_PX, SIDE_SHARE * length)
    cut_px += _beyond_right(bench, outline, q_px)
    limit = max(LEAST_RUN_PX, LEAST_RUN_SHARE * total_px)
    return Seen(cut_by_frame=cut_px > LEAST_RUN_PX, occluded=side_occluded or occluded_px > limit)


def _beyond_right(bench: Workbench, outline: Outline, q_px: FloatArray) -> float:
    """Return the length of sides where the right photo ends and that the left one alone doesn't plainly show."""
    p = pixel_plane(q_px, bench.pair.camera)
    length = 0.0
    for edge in outline.edges:
        if edge.fit is not None and edge.fit.strength > PLAIN_STRENGTH:
            continue
        points = edge.line.start + np.linspace(0.1, 0.9, 17)[:, None] * (edge.line.stop - edge.line.start)
        points = points + 6.0 * edge.line.normal
        partner = points.copy()
        partner[:, 0] -= points @ p[:2] + p[2]
        lost = (partner[:, 0] < 0.0) | ~at_places(bench.pair.valid_right, partner)
        length += edge.line.length_px * float(np.mean(lost))
    return length


def _nearer(
    bench: Workbench, points: FloatArray, normals: FloatArray, q_px: FloatArray, by_mask: BoolArray
) -> BoolArray:
    """Say where what lies just beyond the outline stands before the face's plane, and doesn't rise from its edge.

    `by_mask` (N,) are places on a border that only a mask draws: where nothing is measured beside it, what is measured
    first further out counts.
    """
    p = pixel_plane(q_px, bench.pair.camera)
    found, votes = (np.zeros(len(points), dtype=np.intp) for _ in range(2))
    clear = np.zeros(len(points), dtype=bool)
    for seen in outwards(bench, points, normals, p, (*TOUCH_PX, *PAST_MASK_PX)):
        rise = RISE_PER_PX * seen.off_px
        nearer = seen.inside & (seen.step_px > NEARER_PX + rise) & (seen.step_px > NEARER_SIGMAS * seen.sigma_px)
        measured = seen.measured
        if seen.off_px in TOUCH_PX:
            clear |= nearer & measured & (found == 0) & (seen.step_px > CLEAR_STEP_PX + rise)
        else:
            measured = measured & by_mask & (found < 2)
            nearer &= measured & (seen.label != bench.scene.bars_label)
        found += measured
        votes += nearer
    return clear | (votes >= 2) | _past_half_seen(bench, points, normals, p)


def _past_half_seen(bench: Workbench, points: FloatArray, normals: FloatArray, p: FloatArray) -> BoolArray:
    """Say where, to the right, nothing is measured until something nearer begins."""
    open_ = normals[:, 0] > 0.5
    found = np.zeros(len(points), dtype=bool)
    for seen in outwards(bench, points, normals, p, (3.0, 6.0, *HALF_SEEN_PX)):
        # the strip is no wider than the step that makes it
        found |= open_ & seen.measured & (seen.step_px > max(NEARER_PX, 0.5 * seen.off_px))
        open_ &= seen.inside & ~seen.measured
    return found
