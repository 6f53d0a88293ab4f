"""Says in words what changed of the cost lines from one result to the next: what was planned, and what is certain."""

from __future__ import annotations

from collections.abc import Iterator

from asbuilt_bim.progress.report import CostProgress, ProgressReport
from asbuilt_bim.report.wording.values import number, plain, rate, unit_sign


def cost_changes(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Yield a line for each cost line that came, went, is planned otherwise, or whose certain value is another.

    What a line is paid by is the difference of two certain values: one that has fallen, or a rate that is another,
    has to be seen.
    """
    old = {line.global_id: line for line in before.cost_lines}
    new = {line.global_id: line for line in after.cost_lines}
    for key, line in new.items():
        if key not in old:
            yield f"{_named(line)}: new"
        elif text := ", ".join(_parts(old[key], line)):
            yield f"{_named(line)}: {text}"
    yield from (f"{_named(old[key])}: no longer there" for key in old if key not in new)


def _parts(old: CostProgress, new: CostProgress) -> Iterator[str]:
    """Yield what changed on one line, as it is shown."""
    shown = {
        "planned": (_quantity(old), _quantity(new)),
        "rate": (rate(old.rate), rate(new.rate)),
        "elements": (str(len(old.elements)), str(len(new.elements))),
        "not measured": (str(old.others), str(new.others)),
        "certain": (_money(old), _money(new)),
    }
    for what, (was, now) in shown.items():
        if was != now:
            yield f"{what} {was} -> {now}"


def _quantity(line: CostProgress) -> str:
    return f"{number(line.planned_quantity, 3)} {unit_sign(line.unit)}"


def _money(line: CostProgress) -> str:
    return f"{number(line.earned_lower)} {plain(line.currency)}".strip()


def _named(line: CostProgress) -> str:
    return f"cost line {plain(f'{line.identification} {line.name}').strip() or line.global_id}"
