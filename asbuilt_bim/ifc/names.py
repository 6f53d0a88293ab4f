"""What this program writes into an IFC file: the names, the measures, and GlobalIds that show who made them."""

import base64
import hashlib
from dataclasses import dataclass
from datetime import date
from typing import Any, Literal

import ifcopenshell.guid

from asbuilt_bim.codes import Note

PROGRESS_SET = "AsBuilt_Progress"
QUANTITY_SET = "AsBuilt_Quantities"
HISTORY_SET = "AsBuilt_History"
METHOD = "asbuilt_bim: stereo photographs; union of the measured outlines on each design face, openings taken off"
_SETS = (PROGRESS_SET, QUANTITY_SET, HISTORY_SET)
PHOTO = "As-built photo"
"""Name of the relation between a photo and the elements that it shows."""
AS_BUILT = "ASBUILT"
"""ObjectType of the controls that the writer makes: a cost schedule of that type is never read as a plan."""
PROGRAM = "asbuilt_bim"
_OWN = b"asbuil\x80"  # six letters, then a UUID's version 8: made as its maker likes
_BEGINNING = ifcopenshell.guid.compress((_OWN + bytes(9)).hex())[:10]  # the characters that hold those seven bytes
_IFC_LETTERS = bytes.maketrans(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/",
    b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$",
)

