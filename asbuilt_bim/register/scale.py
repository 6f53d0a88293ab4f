"""Is the rig's scale right? A visit's known lengths against what the rig makes of them: disc, prints, distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray, weighted_median
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.print_shape import UNIT_MISTAKES

Kind = Literal["target's diameter", "markers' size", "markers' distances"]

SCALE_LIMIT = 0.03
"""Of a length, 6 % of an area: more than discs and prints are ever off by, all the same way."""
DOUBT_LIMIT, DOUBT_SIGNIFICANT = 0.015, 2.5  # it is warned of, and nothing is refused
SIGNIFICANT = 4.0
POOLED_LIMIT, POOLED_SIGNIFICANT = 0.005, 5.0
"""All known lengths together are warned of from 1 % of an area on, where chance can't explain it."""
KNOWN_TO = {"target's diameter": 0.01, "markers' size": 0.01, "markers' distances": 0.001}
"""What a length is made or surveyed to, relative; common to all of its kind, so that it doesn't average out. A survey's
own sigma is told; its scale is off by a map grid's factor (0.04 %) or a tape's sag and stretch at most."""
_TOLD_BY: dict[Kind, str] = {
    "target's diameter": "target.diameter_m",
    "markers' size": "markers.size_m",
    "markers' distances": "the survey (markers.survey)",
}
_LEAST_SPACING_M = 0.5
_UNIT_SHARE = 0.04
_ACROSS_RAY = 0.05  # a pixel is disparity / focal length as much across the ray as along it
_OF_MEDIAN = 1.2533  # its sigma over the mean's, of Gaussians
_TARGET_SIGMA = 0.01  # of one station's diameter: a tenth of a pixel on a radius of ten


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleOfKind:
    """A visit's lengths of one kind: measured over known, its sigma, and how many."""

    kind: Kind
    ratio: float
    sigma: float
    count: int


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


def judge_scale(
    evidence: Sequence[ScaleEvidence], diameter_m: float | None, size_m: float, survey: Sequence[SurveyedMarker]
) -> ScaleVerdict | None:
    """Compare a visit's lengths with the told and surveyed ones; None where there are none."""
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
    agree = bool(np.all(np.abs(logs - np.median(logs)) < 3.0 * np.array([kind.sigma for kind in kinds]) + 3.0 * sigma))
    return ScaleVerdict(kinds=tuple(kinds), ratio=float(np.exp(middle)), sigma=sigma, agree=agree)


def scale_rejection(what: str, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None) -> Rejection:
    """Return why nothing can be measured with a rig of the wrong scale, and the mistake that it looks like."""
    lengths = ", ".join(f"{kind.kind} {100 * (kind.ratio - 1):+.1f} %" for kind in verdict.kinds)
    return Rejection(
        what=what,
        reason=f"the rig's scale is wrong: lengths come out {verdict.ratio:.3f} times too large ({lengths}); "
        f"{_cause(verdict.ratio, rig.baseline_m, square_m)}",
        value=f"{100 * (verdict.ratio - 1):+.1f} %",
        limit=f"{100 * SCALE_LIMIT:g} %",
        remedy="correct it and run again",
    )


def doubt_rejection(
    what: str, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None = None
) -> Rejection | None:
    """Return a warning where known lengths come out wrong by less, or contradict each other; None where all is well."""
    if verdict.is_wrong:
        return None
    return _doubt_of_kinds(what, verdict) or _doubt_of_all(what, verdict, rig, square_m)


def _doubt_of_all(what: str, verdict: ScaleVerdict, rig: StereoRig, square_m: float | None) -> Rejection | None:
    """Warn where no kind stands out, but all of them together can't come out as they do by chance."""
    off, limit = float(np.log(verdict.ratio)), max(POOLED_LIMIT, POOLED_SIGNIFICANT * verdict.sigma)
    if not verdict.agree or abs(off) <= limit:
        return None
    than = "large" if off > 0.0 else "small"
    kinds = ", ".join(f"{k.kind} {100 * (k.ratio - 1):+.1f} %" for k in verdict.kinds)
    return Rejection(
        what=what,
        reason=f"known lengths together come out {100 * abs(verdict.ratio - 1):.2f} % too {than} "
        f"(± {100 * verdict.sigma:.2f} %; {kinds}), and so every area {100 * abs(verdict.ratio**2 - 1):.1f} % too "
        f"{than}, which its sigma doesn't hold; {_cause(verdict.ratio, rig.baseline_m, square_m)}",
        value=f"{100 * (verdict.ratio - 1):+.2f} %",
        limit=f"{100 * limit:.2f} %",
        remedy="if that is right, measure the disc and the prints, and check the survey's scale",
    )


