"""What lies past an outline's border: disparity against the face's own, and the edge that both photos show there."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.level import Floor
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.face_cost import OFF_PX
from asbuilt_bim.measure.outline.fit import MASK_SIGMA_PX, Outline
from asbuilt_bim.measure.outline.profile import at_places, owners, walk
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.stereo.warp import sample

FEATURES = (
    "behind",  # shares of the side past which lies: what is further away than the face
    "before",  # what is nearer, and doesn't rise from its edge
    "meets",  # another surface that begins at the edge
    "goes on",  # what lies on the face's own plane
    "past the frame",  # nothing, in one photo or both
    "edge",  # the share that shows an edge in both photos
    "stands",  # the share where a floor that is known meets the face
)
"""What a side is asked.

Asked as well, these bought nothing on scenes left out: how far off its plane lies what is past it, how it differs in
grain, brightness and between the photos, by how much its edge misses the plane, bars, what drew it, depth lost within.
"""
OUTWARD_PX = np.arange(3.0, 40.0, 3.0)
FATTENED_PX = 13.0
"""The matcher's window carries a face on past its end for up to so far: what is on its plane there says nothing."""
FAR_PX = np.arange(OUTWARD_PX[-1], FATTENED_PX * OUTWARD_PX[-1], FATTENED_PX)
"""Where nothing near a side is seen to be another body, it is looked for as far as a quarter of a photo off."""
OFF_SIGMAS = 2.0
RISE_PER_PX = 0.35
"""How fast a surface that only touches the face may come nearer off its edge: a floor, a wall at a right angle."""
UNKNOWN_SIGMA_PX = 4.0
LEAST_STOREY_M = 2.0
"""People stand upright between a slab and what is under it."""
BEHIND, BEFORE, MEETS, GOES_ON = range(1, 5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """The face's own surface: its disparity (...,) at places (..., 2) of the left photo, and which piece it is."""

    disparity_px: Callable[[FloatArray], FloatArray]  # past the face's border, too
    piece: int  # of the scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BorderSide:
    """One side of an outline: its places (N, 2) and normals off the face, the length of each, and its edge."""

    number: int  # of the outline's edge that it is, -1 where there is none
    points: FloatArray
    normals: FloatArray
    steps_px: FloatArray
    strength: float  # of the edge that both photos show there
    sigma_px: float

    @property
    def length_px(self) -> float:
        """Return the length in pixels."""
        return float(self.steps_px.sum())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """What a side shows: the features (K,), and how far past it, on average, nothing is seen that isn't the face."""

    features: FloatArray
    open_px: float  # as far as is looked nearby
    far_px: float  # as far as is looked at all


def border_sides(outline: Outline) -> list[BorderSide]:
    """Return each straight side of the outline, and what of each ring has no line as one."""
    found: list[BorderSide] = []
    for ring in outline.rings:
        points, normals, steps = walk(ring)
        owner = owners([edge.line for edge in outline.edges], points, normals)
        for number in np.unique(owner):
            edge = outline.edges[number] if number >= 0 else None
            fit = edge.fit if edge is not None else None
            found.append(
                BorderSide(
                    number=int(number), points=points[owner == number], normals=normals[owner == number],
                    steps_px=steps[owner == number], strength=fit.strength if fit is not None else 0.0,
                    sigma_px=edge.sigma_px if edge is not None else MASK_SIGMA_PX,
                )
            )  # fmt: skip
    return found


def round_sides(ring: FloatArray, proven: bool, sigma_px: float) -> list[BorderSide]:
    """Return a round column's silhouettes, its top and its foot; `proven`: edges were found on all of them."""
    points, normals, steps = walk(ring)
    owner = 2 * (np.abs(normals[:, 0]) > np.abs(normals[:, 1])) + (normals.sum(axis=1) > 0.0)
    return [
        BorderSide(
            number=-1, points=points[owner == one], normals=normals[owner == one], steps_px=steps[owner == one],
            strength=float(proven), sigma_px=sigma_px,
        )
        for one in np.unique(owner)
    ]  # fmt: skip


def flat_surface(p: FloatArray, piece: int) -> Surface:
    """Return the surface of a plane, d = p0 x + p1 y + p2 in pixels."""
    return Surface(disparity_px=_by_plane(p), piece=piece)


def _by_plane(p: FloatArray) -> Callable[[FloatArray], FloatArray]:
    return lambda at: np.asarray(at[..., 0] * p[0] + at[..., 1] * p[1] + p[2])


def shown_by(bench: Workbench, side: BorderSide, own: Surface) -> Shown:
    """Return what a side shows; `own` is the face's surface."""
    weight = side.steps_px / side.steps_px.sum()
    profile = _profile(bench, side, own)
    kind, open_px = _beyond(profile)
    far_px = _open_far(bench, side, own, open_px)
    behind, before, meets, goes_on = (float(weight @ (kind == k)) for k in (BEHIND, BEFORE, MEETS, GOES_ON))
    framed = at_places(bench.frame, side.points)
    past = float(weight @ (framed | ~profile.paired))
    edge = (1.0 - float(weight @ framed)) * (1.0 - before) * side.strength  # what stands before has edges of its own
    features = np.array([behind, before, meets, goes_on, past, edge, _stands(bench, side, own, profile, weight)])
    return Shown(features=features, open_px=float(weight @ open_px), far_px=float(weight @ far_px))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Profile:
    """What is measured past a side's N places, at each of K distances off it."""

    at: FloatArray  # (N, K, 2) px
    own_px: FloatArray  # (N, K) the face's disparity there
    step_px: FloatArray  # (N, K) disparity before it
    limit_px: FloatArray  # (N, K) a step of less may be noise
    measured: BoolArray  # (N, K)
    same: BoolArray  # (N, K) it is the face's own piece of the scene
    inside: BoolArray  # (N, K) the photo's frame holds it
    off: BoolArray  # (N, K) what is measured isn't the face
    paired: BoolArray  # (N,) the right photo shows what lies just past the side


def _profile(bench: Workbench, side: BorderSide, surface: Surface, distances_px: FloatArray = OUTWARD_PX) -> _Profile:
    at = side.points[:, None] + distances_px[None, :, None] * side.normals[:, None]
    own, level = surface.disparity_px(at), bench.scene.level
    height, width = level.measured.shape
    x, y = np.round(at[..., 0]).astype(np.intp), np.round(at[..., 1]).astype(np.intp)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    sky = bench.sky[y, x]
    disparity = np.where(sky, 0.0, np.nan_to_num(level.disparity_px[y, x]))
    sigma = np.nan_to_num(level.sigma_px[y, x], nan=UNKNOWN_SIGMA_PX, posinf=UNKNOWN_SIGMA_PX)
    there, row = (at[:, 1:2, 0] - own[:, 1:2]).astype(np.float32), at[:, 1:2, 1].astype(np.float32)
    in_right = (there > 0.0) & (sample(bench.slopes.valid_right, there, row) > 0.9)
    measured, step = inside & (level.measured[y, x] | sky), disparity - own
    limit = np.where(sky, OFF_PX, np.maximum(OFF_PX, OFF_SIGMAS * sigma))
    return _Profile(
        at=at, own_px=own, step_px=step, limit_px=limit, measured=measured, off=measured & (np.abs(step) > limit),
        same=inside & (bench.scene.labels[y, x] == surface.piece), inside=inside, paired=in_right[:, 0],
    )  # fmt: skip


def _beyond(profile: _Profile) -> tuple[FloatArray, FloatArray]:
    """Return what lies past each place (N,), 0 where nothing is measured, and how far off it begins (px)."""
    off = profile.off
    ends = off.any(axis=1)
    first = np.where(ends, off.argmax(axis=1), len(OUTWARD_PX))
    rows, at = np.arange(len(off)), np.minimum(first, len(OUTWARD_PX) - 1)
    own = profile.measured & ~off & (OUTWARD_PX > FATTENED_PX) & (np.arange(len(OUTWARD_PX)) < first[:, None])
    # what scatters for a few pixels is no end where the same piece shows again behind it
    own |= profile.same & (OUTWARD_PX > FATTENED_PX) & (OUTWARD_PX < 2.0 * FATTENED_PX)
    step, rise = profile.step_px[rows, at], profile.limit_px[rows, at] + RISE_PER_PX * OUTWARD_PX[at]
    kind = np.where(step < 0.0, BEHIND, np.where(step > rise, BEFORE, MEETS)) * ends
    kind[own.any(axis=1)] = GOES_ON
    return kind, np.where(ends, OUTWARD_PX[at], OUTWARD_PX[-1])


def _open_far(bench: Workbench, side: BorderSide, surface: Surface, open_px: FloatArray) -> FloatArray:
    """Return how far off each place (N,) the first thing is seen that isn't the face: the frame's end is one, too."""
    places = open_px >= OUTWARD_PX[-1]
    if not places.any():
        return open_px
    far = _profile(bench, replace(side, points=side.points[places], normals=side.normals[places]), surface, FAR_PX)
    ends, far_px = far.off | ~far.inside, open_px.copy()
    far_px[places] = np.where(ends.any(axis=1), FAR_PX[ends.argmax(axis=1)], FAR_PX[-1])
    return far_px


def stood_on(floors: Sequence[Floor]) -> list[Floor]:
    """Return the floors, the largest first, that a face may stand on: that one, and the lowest of each storey.

    Over another floor and smaller, a level surface may be a deck or a heap, behind which the face goes on.
    """
    above = [[one.below_m - LEAST_STOREY_M, one.below_m] for one in floors]
    return [one for k, one in enumerate(floors) if k == 0 or not any(a < one.below_m < b for a, b in above)]


def _stands(bench: Workbench, side: BorderSide, surface: Surface, profile: _Profile, weight: FloatArray) -> float:
    """Return the share of a side past which one of the scene's floors lies and meets the face.

    A heap of rubble begins at a face's foot as a floor does, but it isn't one: it hides the foot.
    """
    near = OUTWARD_PX < 2.0 * FATTENED_PX
    known, own = profile.measured[:, near], surface.disparity_px(side.points)
    best = 0.0
    for floor in stood_on(bench.scene.floors):
        plane = _by_plane(pixel_plane(floor.q_px, bench.pair.camera))
        miss = np.abs((profile.step_px + profile.own_px - plane(profile.at))[:, near])
        lies = 2 * np.count_nonzero(known & (miss < profile.limit_px[:, near]), axis=1) > known.sum(axis=1)
        best = max(best, float(weight @ (lies & (np.abs(plane(side.points) - own) < OFF_PX))))
    return best
