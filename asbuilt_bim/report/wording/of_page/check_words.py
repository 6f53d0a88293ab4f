"""What a check on site says: each thing that was looked at, how it came out, and what to do before leaving."""

from collections.abc import Sequence

from asbuilt_bim.codes import Values
from asbuilt_bim.progress.visits.checked import Aspect, CheckedAspect, CheckedStation, CheckedVisit, Grade
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.words import Words, fill

ASPECT_NAMES: dict[Aspect, str] = {
    "photos": "sharp, exposed",
    "day": "its day",
    "pair": "both eyes",
    "rig": "rig as calibrated",
    "disc": "red disc",
    "tags": "tags",
    "place": "placed",
}
GRADE_NAMES: dict[Grade, str] = {"ok": "ok", "doubtful": "doubtful", "not": "not ok", "unchecked": "not looked at"}
_SEEN: dict[Aspect, str] = {
    "photos": "blur {blur_px:.1f} px, light {stops:+.1f} stops",
    "day": "{day}",
    "pair": "{matches} matches",
    "rig": "rows {rows_px:.2f} px apart",
    "disc": "{range_m:.2f} m away",
    "tags": "{tags:all}",
    "place": "± {sigma_m:mm} at {ahead_m:.0f} m",
}
_NONE: dict[Aspect, str] = {"tags": "none read", "day": "no photo says"}
_UNREAD = "; in view, not read: {unread:all}"
TAKE_AGAIN = "Put that right, or take it again, before you leave."
NONE_COUNTS = "Not one station would count."
STAY = " Don't leave yet."
FILE_WRONG = "wrong in the project file"
CORRECT_FILE = "The photos are fine. Correct the project file, and check again."


def grade_words(aspect: CheckedAspect) -> str:
    """Return an aspect's grade in words, and whose mistake it is."""
    return FILE_WRONG if aspect.grade == "not" and aspect.by_file else GRADE_NAMES[aspect.grade]


def station_words(station: CheckedStation, visit: CheckedVisit) -> str:
    """Say whether a station counts."""
    if not station.counts:
        return "will not count"
    if visit.other_visits is not None:
        return "counts once its visit is written" if station.grade == "ok" else "doubtful, its visit isn't written"
    return "will count" if station.grade == "ok" else "counts, doubtful"


def remedy_words(station: CheckedStation) -> str:
    """Say what to do with a station that doesn't count."""
    return CORRECT_FILE if station.only_file_wrong else TAKE_AGAIN


def aspect_words(aspect: CheckedAspect) -> str:
    """Return an aspect's numbers in words, "" where nothing was measured of it."""
    values: Values = aspect.values
    if not values or (aspect.aspect == "tags" and not values["tags"]):
        return _NONE.get(aspect.aspect, "") if aspect.grade != "unchecked" else ""
    unread = fill(_UNREAD, values) if values.get("unread") else ""
    return fill(_SEEN[aspect.aspect], values) + unread


def aspect_reasons(station: CheckedStation) -> tuple[Words, ...]:
    """Return why a station is not ok, the cause first, and what to do: as a run would say it."""
    return tuple(words_of(reason) for aspect in station.aspects if aspect.grade != "ok" for reason in aspect.reasons)


def verdict_words(visit: CheckedVisit) -> str:
    """Say in a sentence or two whether the site may be left, as far as the photos go."""
    count, of = visit.counting, len(visit.stations)
    new = [name for name in visit.again if name not in {*visit.by_name, *visit.by_file}]
    again = f" Put the files of {_listed(visit.by_name)} right and check again." if visit.by_name else ""
    if visit.by_file:
        fine = "Your photos" if len(visit.by_file) == of else f"The photos of {_listed(visit.by_file)}"
        again += f" {fine} are fine: correct the project file and check again."
    if not count:
        return NONE_COUNTS + (STAY if new or not again else "") + again
    first = f"All {of} stations" if count == of else f"{count} of {of} stations"
    if of == 1:
        first = "The station"
    again += f" Take {_listed(new)} again before you leave." if new else ""
    doubt = f" Look at {_listed(visit.doubtful)}: doubtful." if visit.doubtful else ""
    return f"{first} will count{_once_written(visit)}.{again}{doubt}"


def _once_written(visit: CheckedVisit) -> str:
    """Say which visit the project file lacks: a run leaves out photos of another day than their visit's."""
    if visit.other_visits is None:
        return ""
    days = [day.isoformat() for day in visit.other_visits]
    has = f"has {_listed(days)}" if days else "has none yet"
    return (
        f" once the project file has a visit of {visit.day.isoformat()}. It {has}. "
        "Write that visit, or correct its date: a run leaves out photos of another day"
    )


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
