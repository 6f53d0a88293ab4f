"""The file's units against SI: each by its own unit, since areas are often in m2 where lengths are in mm."""

from dataclasses import dataclass
from typing import Any, Literal

import ifcopenshell.util.unit

from asbuilt_bim.bim.cost_units import currency_of

Measure = Literal["volume", "area", "length", "count"]
_MEASURES: dict[str, tuple[Measure, str]] = {
    "IfcQuantityVolume": ("volume", "VOLUMEUNIT"),
    "IfcQuantityArea": ("area", "AREAUNIT"),
    "IfcQuantityLength": ("length", "LENGTHUNIT"),
    "IfcQuantityCount": ("count", ""),
    "IfcQuantityNumber": ("count", ""),  # of IFC4X3, where a count is a whole number
}
_PREFIXES: dict[str, float] = ifcopenshell.util.unit.prefixes
_CONVERTED: dict[str, str] = ifcopenshell.util.unit.unit_symbols
_SI_SYMBOL = {"volume": "m3", "area": "m2", "length": "m", "count": "pcs"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """How many SI units one unit of the file is, and the currency's name ("" where the file doesn't say)."""

    length_scale: float
    area_scale: float
    volume_scale: float
    currency: str

    def length(self, value: float) -> float:
        """Return metres of a length in the file's unit."""
        return float(value) * self.length_scale

    def scale(self, measure: Measure) -> float:
        """Return how many SI units one unit of the file is, for a measure."""
        return {"volume": self.volume_scale, "area": self.area_scale, "length": self.length_scale, "count": 1.0}[
            measure
        ]

    def quantity(self, quantity: Any) -> tuple[Measure | None, float]:
        """Return what an IfcPhysicalSimpleQuantity measures and its value in SI; its own unit overrides the file's."""
        measure = quantity_measure(quantity)
        value = float(quantity[3] or 0.0)
        if measure is None:
            return None, value
        return measure, value * (unit_scale(quantity.Unit) if quantity.Unit else self.scale(measure))


def quantity_measure(quantity: Any) -> Measure | None:
    """Return what a simple quantity measures, None for weight, time, and a number of some physical unit."""
    if quantity.is_a("IfcQuantityNumber") and quantity.Unit and not quantity.Unit.is_a("IfcContextDependentUnit"):
        return None
    return _MEASURES[quantity.is_a()][0] if quantity.is_a() in _MEASURES else None


def read_units(file: Any) -> Units:
    """Read the project's units; what it doesn't state is SI, and an area or volume unit missing is metres' power."""
    assigned = file.by_type("IfcUnitAssignment")
    money = [unit for assignment in assigned[:1] for unit in assignment.Units if unit.is_a("IfcMonetaryUnit")]
    return Units(
        length_scale=_project_scale(file, "LENGTHUNIT"),
        area_scale=_project_scale(file, "AREAUNIT"),
        volume_scale=_project_scale(file, "VOLUMEUNIT"),
        currency=currency_of(str(money[0].Currency)) if money else "",
    )


def _project_scale(file: Any, unit_type: str) -> float:
    return float(ifcopenshell.util.unit.calculate_unit_scale(file, unit_type))


def unit_scale(unit: Any) -> float:
    """Return how many SI units a named unit is: prefixes to the power of its dimension, conversions followed."""
    if unit.is_a("IfcConversionBasedUnit"):
        factor = unit.ConversionFactor
        return float(factor.ValueComponent.wrappedValue) * unit_scale(factor.UnitComponent)
    if unit.is_a("IfcSIUnit"):
        power = {"SQUARE_METRE": 2, "CUBIC_METRE": 3}.get(unit.Name, 1)
        return float(_PREFIXES.get(unit.Prefix or "", 1.0)) ** power
    return 1.0


def unit_symbol(file: Any, measure: Measure, own: Any = None) -> str:
    """Return the short name of a quantity's unit: m3, m2, m, pcs, or the file's own (ft2, cm)."""
    if measure == "count":
        return _SI_SYMBOL[measure]
    kind = {"volume": "VOLUMEUNIT", "area": "AREAUNIT", "length": "LENGTHUNIT"}[measure]
    stated = bool(file.by_type("IfcProject"))
    unit = own or (ifcopenshell.util.unit.get_project_unit(file, kind) if stated else None)
    if unit is None or (unit.is_a("IfcSIUnit") and not unit.Prefix):
        return _SI_SYMBOL[measure]
    if unit.is_a("IfcConversionBasedUnit"):  # `FOOT` in one exporter's file, `foot` in another's
        name = str(unit.Name or "")
        return _CONVERTED.get(name.casefold(), name)
    return str(ifcopenshell.util.unit.get_unit_symbol(unit)) or str(getattr(unit, "Name", ""))
