"""What this program writes into an IFC file: the names, the measures, and how each is made."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any, Literal

import ifcopenshell.guid
import ifcopenshell.util.unit

from asbuilt_bim.ifc.units import Units, read_units

PROGRESS_SET = "AsBuilt_Progress"
QUANTITY_SET = "AsBuilt_Quantities"
METHOD = "asbuilt_bim: stereo photographs; union of the measured outlines on each design face, openings taken off"
_NAMESPACE = uuid.UUID("5f0c5d5e-3f2b-5d3a-9d49-5a5b1d1c7a10")
_LABEL_LENGTH = 255

PropertyKind = Literal["label", "text", "ratio", "length", "angle", "date", "count"]
Value = str | float | int | date


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """One property of `PROGRESS_SET`: its kind of value and what it says."""

    name: str
    kind: PropertyKind
    says: str


MARKS: tuple[Mark, ...] = (
    Mark(name="State", kind="label", says="complete, part, not started or unknown after the visit"),
    Mark(name="CompletionBest", kind="ratio", says="built / (built + open); absent where under 10 % was decided"),
    Mark(name="CompletionLower", kind="ratio", says="completion if what is unknown were open"),
    Mark(name="CompletionUpper", kind="ratio", says="completion if what is unknown were built"),
    Mark(name="Coverage", kind="ratio", says="cells decided (built or open) / all cells"),
    Mark(name="DeviationFromDesign", kind="length", says="largest offset of a measured face, positive outwards"),
    Mark(name="DeviationSigma", kind="length", says="standard deviation of DeviationFromDesign"),
    Mark(name="Tilt", kind="angle", says="tilt of that face against the design"),
    Mark(name="VisitDate", kind="date", says="day of the visit that this is the state of"),
    Mark(name="Stations", kind="text", says="stations that decided something of it"),
    Mark(name="ProgramVersion", kind="label", says="version of asbuilt_bim that wrote this"),
    Mark(name="Basis", kind="text", says="which number went into the schedule or the cost line, and why"),
    Mark(name="ElementsComplete", kind="count", says="elements in the state complete"),
    Mark(name="ElementsPart", kind="count", says="elements in the state part"),
    Mark(name="ElementsNotStarted", kind="count", says="elements in the state not started"),
    Mark(name="ElementsUnknown", kind="count", says="elements in the state unknown: never read as not built"),
    Mark(name="OriginalTaskTime", kind="label", says="NONE where the task had no task time before"),
    Mark(name="OriginalDataOrigin", kind="label", says="task's DataOrigin before it was overwritten"),
    Mark(name="OriginalStatusTime", kind="label", says="task's StatusTime before it was overwritten"),
    Mark(name="OriginalActualStart", kind="label", says="task's ActualStart before it was overwritten"),
    Mark(name="OriginalActualFinish", kind="label", says="task's ActualFinish before it was overwritten"),
    Mark(name="OriginalCompletion", kind="label", says="task's Completion before it was overwritten"),
)
QUANTITIES: dict[str, str] = {
    "AsBuiltArea": "area of the union of all measured outlines on its faces; absent where none was measured",
    "AsBuiltAreaSigma": "standard deviation of AsBuiltArea",
    "DesignExposedArea": "the design's lateral surface, openings and contact with other elements taken off",
}
_KIND_OF = {mark.name: mark.kind for mark in MARKS}


def measure_class(kind: PropertyKind, schema: str) -> str:
    """Return the IFC type of a kind of value; IFC2X3 has no IfcDate."""
    classes: dict[PropertyKind, str] = {
        "label": "IfcLabel",
        "text": "IfcText",
        "ratio": "IfcNormalisedRatioMeasure",
        "length": "IfcLengthMeasure",
        "angle": "IfcPlaneAngleMeasure",
        "date": "IfcLabel" if schema == "IFC2X3" else "IfcDate",
        "count": "IfcInteger",
    }
    return classes[kind]


class Marker:
    """Makes our entities in one file: SI in, the file's units out; GlobalIds are made from what they belong to."""

    def __init__(self, file: Any) -> None:
        self.file = file
        self.units: Units = read_units(file)
        self.angle_scale = float(ifcopenshell.util.unit.calculate_unit_scale(file, "PLANEANGLEUNIT")) or 1.0
        self.owner: Any = _owner_history(file)

    def rooted(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Make a rooted entity whose GlobalId follows from `key`, so that writing again gives the same one."""
        digest = uuid.uuid5(_NAMESPACE, key).hex
        return self.file.create_entity(
            ifc_class, GlobalId=ifcopenshell.guid.compress(digest), OwnerHistory=self.owner, **attributes
        )

    def properties(self, thing: Any, values: Mapping[str, Value | None]) -> Any:
        """Give a thing our property set; values that are None are left out. Lengths in metres, angles in radians."""
        made = [
            self.file.create_entity("IfcPropertySingleValue", Name=name, NominalValue=self._value(name, value))
            for name, value in values.items()
            if value is not None
        ]
        key = f"{thing.GlobalId}/{PROGRESS_SET}"
        new = self.rooted("IfcPropertySet", key, Name=PROGRESS_SET, HasProperties=made)
        self._tie(thing, new, key)
        return new

    def areas(self, thing: Any, areas_m2: Mapping[str, float | None]) -> Any:
        """Give a thing our quantity set; areas in m2 go into the file's area unit."""
        made = [
            self.file.create_entity("IfcQuantityArea", Name=name, AreaValue=max(area, 0.0) / self.units.area_scale)
            for name, area in areas_m2.items()
            if area is not None
        ]
        key = f"{thing.GlobalId}/{QUANTITY_SET}"
        new = self.rooted("IfcElementQuantity", key, Name=QUANTITY_SET, MethodOfMeasurement=METHOD, Quantities=made)
        self._tie(thing, new, key)
        return new

    def _tie(self, thing: Any, definition: Any, key: str) -> None:
        self.rooted(
            "IfcRelDefinesByProperties", f"{key}/rel", RelatedObjects=[thing], RelatingPropertyDefinition=definition
        )

    def _value(self, name: str, value: Value) -> Any:
        kind = _KIND_OF[name]
        ifc_class = measure_class(kind, self.file.schema)
        plain: Any = value
        if kind == "ratio":
            plain = min(max(float(plain), 0.0), 1.0)
        elif kind == "length":
            plain = float(plain) / self.units.length_scale
        elif kind == "angle":
            plain = float(plain) / self.angle_scale
        elif isinstance(value, date):
            plain = value.isoformat()
        elif kind == "label":
            plain = str(plain)[:_LABEL_LENGTH]
        return self.file.create_entity(ifc_class, plain)


def _owner_history(file: Any) -> Any:
    """Return the project's owner history; IFC2X3 demands one, so there it is made where the file has none."""
    for project in file.by_type("IfcProject"):
        if project.OwnerHistory is not None:
            return project.OwnerHistory
    found: Sequence[Any] = file.by_type("IfcOwnerHistory")
    if found or file.schema != "IFC2X3":
        return found[0] if found else None
    organisation = file.create_entity("IfcOrganization", Name="asbuilt_bim")
    person = file.create_entity("IfcPerson", FamilyName="asbuilt_bim")
    user = file.create_entity("IfcPersonAndOrganization", ThePerson=person, TheOrganization=organisation)
    program = file.create_entity("IfcApplication", organisation, "1", "asbuilt_bim", "asbuilt_bim")
    return file.create_entity(
        "IfcOwnerHistory", OwningUser=user, OwningApplication=program, ChangeAction="ADDED", CreationDate=0
    )
