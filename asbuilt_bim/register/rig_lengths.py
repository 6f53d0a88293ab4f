"""A rig moved to where known lengths say it stands: baseline and yaw, which rows don't show.

A visit's lengths are the disc's diameter, the markers' size, and the distances of surveyed markers. Each is a
measurement of the rig's numbers, with its own error and one that all of its kind share. The rig's covariance is what
was known before, so that lengths move a rig only as far as they know better.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, PLACES, area_slopes
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.camera.rig_numbers import in_pixels, rig_numbers, seen_points, with_numbers
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.arrays import FloatArray, IntArray, frozen
from asbuilt_bim.geometry.robust_least_squares import by_differences, cauchy, robust_sigma
from asbuilt_bim.measure.sigma.area import hats
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.scale import KNOWN_TO, SCALE_LIMIT, TARGET_SIGMA, KnownLength, distances_seen
from asbuilt_bim.vision.stereo.rig_fit import STEP_PX, STEP_RAD, corrected_rig
from asbuilt_bim.vision.stereo.rig_health import AREA_LIMIT, SIGNIFICANT

FEWEST = 3
"""Lengths: two numbers are asked for, and one length more shows whether they agree."""
_OPEN = np.array([0.1, 0.1])
"""Yaw (rad) and baseline (share) of a rig that lengths show to be another than it was calibrated: any."""
_CHANCE = -2.0 * math.log(math.erfc(SIGNIFICANT / math.sqrt(2.0)))
"""Chi square of two numbers that chance passes as rarely as one passes three sigmas (0.27 %)."""
_WORTH_IT = 0.5  # of the sigma of an area: to be measured again, lengths must take off half of it
_ROUNDS, _REACH = 5, 3.0
_LINEARISED = 3
_MOST_YAW_RAD = np.deg2rad(1.0)
"""A rig that lengths turn or stretch (`SCALE_LIMIT`) by more has a mistake in its numbers, which is to be named."""
_LEAST_OWN = 1e-5  # of a length whose error is all in its points' depths
_ROUND = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownLengths:
    """What is known of a visit's lengths: the disc's diameter, the markers' size, and the survey."""

    diameter_m: float | None
    size_m: float | None
    survey: Sequence[SurveyedMarker]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LengthsFit:
    """The rig as known lengths show it, and what they changed.

    `yaw_rad` and `scale` (of the baseline, as a share) with their sigmas; an area's sigma at 5 m in the frame's worst
    place before and after. `is_other`: the lengths contradict what was known of the rig, which is why it isn't used.
    """

    rig: StereoRig
    count: int
    yaw_rad: float
    yaw_sigma_rad: float
    scale: float
    scale_sigma: float
    area_sigma_before: float
    area_sigma: float
    is_other: bool


