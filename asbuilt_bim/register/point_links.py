"""Two stations linked by points that both show: known again by their look, and at one place by both depths.

The look alone proves nothing on concrete: panels, tie holes and brackets repeat. So a match counts where one motion
carries the points of one station to those of the other, in x, y and disparity; and where no other motion does so for
half as many.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, laid_over, skew
from asbuilt_bim.register.solve import moved
from asbuilt_bim.vision.landmarks.find import Landmarks, parts_of

LEAST_POINTS = 15
"""Points that agree in six unknowns: chance gives three, and a few more on one plane."""
LEAST_PARTS = 4
"""Of the frame's sixteen: fewer leave the turn open."""
RIVAL_SHARE = 0.5
"""Another motion that explains so many points as well leaves it open which is right."""
COMMON_PX = 0.15
"""What the lens model leaves in one part of a frame, which all points there have in common."""
BETWEEN_PX = 0.06
"""The same from one photo to the other."""
NEAREST_M = 0.3
LIMIT = 11.3
"""Of chi-squared of three: a point that is the same is off by more once in a hundred times."""
_TRIALS = 300
_NEXT = 2  # alike things are matched with both
SAME_M, SAME_RAD = 0.10, float(np.radians(2.0))
"""Two places or motions as near as that are one."""
_ROUNDS = 10


Which = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """What a station shows of points: its camera, and its landmarks."""

    name: str
    camera: RectifiedCamera
    landmarks: Landmarks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointLink:
    """`first_from_second` (4, 4), between left frames; covariance (6, 6) of a small motion in the first's axes.

    The motion is [rotation vector, translation] of the second camera about its own centre. `by_disparity` (6,) is how
    it changes by a pixel of disparity that the rig is off by in common. `points` agree.
    """

    first: str
    second: str
    first_from_second: FloatArray
    covariance: FloatArray
    by_disparity: FloatArray
    points: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pairs:
    """M matches: pixels and disparities (M, 3) in both, points (M, 3) in both left frames."""

    a: FloatArray
    b: FloatArray
    points_a: FloatArray
    points_b: FloatArray
    of_a: NDArray[np.intp]
    of_b: NDArray[np.intp]


def link_by_points(first: Shown, second: Shown) -> PointLink | None:
    """Return how a second station stands to a first one by what both show; None where that isn't sure."""
    pairs = _matched(first, second)
    if len(pairs.a) < LEAST_POINTS:
        return None
    found = _best(pairs, first, second, np.ones(len(pairs.a), dtype=bool))
    if found is None:
        return None
    pose, good = _settled(pairs, first, second, found)
    if pose is None or good.sum() < LEAST_POINTS:
        return None
    parts = parts_of(pairs.a[good, :2], (first.camera.width_px, first.camera.height_px))
    parts_b = parts_of(pairs.b[good, :2], (second.camera.width_px, second.camera.height_px))
    spread = min(len(np.unique(parts)), len(np.unique(parts_b)))
    if spread < LEAST_PARTS or _rival(pairs, first, second, pose) > RIVAL_SHARE * good.sum():
        return None
    return _link(pairs, first, second, pose, good)


def _matched(first: Shown, second: Shown) -> _Pairs:
    """Return matches by look: each landmark with the one most like it, and with the next where they are alike."""
    one, other = first.landmarks, second.landmarks
    rows: list[tuple[int, int]] = []
    if len(one.looks) > 1 and len(other.looks) > 1:
        matcher = cv2.BFMatcher(cv2.NORM_L2)
        a, b = one.looks.astype(np.float32), other.looks.astype(np.float32)
        back = {m.queryIdx: {n.trainIdx for n in found} for found in matcher.knnMatch(b, a, k=_NEXT) for m in found[:1]}
        for found in matcher.knnMatch(a, b, k=_NEXT):
            rows += [(m.queryIdx, m.trainIdx) for m in found if m.queryIdx in back.get(m.trainIdx, ())]
    of_a, of_b = np.array(rows, dtype=np.intp).reshape(-1, 2).T
    pixels = [np.column_stack([x.left_px, x.disparity_px])[of] for x, of in ((one, of_a), (other, of_b))]
    points = [s.camera.points(p[:, :2], p[:, 2]) for s, p in zip((first, second), pixels, strict=True)]
    return _Pairs(a=pixels[0], b=pixels[1], points_a=points[0], points_b=points[1], of_a=of_a, of_b=of_b)


