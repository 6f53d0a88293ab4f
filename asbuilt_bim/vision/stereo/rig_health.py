"""Does the rig still stand as it was calibrated? Judged from the photos themselves, pooled over a visit.

Never by the mean vertical residual: a yaw of 0.2 degrees moves it by a fifth of a pixel and areas by 16 %. Judged is
the fitted correction: what it does to an area at 5 m and to the rows, against its sigma.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from asbuilt_bim.camera.photo.overlap import PairMatches
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import rig_numbers
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.vision.stereo.rig_fit import (
    PRIOR_RAD,
    STEP_RAD,
    RigFit,
    corrected_rig,
    fit_rig,
    relative_units,
    row_effect_px,
    worst_area_effect,
)
from asbuilt_bim.vision.stereo.rig_matches import MATCHES_PER_MEASUREMENT, levelled_matches

AREA_LIMIT = 0.02
"""Of an area at 5 m: what the rig alone may cost; the whole error is to stay within about 3 %."""
ROWS_LIMIT_PX = 1.0
"""Dense stereo looks along rows: from about a pixel apart it misses fine texture and bends edges."""
ROWS_DOUBT_PX = 0.5
SIGNIFICANT = 3.0
"""In sigmas: an untouched rig passes it once in several hundred visits."""
LEAST_MATCHES = 60
"""Fewer leave yaw open by more than any limit, and a wrong pair of photos may have as many by chance."""
MOST_TURN_RAD = np.deg2rad(5.0)
"""A rig turned further is bent for anyone to see: such photos are no pair, and the check of the pair says why."""
_DIFFERENT = 4.0  # in sigmas, of the best of several places to part a visit
_ROUNDS = 3
_LEVEL_PX = 0.1  # rows further apart than this are matched again, levelled: following is best at whole pixels

State = Literal["sound", "doubtful", "knocked", "undetermined"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationHealth:
    """What one station's matches say of its rig."""

    station: str
    fit: RigFit
    camera: RectifiedCamera  # of the rig that the fit corrects


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigVerdict:
    """What the matches of some stations of a visit say together; `covariance` (5, 5) counts the calibration's in.

    `area_effect` is the relative error of an area at 5 m (the worst place of the frame) with the calibration as it is.
    `rows_px` is how far apart rows lie there. `noise` (5, 5) is the covariance without the calibration's part.
    """

    stations: tuple[str, ...]
    state: State
    correction_rad: FloatArray  # (5,)
    covariance: FloatArray
    noise: FloatArray
    from_rig: FloatArray  # (5, P): what errors of the calibrated numbers put into the correction
    from_lens: FloatArray  # (5, 24): what a pixel left by the lenses in each cell of the frame puts into it
    area_effect: float
    area_sigma: float
    rows_px: float
    station_rows_px: tuple[float, ...]  # of each station, the median of its matches
    matches: int


def station_health(pair: RectifiedPair, coarse: PairMatches, rig: StereoRig) -> StationHealth | None:
    """Fit how the right camera stands now to a station's matches; None where they are too few to say anything."""
    fit = None
    for _ in range(_ROUNDS):
        before = np.zeros(5) if fit is None else fit.correction_rad
        matches = levelled_matches(pair, coarse, before)
        if len(matches.left_px) < LEAST_MATCHES:
            return None
        fit = fit_rig(matches.left_px, matches.right_px, pair.camera, rig, MATCHES_PER_MEASUREMENT)
        if fit is None or fit.matches < max(LEAST_MATCHES, 0.4 * len(matches.left_px)):
            return None
        if np.abs(fit.correction_rad[:3]).max() > MOST_TURN_RAD:
            return None
        if row_effect_px(fit.correction_rad - before, pair.camera) < _LEVEL_PX:
            break
    return None if fit is None else StationHealth(station=pair.name, fit=fit, camera=pair.camera)