Span = tuple[IntArray, IntArray]
"""Points at either end of a length: their means are what it lies between."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Length:
    """One known length, the mean of its `spans`; `own` is its sigma beside its points' depths, as a share.

    `alike` holds what it errs by, as a share, for a sigma of what other lengths err by, too: a print, a survey row.
    """

    kind: KnownLength
    known_m: float
    spans: tuple[Span, ...]
    own: float
    alike: dict[object, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Lengths:
    """All lengths of a visit between points (N, 3) of left frames, whose depths have their own sigma (N,)."""

    points_m: FloatArray
    depth_m: FloatArray
    each: tuple[_Length, ...]

    @property
    def log_known(self) -> FloatArray:
        """Return the logarithm (L,) of what is known."""
        logs: FloatArray = np.log(np.array([one.known_m for one in self.each]))
        return logs

    def logs(self, points_m: FloatArray) -> FloatArray:
        """Return the logarithm (L,) of the lengths between points (N, 3).

        Depths err, and what errs across a span makes it longer: by half of its variance over the length. It is taken
        off.
        """
        ray = points_m / np.linalg.norm(points_m, axis=1, keepdims=True)
        found = np.zeros(len(self.each))
        for k, one in enumerate(self.each):
            for a, b in one.spans:
                span = points_m[a].mean(axis=0) - points_m[b].mean(axis=0)
                length = float(np.linalg.norm(span))
                across = 1.0 - float((span / length) @ ray[np.r_[a, b]].mean(axis=0)) ** 2
                variance = sum(float(np.mean(self.depth_m[end] ** 2)) / len(end) for end in (a, b))
                found[k] += (length - 0.5 * across * variance / length) / len(one.spans)
        return np.log(np.maximum(found, 1e-9))

    def covariance(self) -> FloatArray:
        """Return the lengths' covariance (L, L) by what they err by themselves: a marker's depths are in several."""
        ray = self.points_m / np.linalg.norm(self.points_m, axis=1, keepdims=True)
        by_depth = self._by_depth(ray)
        own = np.diag([one.own**2 for one in self.each])
        covariance: FloatArray = (by_depth * self.depth_m**2) @ by_depth.T + own
        return covariance

    def by_lens(self, camera: RectifiedCamera) -> FloatArray:
        """Return what a pixel that the lenses leave in each cell of the frame makes of the lengths (L, 24)."""
        ray = self.points_m / np.linalg.norm(self.points_m, axis=1, keepdims=True)
        depth = self.points_m @ camera.rectified_from_left[2]
        further = np.linalg.norm(self.points_m, axis=1) * depth / (camera.f_px * camera.baseline_m)
        by_cell: FloatArray = (self._by_depth(ray) * further) @ hats(camera.project(self.points_m), camera)
        return by_cell

    def _by_depth(self, ray: FloatArray) -> FloatArray:
        """Return how each length changes, as a share, where each point moves along its ray (L, N), in 1/m."""
        by_depth = np.zeros((len(self.each), len(self.points_m)))
        for k, one in enumerate(self.each):
            for a, b in one.spans:
                span = self.points_m[a].mean(axis=0) - self.points_m[b].mean(axis=0)
                along = ray @ (span / (span @ span)) / len(one.spans)
                by_depth[k, a] += along[a] / len(a)
                by_depth[k, b] -= along[b] / len(b)
        return by_depth

    def shared(self) -> FloatArray:
        """Return what a sigma of each cause (C) that several lengths share makes of them (L, C)."""
        causes = list(dict.fromkeys(cause for one in self.each for cause in one.alike))
        return np.array([[one.alike.get(cause, 0.0) for cause in causes] for one in self.each])


def rig_by_lengths(
    rig: StereoRig,
    measured_with: StereoRig,
    evidence: Sequence[ScaleEvidence],
    known: KnownLengths,
    camera: RectifiedCamera,
) -> LengthsFit | None:
    """Move a rig to where a visit's lengths say it stands; None where they say too little, or contradict each other.

    `measured_with` is the rig that the evidence was triangulated with, `camera` its rectified one; `rig` the same or
    one that was levelled. The rig comes back with a covariance, also where it had none before. The lengths' slopes are
    taken again where they have moved it to (an iterated Kalman update).
    """
    lengths = _gathered(evidence, known)
    if lengths is None:
        return None
    before, used = known_rig(rig, camera), known_rig(measured_with, camera)
    moved = rig_numbers(before) - rig_numbers(used)
    seen = seen_points(used, *_directions(lengths.points_m, used))

    def off(change: FloatArray) -> FloatArray:
        return lengths.logs(midpoints(*seen.rays(moved + change))) - lengths.log_known

    steps = np.where(in_pixels(before), STEP_PX, STEP_RAD)
    change, prior, is_other = np.zeros(len(steps)), before.covariance, False
    yaw_scale, causes = _yaw_and_scale(before, camera), lengths.shared()
    shared = np.concatenate([causes, before.lens_left_px * lengths.by_lens(camera)], axis=1)
    for at in range(_LINEARISED):
        slopes = by_differences(off, change, steps)
        start = off(change) - slopes @ change
        if not (np.all(np.isfinite(slopes)) and np.all(np.isfinite(start))):
            return None
        noise = _own_noise(start, slopes @ yaw_scale, lengths, shared) + shared @ shared.T
        if at == 0 and (is_other := _contradict(start, slopes, yaw_scale, prior, noise)):
            prior = prior + yaw_scale * _OPEN**2 @ yaw_scale.T
        weight = np.linalg.inv(slopes @ prior @ slopes.T + noise)
        change = -prior @ slopes.T @ weight @ start
    if np.abs(causes.T @ weight @ start).max() > SIGNIFICANT:  # whatever the rig, a kind or a survey row is wrong
        return None
    covariance = frozen(prior - prior @ slopes.T @ weight @ slopes @ prior)
    found = replace(with_numbers(before, rig_numbers(before) + change), covariance=covariance)
    fit = _fit(
        before, found, change, np.asarray(np.linalg.pinv(yaw_scale), dtype=np.float64), len(start), is_other=is_other
    )
    return fit if abs(fit.scale) < SCALE_LIMIT and abs(fit.yaw_rad) < _MOST_YAW_RAD else None


def _fit(
    before: StereoRig, found: StereoRig, change: FloatArray, two: FloatArray, count: int, *, is_other: bool
) -> LengthsFit:
    (yaw, scale), sigmas = two @ change, np.sqrt(np.maximum(np.diag(two @ found.covariance @ two.T), 0.0))
    return LengthsFit(
        rig=found, count=count, yaw_rad=float(yaw), yaw_sigma_rad=float(sigmas[0]), scale=float(scale),
        scale_sigma=float(sigmas[1]), area_sigma_before=_worst(before), area_sigma=_worst(found), is_other=is_other,
    )  # fmt: skip


def is_worth_it(fit: LengthsFit) -> bool:
    """Say whether lengths know the rig well enough that it be used as they show it.

    A rig that was another must come out known to the limit of areas; any other must gain half of its sigma.
    """
    if fit.is_other:
        return fit.area_sigma < AREA_LIMIT
    return fit.area_sigma < _WORTH_IT * fit.area_sigma_before


def known_rig(rig: StereoRig, camera: RectifiedCamera) -> StereoRig:
    """Return a rig with a covariance: its own, or what a rig without one is trusted to, as that of its numbers.

    What its lenses leave is kept apart: it is no number of the rig.
    """
    if np.any(rig.covariance):
        return rig
    turns = _by_turn(rig, camera) * np.array(rig.width.turn_rad)
    stretch = _stretch(rig) * rig.width.scale_share
    covariance = turns @ turns.T + np.outer(stretch, stretch)
    return replace(rig, covariance=frozen(covariance), lens_px=rig.width.lens_px)


def _by_turn(rig: StereoRig, camera: RectifiedCamera) -> FloatArray:
    """Return how the rig's numbers change with the five of a correction (P, 5)."""
    start, steps = rig_numbers(rig), STEP_RAD * np.eye(5)
    slopes = [(rig_numbers(corrected_rig(rig, camera, step)) - start) / STEP_RAD for step in steps]
    return np.stack(slopes, axis=1)


