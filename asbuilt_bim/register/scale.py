"""Is the rig's scale right? A visit's known lengths against what the rig makes of them: disc, prints, distances."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, Subject, Value
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen, weighted_median
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.register.pose import Placement, SurveyedMarker
from asbuilt_bim.register.print_shape import UNIT_MISTAKES


class KnownLength(StrEnum):
    """What is held against the rig's scale."""

    TARGET_DIAMETER = "target's diameter"
    MARKER_SIZE = "markers' size"
    MARKER_DISTANCES = "markers' distances"


SCALE_LIMIT = 0.03
"""Of a length, 6 % of an area: more than discs and prints are ever off by, all the same way."""
DOUBT_LIMIT, DOUBT_SIGNIFICANT = 0.015, 2.5  # it is warned of, and nothing is refused
SIGNIFICANT = 4.0
POOLED_LIMIT, POOLED_SIGNIFICANT = 0.005, 5.0
"""All known lengths together are warned of from 1 % of an area on, where chance can't explain it."""
KNOWN_TO = {KnownLength.TARGET_DIAMETER: 0.01, KnownLength.MARKER_SIZE: 0.01, KnownLength.MARKER_DISTANCES: 0.001}
"""What a length is made or surveyed to, relative; common to all of its kind, so that it doesn't average out. A survey's
own sigma is given; its scale is off by a map grid's factor (0.04 %) or a tape's sag and stretch at most."""
_LEAST_SPACING_M = 0.5
_UNIT_SHARE = 0.04
_ACROSS_RAY = 0.05  # a pixel is disparity / focal length as much across the ray as along it
_OF_MEDIAN = 1.2533  # its sigma over the mean's, of Gaussians
TARGET_SIGMA = 0.01  # of one station's diameter: a tenth of a pixel on a radius of ten


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleOfKind:
    """A visit's lengths of one kind: measured over known, and its sigma."""

    kind: KnownLength
    ratio: float
    sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleVerdict:
    """All kinds together: `agree` where no kind contradicts the others by more than 3 sigma."""

    kinds: tuple[ScaleOfKind, ...]
    ratio: float
    sigma: float
    agree: bool

    @property
    def is_wrong(self) -> bool:
        """Say whether kinds that agree with each other, two at least, all say that the rig's scale is wrong."""
        off = abs(np.log(self.ratio))
        return len(self.kinds) >= 2 and self.agree and off > SCALE_LIMIT and off > SIGNIFICANT * self.sigma


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScaleDoubt:
    """By which share lengths are doubtful, and the places (N, 3) in the world at each of which they may be right."""

    share: float
    places_m: FloatArray

    def reach_m(self, points_m: FloatArray) -> FloatArray:
        """Return how far points (M, 3) may lie elsewhere (M,), whether the rig's scale is wrong or the survey's."""
        away = np.linalg.norm(points_m[:, None, :] - self.places_m, axis=2)
        reach: FloatArray = self.share * away.max(axis=1, initial=0.0)
        return reach


def scale_doubt(placement: Placement, survey: Sequence[SurveyedMarker], share: float) -> ScaleDoubt | None:
    """Return what a doubt of lengths means for a visit that is placed: by the markers it saw, else where it stood."""
    if share <= 0.0 or not placement.stations:
        return None
    used = {marker for one in placement.stations for marker in one.pose.markers_used}
    places = [marker.corners_m.mean(axis=0) for marker in survey if marker.marker_id in used]
    eyes = [one.pose.world_from_left[:3, 3] for one in placement.stations]
    return ScaleDoubt(share=share, places_m=frozen(np.array(places or eyes)))


def judge_scale(
    evidence: Sequence[ScaleEvidence], diameter_m: float | None, size_m: float | None, survey: Sequence[SurveyedMarker]
) -> ScaleVerdict | None:
    """Compare a visit's lengths with the given and surveyed ones; None where there are none."""
    kinds = [
        kind
        for kind in (_diameters(evidence, diameter_m), _sizes(evidence, size_m), _distances(evidence, survey))
        if kind is not None
    ]
    if not kinds:
        return None
    logs = np.log([kind.ratio for kind in kinds])
    weights = np.array([kind.sigma**-2 for kind in kinds])
    middle = float(weights @ logs / weights.sum())
    sigma = float(weights.sum() ** -0.5)
    agree = all(_agrees(k, logs, weights) for k in range(len(logs)))
    return ScaleVerdict(kinds=tuple(kinds), ratio=float(np.exp(middle)), sigma=sigma, agree=agree)


