"""Cost lines by schedule and currency with their sums, and what each element brings to them; others only write them."""

from dataclasses import dataclass

from asbuilt_bim.progress.money import total
from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.report.wording.values import plain

NO_CURRENCY = "(no currency)"


@dataclass(frozen=True, slots=True, kw_only=True)
class CostGroup:
    """Lines that may be added up: of one schedule and one currency."""

    name: str
    currency: str
    lines: tuple[CostProgress, ...]
    planned: float
    earned_best: float | None  # of the lines that are known; None where none is
    earned_lower: float

    @property
    def unknown(self) -> int:
        """Return how many lines the best sum is without."""
        return sum(line.earned_best is None for line in self.lines)


def cost_groups(report: ProgressReport) -> tuple[CostGroup, ...]:
    """Return the groups in order of schedule and currency; a schedule is named where there are several."""
    several = len({line.schedule for line in report.cost_lines}) > 1
    groups = []
    for schedule, currency in sorted({(line.schedule, line.currency) for line in report.cost_lines}):
        lines = [line for line in report.cost_lines if (line.schedule, line.currency) == (schedule, currency)]
        known = [line.earned_best for line in lines if line.earned_best is not None]
        of_schedule = f", {plain(schedule) or 'lines of no schedule'}" if several else ""
        groups.append(
            CostGroup(
                name=f"{plain(currency) or NO_CURRENCY}{of_schedule}",
                currency=currency,
                lines=tuple(lines),
                planned=total(line.planned_value for line in lines),
                earned_best=total(known) if known else None,
                earned_lower=total(line.earned_lower for line in lines),
            )
        )
    return tuple(groups)


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