def _doubt_of_kinds(what: str, verdict: ScaleVerdict) -> Rejection | None:
    allowed = {kind.kind: max(DOUBT_LIMIT, DOUBT_SIGNIFICANT * kind.sigma) for kind in verdict.kinds}
    off = [kind for kind in verdict.kinds if abs(np.log(kind.ratio)) > allowed[kind.kind]]
    if not off:
        return None
    named = ", ".join(f"{kind.kind} {100 * (kind.ratio - 1):+.1f} % (± {100 * kind.sigma:.1f} %)" for kind in off)
    others = ", ".join(f"{k.kind} {100 * (k.ratio - 1):+.1f} %" for k in verdict.kinds if k not in off)
    return Rejection(
        what=what,
        reason=f"known lengths come out wrong: {named}" + (f"; others don't: {others}" if others else ""),
        limit=", ".join(f"{100 * allowed[kind.kind]:.1f} %" for kind in off),
        remedy=_doubt_remedy(off, verdict),
    )


def _doubt_remedy(off: Sequence[ScaleOfKind], verdict: ScaleVerdict) -> str:
    """One kind alone against others that agree: what was told of it is wrong, and the rig isn't."""
    if len(off) == 1 and len(verdict.kinds) > 1:
        return f"the rig is right by the others: measure again and correct {_TOLD_BY[off[0].kind]}"
    return "measure the disc and the prints; if they are right, calibrate the rig again"


def _diameters(evidence: Sequence[ScaleEvidence], diameter_m: float | None) -> ScaleOfKind | None:
    found = [one.target_diameter_m for one in evidence if one.target_diameter_m > 0.0]
    if diameter_m is None or not found:
        return None
    return _kind("target's diameter", np.array(found) / diameter_m, np.full(len(found), _TARGET_SIGMA))


def _sizes(evidence: Sequence[ScaleEvidence], size_m: float) -> ScaleOfKind | None:
    ratios, sigmas = [], []
    for one in evidence:
        for corners, sigma in zip(one.marker_corners_m, one.marker_sigma, strict=True):
            ratios.append(float(np.mean(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))) / size_m)
            sigmas.append(float(sigma))
    return _kind("markers' size", np.array(ratios), np.array(sigmas)) if ratios else None


def _distances(evidence: Sequence[ScaleEvidence], survey: Sequence[SurveyedMarker]) -> ScaleOfKind | None:
    """Pool the distances of each two markers over the stations first: what the survey errs by there is one error."""
    known = {marker.marker_id: marker for marker in survey}
    seen: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for one in evidence:
        there = [i for i, marker_id in enumerate(one.marker_ids) if marker_id in known]
        for i, j in pairwise(there):  # each marker with the next one: all pairs would repeat errors
            ids = (one.marker_ids[i], one.marker_ids[j])
            true = _apart_m(known[ids[0]].corners_m, known[ids[1]].corners_m)
            if true < _LEAST_SPACING_M:
                continue
            measured = _apart_m(one.marker_corners_m[i], one.marker_corners_m[j])
            own_sigma_m = _distance_sigma_m(one.marker_corners_m[[i, j]].mean(axis=1), one.marker_sigma[[i, j]])
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
    return _kind("markers' distances", np.array(ratios), np.array(sigmas))


def _distance_sigma_m(centres_m: FloatArray, relative: FloatArray) -> float:
    """Return what the distance of two markers (2, 3) errs by: each errs along its ray, and the distance by its part."""
    ranges = np.linalg.norm(centres_m, axis=1)
    along = (centres_m[1] - centres_m[0]) / np.linalg.norm(centres_m[1] - centres_m[0])
    share = np.hypot(centres_m @ along / ranges, _ACROSS_RAY)
    return float(np.linalg.norm(ranges * relative * share))


def _apart_m(corners_m: FloatArray, others_m: FloatArray) -> float:
    return float(np.linalg.norm(corners_m.mean(axis=0) - others_m.mean(axis=0)))


def _kind(kind: Kind, ratios: FloatArray, sigmas: FloatArray) -> ScaleOfKind:
    """Pool one kind by the median, weighted, so that one wrong print or survey row doesn't carry it."""
    logs, weights = np.log(ratios), 1.0 / np.maximum(sigmas, 1e-6) ** 2
    middle = weighted_median(logs, weights)
    scatter = robust_sigma((logs - middle) * np.sqrt(weights))  # 1 where sigmas hold
    sigma = float(np.hypot(_OF_MEDIAN * max(scatter, 1.0) * weights.sum() ** -0.5, KNOWN_TO[kind]))
    return ScaleOfKind(kind=kind, ratio=float(np.exp(middle)), sigma=sigma, count=len(logs))


def _cause(ratio: float, baseline_m: float, square_m: float | None) -> str:
    """Say what mistake a ratio looks like: a unit, a board's square, or a baseline."""
    for factor, unit in UNIT_MISTAKES.items():
        if abs(ratio / factor - 1.0) < _UNIT_SHARE:
            return f"its baseline of {baseline_m:.4g} m looks like {unit}: it would be {baseline_m / ratio:.4g} m"
    if square_m is not None:
        return (
            f"rig.boards.square_m is {square_m:g} m, and these lengths ask for {square_m / ratio:.4g} m: measure the "
            "board's squares"
        )
    return f"its baseline is {baseline_m:.4g} m, and these lengths ask for {baseline_m / ratio:.4g} m"