def _agrees(k: int, logs: FloatArray, weights: FloatArray) -> bool:
    """Say whether one kind says what the others say together: both may err, and loosely known ones by much."""
    others = np.arange(len(logs)) != k
    if not others.any():
        return True
    away = logs[k] - weights[others] @ logs[others] / weights[others].sum()
    return bool(abs(away) < 3.0 * np.sqrt(1.0 / weights[k] + 1.0 / weights[others].sum()))


def scale_rejection(subject: Subject, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None) -> Rejection:
    """Return why nothing can be measured with a rig of the wrong scale, and the mistake that it looks like."""
    values = _values(verdict) | _asked(verdict.ratio, rig.baseline_m, square_m) | {"limit_share": SCALE_LIMIT}
    return rejected(Reason.SCALE_WRONG, subject, **values)


def doubt_rejection(
    subject: Subject, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None = None
) -> Rejection | None:
    """Return a warning where known lengths come out wrong by less, or contradict each other; None where all is well."""
    if verdict.is_wrong:
        return None
    return _doubt_of_kinds(subject, verdict, rig, square_m) or _doubt_of_all(subject, verdict, rig, square_m)


def _doubt_of_all(subject: Subject, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None) -> Rejection | None:
    """Warn where no kind stands out, but all of them together can't come out as they do by chance."""
    off, limit = float(np.log(verdict.ratio)), max(POOLED_LIMIT, POOLED_SIGNIFICANT * verdict.sigma)
    if not verdict.agree or abs(off) <= limit:
        return None
    values = _values(verdict) | _asked(verdict.ratio, rig.baseline_m, square_m) | {"limit_share": limit}
    return rejected(Reason.LENGTHS_DOUBTFUL_TOGETHER, subject, **values)


def _doubt_of_kinds(
    subject: Subject, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None
) -> Rejection | None:
    """Warn of kinds that come out wrong; where none of the others says otherwise, with what they ask of the rig."""
    allowed = [max(DOUBT_LIMIT, DOUBT_SIGNIFICANT * kind.sigma) for kind in verdict.kinds]
    off = [bool(abs(np.log(kind.ratio)) > limit) for kind, limit in zip(verdict.kinds, allowed, strict=True)]
    if not any(off):
        return None
    wrong = tuple(str(kind.kind) for kind, is_off in zip(verdict.kinds, off, strict=True) if is_off)
    values = _values(verdict) | {"wrong": wrong, "limit_shares": tuple(allowed)}
    if verdict.agree:
        values |= _asked(verdict.ratio, rig.baseline_m, square_m)
    return rejected(Reason.LENGTHS_DOUBTFUL, subject, **values)


def _values(verdict: ScaleVerdict) -> dict[str, Value]:
    """Return what each kind of length says, and all of them together: measured over known."""
    return {
        "ratio": verdict.ratio,
        "sigma": verdict.sigma,
        "kinds": tuple(str(kind.kind) for kind in verdict.kinds),
        "ratios": tuple(kind.ratio for kind in verdict.kinds),
        "sigmas": tuple(kind.sigma for kind in verdict.kinds),
    }


def _asked(ratio: float, baseline_m: float, square_m: float | None) -> dict[str, Value]:
    """Return what the lengths ask of the baseline, or of the board's squares, and the unit that it looks like."""
    values: dict[str, Value] = {"baseline_m": baseline_m, "asked_baseline_m": baseline_m / ratio}
    for factor, unit in UNIT_MISTAKES.items():
        if abs(ratio / factor - 1.0) < _UNIT_SHARE:
            return values | {"unit": unit}
    if square_m is not None:
        values |= {"square_m": square_m, "asked_square_m": square_m / ratio}
    return values


def _diameters(evidence: Sequence[ScaleEvidence], diameter_m: float | None) -> ScaleOfKind | None:
    found = [one.target_diameter_m for one in evidence if one.target_diameter_m > 0.0]
    if diameter_m is None or not found:
        return None
    return _kind(KnownLength.TARGET_DIAMETER, np.array(found) / diameter_m, np.full(len(found), TARGET_SIGMA))


