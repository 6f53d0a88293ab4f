"""What is otherwise than at the visit before, an element a row: what a month's payment is argued by."""

from __future__ import annotations

from dataclasses import dataclass

from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.report.wording.values import area, percent, percent_certain


@dataclass(frozen=True, slots=True, kw_only=True)
class SinceRow:
    """An element as it was at the visit before, and as it is now; None where that design did not have it."""

    then: ElementProgress | None
    now: ElementProgress | None

    @property
    def element(self) -> ElementProgress:
        """Return the element that the row is of, as last known."""
        found = self.now or self.then
        assert found is not None
        return found


def since_rows(before: ProgressReport, after: ProgressReport) -> tuple[SinceRow, ...]:
    """Return the elements that came, went, or changed by what the page shows, by class and name."""
    old = {element.global_id: element for element in before.elements}
    new = {element.global_id: element for element in after.elements}
    rows = [SinceRow(then=old.get(key), now=new.get(key)) for key in old | new]
    told = [row for row in rows if _shown(row.then) != _shown(row.now)]
    return tuple(sorted(told, key=lambda r: (r.element.ifc_class, r.element.name, r.element.global_id)))


def _shown(element: ElementProgress | None) -> tuple[str | None, ...]:
    """Return what a row shows of an element, as it reads."""
    if element is None:
        return ()
    done = element.completion
    built = area(element.as_built_area_m2, element.as_built_sigma_m2)
    return (element.state, percent_certain(done.lower), percent(done.best), built)
