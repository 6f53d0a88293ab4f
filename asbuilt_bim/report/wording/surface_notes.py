"""Sentences on surfaces, elements and stations."""

import math
from collections.abc import Mapping, Sequence

from asbuilt_bim.codes import Note, Reason, Value
from asbuilt_bim.report.wording.template import Template, filled
from asbuilt_bim.report.wording.values import percent, plain

HUES = (
    (30.0, "red"), (65.0, "red-brown"), (82.0, "yellow-brown"), (105.0, "yellow"), (190.0, "green"), (300.0, "blue"),
    (345.0, "purple"), (360.0, "red"),
)  # fmt: skip
"""What CIE Lab's hues are called, each up to an angle in degrees."""
_OFF = "{distance_m:.2f} m off its design ({x_m:+.2f} m in x, {y_m:+.2f} m in y)"
_ACCEPT = "Nothing of it counts until accept_moved in the project file lists {subject.name}"
FILE_WORDS = {"ifc": "IFC file", "survey": "survey", "options": "scope, accepted shift or option"}
"""Other than by its name: what a run is made from."""
_SEEN = "{coverage:% seen} of it was seen, "


def torn_heights(values: Mapping[str, Value]) -> str:
    """Say how high over its foot an element is torn: `0.9 to 1.4 m over its foot`; "" where a note doesn't tell."""
    if not {"low_m", "high_m"} <= values.keys():
        return ""
    low_m, high_m = float(str(values["low_m"])), float(str(values["high_m"]))
    return f"{max(low_m, 0.0):.1f} to {high_m:.1f}\N{NO-BREAK SPACE}m over its foot"


def photos_disagree(kind: str, name: str, stations: Sequence[str], where: str = "") -> str:
    """Return the sentence on an element that photos show built and open in the same place."""
    own = name if name.lower().startswith(kind.lower()) else f"{kind.capitalize()} {name or '(no name)'}"
    own += f" ({where})" if where else ""
    if len(stations) == 1:
        return f"Photo {stations[0]} shows part of {own} both built and not: it counts as not seen. Look at the picture"
    which = f"pictures {', '.join(stations[:-1])} and {stations[-1]}" if stations else "them"
    return f"Photos disagree about part of {own}, built or not: it counts as not seen. Look at {which}"


def _disagree(note: Note) -> str:
    values = note.values
    stations, day = values["stations"], f" of {values['day']}" if "day" in values else ""
    names = [f"{name}{day}" for name in stations] if isinstance(stations, tuple) else []
    return photos_disagree(str(values["kind"]), str(values["element"]), names, torn_heights(values))


def _stands_off(note: Note) -> str:
    offset_m = float(str(note.values["offset_m"]))
    where = "in front of" if offset_m > 0.0 else "behind"
    text = f"A surface in photo {{subject.station}} stands {abs(offset_m) * 100:.0f} cm {where} the design"
    return filled(f"{text} and was not counted", note)


def _other_size(note: Note) -> str:
    area_m2, design_m2 = (float(str(note.values[key])) for key in ("area_m2", "design_m2"))
    than = "larger" if area_m2 > design_m2 else "smaller"
    share = percent(abs(area_m2 - design_m2) / design_m2)
    text = f"One face measures {{area_m2:.2f}} ± {{sigma_m2:m²}}, {share} {than} than its design of {{design_m2:m²}}"
    return filled(text, note)


def _other_colour(note: Note) -> str:
    tint = note.values["tint"]
    colour = colour_word(*(float(part) for part in tint)) if isinstance(tint, tuple) else "of another colour"
    seen = (
        f"{{share:%}} of a face of {{area_m2:m²}} in photo {{subject.station}} is {colour}, this visit's concrete isn't"
    )
    if note.values["counted"]:
        return filled(f"{seen}. It lies where the design has concrete and was counted: check the picture", note)
    return filled(f"{seen}, so it was not counted. To count any colour, set options.progress.tinted_share to 1", note)


def colour_word(a: float, b: float) -> str:
    """Return what people call a tint of CIE Lab's a and b: `red-brown`."""
    hue_deg = math.degrees(math.atan2(b, a)) % 360.0
    return next(word for most_deg, word in HUES if hue_deg <= most_deg)


def _photos_changed(note: Note) -> str:
    kinds = {"gone": "no longer used: ", "added": "new: ", "replaced": "with other photos: "}
    told = [f"{words}{{{key}:list}}" for key, words in kinds.items() if note.values[key]]
    more = ", and {others} more" if note.values["others"] else ""
    return filled(
        f"What valuation {{number}} was signed on has changed. Stations {'; '.join(told)}{more}. What was certified "
        "stays as it was, but what counts of it now follows today's photos. Put them back, or write down why",
        note,
    )


def _files_changed(note: Note) -> str:
    files = note.values["files"]
    named = [FILE_WORDS.get(str(one), str(one)) for one in (files if isinstance(files, tuple) else ())]
    return filled(
        f"Valuation {{number}} was signed on a run with another {', another '.join(named)}. What was certified stays "
        "as it was, but what counts of it now follows today's files. If nobody meant that, put them back",
        note,
    )


