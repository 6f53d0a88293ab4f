"""Sentences on the IFC file, and on what a revision did to it."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.of_design import accepted_words
from asbuilt_bim.report.wording.template import Template, filled

ELEMENT = "{ifc_class} {element:name} ({subject.name})"
_NEW_IDS = "Have the program that wrote the file give new GlobalIds"
_REVISED = "Revised design (against the result of {since}): "
_KEPT = "What was seen of them counts if it still fits the new design"


def _bad_id(note: Note) -> str:
    what = "left out: {ifc_class} {thing:name}: "
    if not note.values["global_id"]:
        return filled(what + f"its GlobalId is empty. {_NEW_IDS}", note)
    written = "its GlobalId '{global_id}' ({characters} characters) is not 22 letters, digits, _ or $. "
    return filled(what + written + _NEW_IDS, note)


def _no_storey(note: Note) -> str:
    why = "" if note.values["storeys"] else " (the file holds no IfcBuildingStorey or IfcFacilityPart)"
    text = "{count:# wall or column belongs|# walls or columns belong} to no storey"
    return filled(text + why + ": counted in the whole only", note)


def _maps(note: Note) -> str:
    own, other = note.values["map"] or "no map", note.values["other_map"] or "no map"
    files = f"{note.subject.name} ({own}) and {note.values['other_file']} ({other})"
    return f"{files} are not on one map: taken to share coordinates"


def _accepted(note: Note) -> str:
    return (
        f"The survey lies {accepted_words(note.values)} off the design. A person has accepted it (accept_survey_shift)"
    )


def _not_needed(note: Note) -> str:
    shift = accepted_words(note.values)
    return f"accept_survey_shift ({shift}) isn't needed: the survey lies on the design. Take it out"


DESIGN_NOTES: Mapping[Reason, Template] = {
    Reason.CONTACT_NOT_TAKEN_OFF: f"{ELEMENT}: where it touches its neighbours was not taken off: {{error}}",
    Reason.TOUCHED_ALL_OVER: f"{ELEMENT} touches others all over: no photo can see it",
    Reason.GLOBAL_ID_INVALID: _bad_id,
    Reason.GLOBAL_ID_TWICE: f"left out: {{ifc_class}} {{thing:name}}: it has the GlobalId of {{other}}. {_NEW_IDS}",
    Reason.GLOBAL_IDS_MORE: "left out: {count} more without a GlobalId of their own",
    Reason.NOT_ON_ONE_MAP: _maps,
    Reason.IN_EARLIER_FILE: "{count:# wall or column|# walls or columns} of {subject.name} also in an earlier file: "
    "counted there",
    Reason.NO_BODY: "no usable body, so not measured: {elements:list}{more}",
    Reason.ELEMENT_UNUSABLE: f"{ELEMENT} can't be used: {{error}}",
    Reason.ELEMENT_TOO_LONG: f"{ELEMENT} can't be used: it is {{length_m:.0f}} m long (limit {{limit_m:.0f}} m). "
    "Check the file's length unit",
    Reason.ELEMENT_TWICE: f"{ELEMENT} fills the same place as {{name}} ({{first}}): the two count once",
    Reason.NO_UPRIGHT_FACE: f"{ELEMENT} can't be used: its body has no upright face",
    Reason.NO_STOREY: _no_storey,
    Reason.NOT_IN_TASKS: "walls and columns in no task: {count} of {of}",
    Reason.NOT_IN_COST_LINES: "walls and columns in no cost line: {count} of {of}",
    Reason.DESIGN_REMOVED: f"{_REVISED}{{count}} gone: {{elements:list}}{{more}}. What was seen of them is left out",
    Reason.DESIGN_ADDED: f"{_REVISED}{{count}} new: {{elements:list}}{{more}}",
    Reason.DESIGN_RESHAPED: f"{_REVISED}{{count}} changed in shape: {{elements:list}}{{more}}. {_KEPT}",
    Reason.DESIGN_MOVED: f"{_REVISED}{{count}} moved: {{elements:list}}{{more}}. {_KEPT}",
    Reason.DESIGN_OTHER_STOREY: f"{_REVISED}{{count}} on another storey: {{elements:list}}{{more}}. They count to the "
    "storey that they are on now, in its totals and in cost lines by storey",
    Reason.DESIGN_OTHER_TASK: f"{_REVISED}{{count}} of another task: {{elements:list}}{{more}}. Whether they are late "
    "goes by the task that they have now",
    Reason.DESIGN_RENAMED: f"{_REVISED}{{count}} renamed: {{elements:list}}{{more}}",
    Reason.SHIFT_ACCEPTED: _accepted,
    Reason.SHIFT_NOT_NEEDED: _not_needed,
    Reason.DESIGN_NEW_IDS: f"{_REVISED}{{count}} with new GlobalIds, in the same place: {{elements:list}}{{more}}. "
    "What was seen of them counts, and so do tables that name the old ones",
}
