"""A rig from photos of tags of known size and no board at all, where there are enough of them."""

from collections.abc import Mapping, Sequence

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust, rms_px
from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, AreaEffect, area_effect
from asbuilt_bim.camera.calibration.calibrate import Calibration, ViewFit, rig_of_adjustment, view_fit
from asbuilt_bim.camera.calibration.checks import (
    Checks,
    corner_fits,
    refuse_impossible,
    scale_sigmas,
    share_covered,
    warning,
)
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, right_from_left_of
from asbuilt_bim.camera.calibration.photo_advice import photo_advice
from asbuilt_bim.camera.calibration.tag_sigma import tag_sigma
from asbuilt_bim.camera.calibration.tag_start import adjust_tags, start_tags
from asbuilt_bim.camera.calibration.tags import Tag, TagSighting, tag_views
from asbuilt_bim.camera.calibration.zhang import bad_view_limit_px, bad_views
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import rig_problems
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.codes import Note, Reason, SubjectKind, about
from asbuilt_bim.errors import CalibrationError, Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray

FEWEST_SIGHTINGS = 12
"""Each says ten things beyond its own pose: 120 for the 24 numbers of a rig, five times over."""
MOST_AREA = 0.03
"""Of 1 m2 at 5 m in the frame's worst place, one sigma: what areas are wanted to. Beyond, the page says of any rig
not to measure with it; one of tags isn't made."""
_FOLDS = 3
_AT_ONCE = 5  # sightings that one piece of advice asks for: a station shows several tags
_LOW_COVERAGE, _LARGE_HOLD_OUT, _LARGE_LENGTH_ERROR = 0.6, 1.5, 0.005  # as of boards
_WORST = 0.5  # of the worst's misfit: these go at once
_TILT_RAD, _NEAR_AND_FAR = np.deg2rad(20.0), 2.0  # what is asked for where it isn't enough; it decides nothing
_ASK = "take more pairs, with more tags in view, near and far, tilted, and in every part of the frame"


def rig_from_tags(
    sightings: Sequence[TagSighting],
    size: tuple[int, int],
    tag: Tag,
    lens: LensModel = "five",
    already_out: Sequence[Rejection] = (),
) -> Calibration:
    """Calibrate both cameras from tags in pairs of photos of `size` (width, height); the cameras have no names yet.

    The adjustment is that of boards: a tag is a small one, of four corners, each sighting with a pose of its own. So
    tags may be moved between the photos. A sighting that doesn't fit the others is left out by name.

    Raises: CalibrationError where there are too few, and where what they leave open makes an area at 5 m too unsure;
    with what is there, and what is missing.
    """
    left_out = list(already_out)
    views = tag_views(sightings, tag)
    pairs = {one.name: one.pair for one in sightings}
    _require_enough(views, pairs, left_out)
    try:
        shared, poses = start_tags(views, size, lens)
        adjusted, views = _without_bad(adjust_tags(shared, poses, views), views, pairs, left_out)
        refuse_impossible(
            right_from_left_of(adjusted.shared), f"tags of {tag.size_m:g} m", "give the tags' size in metres"
        )
        sigma = tag_sigma(adjusted, views, [pairs[view.name] for view in views], tag, size)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"calibration: {len(views)} sightings of tags leave the rig undetermined ({error}); {_ASK}", left_out
        ) from error
    rig = rig_of_adjustment(adjusted, size, sigma.covariance, len(views))
    problems = rig_problems(rig)
    shown = tuple(view_fit(*one) for one in zip(views, adjusted.poses, adjusted.residuals, strict=True))
    distances = [view.distance_m for view in shown]
    checks = _checks(views, adjusted, rig, tag)
    effect = None if problems else area_effect(rig, sigma.by_source)
    if problems or effect is None or not effect.worst <= MOST_AREA:
        raise CalibrationError(_missing(len({pairs[view.name] for view in views}), shown, checks, effect), left_out)
    near, usual = (float(one) for one in np.quantile(distances, [0.1, 0.5]))
    fits = corner_fits(views, adjusted)
    return Calibration(
        rig=rig, views=shown, left_out=tuple(left_out), checks=checks, corners_left=fits[0], corners_right=fits[1],
        by_source=sigma.by_source, corner_errors=sigma.errors, from_tags=True,
        advice=photo_advice(adjusted.shared, rig, tag, sigma, (near, usual), times=_AT_ONCE),
    )  # fmt: skip


def _require_enough(views: Sequence[BoardView], pairs: Mapping[str, str], left_out: Sequence[Rejection]) -> None:
    """Refuse to calibrate from fewer than `FEWEST_SIGHTINGS`.

    Raises: CalibrationError with what became of the others as its `rejections`.
    """
    if len(views) < FEWEST_SIGHTINGS:
        count = len({pairs[view.name] for view in views})
        raise CalibrationError(
            f"calibration: {len(views)} sightings of a tag in both photos, in {count} pairs; at least "
            f"{FEWEST_SIGHTINGS} are needed: {_ASK}",
            left_out,
        )


