"""The templates of our property and quantity set, for authoring programs that want to show them by name."""

from pathlib import Path
from typing import Any

import ifcopenshell

from asbuilt_bim.ifc.names import HISTORY, HISTORY_SET, MARKS, PROGRESS_SET, QUANTITIES, QUANTITY_SET, measure_class
from asbuilt_bim.ifc.write.copy import save
from asbuilt_bim.ifc.write.entities import Marker

_APPLIES = "IfcWall,IfcColumn,IfcBuildingStorey,IfcTask,IfcCostItem"


def write_templates(target: Path) -> None:
    """Write `asbuilt-bim-psets.ifc`: an IFC4 project library that declares both sets.

    Raises:
        OutputError: the file can't be written.
    """
    file = ifcopenshell.file(schema="IFC4")
    file.header.file_name.name = target.name
    file.header.file_name.time_stamp = "2026-01-01T00:00:00"  # the same text makes the same file
    marker = Marker(file)
    library = marker.rooted("IfcProjectLibrary", "template/library", Name="asbuilt_bim property sets")
    progress = _set(marker, PROGRESS_SET, _APPLIES, "PSET_OCCURRENCEDRIVEN", "what was measured of it")
    progress.HasPropertyTemplates = [
        _template(marker, PROGRESS_SET, mark.name, mark.meaning, "P_SINGLEVALUE", measure_class(mark.kind, "IFC4"))
        for mark in MARKS
    ]
    areas = _set(
        marker, QUANTITY_SET, "IfcWall,IfcColumn,IfcBuildingStorey", "QTO_OCCURRENCEDRIVEN", "as-built quantities"
    )
    areas.HasPropertyTemplates = [
        _template(marker, QUANTITY_SET, name, meaning, "Q_AREA", None) for name, meaning in QUANTITIES.items()
    ]
    history = _set(marker, HISTORY_SET, "IfcPerformanceHistory", "PSET_PERFORMANCEDRIVEN", "the visits as time series")
    history.HasPropertyTemplates = [
        _template(marker, HISTORY_SET, name, meaning, "P_REFERENCEVALUE", "IfcTimeSeries")
        for name, (_, meaning) in HISTORY.items()
    ]
    marker.rooted(
        "IfcRelDeclares",
        "template/declares",
        RelatingContext=library,
        RelatedDefinitions=[progress, areas, history],
    )
    save(file, target)


def _set(marker: Marker, name: str, applies: str, kind: str, meaning: str) -> Any:
    return marker.rooted(
        "IfcPropertySetTemplate",
        f"template/{name}",
        Name=name,
        Description=meaning,
        TemplateType=kind,
        ApplicableEntity=applies,
    )


def _template(marker: Marker, owner: str, name: str, meaning: str, kind: str, measure: str | None) -> Any:
    return marker.rooted(
        "IfcSimplePropertyTemplate",
        f"template/{owner}/{name}",
        Name=name,
        Description=meaning,
        TemplateType=kind,
        PrimaryMeasureType=measure,
        AccessState="READONLY",
    )