def _certified_otherwise(note: Note) -> str:
    columns = (note.values[key] for key in ("elements", "signed", "of_run"))
    shares = zip(*(column if isinstance(column, tuple) else () for column in columns), strict=False)
    told = "; ".join(
        f"{plain(str(name))} {percent(float(str(was)))}, and {percent(float(str(now)))} in the run"
        for name, was, now in shares
    )
    more = ", and {others} more" if note.values["others"] else ""
    return (
        filled("Valuation {number} was signed on other shares than those of the run that was current here: ", note)
        + told
        + filled(f"{more}. Either the workbook is of another run, or its numbers were typed over. What was certified "
                 "stays. Ask who signed it; what somebody decides belongs into an override, with name and reason", note)
    )  # fmt: skip


def _not_used(note: Note) -> str:
    stations = note.values["stations"]
    count = len(stations) if isinstance(stations, tuple) else 1
    text = "{stations:list} of the visit of {subject.name} could not be used and "
    return filled(f"Station{'' if count == 1 else 's'} {text}count{'s' if count == 1 else ''} for nothing here", note)


SURFACE_NOTES: Mapping[Reason, Template] = {
    Reason.PARTLY_HIDDEN: "Something stands in front of part of it",
    Reason.STANDS_OFF: _stands_off,
    Reason.STARTER_BARS: "{area_m2:m²} in photo {subject.station} may be starter bars and was not counted",
    Reason.SURFACE_UNCLEAR: "{area_m2:m²} in photo {subject.station} was unclear and not counted",
    Reason.OTHER_COLOUR: _other_colour,
    Reason.PAST_OUTLINE: "Photo {subject.station}: concrete goes on {more_m2:m²} past the {area_m2:m²} outlined",
    Reason.AREAS_APART: "Photo {subject.station} gives {area_m2:.3f} m², over {sigmas:.0f} sigma from the mean of "
    "{mean_m2:.3f} m²",
    Reason.PAST_DESIGN: "Photo {subject.station}: concrete goes on {area_m2:tenth m²} past the design. Look for a "
    "missing opening, extra concrete, or a neighbour that isn't in the IFC file",
    Reason.GONE: "{area_m2:tenth m²} looks open now; an earlier visit saw it built. It was taken away, or one of the "
    "two is wrong",
    Reason.GONE_LITTLE: "{area_m2:tenth m²} looks open now; an earlier visit saw it built",
    Reason.OTHER_SIZE: _other_size,
    Reason.NOT_SEEN: "Nothing of it was seen: no photo shows it, or none well enough",
    Reason.SEEN_LITTLE: "Only {coverage:% seen} of it was seen: too little to say",
    Reason.NOT_SEEN_AGAIN: "It wasn't finished when it was last seen, and this visit didn't see it",
    Reason.SEEN_TO_TOP: f"{_SEEN}up to its top",
    Reason.TOP_NOT_SEEN: f"{_SEEN}all of that built; its top was not seen",
    Reason.SEEN_WITH_FOOT: f"{_SEEN}all of that open: concrete rises from the foot",
    Reason.FOOT_NOT_SEEN: f"{_SEEN}all of that open; its foot was not seen",
    Reason.LEVEL_UNCLEAR: f"{_SEEN}and photos don't show clearly how high it is built",
    Reason.PHOTOS_DISAGREE: _disagree,
    Reason.CONTRADICTS_ITSELF: "Most of what photos show of it contradicts itself: it may stand beside its design, or "
    "something else stands in its place",
    Reason.DISPLACED: f"Built {_OFF}, seen by {{stations:list}}. {_ACCEPT}",
    Reason.DISPLACED_WITH_OTHERS: f"May be built {_OFF}, as most of its storey, or as an earlier visit found. "
    f"{_ACCEPT}",
    Reason.DISPLACED_ACCEPTED: f"Built {_OFF}, and accepted in the project file: it is judged where it stands",
    Reason.STATIONS_NOT_USED: _not_used,
    Reason.PHOTOS_IN_PROJECT: "The project has these photos already, as {stations:list}{more}. They count there, "
    "and once",
    Reason.CERTIFIED_PHOTOS_CHANGED: _photos_changed,
    Reason.CERTIFIED_OTHERWISE: _certified_otherwise,
    Reason.CERTIFIED_FILES_CHANGED: _files_changed,
    Reason.VISITS_GONE: "The last run counted what was seen on {visits:list}, and this one doesn't: the project file "
    "lacks it, or --visit names an earlier one. Put it back, name that visit's result under history, or run without "
    "--visit",
    Reason.OTHER_PROGRAM: "The last run was made by another version of the program ({program}): what changed may come "
    "from that alone",
    Reason.BUILT_EARLY: "{count:# element is|# elements are} built though the schedule begins them after this visit "
    "({elements:quoted}{more}; from {begin} on). If the site isn't ahead of its schedule, the stations stand on "
    "another storey than survey or near say, or the visit's date is wrong",
    Reason.PHOTOS_OF_SEVERAL_DAYS: "Photos of this visit disagree about {count:# element|# elements} "
    "({elements:quoted}{more}). They may be of several days: look at the photos, and give each day a visit of its own",
    Reason.VISIT_TO_COME: "The visit's day, {visit}, is yet to come: by this computer's clock it is {today}. If the "
    "visit's date is wrong, correct it in the project file: plan and lateness go by it",
    Reason.PHOTOS_A_DAY_OFF: "All photos of the visit of {visit} say {day}. They count; if the visit's date is wrong, "
    "correct it in the project file: plan and lateness go by it",
    Reason.DECIDED_NOTHING: "This visit decided nothing: {cause}",
    Reason.LATER_VISIT_UNDOES: "The visit of {later} would undo what was seen at this one: check whether their photos "
    "were exchanged",
}
