"""The page that says whether a calibration is to be trusted: one file, without scripts and without requests."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import AreaEffect, area_effect
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.calibration.check_length import SCALE_LIMIT, LengthCheck
from asbuilt_bim.report.page.calibration_drawings import area_maps, arrow_scale_px, frame_drawing, view_bars
from asbuilt_bim.report.page.environment import environment
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.calibration_sources import (
    SOURCE_WORDS,
    TAG_SOURCE_WORDS,
    advice_words,
    dominating,
    place_words,
)
from asbuilt_bim.report.wording.reasons import words_of

GOOD_AREA, USABLE_AREA = 0.01, 0.03
"""Of an area at 5 m in the frame's worst place, one sigma: a third of what areas are wanted to, and all of it."""

Grade = Literal["good", "usable", "doubtful"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What to make of a calibration, in words: a grade, a sentence, and the reasons for care."""

    grade: Grade
    sentence: str
    reasons: tuple[str, ...]


def verdict(calibration: Calibration, effect: AreaEffect | None, checks: tuple[LengthCheck, ...]) -> Verdict:
    """Judge a calibration by what it does to an area, and by every check that gave a warning."""
    reasons = [note_words(warning) for warning in calibration.checks.warnings]
    if not checks:
        wrong = "tags of another size" if calibration.from_tags else "a board of another size"
        wrong = "points measured in another unit" if calibration.from_control_points else wrong
        reasons.append(
            f"no known length was checked: {wrong} would show in nothing here; pass --check-length, or a second board"
        )
    unsure = [check for check in checks if abs(check.off) > SCALE_LIMIT]
    reasons += [_unsure(check) for check in unsure]
    sigma, adds = _added(effect)
    if sigma > USABLE_AREA:
        sentence = f"Don't measure with this rig. {adds} (limit {100 * USABLE_AREA:g} %)."
        return Verdict(grade="doubtful", sentence=sentence, reasons=tuple(reasons))
    if calibration.checks.warnings or unsure or sigma > GOOD_AREA:
        return Verdict(grade="usable", sentence=f"Usable with care. {adds}.", reasons=tuple(reasons))
    scale = ". A known length came out right" if checks else ""
    return Verdict(grade="good", sentence=f"Good. {adds}{scale}.", reasons=tuple(reasons))


def unfit_words(calibration: Calibration, effect: AreaEffect | None) -> str:
    """Say that a run measures with a rig that isn't fit for it, and what to do; "" where it is fit."""
    sigma, adds = _added(effect)
    if sigma <= USABLE_AREA:
        return ""
    limit = f"(limit {100 * USABLE_AREA:g} %)"
    return f"the rig isn't fit to measure with: every area carries this. {adds} {limit}. {more_to_take(calibration)}"


def _added(effect: AreaEffect | None) -> tuple[float, str]:
    """Return the share that calibration adds to an area where it is worst, and the words for it."""
    if effect is None:
        return 1.0, "What calibration adds to an area isn't known"
    return effect.worst, area_words(effect)


def area_words(effect: AreaEffect) -> str:
    """Say what calibration does to an area at 5 m, in the middle of the frame and where it is worst."""
    return (
        f"Calibration adds ±{_share(effect.sigma)} to an area at 5 m in the middle of the frame, "
        f"±{_share(effect.worst)} at its worst place"
    )


def more_to_take(calibration: Calibration) -> str:
    """Say which photos or points would make a rig fit to measure with, and what else may be wrong with it."""
    if calibration.from_control_points:
        return "Measure more points, in every part of both photos and at several depths"
    wanted = "; ".join(advice_words(one) for one in calibration.advice) or "the board tilted every way, in every part"
    baseline = f"{1000 * calibration.rig.baseline_m:.0f} mm"
    return f"Take more pairs: {wanted}. If the cameras don't stand {baseline} apart, measure the board's squares again"


def _unsure(check: LengthCheck) -> str:
    off, sigma, limit = (f"{100 * share:.2f} %" for share in (check.off, check.sigma_m / check.known_m, SCALE_LIMIT))
    return (
        f"{check.what} is {off} off, and marked too unsurely (± {sigma}) to tell that from {limit}: check with a "
        "longer or a nearer one"
    )


def calibration_html(calibration: Calibration, checks: tuple[LengthCheck, ...] = ()) -> str:
    """Return the page of a calibration; `checks` are the known lengths that it was held against."""
    rig, effect = calibration.rig, area_effect(calibration.rig, calibration.by_source)
    sources = TAG_SOURCE_WORDS if calibration.from_tags else SOURCE_WORDS
    fits = calibration.corners_left, calibration.corners_right
    scale_px = arrow_scale_px(fits)
    frames = [
        frame_drawing("left", rig.left, fits[0], scale_px),
        frame_drawing("right", rig.right, fits[1], scale_px),
    ]
    templates = environment().overlay()  # the other pages' stays as it is
    templates.filters = {**templates.filters, "share": _share, "fixed": _fixed, "degrees": _degrees}
    template = templates.get_template("calibration.html.j2")
    return template.render(
        calibration=calibration,
        left_out=[words_of(rejection) for rejection in calibration.left_out],
        rig=rig,
        effect=effect,
        verdict=verdict(calibration, effect, checks),
        checks=checks,
        frames=frames,
        bars=view_bars(calibration),
        maps=() if effect is None else area_maps(effect, rig.left),
        sources=() if effect is None else tuple((sources[name], sigma) for name, sigma in effect.sources),
        dominating="" if effect is None else dominating(effect.sources, sources),
        worst_place="" if effect is None else place_words(effect.worst_place),
        advice=tuple(
            (advice_words(one, "tags" if calibration.from_tags else "board"), one.worst) for one in calibration.advice
        ),
    )


def calibration_page(calibration: Calibration, checks: tuple[LengthCheck, ...] = ()) -> bytes:
    """Return the page as the file holds it."""
    return calibration_html(calibration, checks).encode("utf-8", "replace")


def _share(value: float) -> str:
    """Write a share in per cent with two digits that count: 0.031 %, 0.31 %, 3.1 %."""
    per_cent = 100.0 * value
    digits = 1 if per_cent >= 1.0 else 2 if per_cent >= 0.1 else 3
    return f"{per_cent:.{digits}f} %"


def _fixed(value: float, digits: int = 2) -> str:
    return f"{value:.{digits}f}"


def _degrees(value: float) -> str:
    return f"{np.rad2deg(value):.0f}°"
