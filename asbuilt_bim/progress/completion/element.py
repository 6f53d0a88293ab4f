"""From the states of an element's cells to its completion and its state."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from asbuilt_bim.bim.cells import element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, about, each_once, noted
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.displaced import Displaced
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, State
from asbuilt_bim.progress.states.cell_states import CellStates, cell_states
from asbuilt_bim.progress.states.doubts import doubts_of
from asbuilt_bim.progress.states.pour import model
from asbuilt_bim.progress.surface import SurfaceState, unseen


def progress_of(
    element: BimElement,
    surfaces: Sequence[SurfaceState],
    visit_date: date,
    history: VisitHistory,
    options: ProgressOptions,
    displaced: Displaced | None = None,
) -> ElementProgress:
    """Return one element's progress from the states of its faces, or that it stands beside its design."""
    cells = cell_states(element, surfaces, options, _evidence_before(element, history, options))
    built, opened, conflict = (float(np.sum(one)) for one in (cells.built, cells.open, cells.conflict))
    completion = completion_by_cells(cells, options)
    area, sigma = _as_built(surfaces)
    state, why = state_of(cells, element.height_m, completion, options, model().limit)
    stations = sorted({name for surface in surfaces for name in surface.stations})
    last = history.elements.get(element.global_id)
    in_place = displaced is None or displaced.accepted
    was = history.as_it_stood(element) if not stations and in_place else None
    told = [_disagreement(element, cells, stations)] if conflict else []
    if was is not None:
        built, conflict = was.cells_built, was.cells_conflict
        kept = (note for note in was.notes if note.code in (Reason.PHOTOS_DISAGREE, Reason.SEEN_TO_TOP))
        told = [replace(note, values={"day": str(was.last_seen), **note.values}) for note in kept]
        state, why, completion = _not_seen_now(was, why, completion)
    elif not stations and completion.best is not None and completion.lower < options.complete_from:
        state, why, completion = "unknown", Reason.NOT_SEEN_AGAIN, replace(completion, best=None)
    elif state == "part":
        completion = _best_of_a_part(cells, element.height_m, completion, options)
    seen_unfinished = bool(stations) and is_unfinished(state, completion, options.complete_from)
    doubts = list(doubts_of(element, surfaces, state, options))
    subject = about(SubjectKind.ELEMENT, element.global_id)
    because = [noted(why, subject, coverage=completion.coverage)] if why and in_place else []
    notes = [*because, *doubts, *(note for surface in surfaces for note in surface.notes), *told]
    seen_built = sum(surface.built_area_m2 for surface in surfaces)
    seen_open = sum(surface.open_area_m2 for surface in surfaces)
    if displaced is not None and displaced.accepted:
        notes = [_displaced(subject, displaced), *notes]
    elif displaced is not None:
        state, stations = "displaced", list(displaced.stations)
        doubts = [_displaced(subject, displaced)]
        notes = [*doubts, *notes]
    sure = state == "complete" and completion.lower >= options.complete_from
    worst = max((s for s in surfaces if s.offset_m is not None), key=lambda s: abs(s.offset_m or 0.0), default=None)
    leaning = max((s for s in surfaces if s.tilt_rad is not None), key=lambda s: abs(s.tilt_rad or 0.0), default=None)
    return ElementProgress(
        global_id=element.global_id,
        ifc_class=element.ifc_class,
        kind=element.kind,
        name=element.name,
        storey=element.storey,
        state=state,
        completion=completion,
        cells_built=built,
        cells_open=opened,
        cells_unknown=cells.count - built - opened - conflict,
        cells_conflict=conflict,
        surface_coverage=min((seen_built + seen_open) / max(element.exposed_area_m2, 1e-9), 1.0),
        design_area_m2=element.exposed_area_m2,
        design_volume_m3=element.volume_m3,
        built_area_m2=seen_built,
        as_built_area_m2=area,
        as_built_sigma_m2=sigma,
        offset_m=worst.offset_m if worst else None,
        offset_sigma_m=worst.offset_sigma_m if worst else None,
        tilt_rad=leaning.tilt_rad if leaning else None,
        tilt_sigma_rad=leaning.tilt_sigma_rad if leaning else None,
        stations=tuple(stations),
        last_seen=visit_date if stations else last.last_seen if last else None,
        notes=each_once(notes),
        doubts=each_once(doubts),
        best_when_seen=_best_when_seen(completion, last) if in_place else None,  # an empty place's is forgotten
        first_built=history.first_built.get(element.global_id, visit_date) if built > 0.0 else None,
        complete_on=history.complete_on.get(element.global_id, visit_date) if sure else None,
        unfinished_on=visit_date if seen_unfinished else last.unfinished_on if last else None,
        move_m=_plain(displaced.move_m) if displaced else None,
        accepted=displaced is not None and displaced.accepted,
        as_far_as_seen=state == "complete" and completion.lower < options.nearly_all,
        type_name=element.type_name,
        zones=element.zones,
        level_evidence=was.level_evidence if was is not None else cells.levels.evidence,
    )


