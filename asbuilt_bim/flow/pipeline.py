"""The whole flow on one screen: photos and an IFC file in, one report a visit out."""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import reduce

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import OutputError, Rejection
from asbuilt_bim.flow.design_source import design_of, place_on_map, with_costs_table
from asbuilt_bim.flow.measure_visit import Progress, Workplace, measure_visit, picture_name
from asbuilt_bim.flow.rig_source import ProjectRig, rig_of
from asbuilt_bim.flow.rough_places import check_near, rough_places
from asbuilt_bim.flow.shown_again import Photographed, Shown
from asbuilt_bim.flow.visit_report import (
    left_out,
    left_out_before,
    named,
    scale_first,
    with_exchange_named,
    with_undoing_noted,
)
from asbuilt_bim.match.adjust import adjust_with_design
from asbuilt_bim.match.displaced import where_they_stand
from asbuilt_bim.match.survey_trust import Shift, hold_against_design, refused_stations, without_stations
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.measure.step_timer import StepTimer
from asbuilt_bim.progress.completion.records import marker_records, place_of
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.completion.visit_doubts import visit_doubts
from asbuilt_bim.progress.globalid_remap import former_ids, remapped_ids, with_former_ids, with_new_ids
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.report import ElementProgress, MarkerRecord, ProgressReport
from asbuilt_bim.progress.revision import remap_notes, revision_notes
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.undone import undone_front
from asbuilt_bim.progress.tolerance_checks import with_tolerance
from asbuilt_bim.progress.valuation.inputs import Observation
from asbuilt_bim.progress.visits.order import Contradiction, contradictions, likeliest_wrong, refusals
from asbuilt_bim.project.check import refuse_missing
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.networks import people_sought
from asbuilt_bim.project.options import Options
from asbuilt_bim.project.tables.observations import read_observations
from asbuilt_bim.project.tables.outlines import Outline, read_outlines, without_outlined
from asbuilt_bim.project.tables.places import KnownPlaces, check_places, known_places
from asbuilt_bim.register.by_design.notes import design_notes
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.placement import NO_POINTS, NOTHING, ControlPoint, register
from asbuilt_bim.register.pose import Placement, StationPose, SurveyedMarker
from asbuilt_bim.register.scale import scale_doubt
from asbuilt_bim.report.result.document import read_past
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
    barred: Sequence[Rejection] = (),
    scale_share: float = 0.0,
) -> ProgressReport:
    """Return what a visit's measured stations say of the design. Pure: no clock, no files, no globals.

    What is known to be wrong decides nothing. Where the survey lies beside the design, or the visit would undo what
    earlier ones saw, or is `barred` for what another visit says, not one station counts, and everything is as the
    visits before left it. Nothing is said of elements that stand beside their design, until a person accepts that: then
    they are judged where they stand. `share` has stations placed and matched and elements judged, here or in several
    processes: that changes nothing. By `scale_share` known lengths contradict the scale: what lies elsewhere for it is
    within the bounds.
    """
    remembered = {marker_id: place_of(record) for marker_id, record in history.markers.items()}
    placement = register(
        tuple(measured), survey, options.register, given=given, control_points=control_points, remembered=remembered,
        share=share, rough=rough,
    )  # fmt: skip
    held = hold_against_design(placement, design, options.match, accept_shift, share)
    against = (*barred, *refused_stations(held.matched, Reason.STATION_VISIT_CONTRADICTS)) if barred else ()
    seen = without_stations(held.matched, design, options.match) if barred else held.matched
    standing = where_they_stand(seen, design, options.match, history.moves_m, accept_moved)
    design, beside = standing.design, standing.not_accepted
    matched = adjust_with_design(standing.matched, design, options.match, share)
    doubt = scale_doubt(placement, survey, scale_share)
    surfaces = classify_surface(matched, design, history, options.progress, beside, share, doubt)
    undone = undone_front(surfaces, design, history, day, options.progress)
    if undone:
        against = (*undone, *refused_stations(matched, Reason.STATION_VISIT_UNDOES))
        matched = without_stations(matched, design, options.match)
        surfaces = classify_surface(matched, design, history, options.progress, beside, share)
    placed = {station.measurement.station for station in matched.stations}
    report = summarise(
        surfaces,
        matched,
        design,
        history,
        day,
        rejections=scale_first(held.rejections, (*against, *rejections, *placement.rejections), scale_share),
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
def run_project(
    project: Project, place: Workplace, progress: Progress, before: ProgressReport | None = None
) -> RunResult:
    """Run every visit of a project in the order of dates, each with the history of those before.

    `before` is what an earlier run in the same place found: it knows the GlobalIds that elements had then.
    A bad station is a rejection in its visit's report. A visit without one good station still gives a report: in it
    everything is as the visits before left it.

    Raises:
        AsBuiltError: files are missing, or the IFC, the rig, the boards or the survey can't be used; or `before` is of
            another project.
    """
    timer = StepTimer(time.perf_counter)
    refuse_missing(project)
    progress("read the IFC", 0, 1)
    past = read_past(project.history, project.visits[0].date)
    design = _with_former_ids(design_of(project, place.cache), (*past[-1:], before))
    _refuse_another(before, project, design, "the folder for the results holds those", "choose another --out")
    for report in past:
        _refuse_another(report, project, design, "history: has a result", "take it out of the project file")
    design = with_costs_table(design, project, place.cache)
    if project.schedule is not None:
        design = scheduled(design, project.schedule)
    observed, unknown = read_observations(project.observations, design) if project.observations else ((), ())
    unknown = (*unknown, *_moved_unknown(project.accept_moved, design))
    known_of = known_places(project, lambda: place_on_map(project))
    stray = check_places(known_of, design)
    check_near(project, design)
    progress("read the IFC", 1, 1, ", ".join(path.name for path in project.ifc))
    timer.done("read the IFC")
    source = rig_of(project, place.cache, progress)
    rig = source.rig
    timer.done("rig")
    others = remapped_ids(past[-1], design) if past else {}
    carried = tuple(with_former_ids(with_new_ids(report, others), design.former_ids) for report in past)
    known = _Known(
        project=project, place=place, progress=progress, timer=timer, design=design, rig=source, places=known_of,
        past=carried, stray=stray, observed=observed, unknown=unknown,
        others=others, outlines=read_outlines(project, (rig.left.width_px, rig.left.height_px)),
    )  # fmt: skip
    found, barred = set[Contradiction](), dict[date, tuple[Rejection, ...]]()
    borrowed: dict[Photographed, Rejection] = {}
    while True:
        judged = _judged(known, barred, borrowed)
        if judged.borrowed:
            borrowed |= judged.borrowed
            continue
        found |= set(contradictions(judged.reports))
        in_order = sorted(found, key=lambda one: (one.later, one.earlier))
        wrong = likeliest_wrong(in_order, judged.of_their_days)
        if wrong <= judged.refused | barred.keys():
            break
        barred = dict(refusals(in_order, wrong))
    return RunResult(
        rig=rig,
        calibration=source.calibration,
        design=design,
        reports=with_exchange_named(with_undoing_noted(judged.reports)),
        pictures=judged.pictures,
        seconds=timer.seconds,
        from_cache=judged.from_cache,
        past=known.past,
    )


def _with_former_ids(design: BimModel, earlier: Sequence[ProgressReport | None]) -> BimModel:
    ids = [former_ids(report, design) for report in earlier if report is not None]
    return replace(design, former_ids={old: today for one in ids for old, today in one.items()})


def _refuse_another(before: ProgressReport | None, project: Project, design: BimModel, what: str, advice: str) -> None:
    """Refuse to go on from another project's result: what it saw and certified isn't this one's."""
    if before is None or before.project_name == project.name:
        return
    there = {element.global_id for element in design.elements}
    if not any(design.today(element.global_id) in there for element in before.elements):
        raise OutputError(
            f"{what} of another project, {before.project_name[:60]!r} (visit of {before.visit_date.isoformat()}): not "
            f"one of its walls and columns is in the IFC of {project.name[:60]!r}; {advice}"
        )


def _moved_unknown(accepted: Collection[str], design: BimModel) -> tuple[Note, ...]:
    """Return the note on GlobalIds that `accept_moved` lists and no element has."""
    there = {element.global_id for element in design.elements}
    lost = [key for key in accepted if design.today(key) not in there]
    named = tuple(key[:60] for key in lost[:8])
    return (
        (noted(Reason.ACCEPT_MOVED_UNKNOWN, about(SubjectKind.DESIGN), elements=named, count=len(lost)),)
        if lost
        else ()
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Known:
    """What a run knows before it looks at its visits; `past` are reports of earlier runs, with today's GlobalIds."""

    project: Project
    place: Workplace
    progress: Progress
    timer: StepTimer
    design: BimModel
    rig: ProjectRig
    places: KnownPlaces
    past: tuple[ProgressReport, ...]
    stray: tuple[Rejection, ...]
    observed: tuple[Observation, ...]
    unknown: tuple[Note, ...]
    others: Mapping[str, str]
    outlines: tuple[Outline, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Judged:
    """The visits' reports and pictures, which visits undo others, and which have photos that say they are theirs."""

    reports: tuple[ProgressReport, ...]
    pictures: dict[str, bytes]
    from_cache: int
    of_their_days: frozenset[date]
    borrowed: Mapping[Photographed, Rejection]  # stations whose photos say the day of a later visit's station

    @property
    def refused(self) -> frozenset[date]:
        """Return the visits that decided nothing, since they would undo earlier ones."""
        undoing = (one for one in self.reports if any(r.code is Reason.VISIT_UNDOES for r in one.rejections))
        return frozenset(one.visit_date for one in undoing)


def _judged(
    known: _Known, barred: Mapping[date, Sequence[Rejection]], borrowed: Mapping[Photographed, Rejection]
) -> _Judged:
    """Judge every visit with the history of those before; those `barred`, and stations `borrowed`, decide nothing.

    Where visits contradict each other, or a later one has a station's photos, this is done again without them: then
    stations come from the cache.
    """
    taken_back: dict[Photographed, Rejection] = {}
    project, past, design = known.project, known.past, known.design
    history = reduce(remember, past, EMPTY_HISTORY)
    from_cache = 0
    reports: list[ProgressReport] = []
    lost = left_out_before(past)  # at earlier visits: the last report alone would never say it
    pictures: dict[str, bytes] = {}
    of_their_days: set[date] = set()
    shown: tuple[Shown, ...] = ()
    survey = known.places.survey
    share = AmongProcesses(workers=known.place.workers)
    for visit in project.visits:
        seen = measure_visit(visit, project, known.rig.rig, known.place, known.progress, survey, shown, borrowed)
        shown = seen.shown
        taken_back |= seen.borrowed
        of_their_days |= {visit.date} if seen.of_its_day else set()
        known.timer.done("measure")
        rejections = (*known.rig.warnings, *seen.rejections, *known.stray)
        accepted = project.accepted_shift, tuple(map(design.today, project.accept_moved))
        report = monitor(
            seen.measured, rejections, survey, design, history, visit.date, project.options, *accepted, share=share,
            given=known.places.given(visit.date, seen.measured), rough=rough_places(visit, design),
            barred=barred.get(visit.date, ()), scale_share=seen.scale_share,
            control_points=known.places.clicked(visit.date, known.rig.rig, seen.measured),
        )  # fmt: skip
        revised = (*remap_notes(past[-1], known.others), *revision_notes(past[-1], report)) if past else ()
        notes = (*report.notes, *visit_doubts(report), *known.unknown, *seen.notes, *revised, *lost)
        report = replace(report, rig=seen.rig, notes=notes, observations=known.observed)
        report = with_former_ids(with_tolerance(report, design, project.tolerance), design.former_ids)
        report = replace(
            report, pictures=project.pictures, csv=project.csv, people_sought=people_sought(project.networks),
            people_outlined=len(known.outlines),
        )  # fmt: skip
        names = [station.name for station in visit.stations if station.name not in report.placed]
        lost += left_out(names, visit.date)
        history = remember(history, report)
        known.timer.done("register, match, judge")
        known.progress("judge", len(reports) + 1, len(project.visits), visit.date.isoformat())
        reports.append(named(report, project, visit))
        shown_now = without_outlined(seen.pictures, known.outlines, visit.date, known.rig.rig, seen.measured)
        pictures.update({picture_name(visit.date, name): picture for name, picture in shown_now.items()})
        from_cache += seen.from_cache
    return _Judged(
        reports=tuple(reports),
        pictures=pictures,
        from_cache=from_cache,
        of_their_days=frozenset(of_their_days),
        borrowed=taken_back,
    )
