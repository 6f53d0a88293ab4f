"""What a surveyor has to know of cost lines before he pays by them: what isn't measured, what may be paid twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from asbuilt_bim.bim.model import CostLine

MOST_TWICE = 10


def cost_notes(lines: Sequence[CostLine]) -> list[str]:
    """Return what is said of the lines of a file; of those that repeat each other the first few."""
    unmeasured = [_unmeasured(line) for line in lines if line.others]
    schedules = sorted({line.schedule for line in lines})
    several = [f"cost lines stand in {len(schedules)} cost schedules; each has a sum of its own"]
    credits = [_takes_off(line) for line in lines if line.planned_quantity * line.rate < 0.0]
    return [*unmeasured, *credits, *(several if len(schedules) > 1 else ()), *list(_paid_twice(lines))[:MOST_TWICE]]


def _unmeasured(line: CostLine) -> str:
    return (
        f"cost item {_name(line)}: {line.others} of the {len(line.elements) + line.others} elements that it pays for "
        "are not measured here; their part of it is unknown, and not certain"
    )


def _takes_off(line: CostLine) -> str:
    return (
        f"cost item {_name(line)}: takes {abs(line.planned_quantity * line.rate):.2f} off when all of it is built; "
        "what wasn't seen of it is taken off certain totals, too"
    )


def _paid_twice(lines: Sequence[CostLine]) -> Iterator[str]:
    """Name the lines of one schedule that pay for an element by the same measure as a line before them."""
    first: dict[tuple[str, str, str], CostLine] = {}
    for line in lines:
        keys = [(line.schedule, line.measure, element) for element in line.elements]
        for old in dict.fromkeys(_name(first[key]) for key in keys if key in first):
            yield f"cost items {old} and {_name(line)}: both pay for the same elements by {line.measure}; both count"
        first |= {key: line for key in keys if key not in first}


def _name(line: CostLine) -> str:
    return line.name or line.global_id
