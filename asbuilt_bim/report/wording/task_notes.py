"""Sentences that go out with a task or a cost line: to its schedule, and into the IFC copy."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.completion import bounds_note
from asbuilt_bim.report.wording.template import Template, filled

_BOUNDS = "at least {lower:% at least} (lower bound), possibly {upper:% at most}"


def _unknown(note: Note) -> str:
    begun = " Part of it was seen built by {begun}." if note.values["begun"] else ""
    return filled(f"Unknown: too little was seen to say.{begun}", note)


def _measured(note: Note) -> str:
    best = "best estimate {best:tenth %}" if "best" in note.values else "not enough seen for a best estimate"
    return filled(f"Measured: {_BOUNDS}; {best}.", note)


def _part(note: Note) -> str:
    why = ["{unknown} of {of} elements are unknown"] if note.values["unknown"] else []
    why += ["{others} of {of} are not measured here"] if note.values["others"] else []
    return filled(f"Part measured: {_BOUNDS}; {', '.join(why)}.", note)


def _lower(note: Note) -> str:
    why = ["{unknown} of its elements are unknown"] if note.values["unknown"] else []
    why += ["{others} more not measured here"] if note.values["others"] else []
    why += ["the best estimate is {best:tenth %}"] if "best" in note.values else []
    empty = "; it is 0, which the schedule can't hold and leaves empty" if note.values["left_empty"] else ""
    return filled(f"Completion is the lower bound{': ' if why else ''}{', '.join(why)}{empty}", note)


def _cost(note: Note) -> str:
    bound = "upper bound (it takes money off)" if note.values["takes_off"] else "lower bound"
    way = "up" if note.values["takes_off"] else "down"
    whole = f" ({{certain:g}}, rounded {way} to whole pieces)" if note.values["rounded"] else ""
    best = "best {best:g} {unit}" if "best" in note.values else "not enough seen for a best estimate,"
    return filled(f"{bound} of the as-built quantity{whole}; {best} of {{planned:g}} {{unit}}", note)


TASK_NOTES: Mapping[Reason, Template] = {
    Reason.TASK_UNKNOWN: _unknown,
    Reason.TASK_COMPLETE: "Seen complete: all {elements} elements. Best estimate {best:tenth %}, at least "
    "{lower:% at least}.",
    Reason.TASK_NOTHING_BUILT: "Measured: nothing is built yet.",
    Reason.TASK_MEASURED: _measured,
    Reason.TASK_PART_MEASURED: _part,
    Reason.BASIS_UNKNOWN: "too little was seen to say: the task's own time is as it was",
    Reason.BASIS_NO_TIME: "the task has no schedule time control that could hold its completion",
    Reason.BASIS_SEVERAL_TIMES: "the task stands in {count} schedules with a time each: none was chosen",
    Reason.BASIS_SHARED_TIME: "the task shares its time with another: it was left as it was",
    Reason.BASIS_COMPLETE: "Completion is 1: seen complete; at least {lower:% at least} is certain",
    Reason.BASIS_LOWER: _lower,
    Reason.BASIS_COST: _cost,
    Reason.BOUNDS: bounds_note,
}