def _stretch(rig: StereoRig) -> FloatArray:
    """Return how the rig's numbers (P,) change with the baseline's length, as a share of it."""
    stretch = np.zeros(len(rig.covariance))
    at = len(PARAMETERS) - 3
    stretch[at : at + 3] = rig.right_from_left[:3, 3]
    return stretch


def _yaw_and_scale(rig: StereoRig, camera: RectifiedCamera) -> FloatArray:
    return np.stack([_by_turn(rig, camera)[:, 1], _stretch(rig)], axis=1)


def _contradict(
    start: FloatArray, slopes: FloatArray, yaw_scale: FloatArray, covariance: FloatArray, noise: FloatArray
) -> bool:
    """Say whether the lengths ask for a yaw and a scale that what was known of the rig doesn't allow."""
    along = slopes @ yaw_scale
    weight = np.linalg.inv(noise + slopes @ covariance @ slopes.T)
    information = along.T @ weight @ along + np.diag(1.0 / _OPEN**2)
    asked = -np.linalg.solve(information, along.T @ weight @ start)
    return float(asked @ information @ asked) > _CHANCE


def _own_noise(start: FloatArray, along: FloatArray, lengths: _Lengths, shared: FloatArray) -> FloatArray:
    """Return the covariance (L, L) of the lengths' own errors; one far off whatever the rig is counts less."""
    own = lengths.covariance()
    sigma = np.sqrt(np.diag(own))
    columns = np.concatenate([along, shared], axis=1)
    prior = np.diag(1.0 / np.r_[_OPEN, np.ones(shared.shape[1])] ** 2)
    wider = np.ones(len(start))
    for _ in range(_ROUNDS):
        weighed = columns.T / (sigma * wider) ** 2
        fitted = np.linalg.solve(weighed @ columns + prior, weighed @ start)
        left = (start - columns @ fitted) / sigma
        scatter = max(1.0, robust_sigma(left))
        wider = scatter / np.sqrt(cauchy(left / scatter, reach=_REACH))
    return own * np.outer(wider, wider)


