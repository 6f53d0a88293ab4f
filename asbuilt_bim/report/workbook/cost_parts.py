"""What each element brings to a cost line: which walls were paid for, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.report.workbook.cost_groups import cost_groups


@dataclass(frozen=True, slots=True, kw_only=True)
class CostPart:
    """An element's part of a cost line; the parts of a line add up to it before it is rounded to the cent.

    What isn't measured of a line that takes money off is taken off it, too, and stands in no part.
    """

    line: CostProgress
    element: ElementProgress
    planned_quantity: float  # in the line's own unit

    @property
    def certain(self) -> float:
        """Return the share (0..1) of the element that a certificate counts for this line."""
        completion = self.element.completion
        return completion.upper if self.line.takes_off else completion.lower

    @property
    def as_built_lower(self) -> float:
        """Return what of it is certain, in the line's own unit."""
        return self.planned_quantity * self.certain

    @property
    def earned_lower(self) -> float:
        """Return what that is worth, not rounded."""
        return self.as_built_lower * self.line.rate


def cost_parts(report: ProgressReport) -> tuple[CostPart, ...]:
    """Return the parts of every line in the order of the cost sheet, within a line by class and name."""
    elements = {element.global_id: element for element in report.elements}
    parts: list[CostPart] = []
    for group in cost_groups(report):
        for line in group.lines:
            members = [elements[key] for key in line.parts if key in elements]
            for element in sorted(members, key=lambda e: (e.ifc_class, e.name, e.global_id)):
                share = line.parts[element.global_id]
                parts.append(CostPart(line=line, element=element, planned_quantity=share * line.planned_quantity))
    return tuple(parts)
