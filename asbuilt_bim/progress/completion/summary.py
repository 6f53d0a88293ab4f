"""Sums a visit up: elements, storeys, tasks, cost lines, and all that was left out, in one report."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date

from asbuilt_bim.bim.model import BimModel, Task
from asbuilt_bim.bim.schedule import EVERY_DAY, WorkCalendar
from asbuilt_bim.errors import Rejection
from asbuilt_bim.match.displaced import Displaced
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.completion.earned_value import cost_progress
from asbuilt_bim.progress.completion.element import is_unfinished, progress_of
from asbuilt_bim.progress.completion.forecast import forecast
from asbuilt_bim.progress.completion.moments import days_past, late_days
from asbuilt_bim.progress.completion.planned import days_behind, planned_share
from asbuilt_bim.progress.completion.records import design_face_record, station_record
from asbuilt_bim.progress.completion.rollup import group, with_unmeasured
from asbuilt_bim.progress.completion.wanted_views import wanted_views
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, GroupProgress, ProgressReport, TaskProgress
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
    displaced: Mapping[str, Displaced] | None = None,
) -> ProgressReport:
    """Return the visit's report. Pure: photo paths and provenance are the edge's to fill in.

    `rejections` are those of earlier steps; `unplaced` are stations that were measured but have no pose.
    """
    limits = options or ProgressOptions()
    by_id = {surface.face_id: surface for surface in surfaces}
    of_element = {e.global_id: [by_id[face.face_id] for face in e.faces] for e in design.elements}
    elements = tuple(
        progress_of(e, of_element[e.global_id], visit_date, history, limits, (displaced or {}).get(e.global_id))
        for e in design.elements
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
        storeys=_storeys(design, elements, of_element, limits),
        whole=group("", "Whole", elements, of_element, limits),
        tasks=tuple(
            task_progress(task, progress, of_element, visit_date, limits, task.calendar or calendar)
            for task in design.tasks
        ),
        cost_lines=tuple(cost_progress(line, bodies, progress, limits) for line in design.cost_lines),
        faces=tuple(design_face_record(f, by_id[f.face_id]) for e in design.elements for f in e.faces),
        stations=tuple(sorted(stations, key=lambda record: record.name)),
        rejections=tuple(dict.fromkeys(rejections)),
        unmatched=matched.unmatched,
        unobserved=tuple(s.face_id for s in surfaces if s.built_area_m2 + s.open_area_m2 <= 0.0),
        notes=design.notes,
        schedule=design.schedule,
        north=design.north,
        grid_lines=design.grid_lines,
        wanted_views=wanted_views(design, progress, by_id, stations, visit_date),
        complete_from=limits.complete_from,
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


def task_progress(
    task: Task,
    elements: Mapping[str, ElementProgress],
    surfaces: Mapping[str, Sequence[SurfaceState]],
    visit_date: date,
    options: ProgressOptions,
    calendar: WorkCalendar = EVERY_DAY,
) -> TaskProgress:
    """Return a task's progress. Its start is the first visit that saw something of it built; its finish the first one
    that found all of its elements complete, and as much of each certain (`complete_from`). A task with elements that
    aren't measured here is never finished here.
    """
    members = [elements[key] for key in task.elements if key in elements]
    others = task.others + len(task.elements) - len(members)
    complete = bool(members) and not others and all(element.complete_on for element in members)
    measured = group(task.global_id, task.name, members, surfaces, options)
    share = len(members) / max(len(members) + others, 1)
    made = TaskProgress(
        progress=replace(measured, completion=with_unmeasured(measured.completion, share)),
        schedule_start=task.schedule_start,
        schedule_finish=task.schedule_finish,
        actual_start=_first(element.first_built for element in members),
        actual_finish=_last(element.complete_on for element in members) if complete else None,
        late=_late(task, members, complete, visit_date, options),
        identification=task.identification,
        outline=task.outline,
        links=task.links,
        schedule_uid=task.schedule_uid,
        planned=planned_share(task.schedule_start, task.schedule_finish, visit_date, calendar),
        others=others,
        ifc_finish=task.ifc_finish,
        finish_from=task.finish_from,
    )
    unfinished_on = _last(element.unfinished_on for element in members)
    best, least, most = days_behind(made, made.progress.completion, visit_date, calendar, unfinished_on)
    ends = forecast(made, visit_date, calendar)
    return replace(
        made,
        behind_days=best,
        behind_least_days=least,
        behind_most_days=most,
        late_days=late_days(made.schedule_finish, made.late, visit_date),
        forecast_finish=ends.finish,
        forecast_earliest=ends.earliest,
    )


def _first(days: Iterable[date | None]) -> date | None:
    return min((day for day in days if day is not None), default=None)


def _last(days: Iterable[date | None]) -> date | None:
    return max((day for day in days if day is not None), default=None)


def _late(
    task: Task, members: Sequence[ElementProgress], complete: bool, visit_date: date, options: ProgressOptions
) -> bool | None:
    if task.schedule_finish is None or not members:
        return None
    if complete or not days_past(task.schedule_finish, visit_date):
        return False
    return True if any(is_unfinished(one.state, one.completion, options.complete_from) for one in members) else None