def _sizes(evidence: Sequence[ScaleEvidence], size_m: float | None) -> ScaleOfKind | None:
    if size_m is None:
        return None
    ratios, sigmas = [], []
    for one in evidence:
        for corners, sigma in zip(one.marker_corners_m, one.marker_sigma, strict=True):
            ratios.append(float(np.mean(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))) / size_m)
            sigmas.append(float(sigma))
    return _kind(KnownLength.MARKER_SIZE, np.array(ratios), np.array(sigmas)) if ratios else None


def _distances(evidence: Sequence[ScaleEvidence], survey: Sequence[SurveyedMarker]) -> ScaleOfKind | None:
    """Pool the distances of each two markers over the stations first: what the survey errs by there is one error."""
    known = {marker.marker_id: marker for marker in survey}
    seen: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for one in evidence:
        for i, j, true, own_sigma_m in distances_seen(one, survey):
            measured = _apart_m(one.marker_corners_m[i], one.marker_corners_m[j])
            ids = one.marker_ids[i], one.marker_ids[j]
            seen.setdefault(ids, []).append((measured / true, own_sigma_m / true))
    if not seen:
        return None
    ratios, sigmas = [], []
    for (a, b), found in seen.items():
        ratio, own = np.array(found).T
        weights = 1.0 / np.maximum(own, 1e-6) ** 2
        true = _apart_m(known[a].corners_m, known[b].corners_m)
        surveyed = float(np.hypot(known[a].sigma_m, known[b].sigma_m)) / true
        ratios.append(float(np.exp(weighted_median(np.log(ratio), weights))))
        sigmas.append(float(np.hypot(_OF_MEDIAN * weights.sum() ** -0.5, surveyed)))
    return _kind(KnownLength.MARKER_DISTANCES, np.array(ratios), np.array(sigmas))


def distances_seen(one: ScaleEvidence, survey: Sequence[SurveyedMarker]) -> list[tuple[int, int, float, float]]:
    """Return the surveyed distances that a station shows: two markers by place, the true metres, the photos' sigma.

    Each marker with the next one: all pairs would repeat errors.
    """
    known = {marker.marker_id: marker for marker in survey}
    there = [i for i, marker_id in enumerate(one.marker_ids) if marker_id in known]
    found = []
    for i, j in pairwise(there):
        true_m = _apart_m(known[one.marker_ids[i]].corners_m, known[one.marker_ids[j]].corners_m)
        if true_m >= _LEAST_SPACING_M:
            sigma_m = _distance_sigma_m(one.marker_corners_m[[i, j]].mean(axis=1), one.marker_sigma[[i, j]])
            found.append((i, j, true_m, sigma_m))
    return found


def _distance_sigma_m(centres_m: FloatArray, relative: FloatArray) -> float:
    """Return what the distance of two markers (2, 3) errs by: each errs along its ray, and the distance by its part."""
    ranges = np.linalg.norm(centres_m, axis=1)
    along = (centres_m[1] - centres_m[0]) / np.linalg.norm(centres_m[1] - centres_m[0])
    share = np.hypot(centres_m @ along / ranges, _ACROSS_RAY)
    return float(np.linalg.norm(ranges * relative * share))


def _apart_m(corners_m: FloatArray, others_m: FloatArray) -> float:
    return float(np.linalg.norm(corners_m.mean(axis=0) - others_m.mean(axis=0)))


def _kind(kind: KnownLength, ratios: FloatArray, sigmas: FloatArray) -> ScaleOfKind:
    """Pool one kind by the median, weighted, so that one wrong print or survey row doesn't carry it."""
    logs, weights = np.log(ratios), 1.0 / np.maximum(sigmas, 1e-6) ** 2
    middle = weighted_median(logs, weights)
    scatter = robust_sigma((logs - middle) * np.sqrt(weights))  # 1 where sigmas hold
    sigma = float(np.hypot(_OF_MEDIAN * max(scatter, 1.0) * weights.sum() ** -0.5, KNOWN_TO[kind]))
    return ScaleOfKind(kind=kind, ratio=float(np.exp(middle)), sigma=sigma)
