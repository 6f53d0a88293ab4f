"""The page's own rows: what to photograph next and where to stand, and what changed since the last visit."""

import math
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, ProgressReport, WantedView
from asbuilt_bim.report.wording.values import area, percent, percent_certain

MOST_SHOWN = 12
_TOWARDS = (
    "+x",
    "+x/+y",
    "+y",
    "\N{MINUS SIGN}x/+y",
    "\N{MINUS SIGN}x",
    "\N{MINUS SIGN}x/\N{MINUS SIGN}y",
    "\N{MINUS SIGN}y",
    "+x/\N{MINUS SIGN}y",
)
"""A line breaks behind a hyphen, but behind no minus sign."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NextRow:
    """A view to take."""

    element: ElementProgress
    begun: bool
    open_m2: float
    unseen_m2: float
    side: str  # "side towards +y"
    stand: str


def next_rows(report: ProgressReport) -> tuple[NextRow, ...]:
    """Return the rows, the most valuable first; `MOST_SHOWN` of them fit the page."""
    elements = {element.global_id: element for element in report.elements}
    faces = {face.face_id: face for face in report.faces}
    return tuple(
        NextRow(
            element=elements[view.element],
            begun=view.begun,
            open_m2=view.open_m2,
            unseen_m2=view.unseen_m2,
            side=_side(view, faces[view.face_id]),
            stand=_stand(view),
        )
        for view in report.wanted_views
        if view.element in elements and view.face_id in faces
    )


def _side(view: WantedView, face: DesignFaceRecord) -> str:
    """Name a side by the axes of the IFC's world that it looks along."""
    if view.stand_x_m is not None and view.stand_y_m is not None:
        x, y = view.stand_x_m - view.look_x_m, view.stand_y_m - view.look_y_m
    elif face.kind == "plane":
        x, y, _ = np.cross(face.frame_m[1], face.frame_m[2]).tolist()
    else:
        return "lateral surface"
    word = "lateral surface" if face.kind == "cylinder" else face.role
    return f"{word} towards {_TOWARDS[round(math.atan2(y, x) / (math.pi / 4.0)) % 8]}"


def _stand(view: WantedView) -> str:
    """Say where to stand."""
    if view.stand_x_m is None or view.stand_y_m is None:
        return "the design leaves no 3 m free before it: go near, or look along it"
    away = math.hypot(view.stand_x_m - view.look_x_m, view.stand_y_m - view.look_y_m)
    place = f"{away:.1f} m before it, at x {view.stand_x_m:.1f}, y {view.stand_y_m:.1f}"
    return place + (
        f"; {view.nearest_m:.1f} m from station {view.nearest_station}" if view.nearest_m is not None else ""
    )


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
    reported = [row for row in rows if _shown(row.then) != _shown(row.now)]
    return tuple(sorted(reported, key=lambda r: (r.element.ifc_class, r.element.name, r.element.global_id)))


def _shown(element: ElementProgress | None) -> tuple[str | None, ...]:
    """Return what a row shows of an element, as it reads."""
    if element is None:
        return ()
    done = element.completion
    built = area(element.as_built_area_m2, element.as_built_sigma_m2)
    return (element.shown_state, percent_certain(done.lower), percent(done.best), built)
