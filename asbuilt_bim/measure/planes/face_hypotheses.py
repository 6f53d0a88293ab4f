"""Faces in the making: a piece of an instance, its plane as the photos show it, its outline."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.geometry.disparity_plane import fit_q
from asbuilt_bim.geometry.masks import Box, at_pixels, box_of, nonzero
from asbuilt_bim.measure.outline.edges import Gradients, pixel_plane
from asbuilt_bim.measure.outline.fit import Outline, find_outline, shared_ends
from asbuilt_bim.measure.outline.straight import Surroundings
from asbuilt_bim.measure.planes.adjust import PlaneSight
from asbuilt_bim.measure.planes.crossing import apart, side_by_side
from asbuilt_bim.measure.planes.halves import NUMBERS, as_halves_agree, excess_share
from asbuilt_bim.measure.planes.raster import shrunk
from asbuilt_bim.measure.planes.refine import PlaneFit, refine_plane
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.scene.read import Scene, q_of_piece

LEAST_SHARE = 0.3
"""A piece belongs to the instance that covers at least this share of it."""
LEAST_PIXELS = 150
MATCHER_BLOCK_PX = 150.0
"""Pixels of a matcher's answer that err together: its window and its smoothness."""
MOST_DENSE, LEAST_DENSE = 8_000, 30
MATCHER_MISS_PX = 24.0
"""How far a border may be missed: left of it lies a strip that the right photo doesn't show."""
EDGE_PX = 6.0
"""A matcher's answer this near a border may be the neighbour's; further off it means what it says."""
OFF_PLANE_PX = 1.5
OCCLUDED_SHARE = 0.12
BORDERS_PX, NARROW_PX = (2, 3), 90
"""What is left out along a border; of a narrow face, where a pixel tilts the plane, it is tried with a pixel more."""
CONTRADICTS_SIGMAS = 2.0
NARROW_SHARE = 0.9
"""A face under this share of its neighbour's width in the photo takes top and foot from it."""
WHOLE: Box = (slice(None), slice(None))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceHypothesis:
    """A face in the making: `piece` of the scene, `instance`, its pixels (H, W), its plane and, later, its outline.

    `texture_grey` is the gradient that an edge must stand out of.
    """

    piece: int
    instance: int
    mask: BoolArray
    texture_grey: float
    sight: PlaneSight
    refined: bool
    doubt: float = 1.0  # 0..1: the share of what halves of its pixels differ by that isn't by chance
    outline: Outline | None = None


def face_hypotheses(bench: Workbench, instances: Sequence[Instance]) -> list[FaceHypothesis]:
    """Make a face hypothesis for each flat piece of each instance, with its plane refined on both photos."""
    hypotheses: list[FaceHypothesis] = []
    for number, instance in enumerate(instances):
        for piece in pieces_of(bench.scene, instance):
            if bench.scene.pieces[piece].circle is not None:
                continue
            hypotheses.append(_hypothesis(bench, piece, number, piece_mask(bench.scene, piece, instance)))
    return hypotheses


def piece_mask(scene: Scene, piece: int, instance: Instance) -> BoolArray:
    """Return the pixels (H, W) of a piece in an instance.

    A mask that doesn't come from the disparity knows the border that the matcher missed. What it holds beside the
    piece, and no other piece has, goes to the nearest piece. What is measured to lie off its plane doesn't: a mask may
    be rough.
    """
    own = scene.mask(piece) & instance.mask
    if instance.source.border_from_depth:
        return own
    others = (scene.labels >= 0) & (scene.labels < len(scene.pieces)) & ~own
    near, far = (
        cv2.distanceTransform((~area).astype(np.uint8), cv2.DIST_L2, 3) for area in (own, others & instance.mask)
    )
    level = scene.level
    elsewhere = level.measured & (np.abs(level.d_px - scene.pieces[piece].at(level.x_px)) > OFF_PLANE_PX)
    elsewhere |= scene.labels >= len(scene.pieces)
    open_to_it = (near < EDGE_PX) | ((near < MATCHER_MISS_PX) & ~elsewhere)
    filled: BoolArray = own | (instance.mask & ~others & open_to_it & (near < far))
    return filled


