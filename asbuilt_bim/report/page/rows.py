"""The page's own rows: what to photograph next and where to stand, and what changed since the last visit."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.completion.wanted_views import stands_on
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, ProgressReport, WantedView
from asbuilt_bim.report.page.plan import storey_hulls, towards_on_plan
from asbuilt_bim.report.wording.completion import best_words
from asbuilt_bim.report.wording.of_page.next_words import (
    FROM_OUTSIDE,
    FROM_SCAFFOLD,
    NO_ROOM,
    ON_FLOOR,
    near_words,
    side_words,
    stand_words,
)
from asbuilt_bim.report.wording.values import area, percent_certain


@dataclass(frozen=True, slots=True, kw_only=True)
class NextRow:
    """A view to take, by its number on the plan."""

    number: int
    element: ElementProgress
    begun: bool
    open_m2: float
    unseen_m2: float
    words: str


def next_rows(report: ProgressReport) -> tuple[NextRow, ...]:
    """Return the rows, the most valuable first; `MOST_VIEWS` of them fit the page."""
    elements = {element.global_id: element for element in report.elements}
    faces = {face.face_id: face for face in report.faces}
    towards, hulls = towards_on_plan(report), storey_hulls(report)
    stood = {s.name: s.world_from_left[:2, 3] for s in report.stations if s.world_from_left is not None}
    lowest = report.storeys[0].key if report.storeys else ""
    rows = []
    for number, view in enumerate(report.wanted_views, start=1):
        if (element := elements.get(view.element)) is None or (face := faces.get(view.face_id)) is None:
            continue
        where = _where(view, hulls.get(element.storey), is_lowest=element.storey == lowest)
        rows.append(
            NextRow(
                number=number,
                element=element,
                begun=view.begun,
                open_m2=view.open_m2,
                unseen_m2=view.unseen_m2,
                words=_words(number, view, face, towards, where, stood.get(view.nearest_station)),
            )
        )
    return tuple(rows)


def _words(
    number: int,
    view: WantedView,
    face: DesignFaceRecord,
    towards: Callable[[float, float], str] | None,
    where: str,
    stood_m: FloatArray | None,
) -> str:
    """Say where to stand, before which side, and which way that is from the nearest station (2,)."""
    role = "lateral surface" if face.kind == "cylinder" else face.role
    if view.stand_x_m is None or view.stand_y_m is None:
        x, y, _ = np.cross(face.frame_m[1], face.frame_m[2]).tolist()
        known = towards is not None and face.kind == "plane"
        return f"{side_words(role, towards(x, y) if known and towards else '').capitalize()}. {NO_ROOM}"
    x, y = view.stand_x_m - view.look_x_m, view.stand_y_m - view.look_y_m
    side = side_words(role, towards(x, y) if towards else "")
    way = ""
    if towards is not None and stood_m is not None:
        way = towards(view.stand_x_m - float(stood_m[0]), view.stand_y_m - float(stood_m[1]))
    near = near_words(view.nearest_station, view.nearest_m, way)
    return f"{stand_words(number, side, math.hypot(x, y), where)} {near}".strip()


def _where(view: WantedView, hull_m: FloatArray | None, *, is_lowest: bool) -> str:
    """Say whether a place lies on its storey's floor, as far as its walls and columns show how far that reaches."""
    if hull_m is None or view.stand_x_m is None or view.stand_y_m is None:
        return ON_FLOOR
    if stands_on(hull_m, np.array([view.stand_x_m, view.stand_y_m])):
        return ON_FLOOR
    return FROM_OUTSIDE if is_lowest else FROM_SCAFFOLD


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

    @property
    def is_other_state(self) -> bool:
        """Say whether it came, went, or is in another state; else its figures alone read otherwise."""
        return (self.then and self.then.shown_state) != (self.now and self.now.shown_state)


def since_rows(before: ProgressReport, after: ProgressReport) -> tuple[SinceRow, ...]:
    """Return the elements that came, went, or changed by what the page shows: other states first, by class and name."""
    old = {element.global_id: element for element in before.elements}
    new = {element.global_id: element for element in after.elements}
    rows = [SinceRow(then=old.get(key), now=new.get(key)) for key in old | new]
    reported = [row for row in rows if _shown(row.then) != _shown(row.now)]
    return tuple(sorted(reported, key=_since_order))


def _since_order(row: SinceRow) -> tuple[bool, str, str, str]:
    return not row.is_other_state, row.element.ifc_class, row.element.name, row.element.global_id


def _shown(element: ElementProgress | None) -> tuple[str | None, ...]:
    """Return what a row shows of an element, as it reads."""
    if element is None:
        return ()
    done = element.completion
    built = area(element.as_built_area_m2, element.as_built_sigma_m2)
    return (element.shown_state, percent_certain(done.lower), best_words(done), built)
