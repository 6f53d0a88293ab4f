"""Makes our entities in an open IFC file: SI in, the file's units out, every rooted one with one of our GlobalIds."""

from collections.abc import Callable, Mapping, Sequence
from datetime import date, datetime
from typing import Any

from asbuilt_bim.codes import Note
from asbuilt_bim.ifc.names import (
    KIND_OF,
    METHOD,
    PROGRAM,
    PROGRESS_SET,
    QUANTITY_SET,
    PropertyKind,
    Value,
    measure_class,
    our_guid,
)
from asbuilt_bim.ifc.units import Units, read_units

DESCRIPTION = 1
"""Place of a property's attribute Description, which IFC4X3 calls Specification."""
LABEL_LENGTH = 255
"""What an IfcLabel holds."""


Words = Callable[[Note], str]
"""Makes the sentence of a note."""


def bare(note: Note) -> str:
    """Return a note's code alone: what is written where nobody gives words."""
    return str(note.code)


class Marker:
    """Makes our entities in one open file; `words` makes the texts that stand in its properties."""

    def __init__(self, file: Any, words: Words = bare) -> None:
        self.file = file
        self.words = words
        self.schema: str = file.schema  # asking the file each time costs more than making an entity
        self.units: Units = read_units(file)
        self.owner: Any = _owner_history(file)

    def rooted(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Make a rooted entity whose GlobalId follows from `key`, so that writing again gives the same one."""
        return self.file.create_entity(ifc_class, GlobalId=our_guid(key), OwnerHistory=self.owner, **attributes)

    def find(self, global_id: str, ifc_class: str = "IfcObject") -> Any:
        """Return the entity of a GlobalId; None where the file has none of that class."""
        try:
            found = self.file.by_guid(global_id)
        except RuntimeError:
            return None
        return found if found.is_a(ifc_class) else None

    def properties(
        self, thing: Any, values: Mapping[str, Value | None], references: Mapping[str, Any] | None = None
    ) -> None:
        """Give a thing our property set; values that are None are left out. Lengths in metres.

        `references` are entities of the file (IFC2X3 keeps its dates as such), kept by reference.
        """
        made = [self._property(name, value) for name, value in values.items() if value is not None]
        made += [
            self.file.create_entity("IfcPropertyReferenceValue", Name=name, PropertyReference=entity)
            for name, entity in (references or {}).items()
        ]
        self.add_set(thing, PROGRESS_SET, made)

    def _property(self, name: str, value: Value) -> Any:
        if not isinstance(value, Note):
            return self.single(name, self.measure(KIND_OF[name], value))
        made = self.single(name, self.measure(KIND_OF[name], self.words(value)))
        made[DESCRIPTION] = str(value.code)
        return made

    def single(self, name: str, value: Any) -> Any:
        """Return a property of one value."""
        return self.file.create_entity("IfcPropertySingleValue", Name=name, NominalValue=value)

    def add_set(self, thing: Any, name: str, properties: Sequence[Any], description: str | None = None) -> None:
        """Give a thing a property set; one without one of our names bears it in its description."""
        key = f"{thing.GlobalId}/{name}"
        new = self.rooted("IfcPropertySet", key, Name=name, Description=description, HasProperties=properties)
        self._relate(thing, new, key)

    def areas(self, thing: Any, areas_m2: Mapping[str, float | None]) -> None:
        """Give a thing our quantity set; areas in m2 go into the file's area unit."""
        made = [
            self.file.create_entity("IfcQuantityArea", Name=name, AreaValue=max(area, 0.0) / self.units.area_scale)
            for name, area in areas_m2.items()
            if area is not None
        ]
        key = f"{thing.GlobalId}/{QUANTITY_SET}"
        new = self.rooted("IfcElementQuantity", key, Name=QUANTITY_SET, MethodOfMeasurement=METHOD, Quantities=made)
        self._relate(thing, new, key)

    def _relate(self, thing: Any, definition: Any, key: str) -> None:
        self.rooted(
            "IfcRelDefinesByProperties", f"{key}/rel", RelatedObjects=[thing], RelatingPropertyDefinition=definition
        )

    def measure(self, kind: PropertyKind, value: Value) -> Any:
        """Return a typed IFC value of a value in SI."""
        plain: Any = value
        if kind == "ratio":
            plain = min(max(float(plain), 0.0), 1.0)
        elif kind == "length":
            plain = float(plain) / self.units.length_scale
        elif kind == "area":
            plain = float(plain) / self.units.area_scale
        elif isinstance(value, date):
            plain = value.isoformat()
        elif kind == "label":
            plain = str(plain)[:LABEL_LENGTH]
        return self.file.create_entity(measure_class(kind, self.schema), plain)

    def moment(self, when: date | None) -> Any:
        """Return a moment as the schema wants it: text, or in IFC2X3 an IfcCalendarDate or IfcDateAndTime."""
        if when is None:
            return None
        if self.schema != "IFC2X3":
            return when.isoformat() if isinstance(when, datetime) else f"{when.isoformat()}T00:00:00"
        day = self.file.create_entity(
            "IfcCalendarDate", DayComponent=when.day, MonthComponent=when.month, YearComponent=when.year
        )
        if not isinstance(when, datetime):
            return day
        time = self.file.create_entity(
            "IfcLocalTime", HourComponent=when.hour, MinuteComponent=when.minute, SecondComponent=float(when.second)
        )
        return self.file.create_entity("IfcDateAndTime", DateComponent=day, TimeComponent=time)


def _owner_history(file: Any) -> Any:
    """Return the project's owner history; IFC2X3 demands one, so there it is made where the file has none."""
    for project in file.by_type("IfcProject"):
        if project.OwnerHistory is not None:
            return project.OwnerHistory
    found: Sequence[Any] = file.by_type("IfcOwnerHistory")
    if found or file.schema != "IFC2X3":
        return found[0] if found else None
    organisation = file.create_entity("IfcOrganization", Name=PROGRAM)
    person = file.create_entity("IfcPerson", FamilyName=PROGRAM)
    user = file.create_entity("IfcPersonAndOrganization", ThePerson=person, TheOrganization=organisation)
    program = file.create_entity("IfcApplication", organisation, "1", PROGRAM, PROGRAM)
    return file.create_entity(
        "IfcOwnerHistory", OwningUser=user, OwningApplication=program, ChangeAction="ADDED", CreationDate=0
    )
