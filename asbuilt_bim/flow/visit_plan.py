"""What a visit should photograph and from where: before it for all that is due, during it for what is still unseen."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import ResultError
from asbuilt_bim.flow.design_source import design_of
from asbuilt_bim.flow.output.folder import read_current
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.ifc.apart import read_floors
from asbuilt_bim.progress.completion.planned import due_by
from asbuilt_bim.progress.completion.records import place_of
from asbuilt_bim.progress.completion.wanted_views import begun_by
from asbuilt_bim.progress.globalid_remap import known_again
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.visits.expected import VisitPlan, expected_stations
from asbuilt_bim.progress.visits.plan_visit import plan_visit
from asbuilt_bim.progress.visits.surroundings import Surroundings
from asbuilt_bim.progress.visits.tags import NEEDED, helpful_tags, surveyed_tags, tags_in_view
from asbuilt_bim.project.model import Project
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.tags import TagPlace
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.schedule.read import scheduled

PLANNED_TAG_M = 0.25
"""What `asbuilt-bim print tags` prints, where the project gives no size."""


def planned_design(project: Project, cache: Cache) -> BimModel:
    """Return the project's design with its planned dates.

    Raises:
        AsBuiltError: the IFC files or the schedule can't be used.
    """
    design = design_of(project, cache)
    return design if project.schedule is None else scheduled(design, project.schedule)


def visit_plan(
    project: Project,
    design: BimModel,
    rig: StereoRig,
    survey: tuple[SurveyedMarker, ...],
    day: date,
    known: ProgressReport,
    *,
    most: int = 0,
    taken: Sequence[FloatArray] = (),
) -> VisitPlan:
    """Plan the stations for what is due on a day, less what earlier visits saw built: `known` is the report of them.

    `taken` are the poses (4, 4) of stations of that day: what they show isn't wanted again. Of `most` stations those
    come first that see enough tags, and what should stand already.

    Raises:
        AsBuiltError: the IFC files can't be used.
    """
    wanted = begun_by(design, day)
    due = tuple(one for one in design.elements if one.global_id in wanted)
    states = known_states(known, design, project)
    tags, size_m = surveyed_tags(survey), project.markers.size_m or PLANNED_TAG_M
    by_tags = bool(survey) or not (project.poses or project.control_points or _any_near(project))

    def placed(around: Surroundings, pose: FloatArray) -> bool:
        return len(tags_in_view(rig, around, pose, tags)) >= NEEDED

    visit = plan_visit(
        design, read_floors(project.ifc), rig, wanted, states, most=most, taken=taken,
        first=due_by(design.tasks, day), counts=placed if by_tags else None,
    )  # fmt: skip
    return VisitPlan(
        day=day,
        known=known,
        visit=visit,
        stations=expected_stations(visit, rig, tags, due, project.options.measure.most_width_px),
        tags=helpful_tags(visit, rig, tags, size_m, due),
        due=due,
        later=len(design.elements) - len(due),
        has_dates=any(task.schedule_start is not None for task in design.tasks),
        by_tags=by_tags,
    )


def _any_near(project: Project) -> bool:
    return any(station.near is not None for one in project.visits for station in one.stations)


def known_report(
    project: Project, design: BimModel, survey: tuple[SurveyedMarker, ...], day: date, result: Path | None
) -> ProgressReport:
    """Return what earlier visits saw: a result, that of a run's folder, or a report of nothing seen.

    Raises:
        ResultError: there is none at `result`, it can't be read, or it is of other elements.
    """
    if result is None:
        blank = monitor((), (), survey, design, EMPTY_HISTORY, day, project.options)
        return replace(blank, project_name=project.name, rejections=(), notes=())
    current = read_current(result) if result.is_dir() else None
    if result.is_dir() and current is None:
        raise ResultError(f"{result}: holds no run of this program's; name the --out folder of a run, or drop --result")
    report = known_again(read_result(result if current is None else current.folder / "result.json"), design)
    if not {one.global_id for one in report.elements} & {one.global_id for one in design.elements}:
        raise ResultError(f"{result}: is of another design: not one element is the same; name a result of this project")
    return report


def remembered_tags(report: ProgressReport) -> dict[int, TagPlace]:
    """Return the markers that nobody surveyed, by id, where the visits of a report found them."""
    return {number: place_of(record) for number, record in remember(EMPTY_HISTORY, report).markers.items()}


def known_states(report: ProgressReport, design: BimModel, project: Project) -> dict[str, SurfaceState]:
    """Return what a report knows of the design's faces, by face id; where a revision moved a face, of where it is."""
    history = remember(EMPTY_HISTORY, report)
    found: dict[str, SurfaceState] = {}
    for element in design.elements:
        for face in element.faces:
            state = history.earlier(element.global_id, face, project.options.progress)
            if state is not None:
                found[face.face_id] = state
    return found