def judge(healths: Sequence[StationHealth], rig: StereoRig, significant: float = SIGNIFICANT) -> RigVerdict:
    """Pool stations (at least one) of one rig and say whether it stands as calibrated.

    Stations that scatter more than their matches explain widen the sigma in proportion (Birge 1932).
    """
    prior = np.eye(5) / PRIOR_RAD**2
    total = prior + sum((h.fit.information for h in healths), np.zeros((5, 5)))
    noise = np.linalg.inv(total)
    correction = noise @ sum(((h.fit.information + prior) @ h.fit.correction_rad for h in healths), np.zeros(5))
    apart = [h.fit.correction_rad - correction for h in healths]
    scatter = sum(float(a @ h.fit.information @ a) for a, h in zip(apart, healths, strict=True))
    freedom = 5 * (len(healths) - 1)
    noise = noise * max(1.0, scatter / freedom if freedom else 1.0)
    from_stations = sum((h.fit.from_rig for h in healths), np.zeros((5, len(rig.covariance))))
    from_rig = np.linalg.inv(total) @ from_stations / relative_units(rig)
    from_lens = np.linalg.inv(total) @ sum((h.fit.from_lens for h in healths), np.zeros((5, 1)))
    covariance = noise + _calibration(from_rig, from_lens, rig)
    if not np.any(rig.covariance):
        covariance = covariance + np.diag(np.square(rig.width.turn_rad))
    camera = healths[0].camera
    area, area_sigma = worst_area_effect(correction, covariance, camera)
    rows = row_effect_px(correction, camera)
    return RigVerdict(
        stations=tuple(h.station for h in healths),
        state=_state(area, area_sigma, rows, _rows_sigma(correction, covariance, camera), significant),
        correction_rad=frozen(correction), covariance=frozen(covariance), noise=frozen(noise),
        from_rig=frozen(from_rig), from_lens=frozen(from_lens), area_effect=area, area_sigma=area_sigma, rows_px=rows,
        station_rows_px=tuple(h.fit.rows_px for h in healths), matches=sum(h.fit.matches for h in healths),
    )  # fmt: skip


def judge_visit(healths: Sequence[StationHealth], rig: StereoRig) -> tuple[RigVerdict, ...]:
    """Judge a visit's stations, in the order in which they were taken, in stretches between which the rig was knocked.

    One verdict where nothing happened on the way. A stretch ends where the stations before and after differ by half the
    area limit or more than half the limit of rows. The difference must also be over 4 of its sigmas.
    """
    if not healths:
        return ()
    cuts = [(_difference(healths[:k], healths[k:], rig), k) for k in range(1, len(healths))]
    worst, k = max(cuts, default=(0.0, 0))
    if worst <= _DIFFERENT:
        return (judge(healths, rig),)
    return (*judge_visit(healths[:k], rig), *judge_visit(healths[k:], rig))


def levelled(verdict: RigVerdict, camera: RectifiedCamera) -> RigVerdict:
    """Return the verdict with what rows show alone: pitch and roll, given that the rest stands as calibrated.

    A yaw hides in the rows: what the lenses leave there looks like one, and would ruin every distance.
    """
    free, held = [0, 2], [1, 3, 4]
    keep = np.zeros((5, 5))
    keep[np.ix_(free, free)] = np.eye(2)
    keep[np.ix_(free, held)] = -verdict.noise[np.ix_(free, held)] @ np.linalg.inv(verdict.noise[np.ix_(held, held)])
    correction, covariance = keep @ verdict.correction_rad, keep @ verdict.covariance @ keep.T
    area, area_sigma = worst_area_effect(correction, covariance, camera)
    return replace(
        verdict, correction_rad=frozen(correction), covariance=frozen(covariance),
        noise=frozen(keep @ verdict.noise @ keep.T), from_rig=frozen(keep @ verdict.from_rig),
        from_lens=frozen(keep @ verdict.from_lens), area_effect=area, area_sigma=area_sigma,
        rows_px=row_effect_px(correction, camera),
    )  # fmt: skip


