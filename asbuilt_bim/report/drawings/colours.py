"""The colours of the report: told apart by colour-blind eyes too, and never the only sign of a state."""

import re
from collections.abc import Mapping

from asbuilt_bim.errors import OptionError
from asbuilt_bim.progress.report import ProgressReport, ShownState

STATE_COLOURS: dict[ShownState, str] = {
    "complete": "#12a878",
    "complete as far as seen": "#8fdcc0",
    "part": "#f0a202",
    "not started": "#4f8edc",
    "displaced": "#c2408f",
    "unknown": "#9aa3ad",
}
UNMATCHED = "unmatched"
UNMATCHED_COLOUR = "#c9ced4"
NOT_COUNTED_COLOUR = "#b98a5e"
TARGET_COLOUR = "#ff3b5c"
ORDER: tuple[ShownState, ...] = ("complete", "complete as far as seen", "part", "not started", "displaced", "unknown")


def with_default_colours(given: Mapping[ShownState, str]) -> dict[ShownState, str]:
    """Return a colour for each state: the one that is given, `#rrggbb`, or the report's.

    Raises:
        OptionError: there is no such state, or what is given is no colour of this form.
    """
    if not isinstance(given, Mapping):
        raise OptionError(f"colours: {given!r:.60} is no dictionary; give {{'complete': '#12a878'}}, state by state")
    for state, colour in given.items():
        if state not in STATE_COLOURS:
            raise OptionError(f"colours: {state!r:.60} is no state; the states are {', '.join(STATE_COLOURS)}")
        if not isinstance(colour, str) or not re.fullmatch("#[0-9a-fA-F]{6}", colour):
            raise OptionError(
                f"colours: {colour!r:.60} for {state!r} is no colour; write #rrggbb, such as {STATE_COLOURS[state]}"
            )
    return {**STATE_COLOURS, **given}


def element_states(report: ProgressReport) -> dict[str, ShownState]:
    """Return GlobalId -> state."""
    return {element.global_id: element.shown_state for element in report.elements}


def element_names(report: ProgressReport) -> dict[str, str]:
    """Return GlobalId -> name; an element without a name goes by its GlobalId."""
    return {element.global_id: element.name or element.global_id for element in report.elements}


def joint_state(states: list[ShownState]) -> ShownState:
    """Return the state of several elements that share a face: the same, or `part` where they differ.

    Of complete ones of which one wasn't seen nearly whole, that is said.
    """
    distinct = set(states)
    if distinct == {"complete", "complete as far as seen"}:
        return "complete as far as seen"
    return distinct.pop() if len(distinct) == 1 else "part" if distinct else "unknown"


def bgr(colour: str) -> tuple[int, int, int]:
    """Return `#rrggbb` in OpenCV's order."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return blue, green, red
