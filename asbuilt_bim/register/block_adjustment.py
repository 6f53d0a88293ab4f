"""Least squares of a whole visit at once: poses of all stations, poses and sizes of all prints, the rig's own error.

What is known of single stations and prints (survey, given poses, sizes) are further rows. Prints are eliminated first,
so that 200 stations are a system of 1,200 unknowns. Coordinates are from an origin near the site.

Reference: Triggs et al. 1999, bundle adjustment, a modern synthesis (section 6: the reduced camera system).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.robust_least_squares import cauchy
from asbuilt_bim.geometry.transform import skew
from asbuilt_bim.register.between import Between, BetweenRows, add_between, between_rows
from asbuilt_bim.register.solve import moved
from asbuilt_bim.register.tags import SQUARE

STATION, TAG, COMMON = 6, 7, 1
"""Unknowns of a station, of a print, and in common: the disparity that the rig is off by."""
LOOSE_STATION = np.array([10.0] * 3 + [1e3] * 3) ** -2.0
LOOSE_TAG = np.array([10.0] * 3 + [1e3] * 3 + [3.0]) ** -2.0
"""What is known of everything: a turn to 10 rad, a place to 1 km, a size to a factor of 20. What no photo holds keeps
its place so, and has a sigma that says it."""
NEAREST_M = 0.05
"""Before a camera: nearer, nothing is seen."""
_ROUNDS, _STILL = 60, 1e-5  # rounds at most; a step in sigmas of the unknowns that is none
_DAMPING, _MOST_DAMPING = 1e-4, 1e8

Rows = tuple[FloatArray, FloatArray]
"""Whitened residuals (m,), and their slopes (m, P) by a small motion of what they are about."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class State:
    """Poses (N, 4, 4) of stations, poses (M, 4, 4) and sizes (M,) of prints, and the disparity in common in pixels."""

    stations: FloatArray
    tags: FloatArray
    sizes_m: FloatArray
    disparity_px: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonNoise:
    """What the four corners of a print err by in common, one sigma each, in pixels.

    `direction_px` is what the lens model leaves in both photos alike, `between_px` what it leaves from one to the
    other, and `edge_px` how far outwards corners are found: black bleeds.
    """

    direction_px: float
    between_px: float
    edge_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sightings:
    """K sightings: which station (K,) sees which print (K,), as x left, y, x right, y (K, 4, 4) of its corners.

    `both` (K,) is False where the left photo alone shows it. `corner_px` (K,) is the finder's standard deviation of a
    coordinate. `cameras` are by station.
    """

    station: NDArray[np.intp]
    tag: NDArray[np.intp]
    pixels: FloatArray
    both: NDArray[np.bool_]
    corner_px: FloatArray
    noise: "CommonNoise"
    cameras: Sequence[RectifiedCamera]

    def kept(self, which: NDArray[np.bool_]) -> "Sightings":
        """Return some of them (K,)."""
        return replace(
            self, station=self.station[which], tag=self.tag[which], pixels=self.pixels[which], both=self.both[which],
            corner_px=self.corner_px[which],
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Known:
    """What is known of one station or print: `rows` makes whitened residuals and slopes of its pose and size."""

    name: str
    of_tag: bool
    index: int
    rows: Callable[[FloatArray, float], Rows]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjusted:
    """The state at the least sum of squares, and how far each sighting (K,), known thing (L,) and link (T,) is off.

    That is the root mean square of its rows, in sigmas. Covariances are of each station (N, 6, 6) and print (M, 7, 7).
    """

    state: State
    seen_off: FloatArray
    known_off: FloatArray
    between_off: FloatArray
    station_covariance: FloatArray
    tag_covariance: FloatArray
    residual_px: FloatArray  # (K, 4, 4) seen less predicted


def adjust(
    state: State,
    seen: Sightings,
    known: Sequence[Known],
    disparity_sigma_px: float,
    *,
    between: Sequence[Between] = (),
    reach: float | None = None,
) -> Adjusted | None:
    """Find the state that explains all rows; None where a print lies behind a camera that sees it.

    `reach` is that of Cauchy's weights in sigmas, None for weights of 1.
    """
    trust = Trust(seen=np.ones(len(seen.tag)), known=np.ones(len(known)), between=np.ones(len(between)))
    damping = _DAMPING
    rows = _all_rows(state, seen, known, between, disparity_sigma_px)
    if rows is None:
        return None
    for _ in range(_ROUNDS):
        if reach is not None:
            trust = _trust(rows, seen, reach)
        step, shift = _step(rows, seen, trust, len(state.stations), len(state.tags), damping)
        if step is None:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                return None
            continue
        there = _moved(state, step)
        rows_there = _all_rows(there, seen, known, between, disparity_sigma_px)
        if rows_there is None or rows_there.cost(trust) > rows.cost(trust) * (1.0 + 1e-9) + 1e-12:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                break
            continue
        state, rows, damping = there, rows_there, max(damping * 0.1, 1e-12)
        if shift < _STILL:
            break
    return _finished(state, rows, seen, trust)


def ahead(state: State, seen: Sightings) -> NDArray[np.bool_]:
    """Say of sightings (K,) whether their print lies before the camera; no photo shows it elsewhere."""
    depth_m = _by_camera(state, seen)[2][2]
    return np.asarray((depth_m > NEAREST_M).all(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trust:
    """Weights (K,), (L,) and (T,) of sightings, of what is known and of links, in 0..1."""

    seen: FloatArray
    known: FloatArray
    between: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _AllRows:
    """Whitened rows at a state: of sightings (K, 16), of what is known, and of the rig's error in common."""

    residual: FloatArray  # (K, 16)
    by_station: FloatArray  # (K, 16, 6)
    by_tag: FloatArray  # (K, 16, 7)
    by_common: FloatArray  # (K, 16, 1)
    known: Sequence[tuple[Known, Rows]]
    between: BetweenRows
    common: float
    disparity_sigma_px: float
    pixels: FloatArray  # (K, 4, 4)

    def cost(self, trust: Trust) -> float:
        """Return the weighted sum of squares."""
        seen = float(trust.seen @ np.einsum("kr,kr->k", self.residual, self.residual))
        known = sum(float(w) * float(r @ r) for w, (_, (r, _)) in zip(trust.known, self.known, strict=True))
        linked = float(trust.between @ np.einsum("tr,tr->t", self.between.residual, self.between.residual))
        return float(seen + known + linked + self.common**2)


def _all_rows(
    state: State, seen: Sightings, known: Sequence[Known], between: Sequence[Between], disparity_sigma_px: float
) -> _AllRows | None:
    off, by_point, points = _projected(state, seen)
    if off is None:
        return None
    arms = points - state.stations[seen.station, None, :3, 3]
    own = points - state.tags[seen.tag, None, :3, 3]
    by_common = np.zeros((*off.shape, COMMON))
    by_common[:, :, 2, 0] = -1.0
    slopes = np.concatenate(
        [by_point @ skew(arms), -by_point, -by_point @ skew(own), by_point, by_point @ own[..., None], by_common],
        axis=-1,
    )
    white = _whitened(np.concatenate([off[..., None], -slopes], axis=-1), seen)
    flat = white.reshape(len(off), 16, white.shape[-1])
    return _AllRows(
        residual=flat[:, :, 0],
        by_station=flat[:, :, 1 : 1 + STATION],
        by_tag=flat[:, :, 1 + STATION : 1 + STATION + TAG],
        by_common=flat[:, :, 1 + STATION + TAG :],
        known=[(one, one.rows(*_about(one, state))) for one in known],
        between=between_rows(between, state.stations, state.disparity_px),
        common=state.disparity_px / disparity_sigma_px,
        disparity_sigma_px=disparity_sigma_px,
        pixels=off,
    )


def _about(one: Known, state: State) -> tuple[FloatArray, float]:
    if one.of_tag:
        return state.tags[one.index], float(state.sizes_m[one.index])
    return state.stations[one.index], 0.0


def _projected(state: State, seen: Sightings) -> tuple[FloatArray | None, FloatArray, FloatArray]:
    """Return seen less predicted pixels (K, 4, 4), their slopes by the corner (K, 4, 4, 3), and the corners (K, 4, 3).

    None where a corner would lie behind its camera.
    """
    lenses = np.array([(c.f_px, c.baseline_m, c.cx_px, c.cy_px) for c in seen.cameras])
    f, b, cx, cy = lenses[seen.station].T[:, :, None]
    turn, points, (x, y, z) = _by_camera(state, seen)
    if not np.all(z > NEAREST_M):
        return None, turn, points
    pixels = np.stack([f * x / z + cx, f * y / z + cy, f * (x - b) / z + cx - state.disparity_px, f * y / z + cy], -1)
    zero = np.zeros_like(z)
    across = np.stack([zero, f / z, -f * y / z**2], -1)
    by_left, by_right = np.stack([f / z, zero, -f * x / z**2], -1), np.stack([f / z, zero, -f * (x - b) / z**2], -1)
    by_point = np.stack([by_left, across, by_right, across], axis=2) @ turn[:, None]
    return seen.pixels - pixels, by_point, points


def _by_camera(state: State, seen: Sightings) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the cameras' turns (K, 3, 3), corners in the world (K, 4, 3), and in their cameras (3, K, 4)."""
    rectified = np.stack([c.rectified_from_left for c in seen.cameras])[seen.station]
    poses, tags = state.stations[seen.station], state.tags[seen.tag]
    turn = rectified @ poses[:, :3, :3].transpose(0, 2, 1)
    square = SQUARE[None] * state.sizes_m[seen.tag, None, None]
    points = square @ tags[:, :3, :3].transpose(0, 2, 1) + tags[:, None, :3, 3]
    return turn, points, np.moveaxis((points - poses[:, None, :3, 3]) @ turn.transpose(0, 2, 1), -1, 0)


def _whitened(rows: FloatArray, seen: Sightings) -> FloatArray:
    """Divide rows (K, 4, 4, P) by their noise: each corner's own, and what the four of a print have in common.

    Rows of a right photo that doesn't show the print are zero.
    """
    noise, own = seen.noise, seen.corner_px
    shows = seen.both[:, None, None, None] | (np.arange(4) < 2)[None, None, :, None]
    rows = np.where(shows, rows, 0.0) / own[:, None, None, None]
    outwards = seen.pixels - seen.pixels.mean(axis=1, keepdims=True)
    outwards[~seen.both, :, 2:] = 0.0
    outwards /= np.sqrt(np.square(outwards).sum(axis=(1, 2), keepdims=True))
    swelling = np.einsum("kce,kcep->kp", outwards, rows) * _share(_counts(seen) * np.square(noise.edge_px / own))
    means = rows.mean(axis=1)
    left, right = means[:, :2], means[:, 2:]
    alike = 0.5 * (left + right) * _share(8.0 * np.square(noise.direction_px / own))[..., None]
    apart = 0.5 * (left - right) * _share(2.0 * np.square(noise.between_px / own))[..., None]
    alone = left * _share(4.0 * np.square(noise.direction_px / own))[..., None]
    both = np.concatenate([alike + apart, alike - apart], axis=1)
    shift = np.where(seen.both[:, None, None], both, np.concatenate([alone, np.zeros_like(alone)], axis=1))
    white: FloatArray = rows - shift[:, None] - outwards[..., None] * swelling[:, None, None, :]
    return white


def _share(variance: FloatArray) -> FloatArray:
    """Return how much of a part of the rows (K, 1) goes, whose variance in common is so many times a corner's own."""
    return (1.0 - 1.0 / np.sqrt(1.0 + variance))[:, None]


def _counts(seen: Sightings) -> FloatArray:
    return np.where(seen.both, 16.0, 8.0)


def _off(rows: _AllRows, seen: Sightings) -> tuple[FloatArray, FloatArray]:
    """Return how far each sighting (K,) and each known thing (L,) is off: the root mean square of its rows."""
    known = np.array([np.sqrt(r @ r / len(r)) for _, (r, _) in rows.known])
    return np.sqrt(np.einsum("kr,kr->k", rows.residual, rows.residual) / _counts(seen)), known


def _trust(rows: _AllRows, seen: Sightings, reach: float) -> Trust:
    of_seen, of_known = _off(rows, seen)
    linked = cauchy(rows.between.off, reach)
    return Trust(seen=cauchy(of_seen, reach), known=cauchy(of_known, reach), between=linked)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Normal:
    """Normal equations: of stations and the error in common (6N + 1), of each print (M, 7), and what links them."""

    matrix: FloatArray
    right: FloatArray
    of_tag: FloatArray  # (M, 7, 7)
    right_of_tag: FloatArray  # (M, 7)
    links: list[tuple[NDArray[np.intp], FloatArray]]  # by print: unknowns (u,), and their products with it (u, 7)


def _normal(rows: _AllRows, seen: Sightings, trust: Trust, n: int, m: int) -> _Normal:
    size = STATION * n + COMMON
    matrix, right = np.diag(np.append(np.tile(LOOSE_STATION, n), 0.0)), np.zeros(size)
    of_tag, right_of_tag = np.tile(np.diag(LOOSE_TAG), (m, 1, 1)), np.zeros((m, TAG))
    first = np.concatenate([rows.by_station, rows.by_common], axis=2)
    weighted = first * trust.seen[:, None, None]
    own = np.einsum("kri,krj->kij", weighted, first)
    cross = np.einsum("kri,krj->kij", weighted, rows.by_tag)
    at = np.concatenate(
        [seen.station[:, None] * STATION + np.arange(STATION), np.full((len(own), 1), size - 1, dtype=np.intp)], axis=1
    )
    np.add.at(matrix, (at[:, :, None], at[:, None, :]), own)
    np.add.at(right, at, -np.einsum("kri,kr->ki", weighted, rows.residual))
    tag_weighted = rows.by_tag * trust.seen[:, None, None]
    np.add.at(of_tag, seen.tag, np.einsum("kri,krj->kij", tag_weighted, rows.by_tag))
    np.add.at(right_of_tag, seen.tag, -np.einsum("kri,kr->ki", tag_weighted, rows.residual))
    for weight, (one, (residual, slope)) in zip(trust.known, rows.known, strict=True):
        if one.of_tag:
            of_tag[one.index] += weight * slope.T @ slope
            right_of_tag[one.index] -= weight * slope.T @ residual
        else:
            here = slice(STATION * one.index, STATION * (one.index + 1))
            matrix[here, here] += weight * slope.T @ slope
            right[here] -= weight * slope.T @ residual
    add_between(matrix, right, rows.between, trust.between)
    matrix[-1, -1] += rows.disparity_sigma_px**-2
    right[-1] -= rows.common / rows.disparity_sigma_px
    return _Normal(matrix=matrix, right=right, of_tag=of_tag, right_of_tag=right_of_tag,
                   links=_links(cross, seen, size, m))  # fmt: skip


def _links(cross: FloatArray, seen: Sightings, size: int, m: int) -> list[tuple[NDArray[np.intp], FloatArray]]:
    links = []
    by_tag = np.argsort(seen.tag, kind="stable")
    bounds = np.searchsorted(seen.tag[by_tag], np.arange(m + 1))
    for j in range(m):
        which = by_tag[bounds[j] : bounds[j + 1]]
        at = (seen.station[which][:, None] * STATION + np.arange(STATION)).ravel()
        own = cross[which, :STATION].reshape(-1, TAG)
        links.append((np.append(at, size - 1), np.vstack([own, cross[which, STATION:].sum(axis=0)])))
    return links


def _step(
    rows: _AllRows, seen: Sightings, trust: Trust, n: int, m: int, damping: float
) -> tuple[tuple[FloatArray, FloatArray, float] | None, float]:
    """Return the step of stations (N, 6), prints (M, 7) and the error in common, and its largest part in sigmas."""
    made = _normal(rows, seen, trust, n, m)
    matrix, right = made.matrix.copy(), made.right.copy()
    diagonal = np.diag(matrix).copy()
    matrix[np.diag_indices_from(matrix)] += damping * diagonal
    eye = np.eye(TAG)
    damped = made.of_tag + damping * made.of_tag * eye
    try:
        inverse = np.linalg.inv(damped)
        for (at, link), one, own in zip(made.links, inverse, made.right_of_tag, strict=True):
            matrix[np.ix_(at, at)] -= link @ one @ link.T
            right[at] -= link @ (one @ own)
        np.linalg.cholesky(matrix)
        step = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None, np.inf
    tags = np.zeros((m, TAG))
    for number, ((at, link), one, own) in enumerate(zip(made.links, inverse, made.right_of_tag, strict=True)):
        tags[number] = one @ (own - link.T @ step[at])
    shift = float(np.max(np.abs(step) * np.sqrt(diagonal), initial=0.0))
    stations: FloatArray = np.asarray(step[:-COMMON], dtype=np.float64).reshape(n, STATION)
    return (stations, tags, float(step[-1])), shift


def _moved(state: State, step: tuple[FloatArray, FloatArray, float]) -> State:
    stations, tags = state.stations.copy(), state.tags.copy()
    for poses, steps in ((stations, step[0]), (tags, step[1])):
        for pose, small in zip(poses, steps, strict=True):
            pose[:] = moved(pose, small[:6])
    sizes = state.sizes_m * np.exp(np.clip(step[1][:, 6], -1.0, 1.0)) if len(tags) else state.sizes_m
    return State(stations=stations, tags=tags, sizes_m=sizes, disparity_px=state.disparity_px + step[2])


def _finished(state: State, rows: _AllRows, seen: Sightings, trust: Trust) -> Adjusted | None:
    n, m = len(state.stations), len(state.tags)
    made = _normal(rows, seen, trust, n, m)
    matrix = made.matrix.copy()
    try:
        inverse = np.linalg.inv(made.of_tag) if m else made.of_tag
        for (at, link), one in zip(made.links, inverse, strict=True):
            matrix[np.ix_(at, at)] -= link @ one @ link.T
        np.linalg.cholesky(matrix)
        covariance = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    seen_off, known_off = _off(rows, seen)
    of_tags = []
    for (at, link), one in zip(made.links, inverse, strict=True):
        reach = one @ link.T
        of_tags.append(one + reach @ covariance[np.ix_(at, at)] @ reach.T)
    count = float(trust.seen @ _counts(seen)) + sum(
        w * len(r) for w, (_, (r, _)) in zip(trust.known, rows.known, strict=True)
    )
    count += STATION * float(trust.between.sum())
    free = max(count - STATION * n - TAG * m, 1.0)
    factor = max(rows.cost(trust) / free, 1.0)
    stations = covariance[:-COMMON, :-COMMON].reshape(n, STATION, n, STATION)[np.arange(n), :, np.arange(n)]
    return Adjusted(
        state=state,
        seen_off=seen_off,
        known_off=known_off,
        between_off=rows.between.off,
        station_covariance=factor * stations,
        tag_covariance=factor * np.array(of_tags).reshape(m, TAG, TAG),
        residual_px=rows.pixels,
    )
