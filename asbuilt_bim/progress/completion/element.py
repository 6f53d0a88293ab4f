"""From the states of an element's cells to its completion and its state."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from asbuilt_bim.bim.cells import element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, about, each_once, noted
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.displaced import Displaced
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, State
from asbuilt_bim.progress.states.cell_states import CellStates, cell_states
from asbuilt_bim.progress.states.doubts import doubts_of
from asbuilt_bim.progress.surface import SurfaceState


def completion_of(
    built: float,
    opened: float,
    total: float,
    options: ProgressOptions,
    *,
    least: float = np.inf,
    most: float = 0.0,
) -> Completion:
    """Return completion and its bounds from amounts (cells, m2); what is neither built nor open is unknown.

    `least` and `most` are how much of the total is built at least and at most: no bound is tighter than they say.
    """
    if total <= 0.0:
        return Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)
    coverage = min((built + opened) / total, 1.0)
    best = built / (built + opened) if coverage >= options.known_from and built + opened > 0.0 else None
    lower, upper = min(built, least, total) / total, max(total - opened, most, 0.0) / total
    return Completion(best=best, lower=lower, upper=min(max(upper, lower), 1.0), coverage=coverage)


def progress_of(
    element: BimElement,
    surfaces: Sequence[SurfaceState],
    visit_date: date,
    history: VisitHistory,
    options: ProgressOptions,
    displaced: Displaced | None = None,
) -> ElementProgress:
    """Return one element's progress from the states of its faces, or that it stands beside its design."""
    cells = cell_states(element, surfaces, options)
    built, opened, conflict = (float(np.sum(one)) for one in (cells.built, cells.open, cells.conflict))
    least, most = float(cells.least.sum()), float(cells.most.sum())
    completion = completion_of(built, opened, float(cells.count), options, least=least, most=most)
    area, sigma = _as_built(surfaces)
    state, why = _state(cells, element.height_m, completion, options, is_measured=area is not None)
    stations = sorted({name for surface in surfaces for name in surface.stations})
    if not stations and state != "complete" and completion.best is not None:
        # what was open when it was last seen is forgotten, since it may have been built: what is left isn't all of it
        completion = replace(completion, best=None)
        why = Reason.NOT_SEEN_AGAIN
    elif state != "complete":
        completion = _as_last_seen(element, surfaces, cells, completion, options)
    seen_unfinished = bool(stations) and is_unfinished(state, completion, options.complete_from)
    doubts = list(doubts_of(element, surfaces, state, options))
    subject = about(SubjectKind.ELEMENT, element.global_id)
    in_place = displaced is None or displaced.accepted
    because = [noted(why, subject, coverage=completion.coverage)] if why and in_place else []
    notes = [*because, *doubts, *(note for surface in surfaces for note in surface.notes)]
    notes += _held_back(element, surfaces, cells, options)
    if conflict:
        notes.append(_disagreement(element, cells, stations))
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
        last_seen=visit_date if stations else history.last_seen.get(element.global_id),
        notes=each_once(notes),
        doubts=each_once(doubts),
        best_when_seen=_best_when_seen(element, completion, history, displaced),
        first_built=history.first_built.get(element.global_id, visit_date) if built > 0.0 else None,
        complete_on=history.complete_on.get(element.global_id, visit_date) if sure else None,
        unfinished_on=visit_date if seen_unfinished else history.unfinished_on.get(element.global_id),
        move_m=_plain(displaced.move_m) if displaced else None,
        accepted=displaced is not None and displaced.accepted,
        as_far_as_seen=state == "complete" and completion.lower < options.nearly_all,
        type_name=element.type_name,
        zones=element.zones,
    )


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


def _held_back(
    element: BimElement, surfaces: Sequence[SurfaceState], cells: CellStates, options: ProgressOptions
) -> list[Note]:
    """Return the note of cells that would count as built, had an earlier visit not seen a part of them open."""
    if not any(surface.was_open_uv_m for surface in surfaces):
        return []
    afresh = cell_states(element, [replace(surface, was_open_uv_m=()) for surface in surfaces], options)
    share = float(np.mean(afresh.built & ~cells.built))
    return [noted(Reason.OPEN_BEFORE, about(SubjectKind.ELEMENT, element.global_id), share=share)] if share else []


def _displaced(subject: Subject, found: Displaced) -> Note:
    """Say where an element stands instead, and who says so."""
    x, y, _ = _plain(found.move_m)
    seen_there = Reason.DISPLACED if found.stations else Reason.DISPLACED_WITH_OTHERS
    code = Reason.DISPLACED_ACCEPTED if found.accepted else seen_there
    return noted(code, subject, distance_m=found.distance_m, x_m=x, y_m=y, stations=found.stations)