def _evidence_before(element: BimElement, history: VisitHistory, options: ProgressOptions) -> FloatArray | None:
    """Return what all earlier visits say of each level (lines, rows + 1); None where they say nothing.

    Of an element that was revised since, or a result of before it was kept: by what was built and open.
    """
    was = history.as_it_stood(element)
    if was is not None and was.level_evidence is not None:
        return was.level_evidence
    known = [history.earlier(element.global_id, face, options) for face in element.faces]
    if not any(known):
        return None
    surfaces = [one or unseen(face) for one, face in zip(known, element.faces, strict=True)]
    return cell_states(element, surfaces, options).levels.evidence


def is_unfinished(state: State, completion: Completion, complete_from: float) -> bool:
    """Say whether an element is sure not to be complete: of one that may be, nothing says that it is late."""
    return state in ("part", "not started") and completion.upper < complete_from


def _disagreement(element: BimElement, cells: CellStates, stations: Sequence[str]) -> Note:
    """Return the note of photos that show the same part built and not: where that is, over the element's foot."""
    half = 0.5 / element_cells(element).shape[1]
    torn = cells.height[cells.conflict]
    return noted(
        Reason.PHOTOS_DISAGREE,
        about(SubjectKind.ELEMENT, element.global_id),
        kind=element.kind,
        element=element.name,
        cells=len(torn),
        stations=tuple(stations),
        low_m=float(torn.min() - half) * element.height_m,
        high_m=float(torn.max() + half) * element.height_m,
    )


def _displaced(subject: Subject, found: Displaced) -> Note:
    """Say where an element stands instead, and who says so."""
    x, y, _ = _plain(found.move_m)
    seen_there = Reason.DISPLACED if found.stations else Reason.DISPLACED_WITH_OTHERS
    code = Reason.DISPLACED_ACCEPTED if found.accepted else seen_there
    return noted(code, subject, distance_m=found.distance_m, x_m=x, y_m=y, stations=found.stations)


def _plain(move_m: FloatArray) -> tuple[float, float, float]:
    x, y, z = (round(float(part), 3) + 0.0 for part in move_m)  # never -0.0
    return x, y, z


def _not_seen_now(was: ElementProgress, why: Reason | None, now: Completion) -> tuple[State, Reason | None, Completion]:
    """Return what an element is that no photo shows: what it was, but what was open may have been built since."""
    if was.state == "complete":
        return was.state, None, was.completion
    why = why if now.coverage <= 0.0 else Reason.NOT_SEEN_AGAIN
    return "unknown", why, replace(now, best=None, lower=was.completion.lower, upper=1.0)


def _best_when_seen(completion: Completion, last: ElementProgress | None) -> float | None:
    """Return the best estimate of the last visit that had one."""
    return last.best_when_seen if completion.best is None and last is not None else completion.best


