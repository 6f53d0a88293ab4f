"""Completion in words, in one place: "at least", "possibly", the best estimate, and what was seen."""

import math

from asbuilt_bim.codes import Note
from asbuilt_bim.progress.report import Completion, GroupProgress
from asbuilt_bim.report.wording.values import percent, percent_certain, percent_seen

AT_LEAST, POSSIBLY, BEST, SEEN = "at least", "possibly", "best estimate", "seen"
"""What bounds, estimate and coverage are called, wherever people read them."""
NOT_ENOUGH = "not enough seen"


def at_least(completion: Completion) -> str:
    """Write the number that leads: `at least 48 %`, rounded down."""
    return f"{AT_LEAST} {percent_certain(completion.lower)}"


def possibly(completion: Completion) -> str:
    """Write the upper bound: `possibly 86 %`, rounded up, or `possibly all`."""
    return f"{POSSIBLY} {at_most(completion.upper)}"


def at_most(upper: float) -> str:
    """Write an upper bound without its word: `86 %` or `all`."""
    return "all" if upper >= 1.0 - 1e-9 else f"{math.ceil(upper * 100 - 1e-9)} %"


def best_words(completion: Completion) -> str:
    """Write the best estimate, or that not enough was seen for one."""
    best = completion.best_shown
    return NOT_ENOUGH if best is None else percent(best)


def seen_words(completion: Completion) -> str:
    """Write what share was seen, rounded down: under half never reads as half."""
    return percent_seen(completion.coverage)


def bounds_words(lower: float, upper: float) -> str:
    """Write both bounds for people: `at least 42 %, possibly all`."""
    if upper - lower < 1e-9:
        return {0.0: "nothing of it", 1.0: "all of it"}.get(round(lower, 9), percent(lower))
    if lower < 0.01:
        return f"nothing certain, {POSSIBLY} {at_most(upper)}"
    return f"{AT_LEAST} {percent_certain(lower)}, {POSSIBLY} {at_most(upper)}"


def in_words(completion: Completion) -> str:
    """Write a completion in one line: `at least 48 %, possibly 86 %`."""
    return bounds_words(completion.lower, completion.upper)


def bounds_note(note: Note) -> str:
    """Write the note that holds bounds."""
    return bounds_words(float(str(note.values["lower"])), float(str(note.values["upper"])))


def count_words(group: GroupProgress) -> str:
    """Write how many elements of a group are in which state; states that may be absent only where there are any."""
    parts = [f"{group.surely_complete} complete"]
    parts += [f"{group.as_far_as_seen} complete as far as seen"] if group.as_far_as_seen else []
    parts += [f"{group.part} in part", f"{group.not_started} not started"]
    parts += [f"{group.displaced} displaced"] if group.displaced else []
    return ", ".join([*parts, f"{group.unknown} unknown"])