def pieces_of(scene: Scene, instance: Instance) -> list[int]:
    """Return the scene's pieces that lie in an instance's mask."""
    x0, y0, x1, y1 = instance.box_px
    labels, mask = scene.labels[y0:y1, x0:x1], instance.mask[y0:y1, x0:x1]
    inside = labels[mask & (labels >= 0) & (labels < len(scene.pieces))]
    counts = np.bincount(inside, minlength=len(scene.pieces))
    return [int(n) for n in np.flatnonzero(counts >= np.maximum(LEAST_PIXELS, LEAST_SHARE * scene.sizes))]


def floor_sights(bench: Workbench) -> list[PlaneSight]:
    """Return the scene's floors as the photos show them: dense depth alone put feet of walls 0.45 px too low."""
    scene = bench.scene
    found: list[PlaneSight] = []
    for label, floor in enumerate(scene.floors, start=len(scene.pieces)):
        core = shrunk(scene.mask(label), 2) & ~bench.marks
        sight, fit = _sight(bench, core, floor.q_px)
        if fit is not None:
            fit = as_halves_agree(fit)
            sight = PlaneSight(q_px=fit.q_px, covariance=fit.covariance)
        found.append(sight)
    return found


def outline_faces(
    bench: Workbench,
    hypotheses: Sequence[FaceHypothesis],
    planes: FloatArray,
    floors: Sequence[PlaneSight],
    joint: FloatArray | None = None,
) -> list[FaceHypothesis]:
    """Draw every hypothesis's outline with the planes (n, 3) as they stand; those without one are kept without.

    `joint` (3n, 3n) is the planes' covariance; without it they are as the photos alone show each.
    """
    scene = bench.scene
    joint = side_by_side([hypothesis.sight.covariance for hypothesis in hypotheses]) if joint is None else joint
    known = {hypothesis.piece: planes[i] for i, hypothesis in enumerate(hypotheses)}
    known |= {len(scene.pieces) + k: floor.q_px for k, floor in enumerate(floors)}
    widths = [_width_px(hypothesis.mask) for hypothesis in hypotheses]
    drawn = dict(enumerate(hypotheses))
    for i in sorted(drawn, key=lambda k: -widths[k]):  # the wide ones first: they tell their neighbours top and foot
        hypothesis = hypotheses[i]
        touching = _touching(bench, hypotheses, i)
        around = Surroundings(
            colour=bench.pair.left, marks=bench.marks, left_grey=bench.grey_levels[0], right_grey=bench.grey_levels[1],
            gradients=bench.slopes, labels=scene.labels, planes=known, frame=bench.frame,
            valid_right=bench.pair.valid_right, off_px=_off_plane(bench, planes[i]), camera=bench.pair.camera,
            down=scene.level.view.down, texture_grey=hypothesis.texture_grey,
            meets=tuple(hypotheses[j].piece for j in touching),
            apart=_apart(joint, i, hypotheses, floors, len(scene.pieces)),
        )  # fmt: skip
        ends = None
        for j in touching:
            neighbour = drawn[j].outline
            if neighbour is not None and widths[i] < NARROW_SHARE * widths[j]:
                ends = _down_to(shared_ends(neighbour, hypothesis.piece), hypothesis.mask)
        drawn[i] = replace(hypothesis, outline=find_outline(hypothesis.mask, hypothesis.piece, around, ends))
    return [drawn[i] for i in range(len(hypotheses))]


