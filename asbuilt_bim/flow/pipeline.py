"""The whole flow on one screen: photos and an IFC file in, one report a visit out."""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import reduce

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, each_once, noted
from asbuilt_bim.errors import Rejection
from asbuilt_bim.flow.design_source import design_of, place_on_map, with_costs_table
from asbuilt_bim.flow.measure_visit import Progress, Workplace, measure_visit, picture_name
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.flow.rough_places import check_near, rough_places
from asbuilt_bim.flow.shown_again import Shown
from asbuilt_bim.match.adjust import adjust_with_design
from asbuilt_bim.match.displaced import where_they_stand
from asbuilt_bim.match.survey_trust import Shift, hold_against_design, refused_stations, without_stations
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.measure.step_timer import StepTimer
from asbuilt_bim.progress.completion.records import marker_records, place_of
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.globalid_remap import remapped_ids, with_new_ids
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.report import ElementProgress, MarkerRecord, ProgressReport
from asbuilt_bim.progress.revision import remap_notes, revision_notes
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.undone import undone_front
from asbuilt_bim.progress.tolerance_checks import with_tolerance
from asbuilt_bim.project.check import refuse_missing
from asbuilt_bim.project.networks import people_sought
from asbuilt_bim.project.options import Options
from asbuilt_bim.project.read import Project, Visit
from asbuilt_bim.project.tables.observations import read_observations
from asbuilt_bim.project.tables.outlines import read_outlines, without_outlined
from asbuilt_bim.project.tables.places import known_places
from asbuilt_bim.register.by_design.notes import design_notes
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.placement import NO_POINTS, NOTHING, ControlPoint, register
from asbuilt_bim.register.pose import Placement, StationPose, SurveyedMarker
from asbuilt_bim.register.survey import check_survey
from asbuilt_bim.report.result.document import read_past
from asbuilt_bim.report.tables import lost_stations
from asbuilt_bim.scale.executor import one_thread
from asbuilt_bim.scale.share import AmongProcesses, Share, in_turn
from asbuilt_bim.schedule.read import scheduled


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunResult:
    """What a run found: a report a visit, and the pictures (JPEG without EXIF) that the reports name."""

    rig: StereoRig
    calibration: Calibration | None  # None where the rig was read from a file
    design: BimModel
    reports: tuple[ProgressReport, ...]  # in the order of the visits; the last one is THE result
    pictures: dict[str, bytes]
    seconds: dict[str, float]  # by step of the whole run
    from_cache: int  # stations that had been measured before
    past: tuple[ProgressReport, ...] = ()  # carried over from earlier runs: visits before all of the reports'


def monitor(
    measured: Sequence[StationMeasurement],
    rejections: Sequence[Rejection],
    survey: tuple[SurveyedMarker, ...],
    design: BimModel,
    history: VisitHistory,
    day: date,
    options: Options,
    accept_shift: Shift | None = None,
    accept_moved: Collection[str] = (),
    share: Share = in_turn,
    given: Mapping[str, StationPose] = NOTHING,
    control_points: Mapping[str, Sequence[ControlPoint]] = NO_POINTS,
    rough: RoughPlaces | None = None,
) -> ProgressReport:
    """Return what a visit's measured stations say of the design. Pure: no clock, no files, no globals.

    What is known to be wrong decides nothing. Where the survey lies beside the design, or the visit would undo what
    earlier ones saw, not one station counts, and everything is as the visits before left it. Nothing is said of
    elements that stand beside their design, until a person accepts that: then they are judged where they stand. `share`
    has stations placed and matched and elements judged, here or in several processes: that changes nothing.
    """
    remembered = {marker_id: place_of(record) for marker_id, record in history.markers.items()}
    placement = register(
        tuple(measured), survey, options.register, given=given, control_points=control_points, remembered=remembered,
        share=share, rough=rough,
    )  # fmt: skip
    held = hold_against_design(placement, design, options.match, accept_shift, share)
    standing = where_they_stand(held.matched, design, options.match, history.moves_m, accept_moved)
    design, beside = standing.design, standing.not_accepted
    matched = adjust_with_design(standing.matched, design, options.match)
    surfaces = classify_surface(matched, design, history, options.progress, beside, share)
    undone = undone_front(surfaces, design, history, day, options.progress)
    if undone:
        undone += refused_stations(matched, Reason.STATION_VISIT_UNDOES)
        matched = without_stations(matched, design, options.match)
        surfaces = classify_surface(matched, design, history, options.progress, beside, share)
    placed = {station.measurement.station for station in matched.stations}
    report = summarise(
        surfaces,
        matched,
        design,
        history,
        day,
        rejections=(*held.rejections, *undone, *rejections, *placement.rejections),
        options=options.progress,
        unplaced=[station for station in measured if station.station not in placed],
        displaced=standing.displaced,
    )
    report = replace(report, markers=_markers(placement, history, day, counts=bool(report.placed)))
    return _saying_why(replace(report, notes=(*held.notes, *design_notes(matched.stations), *report.notes)))


def _markers(placement: Placement, history: VisitHistory, day: date, *, counts: bool) -> tuple[MarkerRecord, ...]:
    """Return the markers that nobody surveyed; what a visit found that doesn't count is forgotten."""
    moved = {int(one.subject.name) for one in placement.rejections if one.code is Reason.MARKER_MOVED_SINCE}
    return marker_records(placement.tags if counts else {}, history.markers, day, moved)