PropertyKind = Literal["label", "text", "ratio", "length", "real", "area", "date", "count"]
Value = str | float | int | date | Note
"""What a property holds; a note becomes its words, with its code as the property's description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """One property of `PROGRESS_SET`: its kind of value and what it says."""

    name: str
    kind: PropertyKind
    meaning: str


MARKS: tuple[Mark, ...] = (
    Mark(name="State", kind="label", meaning="complete (as far as seen), part, not started, displaced or unknown"),
    Mark(name="Reason", kind="text", meaning="why it has this state, where that isn't plain"),
    Mark(name="Summary", kind="text", meaning="both bounds in words"),
    Mark(
        name="CompletionBest",
        kind="ratio",
        meaning="what is likelier built than not, of a group the mean; absent where under half was seen",
    ),
    Mark(name="CompletionLower", kind="ratio", meaning="completion if what is unknown were open"),
    Mark(name="CompletionUpper", kind="ratio", meaning="completion if what is unknown were built"),
    Mark(name="Coverage", kind="ratio", meaning="cells of which photos decide a side / all cells"),
    Mark(name="DeviationFromDesign", kind="length", meaning="largest offset of a measured face, positive outwards"),
    Mark(name="DeviationSigma", kind="length", meaning="standard deviation of DeviationFromDesign"),
    Mark(name="TiltMmPerM", kind="real", meaning="largest tilt of a measured face from plumb, in mm per m"),
    Mark(name="TiltSigmaMmPerM", kind="real", meaning="standard deviation of TiltMmPerM"),
    Mark(name="Tolerance", kind="label", meaning="in, out or undecided, by two sigma; it says nothing of built"),
    Mark(name="ToleranceName", kind="label", meaning="the tolerance that the project asks for"),
    Mark(name="Zones", kind="text", meaning="names of the zones that it lies in, with semicolons between"),
    Mark(name="VisitDate", kind="date", meaning="day of the visit that this is the state of; absent where none saw it"),
    Mark(name="Stations", kind="text", meaning="stations that decided something of it"),
    Mark(name="ProgramVersion", kind="label", meaning="version of asbuilt_bim that wrote this"),
    Mark(name="Basis", kind="text", meaning="which number went into the schedule or the cost line, and why"),
    Mark(name="DaysBehind", kind="count", meaning="days behind plan by the best estimate, negative: ahead"),
    Mark(name="DaysLate", kind="count", meaning="days from planned finish to the visit, 0 where not late"),
    Mark(name="PlannedFinish", kind="date", meaning="planned finish that counts, where a schedule file gives it"),
    Mark(name="PlannedFinishFrom", kind="label", meaning="schedule file that PlannedFinish is from"),
    Mark(name="ForecastFinish", kind="date", meaning="finish by what is certain, at the planned pace"),
    Mark(name="ElementsComplete", kind="count", meaning="elements in the state complete"),
    Mark(name="ElementsCompleteAsFarAsSeen", kind="count", meaning="elements in the state complete as far as seen"),
    Mark(name="ElementsPart", kind="count", meaning="elements in the state part"),
    Mark(name="ElementsNotStarted", kind="count", meaning="elements in the state not started"),
    Mark(name="ElementsDisplaced", kind="count", meaning="elements beside their design: none of them counts"),
    Mark(name="ElementsUnknown", kind="count", meaning="elements in the state unknown: never read as not built"),
    Mark(name="Files", kind="text", meaning="files whose elements are counted, where several: don't add up over files"),
    Mark(name="OriginalTaskTime", kind="label", meaning="NONE where the task had no task time before"),
    Mark(name="OriginalDataOrigin", kind="label", meaning="task's DataOrigin before it was overwritten"),
    Mark(name="OriginalStatusTime", kind="label", meaning="task's StatusTime before it was overwritten"),
    Mark(name="OriginalActualStart", kind="label", meaning="task's ActualStart before it was overwritten"),
    Mark(name="OriginalActualFinish", kind="label", meaning="task's ActualFinish before it was overwritten"),
    Mark(name="OriginalCompletion", kind="label", meaning="task's Completion before it was overwritten"),
)
QUANTITIES: dict[str, str] = {
    "AsBuiltArea": "area of the union of all measured outlines on its faces; absent where none was measured",
    "AsBuiltAreaSigma": "standard deviation of AsBuiltArea",
    "PhotographedDesignArea": "design area of the faces that AsBuiltArea was measured on",
    "DesignExposedArea": "the design's lateral surface, openings and contact with other elements taken off",
}
KIND_OF = {mark.name: mark.kind for mark in MARKS}
HISTORY: dict[str, tuple[PropertyKind, str]] = {
    "CompletionBest": ("ratio", "CompletionBest after each visit that saw half"),
    "CompletionLower": ("ratio", "CompletionLower after each visit"),
    "CompletionUpper": ("ratio", "CompletionUpper after each visit"),
    "AsBuiltArea": ("area", "AsBuiltArea after each visit that measured one"),
}


def our_guid(key: str) -> str:
    """Return the GlobalId of what `key` names: the same key gives the same id, and all begin alike."""
    tail = bytearray(hashlib.sha256(key.encode()).digest()[:9])
    tail[1] = tail[1] & 0x3F | 0x80  # the variant that a UUID has
    return _BEGINNING + base64.b64encode(tail).translate(_IFC_LETTERS).decode()


def own_roots(file: Any) -> list[Any]:
    """Return every rooted entity of an open file that this program made: by its GlobalId (text if sound), or its name.

    Programs that export what they have imported may give sets and controls GlobalIds of their own; the names stay.
    """
    found = [one for one in file.by_type("IfcRoot") if str(one[0]).startswith(_BEGINNING)]
    known = {one.id() for one in found}
    sets = [one for one in file.by_type("IfcPropertySetDefinition") if one.id() not in known]
    named = [one for one in sets if one.Name in _SETS or one.Description == PROGRAM]
    named += [one for one in file.by_type("IfcControl") if one.ObjectType == AS_BUILT and one.id() not in known]
    for one in named:
        found += [one, *(user for user in file.get_inverse(one) if user.id() not in known and _serves(user, one))]
    photos = [one for one in file.by_type("IfcRelAssociatesDocument") if one.Name == PHOTO]
    return [*found, *(one for one in photos if one.id() not in known)]


def _serves(relation: Any, one: Any) -> bool:
    """Say whether a relation is there for this entity alone."""
    if relation.is_a("IfcRelDefinesByProperties"):
        return bool(relation.RelatingPropertyDefinition == one)
    if relation.is_a("IfcRelAssignsToControl"):
        return bool(relation.RelatingControl == one)
    return bool(relation.is_a("IfcRelDeclares")) and len(relation.RelatedDefinitions) == 1


def measure_class(kind: PropertyKind, schema: str) -> str:
    """Return the IFC type of a kind of value; IFC2X3 has no IfcDate."""
    classes: dict[PropertyKind, str] = {
        "label": "IfcLabel",
        "text": "IfcText",
        "ratio": "IfcNormalisedRatioMeasure",
        "length": "IfcLengthMeasure",
        "real": "IfcReal",
        "area": "IfcAreaMeasure",
        "date": "IfcLabel" if schema == "IFC2X3" else "IfcDate",
        "count": "IfcInteger",
    }
    return classes[kind]