def _missing(pairs: int, shown: Sequence[ViewFit], checks: Checks, effect: AreaEffect | None) -> str:
    """Say what is there, what it leaves open, and what would help."""
    distances, tilts = [view.distance_m for view in shown], np.array([view.tilt_rad for view in shown])
    covered = min(checks.coverage_left, checks.coverage_right)
    leaves = "the lens isn't held at all" if effect is None else (
        f"they leave 1 m2 at {DISTANCE_M:g} m open to {100 * effect.worst:.1f} % (limit {100 * MOST_AREA:g} %)"
    )  # fmt: skip
    wanted = []
    if covered < _LOW_COVERAGE:
        wanted.append(f"tags in the rest of the frame (they cover {covered:.0%} of it, {_LOW_COVERAGE:.0%} do)")
    if max(distances) < _NEAR_AND_FAR * min(distances):
        wanted.append(f"nearer and further tags (these are {min(distances):.1f} to {max(distances):.1f} m away)")
    if np.quantile(tilts, 0.75) < _TILT_RAD:
        wanted.append(
            f"tags seen from the side (three quarters here are tilted by under {np.rad2deg(_TILT_RAD):.0f} degrees)"
        )
    wanted.append("more pairs, and tags near enough to be large")
    return (
        f"calibration: {len(shown)} sightings of tags in {pairs} pairs are not enough for a rig: {leaves}. "
        f"Missing: {'; '.join(wanted)}"
    )


def _without_bad(
    adjusted: Adjustment, views: list[BoardView], pairs: Mapping[str, str], left_out: list[Rejection]
) -> tuple[Adjustment, list[BoardView]]:
    """Leave out the sightings that fit far worse than the median one, and adjust again, until none is left out.

    The worst first: few tags hold a rig, and a wrong one drags its neighbours along.
    """
    while True:
        rms = np.array([rms_px(residual) for residual in adjusted.residuals])
        bad = bad_views(rms)
        if not bad.any():
            return adjusted, views
        limit_px = bad_view_limit_px(rms)
        bad &= rms > _WORST * rms.max()
        left_out += [
            rejected(Reason.TAG_MISFIT, about(SubjectKind.BOARD_PAIR, view.name), rms_px=float(one), limit_px=limit_px)
            for view, one, is_bad in zip(views, rms, bad, strict=True)
            if is_bad
        ]
        views = [view for view, is_bad in zip(views, bad, strict=True) if not is_bad]
        _require_enough(views, pairs, left_out)
        adjusted = adjust_tags(adjusted.shared, adjusted.poses[~bad], views)


def _checks(views: list[BoardView], adjusted: Adjustment, rig: StereoRig, tag: Tag) -> Checks:
    """Judge by sightings kept back, the tags' size there, and the sigma of focal length and baseline."""
    size = rig.left.width_px, rig.left.height_px
    left, right = (
        share_covered(np.concatenate(px), size) for px in ([v.left_px for v in views], [v.right_px for v in views])
    )
    hold_out, length = _hold_out(views, adjusted, size, tag)
    focal, baseline, _ = scale_sigmas(rig)
    warnings: list[Note] = []
    if min(left, right) < _LOW_COVERAGE:
        warnings.append(warning(Reason.TAGS_COVERAGE, {"share": min(left, right)}))
    if hold_out > max(_LARGE_HOLD_OUT * adjusted.rms_px, 0.3):
        warnings.append(warning(Reason.CALIBRATION_HOLD_OUT, {"hold_out_px": hold_out, "rms_px": adjusted.rms_px}))
    if length > _LARGE_LENGTH_ERROR:
        warnings.append(warning(Reason.TAGS_LENGTH, {"share": length}))
    return Checks(
        coverage_left=left, coverage_right=right, hold_out_rms_px=hold_out, length_error=length,
        focal_sigma_px=focal, baseline_sigma_m=baseline, lens_left_px=0.0, warnings=tuple(warnings),
    )  # fmt: skip


def _hold_out(views: list[BoardView], adjusted: Adjustment, size: tuple[int, int], tag: Tag) -> tuple[float, float]:
    """Return the rms in pixels of sightings kept back, each with its own pose; and how far off their sides are.

    The sides are triangulated, and the median counts: one small tag's errs by more than the rig.
    """
    misses: list[FloatArray] = []
    sides: list[float] = []
    none = np.zeros(len(adjusted.shared), dtype=bool)
    for fold in range(_FOLDS):
        inside = [i for i in range(len(views)) if i % _FOLDS != fold]
        outside = [i for i in range(len(views)) if i % _FOLDS == fold]
        fitted = adjust(adjusted.shared, adjusted.poses[inside], [views[i] for i in inside])
        kept_back = adjust(fitted.shared, adjusted.poses[outside], [views[i] for i in outside], free=none)
        misses += list(kept_back.residuals)
        left, right = camera_of(fitted.shared, 0, size), camera_of(fitted.shared, 1, size)
        for i in outside:
            met = triangulate(left, right, right_from_left_of(fitted.shared), views[i].left_px, views[i].right_px)
            sides.append(float(np.mean(np.linalg.norm(np.roll(met, -1, axis=0) - met, axis=1))) / tag.size_m)
    known = [side for side in sides if np.isfinite(side)]
    return rms_px(np.concatenate(misses)), abs(float(np.median(known)) - 1.0) if known else 1.0