def refined_rig(rig: StereoRig, verdict: RigVerdict, camera: RectifiedCamera) -> StereoRig:
    """Return the rig as the verdict's matches show it; the baseline's length and both lenses stay as calibrated.

    Its covariance is the calibration's where matches can't tell, and the matches' where they can. So are the angles to
    which a rig without one is trusted.
    """
    found = corrected_rig(rig, camera, verdict.correction_rad)
    if not np.any(rig.covariance):
        lens = rig.lens_left_px**2 * verdict.from_lens @ verdict.from_lens.T
        own = np.sqrt(np.diag(verdict.noise + lens))
        pitch, yaw, roll, down, ahead = np.where(own > 0.0, own, rig.width.turn_rad).tolist()
        return replace(found, width=replace(rig.width, turn_rad=(pitch, yaw, roll, down, ahead)))
    steps = []
    for k in range(5):
        step = np.zeros(5)
        step[k] = STEP_RAD
        moved = corrected_rig(rig, camera, verdict.correction_rad + step)
        steps.append((rig_numbers(moved) - rig_numbers(found)) / STEP_RAD)
    by_correction = np.stack(steps, axis=-1)
    left_open = np.eye(len(rig.covariance)) - by_correction @ verdict.from_rig
    covariance = left_open @ rig.covariance @ left_open.T + by_correction @ verdict.noise @ by_correction.T
    return replace(found, covariance=frozen(covariance))


def _state(area: float, area_sigma: float, rows_px: float, rows_sigma_px: float, significant: float) -> State:
    if rows_px > ROWS_LIMIT_PX and rows_px > significant * rows_sigma_px:
        return "knocked"
    if abs(area) > AREA_LIMIT and abs(area) > significant * area_sigma:
        return "knocked"
    if area_sigma > AREA_LIMIT:
        return "undetermined"
    is_doubtful = abs(area) > significant * area_sigma or rows_px > max(ROWS_DOUBT_PX, significant * rows_sigma_px)
    return "doubtful" if is_doubtful else "sound"


def _calibration(from_rig: FloatArray, from_lens: FloatArray, rig: StereoRig) -> FloatArray:
    """Return what the calibration's errors put into the correction (5, 5); a known covariance has its lenses in it."""
    lenses: FloatArray = rig.lens_left_px**2 * from_lens @ from_lens.T
    return lenses + from_rig @ rig.covariance @ from_rig.T if np.any(rig.covariance) else lenses


def _rows_sigma(correction: FloatArray, covariance: FloatArray, camera: RectifiedCamera) -> float:
    rows = row_effect_px(correction, camera)
    slopes = [(row_effect_px(correction + step, camera) - rows) / STEP_RAD for step in STEP_RAD * np.eye(5)]
    return float(np.sqrt(max(np.array(slopes) @ covariance @ np.array(slopes), 0.0)))


def _difference(before: Sequence[StationHealth], after: Sequence[StationHealth], rig: StereoRig) -> float:
    """Return by how many sigmas two groups of stations differ, 0 where it is too little to matter.

    The calibration's errors are common to both; only what they put into one group and not the other counts.
    """
    one, two = judge(before, rig), judge(after, rig)
    camera = before[0].camera
    apart = two.correction_rad - one.correction_rad
    calibration = _calibration(two.from_rig - one.from_rig, two.from_lens - one.from_lens, rig)
    covariance = one.noise + two.noise + calibration
    area, area_sigma = worst_area_effect(apart, covariance, camera)
    rows, rows_sigma = row_effect_px(apart, camera), _rows_sigma(apart, covariance, camera)
    by_area = abs(area) / area_sigma if abs(area) > 0.5 * AREA_LIMIT else 0.0
    by_rows = rows / rows_sigma if rows > ROWS_DOUBT_PX else 0.0
    return max(by_area, by_rows)
