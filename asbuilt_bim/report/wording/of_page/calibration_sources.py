"""Sentences on what a calibration's uncertainty comes from, and on the photos that would help."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from asbuilt_bim.camera.calibration.photo_advice import PhotoAdvice

SOURCE_WORDS = {
    "corners": "corners that err each by itself",
    "photos": "photos whose corners err together: the board or the rig moved between the two, blur, or what the lens "
    "model leaves",
    "flatness": "the board's flatness",
    "print": "the print's scale",
}
TAG_SOURCE_WORDS = {
    "corners": "corners that err each by itself, and edges that light widens all alike",
    "photos": "photos whose tags err together: the rig moved between the two, or what the lens model leaves",
    "flatness": "the tags' flatness",
    "print": "the print's scale",
}
_REMEDIES = {
    "corners": "more photos take it off",
    "photos": "fire both cameras at once, and hold everything still; more photos take it off, too",
    "flatness": "glue the print to glass or composite and give its flatness_m; tilts every way take part of it off",
    "print": "no photo takes it off: measure the print over its whole length, and give print_share",
}
_ACROSS, _DOWN = ("left", "middle", "right"), ("upper", "middle", "lower")


def dominating(sources: tuple[tuple[str, float], ...], words: Mapping[str, str] = SOURCE_WORDS) -> str:
    """Say what counts most, in the words for each, and what to do about it; "" where nothing is known."""
    if not sources:
        return ""
    name, sigma = max(sources, key=lambda one: one[1])
    total = float(np.sqrt(sum(value * value for _, value in sources)))
    share = 100.0 * (sigma / total) ** 2 if total > 0.0 else 0.0
    return f"Most of it, {share:.0f} % of the variance, comes from {words[name]}: {_REMEDIES[name]}."


def advice_words(advice: PhotoAdvice, shown: Literal["board", "tags"] = "board") -> str:
    """Say where to hold the board, or have tags, in one more pair of photos."""
    about_x, about_y = advice.tilt_rad
    tilt = "facing the rig"
    if about_x or about_y:
        side = ("lower" if about_x > 0.0 else "upper") if about_x else ("left" if about_y > 0.0 else "right")
        tilt = f"its {side} side tilted {np.rad2deg(abs(about_x or about_y)):.0f}° away"
    if shown == "tags":
        tilt = tilt.replace("its", "their")
        return f"five tags about {advice.distance_m:.1f} m away, {place_words(advice.place)}, {tilt}"
    return f"the board {advice.distance_m:.1f} m away, {place_words(advice.place)}, {tilt}"


def place_words(place: tuple[float, float]) -> str:
    """Say where in the frame a place (shares of its width and height) lies."""
    across, down = (names[min(int(share * 3.0), 2)] for names, share in zip((_ACROSS, _DOWN), place, strict=True))
    if across == down:
        return "in the middle of the left photo"
    return (
        f"at the {down} {across} of the left photo"
        if "middle" not in (across, down)
        else (f"at the {across if down == 'middle' else down} side of the left photo")
    )
