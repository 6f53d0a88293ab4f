"""Sums a visit up: elements, storeys, tasks, cost lines, and all that was left out, in one report."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.bim.schedule import EVERY_DAY
from asbuilt_bim.errors import Rejection
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.completion.earned_value import cost_progress
from asbuilt_bim.progress.completion.element import progress_of
from asbuilt_bim.progress.completion.records import design_face_record, station_record
from asbuilt_bim.progress.completion.rollup import group
from asbuilt_bim.progress.completion.tasks import task_progress
from asbuilt_bim.progress.completion.wanted_views import wanted_views
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, GroupProgress, ProgressReport
from asbuilt_bim.progress.surface import SurfaceState

NO_STOREY = "(no storey)"


def summarise(
    surfaces: Sequence[SurfaceState],
    matched: MatchResult,
    design: BimModel,
    history: VisitHistory,
    visit_date: date,
    *,
    rejections: Sequence[Rejection] = (),
    options: ProgressOptions | None = None,
    unplaced: Sequence[StationMeasurement] = (),
) -> ProgressReport:
    """Return the visit's report. Pure: photo paths and provenance are the edge's to fill in.

    `rejections` are those of earlier steps; `unplaced` are stations that were measured but have no pose.
    """
    told = options or ProgressOptions()
    by_id = {surface.face_id: surface for surface in surfaces}
    of_element = {e.global_id: [by_id[face.face_id] for face in e.faces] for e in design.elements}
    elements = tuple(
        progress_of(element, of_element[element.global_id], visit_date, history, told) for element in design.elements
    )
    progress = {element.global_id: element for element in elements}
    by_face: dict[str, list[FaceMatch]] = {}
    for match in matched.matches:
        by_face.setdefault(match.face_id, []).append(match)
    parts = {face_id for surface in surfaces for face_id in surface.parts}
    stations = [station_record(p.measurement, p.pose, visit_date, by_face, parts) for p in matched.stations]
    stations += [station_record(one, None, visit_date, {}) for one in unplaced]
    calendar = design.schedule.calendar if design.schedule else EVERY_DAY
    bodies = {element.global_id: element for element in design.elements}
    return ProgressReport(
        project_name=design.project_name,
        visit_date=visit_date,
        earlier_visits=history.visits,
        elements=elements,
        storeys=_storeys(design, elements, of_element, told),
        whole=group("", "Whole", elements, of_element, told),
        tasks=tuple(
            task_progress(task, progress, of_element, visit_date, told, task.calendar or calendar)
            for task in design.tasks
        ),
        cost_lines=tuple(cost_progress(line, bodies, progress, told) for line in design.cost_lines),
        faces=tuple(design_face_record(f, by_id[f.face_id]) for e in design.elements for f in e.faces),
        stations=tuple(sorted(stations, key=lambda record: record.name)),
        rejections=tuple(dict.fromkeys(rejections)),
        unmatched=matched.unmatched,
        unobserved=tuple(s.face_id for s in surfaces if s.built_area_m2 + s.open_area_m2 <= 0.0),
        notes=design.notes,
        schedule=design.schedule,
        wanted_views=wanted_views(design, progress, by_id, stations, visit_date),
    )


def _storeys(
    design: BimModel,
    elements: Sequence[ElementProgress],
    of_element: dict[str, list[SurfaceState]],
    options: ProgressOptions,
) -> tuple[GroupProgress, ...]:
    """Return the storeys from below, those without walls and columns left out; last, what belongs to none."""
    named = {storey.global_id: storey.name for storey in design.storeys}
    groups = []
    for key, name in (*named.items(), ("", NO_STOREY)):
        members = [e for e in elements if e.storey == key or (not key and e.storey not in named)]
        if members:
            groups.append(group(key, name, members, of_element, options))
    return tuple(groups)