def _worst(rig: StereoRig) -> float:
    slopes = area_slopes(rig, PLACES, DISTANCE_M)
    return float(np.sqrt(np.nanmax(np.einsum("ni,ij,nj->n", slopes, rig.covariance, slopes))))


def _directions(points_m: FloatArray, rig: StereoRig) -> tuple[FloatArray, FloatArray]:
    """Return where points (N, 3) of the left frame stand in each camera, as x/z and y/z (N, 2)."""
    right = points_m @ rig.right_from_left[:3, :3].T + rig.right_from_left[:3, 3]
    return points_m[:, :2] / points_m[:, 2:], right[:, :2] / right[:, 2:]


def _gathered(evidence: Sequence[ScaleEvidence], known: KnownLengths) -> _Lengths | None:
    """Gather a visit's lengths; None where they are fewer than `FEWEST`."""
    points: list[FloatArray] = []
    depths: list[FloatArray] = []
    each: list[_Length] = []
    first = 0
    for one in evidence:
        corners = one.marker_corners_m.reshape(-1, 3)
        each += _of_station(one, known, first)
        points.append(corners)
        depths.append(np.repeat(one.marker_depth_m, 4))
        first += len(corners)
        if known.diameter_m is not None and one.target_m is not None and one.target_diameter_m > 0.0:
            each.append(_disc(known.diameter_m, first))
            points.append(one.target_m + 0.5 * one.target_diameter_m * _ROUND)
            depths.append(np.zeros(len(_ROUND)))  # its size is the picture's, and no distance of two points
            first += len(_ROUND)
    if len(each) < FEWEST:
        return None
    return _Lengths(points_m=np.concatenate(points), depth_m=np.concatenate(depths), each=tuple(each))


def _disc(diameter_m: float, first: int) -> _Length:
    kind = KnownLength.TARGET_DIAMETER
    spans = tuple((np.array([first + k], dtype=np.int32), np.array([first + k + 1], dtype=np.int32)) for k in (0, 2))
    return _Length(kind=kind, known_m=diameter_m, spans=spans, own=TARGET_SIGMA, alike={kind: KNOWN_TO[kind]})


def _side(one: ScaleEvidence, k: int, corners: IntArray, size_m: float) -> _Length:
    """Return the four sides of a station's marker number `k`, whose corners (4,) are points by their numbers."""
    spans = tuple((corners[[i]], corners[[(i + 1) % 4]]) for i in range(4))
    in_depth = 0.5 * one.marker_depth_m[k] / float(np.mean(one.marker_corners_m[k, :, 2]))
    across = float(np.sqrt(max(one.marker_sigma[k] ** 2 - in_depth**2, _LEAST_OWN**2)))
    kind = KnownLength.MARKER_SIZE
    return _Length(kind=kind, known_m=size_m, spans=spans, own=across, alike={kind: KNOWN_TO[kind]})


def _of_station(one: ScaleEvidence, known: KnownLengths, first: int) -> list[_Length]:
    """Return a station's markers' sizes, and the distances between those that were surveyed."""
    at = first + np.arange(4 * len(one.marker_ids), dtype=np.int32).reshape(-1, 4)
    found = [_side(one, k, corners, known.size_m) for k, corners in enumerate(at)] if known.size_m is not None else []
    surveyed = {marker.marker_id: marker for marker in known.survey}
    for i, j, true_m, _ in distances_seen(one, known.survey):
        a, b = (surveyed[one.marker_ids[k]] for k in (i, j))
        along = (b.corners_m.mean(axis=0) - a.corners_m.mean(axis=0)) / true_m
        kind = KnownLength.MARKER_DISTANCES
        alike: dict[object, float] = {kind: KNOWN_TO[kind]}
        for marker, sign in ((a, -1.0), (b, 1.0)):
            for axis in range(3):
                alike[marker.marker_id, axis] = sign * marker.sigma_m * float(along[axis]) / true_m
        found.append(_Length(kind=kind, known_m=true_m, spans=((at[i], at[j]),), own=_LEAST_OWN, alike=alike))
    return found
