"""What a check on site says: each thing that was looked at, how it came out, and what to do before leaving."""

from collections.abc import Sequence

from asbuilt_bim.codes import Values
from asbuilt_bim.progress.visits.checked import Aspect, CheckedAspect, CheckedStation, CheckedVisit, Grade
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.words import Words, fill

ASPECT_NAMES: dict[Aspect, str] = {
    "photos": "sharp, exposed",
    "pair": "both eyes",
    "rig": "rig as calibrated",
    "disc": "red disc",
    "tags": "tags",
    "place": "placed",
}
GRADE_NAMES: dict[Grade, str] = {"ok": "ok", "doubtful": "doubtful", "not": "not ok", "unchecked": "not looked at"}
_SEEN: dict[Aspect, str] = {
    "photos": "blur {blur_px:.1f} px, light {stops:+.1f} stops",
    "pair": "{matches} matches",
    "rig": "rows {rows_px:.2f} px apart",
    "disc": "{range_m:.2f} m away",
    "tags": "{tags:all}",
    "place": "± {sigma_m:mm} at {ahead_m:.0f} m",
}
_UNREAD = "; in view, not read: {unread:all}"
TAKE_AGAIN = "Put that right, or take it again, before you leave."
NONE_COUNTS = "Not one station would count. Don't leave yet."


def aspect_words(aspect: CheckedAspect) -> str:
    """Return an aspect's numbers in words, "" where nothing was measured of it."""
    values: Values = aspect.values
    if not values or (aspect.aspect == "tags" and not values["tags"]):
        return "none read" if aspect.aspect == "tags" and aspect.grade != "unchecked" else ""
    unread = fill(_UNREAD, values) if values.get("unread") else ""
    return fill(_SEEN[aspect.aspect], values) + unread


def aspect_reasons(station: CheckedStation) -> tuple[Words, ...]:
    """Return why a station is not ok, the cause first, and what to do: as a run would say it."""
    return tuple(words_of(reason) for aspect in station.aspects if aspect.grade != "ok" for reason in aspect.reasons)


def verdict_words(visit: CheckedVisit) -> str:
    """Say in a sentence or two whether the site may be left, as far as the photos go."""
    count, of = visit.counting, len(visit.stations)
    if not count:
        files = f" Put the files of {_listed(visit.by_name)} right and check again." if visit.by_name else ""
        return NONE_COUNTS + files
    first = f"All {of} stations will count." if count == of else f"{count} of {of} stations will count."
    if of == 1:
        first = "The station will count."
    new = [name for name in visit.again if name not in visit.by_name]
    again = f" Put the files of {_listed(visit.by_name)} right and check again." if visit.by_name else ""
    again += f" Take {_listed(new)} again before you leave." if new else ""
    doubt = f" Look at {_listed(visit.doubtful)}: doubtful." if visit.doubtful else ""
    return f"{first}{again}{doubt}"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