def _saying_why(report: ProgressReport) -> ProgressReport:
    """Say of every element why its visit decided nothing, where no station of it counts."""
    cause = next(iter(report.faults or report.rejections), None)
    if report.placed or cause is None:
        return report

    def with_reason(element: ElementProgress) -> ElementProgress:
        why = noted(Reason.DECIDED_NOTHING, about(SubjectKind.ELEMENT, element.global_id), cause=str(cause.code))
        return replace(element, notes=(why, *element.notes))

    return replace(report, elements=tuple(with_reason(element) for element in report.elements))


@one_thread()
def run_project(project: Project, place: Workplace, progress: Progress) -> RunResult:
    """Run every visit of a project in the order of dates, each with the history of those before.

    A bad station is a rejection in its visit's report. A visit without one good station still gives a report: in it
    everything is as the visits before left it.

    Raises:
        AsBuiltError: files are missing, or the IFC, the rig, the boards or the survey can't be used.
    """
    timer = StepTimer(time.perf_counter)
    refuse_missing(project)
    progress("read the IFC", 0, 1)
    design = with_costs_table(design_of(project, place.cache), project, place.cache)
    if project.schedule is not None:
        design = scheduled(design, project.schedule)
    observed, unknown = read_observations(project.observations, design) if project.observations else ((), ())
    known_of = known_places(project, lambda: place_on_map(project))
    survey = known_of.survey
    stray = check_survey(survey, design)
    check_near(project, design)
    progress("read the IFC", 1, 1, ", ".join(path.name for path in project.ifc))
    timer.done("read the IFC")
    source = rig_of(project, place.cache, progress)
    rig = source.rig
    timer.done("rig")
    known, past = 0, read_past(project.history, project.visits[0].date)
    outlines = read_outlines(project)
    others = remapped_ids(past[-1], design) if past else {}
    past = tuple(with_new_ids(report, others) for report in past)
    history = reduce(remember, past, EMPTY_HISTORY)
    reports: list[ProgressReport] = []
    left_out = _left_out_before(past)  # at earlier visits: the last report alone would never say it
    pictures: dict[str, bytes] = {}
    shown: tuple[Shown, ...] = ()
    share = AmongProcesses(workers=place.workers)
    for visit in project.visits:
        seen = measure_visit(visit, project, rig, place, progress, survey, shown)
        shown = seen.shown
        timer.done("measure")
        rejections = (*source.warnings, *seen.rejections, *stray)
        accepted = project.accepted_shift, project.accept_moved
        report = monitor(
            seen.measured, rejections, survey, design, history, visit.date, project.options, *accepted, share=share,
            given=known_of.given(visit.date), control_points=known_of.clicked(visit.date, rig, seen.measured),
            rough=rough_places(visit, design),
        )  # fmt: skip
        revised = (*remap_notes(past[-1], others), *revision_notes(past[-1], report)) if past else ()
        notes = (*report.notes, *unknown, *seen.rig_notes, *revised, *left_out)
        report = replace(report, rig=seen.rig, notes=notes, observations=observed)
        report = with_tolerance(report, design, project.tolerance)
        report = replace(
            report, pictures=project.pictures, people_sought=people_sought(project.networks),
            people_outlined=len(outlines),
        )  # fmt: skip
        names = [station.name for station in visit.stations if station.name not in report.placed]
        left_out += _left_out(names, visit.date)
        history = remember(history, report)
        timer.done("register, match, judge")
        progress("judge", len(reports) + 1, len(project.visits), visit.date.isoformat())
        reports.append(_named(report, project, visit))
        shown_now = without_outlined(seen.pictures, outlines, visit.date, rig, seen.measured)
        pictures.update({picture_name(visit.date, name): picture for name, picture in shown_now.items()})
        known += seen.from_cache
    return RunResult(
        rig=rig,
        calibration=source.calibration,
        design=design,
        reports=_told_of_undoing(reports),
        pictures=pictures,
        seconds=timer.seconds,
        from_cache=known,
        past=past,
    )


def _told_of_undoing(reports: Sequence[ProgressReport]) -> tuple[ProgressReport, ...]:
    """Say in a visit's report which later visit would undo it: one of the two has the other's photos, maybe."""
    told: list[ProgressReport] = []
    for index, report in enumerate(reports):
        later = [one for one in reports[index + 1 :] if any(r.code is Reason.VISIT_UNDOES for r in one.rejections)]
        subject = about(SubjectKind.VISIT, report.visit_date.isoformat())
        notes = [noted(Reason.LATER_VISIT_UNDOES, subject, later=one.visit_date.isoformat()) for one in later]
        told.append(report if report.nothing_seen else replace(report, notes=(*notes, *report.notes)))
    return tuple(told)


def _left_out_before(past: Sequence[ProgressReport]) -> list[Note]:
    """Return the notes on stations that visits carried over could not use, their own and those they had from before."""
    notes: list[Note] = []
    for report in past:
        notes += [note for note in report.notes if note.code == Reason.STATIONS_NOT_USED]
        notes += _left_out([row.name for row in lost_stations(report)], report.visit_date)
    return list(each_once(notes))


def _left_out(names: Sequence[str], day: date) -> list[Note]:
    """Return a note for the reports of later visits, where stations of a day count for nothing."""
    subject = about(SubjectKind.VISIT, day.isoformat())
    return [noted(Reason.STATIONS_NOT_USED, subject, stations=tuple(names))] if names else []


def _named(report: ProgressReport, project: Project, visit: Visit) -> ProgressReport:
    """Return a report with the project's name and the stations' photo paths, which pure code doesn't know."""
    photos = {station.name: station for station in visit.stations}
    stations = tuple(
        replace(
            record,
            left_photo=project.relative(photos[record.name].left),
            right_photo=project.relative(photos[record.name].right),
            picture=picture_name(visit.date, record.name),
        )
        for record in report.stations
    )
    return replace(report, project_name=project.name, stations=stations)