def _as_built(surfaces: Sequence[SurfaceState]) -> tuple[float | None, float | None]:
    """Add up the faces' as-built areas: what calibration errs by adds up, what the pictures err by is independent."""
    measured = [surface for surface in surfaces if surface.as_built_area_m2 is not None]
    if not measured:
        return None, None
    calibration = sum(surface.as_built_sigma_calibration_m2 for surface in measured)
    image = float(np.linalg.norm([surface.as_built_sigma_image_m2 for surface in measured]))
    return sum(s.as_built_area_m2 or 0.0 for s in measured), float(np.hypot(calibration, image))


def completion_by_cells(cells: CellStates, options: ProgressOptions) -> Completion:
    """Return what is built at least, at most and most likely, and how much of it was seen."""
    if not cells.count:
        return Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)
    coverage, lower, upper, likely = (
        float(one.mean()) for one in (cells.seen, cells.least, np.maximum(cells.most, cells.least), cells.likely)
    )
    best = min(max(likely, lower), upper) if coverage >= options.known_from else None
    return Completion(best=best, lower=lower, upper=upper, coverage=coverage)


def state_of(
    cells: CellStates, height_m: float, completion: Completion, options: ProgressOptions, limit: float
) -> tuple[State, Reason | None]:
    """Name the state that what was seen is likely in, and the reason where it isn't plain.

    Nothing has started where no more than a kicker is built. What is complete has a top that was seen, something of it
    is certain. Where no state is likely enough it is unknown: the top or the foot was not seen, photos contradict one
    another, or they don't tell how high.
    """
    if completion.best is None:
        if completion.coverage > 0.0:
            return "unknown", Reason.SEEN_LITTLE
        return "unknown", Reason.CONTRADICTS_ITSELF if cells.conflict.any() else Reason.NOT_SEEN
    half_seen = completion.coverage >= options.enough_coverage
    low, high = part_of(cells, height_m, options)
    whole = cells.levels.between(high + 1, cells.levels.rows)
    if whole >= limit and completion.lower > 0.0 and _top_is_seen(cells, height_m, options):
        return "complete", None if half_seen else Reason.SEEN_TO_TOP
    if cells.levels.between(0, low - 1) >= limit:
        return "not started", None if half_seen else Reason.SEEN_WITH_FOOT
    if cells.levels.between(low, high) >= limit:
        return "part", None
    likely = cells.likely[cells.seen] >= 0.5
    if likely.all() and not _top_is_seen(cells, height_m, options):
        return "unknown", Reason.TOP_NOT_SEEN
    if not likely.any() and not cells.seen[cells.height == cells.height.min()].any():
        return "unknown", Reason.FOOT_NOT_SEEN
    return "unknown", Reason.LEVEL_UNCLEAR


def part_of(cells: CellStates, height_m: float, options: ProgressOptions) -> tuple[int, int]:
    """Return the lowest and the highest level, in rows, that is a part: over a kicker, and not as good as complete."""
    rows = cells.levels.rows
    return round(options.kicker_m / height_m * rows) + 1, int(np.ceil(options.complete_from * rows)) - 1


def _top_is_seen(cells: CellStates, height_m: float, options: ProgressOptions) -> bool:
    """Say whether any cell was seen that reaches the top, or as near as a kicker is high: so little is no level."""
    reaches = cells.height + cells.height.min()
    return bool(np.any(cells.seen & (reaches >= min(options.complete_from, 1.0 - options.kicker_m / height_m))))


def _best_of_a_part(cells: CellStates, height_m: float, completion: Completion, options: ProgressOptions) -> Completion:
    """Return the completion of a part with a best estimate that is one: the middle of the levels that a part may have.

    Of all levels the middle one may be none at all, though most are a part's.
    """
    (low, high), rows = part_of(cells, height_m, options), cells.levels.rows
    if completion.best is None or low <= completion.best * rows <= high:
        return completion
    below = np.cumsum(cells.levels.chance[cells.levels.seen, low : high + 1].sum(axis=0))
    middle = (low + int(np.searchsorted(below, 0.5 * below[-1]))) / rows
    return replace(completion, best=min(max(middle, completion.lower), completion.upper))