def _plain(move_m: FloatArray) -> tuple[float, float, float]:
    x, y, z = (round(float(part), 3) + 0.0 for part in move_m)  # never -0.0
    return x, y, z


def _best_when_seen(
    element: BimElement, completion: Completion, history: VisitHistory, displaced: Displaced | None
) -> float | None:
    """Return the best estimate of the last visit that had one; what was said of an empty place is forgotten."""
    if displaced is not None and not displaced.accepted:
        return None
    return history.best_when_seen.get(element.global_id) if completion.best is None else completion.best


def _as_last_seen(
    element: BimElement,
    surfaces: Sequence[SurfaceState],
    cells: CellStates,
    completion: Completion,
    options: ProgressOptions,
) -> Completion:
    """Return the completion with cells that were open when last seen open in its best estimate; no bound counts them.

    What is built is remembered and what is open forgotten: of a wall half poured, a strip that is seen again would
    leave a best estimate of nearly all.
    """
    was_open = any(surface.was_open_uv_m for surface in surfaces)
    if completion.best is None or not was_open:
        return completion
    unforgotten = [replace(one, open_uv_m=polygon.union([one.open_uv_m, one.was_open_uv_m])) for one in surfaces]
    before = cell_states(element, unforgotten, options).open & ~cells.built & ~cells.conflict
    built, opened = float(cells.built.sum()), float((cells.open | before).sum())
    return replace(completion, best=max(built / max(built + opened, 1.0), completion.lower))


def _as_built(surfaces: Sequence[SurfaceState]) -> tuple[float | None, float | None]:
    """Add up the faces' as-built areas: what calibration errs by adds up, what the pictures err by is independent."""
    measured = [surface for surface in surfaces if surface.as_built_area_m2 is not None]
    if not measured:
        return None, None
    calibration = sum(surface.as_built_sigma_calibration_m2 for surface in measured)
    image = float(np.linalg.norm([surface.as_built_sigma_image_m2 for surface in measured]))
    return sum(s.as_built_area_m2 or 0.0 for s in measured), float(np.hypot(calibration, image))


def _state(
    cells: CellStates, height_m: float, completion: Completion, options: ProgressOptions, *, is_measured: bool
) -> tuple[State, Reason | None]:
    """Name the state, and the reason where it isn't plain.

    Concrete rises from below: unless nearly all was seen, "complete" needs the top seen built. An element that was seen
    by less than half also needs a face measured on it: something else may stand there. "Not started" needs the foot
    seen open; where half was seen, starter bars may hide the foot, but no more than they do. What lies between stays
    unknown in the bounds either way. Nothing has started where no more than a kicker, one whole cell, is sure to be
    built.
    """
    best = completion.best
    if best is None:
        if completion.coverage > 0.0:
            return "unknown", Reason.SEEN_LITTLE
        return "unknown", Reason.CONTRADICTS_ITSELF if cells.conflict.any() else Reason.NOT_SEEN
    if best >= options.complete_from:
        if completion.coverage >= options.nearly_all or _end_is(cells.built, cells, options, top=True):
            if completion.coverage >= options.enough_coverage:
                return "complete", None
            if is_measured:
                return "complete", Reason.SEEN_TO_TOP
            return "unknown", Reason.NO_FACE_FITS
        return "unknown", Reason.TOP_NOT_SEEN
    if best <= options.not_started_to or cells.least.sum() <= 1.0:
        near_foot = float(np.min(cells.height, where=cells.open, initial=1.0)) * height_m <= options.starter_bars_m
        if (near_foot and completion.coverage >= options.enough_coverage) or _end_is(
            cells.open, cells, options, top=False
        ):
            return "not started", None if completion.coverage >= options.enough_coverage else Reason.SEEN_WITH_FOOT
        return "unknown", Reason.FOOT_NOT_SEEN
    return "part", None


def _end_is(wanted: BoolArray, cells: CellStates, options: ProgressOptions, top: bool) -> bool:
    """Say whether of the topmost (or lowest) tenth of the cells enough was seen, and all of that is as wanted."""
    decided = cells.built | cells.open
    end = cells.height >= 0.9 * cells.height.max() if top else cells.height <= cells.height.min() + 0.1
    return bool(np.mean(decided[end]) >= options.known_from and np.all(wanted[decided & end]))