def _apart(
    joint: FloatArray, i: int, hypotheses: Sequence[FaceHypothesis], floors: Sequence[PlaneSight], first_floor: int
) -> dict[int, FloatArray]:
    """Return, by label, the covariance (3, 3) of face i's q less that of what lies there."""
    own = joint[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
    found = {first_floor + k: own + floor.covariance for k, floor in enumerate(floors)}
    return found | {hypothesis.piece: apart(joint, i, j) for j, hypothesis in enumerate(hypotheses)}


def _down_to(ends: FloatArray | None, mask: BoolArray) -> FloatArray | None:
    """Let a shared edge go down to the mask's own foot where that is much lower: something hides the neighbour."""
    if ends is None:
        return None
    rows, _ = box_of(mask)
    if rows.stop - ends[1, 1] <= OCCLUDED_SHARE * (rows.stop - rows.start) or ends[1, 1] - ends[0, 1] < 1.0:
        return ends
    run = (ends[1] - ends[0]) / (ends[1, 1] - ends[0, 1])
    return np.stack([ends[0], ends[0] + (rows.stop - ends[0, 1]) * run])


def _touching(bench: Workbench, hypotheses: Sequence[FaceHypothesis], i: int) -> list[int]:
    """Return the face hypotheses of the same instance that meet hypothesis i in a convex edge."""
    pieces = bench.scene.pieces
    found: list[int] = []
    for j, other in enumerate(hypotheses):
        low, high = sorted((hypotheses[i].piece, other.piece))
        if other.instance == hypotheses[i].instance and high == low + 1 and pieces[low].convex_next:
            found.append(j)
    return found


def _width_px(mask: BoolArray) -> int:
    _, columns = box_of(mask)
    return int(columns.stop - columns.start)


def refine_inside(bench: Workbench, hypotheses: Sequence[FaceHypothesis]) -> list[FaceHypothesis]:
    """Refine every plane again on the pixels that its outline holds for sure."""
    better: list[FaceHypothesis] = []
    for hypothesis in hypotheses:
        if hypothesis.outline is None:
            better.append(hypothesis)
            continue
        fit = refined_inside(bench, hypothesis, filled(hypothesis.outline.rings, hypothesis.mask.shape))
        sight = PlaneSight(q_px=fit.q_px, covariance=fit.covariance) if fit is not None else hypothesis.sight
        doubt = fit.doubt if fit is not None else hypothesis.doubt
        better.append(replace(hypothesis, sight=sight, refined=hypothesis.refined or fit is not None, doubt=doubt))
    return better


def refined_inside(bench: Workbench, hypothesis: FaceHypothesis, inside: BoolArray) -> PlaneFit | None:
    """Refine a hypothesis's plane on the pixels `inside` (H, W) its outline, less a border.

    Pixels make a fit surer. A narrow face's outermost ones may not, or may tilt it by more than so many can by chance.
    Then they carry something else, what lies past the edge or its chamfer, and are left out.

    Reference: Hausman 1978: of two fits of which one uses what the other does, variances subtract.
    """
    box, usable = box_of(inside), np.zeros_like(inside)
    usable[box] = _near(bench, hypothesis, 1.5, box) & ~bench.marks[box]
    rays = bench.scene.level.rays
    fits: list[PlaneFit | None] = []
    for border_px in BORDERS_PX[: 2 if _width_px(inside) < NARROW_PX else 1]:
        core = shrunk(inside, border_px) & usable
        fits.append(refine_plane(bench.both, rays, core, hypothesis.sight.q_px, again=hypothesis.refined))
    first, last = fits[0], fits[-1]
    if first is None:
        return None
    chosen = first
    if last is not None:
        more = max(float(last.covariance[0, 0] - first.covariance[0, 0]), 0.0)
        if abs(float(last.q_px[0] - first.q_px[0])) > CONTRADICTS_SIGMAS * np.sqrt(more):
            chosen = last
    return as_halves_agree(chosen)


def filled(rings: Sequence[FloatArray], shape: tuple[int, ...]) -> BoolArray:
    """Return the pixels (H, W) whose centres an outline's rings hold, holes off."""
    canvas = np.zeros(shape[:2], dtype=np.uint8)
    for value, ring in zip([1] + [0] * (len(rings) - 1), rings, strict=True):
        cv2.fillPoly(canvas, [np.round(ring * 16.0).astype(np.int32)], value, lineType=cv2.LINE_8, shift=4)
    return canvas > 0


def _hypothesis(bench: Workbench, piece: int, instance: int, mask: BoolArray) -> FaceHypothesis:
    start = q_of_piece(bench.scene.pieces[piece], bench.scene.level)
    core = shrunk(mask, 2)
    core = (core if np.count_nonzero(core) > 0.3 * np.count_nonzero(mask) else mask) & ~bench.marks
    sight, fit = _sight(bench, core, start)
    texture_grey = _texture(bench.slopes, mask)
    return FaceHypothesis(
        piece=piece, instance=instance, mask=mask, texture_grey=texture_grey, sight=sight, refined=fit is not None
    )


def _sight(bench: Workbench, core: BoolArray, start_px: FloatArray) -> tuple[PlaneSight, PlaneFit | None]:
    """Return the plane near `start_px` (3,) on the pixels `core` (H, W), refined on both photos where they hold it."""
    level = bench.scene.level
    fit = refine_plane(bench.both, level.rays, core, start_px)
    if fit is not None:
        return PlaneSight(q_px=fit.q_px, covariance=fit.covariance), fit
    known = core & level.measured
    rays, d, sigma = level.rays[known], level.disparity_px[known], level.sigma_px[known]
    q, covariance = fit_q(rays, d, np.clip(sigma, 0.1, 2.0)) if len(d) > 30 else (start_px, np.eye(3))
    return PlaneSight(q_px=q, covariance=covariance * MATCHER_BLOCK_PX), None


def _off_plane(bench: Workbench, q_px: FloatArray, box: Box = WHOLE) -> Float32Array:
    """Return the measured disparity less the plane's (H, W), in a box of it, NaN where not measured."""
    p = pixel_plane(q_px, bench.pair.camera).astype(np.float32)
    height, width = bench.disparity_px.shape
    rows = p[1] * np.arange(height, dtype=np.float32)[box[0]] + p[2]
    off: Float32Array = bench.disparity_px[box] - rows[:, None]
    off -= p[0] * np.arange(width, dtype=np.float32)[None, box[1]]
    return off


def contradiction(q_px: FloatArray, covariance: FloatArray, hypothesis: FaceHypothesis, bench: Workbench) -> FloatArray:
    """Return what is left open (3, 3) where dense depth shows another plane on the same pixels than the photos do.

    The two err differently: one takes a round or a mixed surface for the plane of its best texture, the other smooths.
    Beyond what their own sigmas explain either may be right, as far as the photos contradict themselves: on renderings,
    where halves of a face agree, its photos are nearer the truth in 48 of 50; on real walls they differ, and depth is.
    """
    level = bench.scene.level
    rows, columns = nonzero(shrunk(hypothesis.mask, 2) & level.measured & ~bench.marks)
    step = max(1, len(rows) // MOST_DENSE)
    rows, columns = rows[::step], columns[::step]
    if len(rows) < LEAST_DENSE:
        return np.zeros((3, 3))
    rays = at_pixels(level.rays, rows, columns)
    dense, scatter = fit_q(rays, level.disparity_px[rows, columns], level.sigma_px[rows, columns])
    apart = dense - q_px
    chi2 = float(apart @ np.linalg.solve(covariance + scatter * MATCHER_BLOCK_PX / step, apart))
    left_open: FloatArray = 0.5 * hypothesis.doubt * excess_share(chi2, NUMBERS) * np.outer(apart, apart)
    return left_open


def _near(bench: Workbench, hypothesis: FaceHypothesis, most_px: float, box: Box) -> BoolArray:
    """Say where in a box the measured disparity agrees with the hypothesis's plane (or nothing was measured)."""
    with np.errstate(invalid="ignore"):
        off = np.abs(_off_plane(bench, hypothesis.sight.q_px, box)) > most_px
    return ~(off & bench.scene.level.measured[box])


def _texture(slopes: Gradients, mask: BoolArray) -> float:
    """Return the gradient that an edge must stand out of: twice the usual one on the face."""
    at = nonzero(mask)
    x, y = slopes.left_x[at], slopes.left_y[at]
    return float(np.clip(2.0 * median(np.hypot(x, y)), 1.0, 12.0)) if x.size else 1.5