def _predicted(camera: RectifiedCamera, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x, y and disparity (n, 3) of points in the left frame, and slopes (n, 3, 3) by the point."""
    turn = camera.rectified_from_left
    x, y, z = (points @ turn.T).T
    f, b = camera.f_px, camera.baseline_m
    zero = np.zeros_like(z)
    pixels = np.stack([f * x / z + camera.cx_px, f * y / z + camera.cy_px, f * b / z], axis=1)
    slopes = np.stack([np.stack([f / z, zero, -f * x / z**2], -1), np.stack([zero, f / z, -f * y / z**2], -1),
                       np.stack([zero, zero, -f * b / z**2], -1)], axis=1)  # fmt: skip
    return pixels, slopes @ turn


def _noise(landmarks: Landmarks, which: Which, counts: FloatArray) -> FloatArray:
    """Return covariances (n, 3, 3) of x, y and disparity: a point's own, and what a part of the frame has in common.

    Of `counts` (n,) points in a part each carries the common error as often: together they know no more than it lets.
    """
    result = np.zeros((len(counts), 3, 3))
    for k in (0, 1):
        result[:, k, k] = landmarks.sigma_px**2 + counts * COMMON_PX**2
    result[:, 2, 2] = landmarks.disparity_sigma_px[which] ** 2 + counts * 2.0 * BETWEEN_PX**2
    return result


def _off(
    pairs: _Pairs, first: Shown, second: Shown, pose: FloatArray, good: BoolArray, counts: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what the second's points differ by in the first's frame (n, 3), the covariance, and slopes by the pose.

    `counts` (n,) is how many points share a part of the frame, 1 where each is judged alone.
    """
    points = apply(pose, pairs.points_b[good])
    predicted, slopes = _predicted(first.camera, points)
    n = np.ones(len(points)) if counts is None else counts
    _, of_b = _predicted(second.camera, pairs.points_b[good])
    carried = slopes @ pose[:3, :3] @ np.linalg.inv(of_b)
    other = carried @ _noise(second.landmarks, pairs.of_b[good], n) @ carried.transpose(0, 2, 1)
    by_pose = np.concatenate([slopes @ -skew(points - pose[:3, 3]), slopes], axis=2)
    return pairs.a[good] - predicted, _noise(first.landmarks, pairs.of_a[good], n) + other, by_pose


def _agree(pairs: _Pairs, first: Shown, second: Shown, pose: FloatArray) -> BoolArray:
    """Say which matches (M,) lie where one motion carries them, in x, y and disparity."""
    ahead = (apply(pose, pairs.points_b) @ first.camera.rectified_from_left.T)[:, 2] > NEAREST_M
    if not ahead.any():
        return ahead
    residual, covariance, _ = _off(pairs, first, second, pose, ahead)
    solved = np.linalg.solve(covariance, residual[..., None])[..., 0]
    good = np.zeros(len(ahead), dtype=bool)
    good[ahead] = np.einsum("ni,ni->n", residual, solved) < LIMIT
    return good


def _unique(pairs: _Pairs, good: BoolArray) -> BoolArray:
    """Keep one match for each landmark of either station."""
    kept = np.zeros(len(good), dtype=bool)
    seen_a: set[int] = set()
    seen_b: set[int] = set()
    for k in np.flatnonzero(good):
        if pairs.of_a[k] not in seen_a and pairs.of_b[k] not in seen_b:
            kept[k] = True
            seen_a.add(int(pairs.of_a[k]))
            seen_b.add(int(pairs.of_b[k]))
    return kept


def _best(pairs: _Pairs, first: Shown, second: Shown, allowed: BoolArray) -> FloatArray | None:
    """Return the motion that most matches agree on, of those that three points give; always the same trials."""
    rng = np.random.default_rng(len(pairs.a))
    own = np.flatnonzero(allowed)
    if len(own) < LEAST_POINTS:
        return None
    sure = own[(pairs.a[own, 2] > 4.0) & (pairs.b[own, 2] > 4.0)]
    base = sure if len(sure) >= LEAST_POINTS else own
    best, count, tried = None, 0, 0
    for _ in range(_TRIALS * 10):
        three = rng.choice(base, 3, replace=False)
        a, b = pairs.points_a[three], pairs.points_b[three]
        sides = [np.linalg.norm(np.roll(x, 1, axis=0) - x, axis=1) for x in (a, b)]
        if sides[0].min() < 0.3 or np.any(np.abs(sides[0] - sides[1]) > 0.05 * sides[0] + 0.02):
            continue
        if (tried := tried + 1) > _TRIALS:
            break
        pose = laid_over(b, a)
        good = _agree(pairs, first, second, pose) & allowed
        if (n := int(good.sum())) > count:
            best, count = pose, n
    return best


def _settled(pairs: _Pairs, first: Shown, second: Shown, pose: FloatArray) -> tuple[FloatArray | None, BoolArray]:
    good = _unique(pairs, _agree(pairs, first, second, pose))
    for _ in range(_ROUNDS):
        if good.sum() < LEAST_POINTS:
            return None, good
        counts = _counts(pairs, first, good)
        residual, covariance, by_pose = _off(pairs, first, second, pose, good, counts)
        weight = np.linalg.inv(covariance)
        information = np.einsum("nki,nkl,nlj->ij", by_pose, weight, by_pose)
        right = np.einsum("nki,nkl,nl->i", by_pose, weight, residual)
        try:
            step = np.linalg.solve(information, right)
        except np.linalg.LinAlgError:
            return None, good
        pose = moved(pose, step)
        good = _unique(pairs, _agree(pairs, first, second, pose))
        if np.linalg.norm(step) < 1e-6:
            break
    return pose, good


def _counts(pairs: _Pairs, first: Shown, good: BoolArray) -> FloatArray:
    """Return for each good match how many share its part of the first frame."""
    part = parts_of(pairs.a[good, :2], (first.camera.width_px, first.camera.height_px))
    return np.bincount(part, minlength=part.max() + 1)[part].astype(np.float64)


def _rival(pairs: _Pairs, first: Shown, second: Shown, pose: FloatArray) -> int:
    """Return how many matches the best other motion explains."""
    other = _best(pairs, first, second, ~_agree(pairs, first, second, pose))
    if other is None:
        return 0
    turn = float(np.arccos(np.clip((np.trace(other[:3, :3] @ pose[:3, :3].T) - 1.0) / 2.0, -1.0, 1.0)))
    if np.linalg.norm(other[:3, 3] - pose[:3, 3]) < SAME_M and turn < SAME_RAD:
        return 0
    return int(_unique(pairs, _agree(pairs, first, second, other)).sum())


def _link(pairs: _Pairs, first: Shown, second: Shown, pose: FloatArray, good: BoolArray) -> PointLink:
    residual, covariance, by_pose = _off(pairs, first, second, pose, good, _counts(pairs, first, good))
    weight = np.linalg.inv(covariance)
    information = np.einsum("nki,nkl,nlj->ij", by_pose, weight, by_pose)
    single, spread, _ = _off(pairs, first, second, pose, good)
    factor = float(np.einsum("ni,nij,nj->", single, np.linalg.inv(spread), single)) / max(3 * good.sum() - 6, 1)
    cov = np.linalg.inv(information)
    _, slopes = _predicted(first.camera, apply(pose, pairs.points_b[good]))
    _, of_b = _predicted(second.camera, pairs.points_b[good])
    moved_b = slopes @ pose[:3, :3] @ np.linalg.inv(of_b)[:, :, 2:]
    by_one = np.zeros_like(residual)
    by_one[:, 2] = 1.0
    by_one -= moved_b[..., 0]
    by_disparity = cov @ np.einsum("nki,nkl,nl->i", by_pose, weight, by_one)
    return PointLink(
        first=first.name, second=second.name, first_from_second=frozen(pose),
        covariance=frozen(cov * max(factor, 1.0)), by_disparity=frozen(by_disparity), points=int(good.sum()),
    )  # fmt: skip
