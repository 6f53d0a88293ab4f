"""Writes the design as IFC4, with its work schedule and its cost schedule."""

from __future__ import annotations

from pathlib import Path

from asbuilt_synthetic.building import Building
from asbuilt_synthetic.ifc_plan import add_cost_schedule, add_work_schedule
from asbuilt_synthetic.ifc_writer import IfcWriter


def write_ifc(building: Building, path: Path) -> None:
    """Write the design of a building as an IFC4 file."""
    writer = IfcWriter(building)
    writer.build()
    add_work_schedule(writer)
    add_cost_schedule(writer)
    writer.save(path)
