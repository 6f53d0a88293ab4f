"""From the states of an element's faces to its cells, its completion and its state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from asbuilt_bim.bim.cells import Cells, CellSamples, cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, State
from asbuilt_bim.progress.surface import SurfaceState

MANTLE_SIDES = 8
"""Sides that a round column is taken to have."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellStates:
    """The cells of an element, each (n,) bool over its real cells only; `height` (n,) is their row from below, 0..1."""

    built: BoolArray
    open: BoolArray
    conflict: BoolArray
    height: FloatArray

    @property
    def count(self) -> int:
        """Return how many cells there are."""
        return len(self.built)


def cell_states(element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions) -> CellStates:
    """Decide each cell by its sides: built if any side is seen built, open if any is seen open, both is a conflict.

    A side decides a cell when enough of its samples there say the same, the unknown ones counted against it. At a pour
    line, where no side is clear, the sides are counted together: that is no conflict.
    """
    cells = element_cells(element)
    real = cells.weight.ravel() > 0.0
    height = np.tile((np.arange(cells.shape[1]) + 0.5) / cells.shape[1], cells.shape[0])[real]
    no = np.zeros(int(real.sum()), dtype=bool)
    if not any(surface.built_uv_m or surface.open_uv_m for surface in surfaces):
        return CellStates(built=no, open=no, conflict=no, height=height)
    counts = _counts(element, cells, surfaces, options)[:, :, real]
    total, built, opened = counts
    decided = built + opened
    share = built / np.maximum(decided, 1.0)
    says_built = (built >= options.decided_share * total) & (built > 0.0)
    says_open = (opened >= options.decided_share * total) & (opened > 0.0) & ~says_built
    enough = says_built | says_open
    clear = enough & ((share >= options.clear_share) | (share <= 1.0 - options.clear_share))
    any_built, any_open = says_built.any(axis=0), says_open.any(axis=0)
    both = any_built & any_open
    conflict = both & (clear & says_built).any(axis=0) & (clear & says_open).any(axis=0)
    pooled = np.where(enough, built, 0.0).sum(axis=0) >= np.where(enough, opened, 0.0).sum(axis=0)
    return CellStates(
        built=np.where(both, pooled & ~conflict, any_built),
        open=np.where(both, ~pooled & ~conflict, any_open),
        conflict=conflict,
        height=height,
    )


def _counts(
    element: BimElement, cells: Cells, surfaces: Sequence[SurfaceState], options: ProgressOptions
) -> FloatArray:
    """Return how many samples each side has in each cell, all, built and open: (3, sides, cells).

    A mantle is taken as eight sides, since no station sees half of it.
    """
    samples: CellSamples = cell_samples(element, options.spacing_m)
    size = cells.shape[0] * cells.shape[1]
    by_face = {surface.face_id: surface for surface in surfaces}
    counts = []
    for index, face in enumerate(element.faces):
        own = samples.face == index
        cell, uv, surface = samples.cell[own], samples.uv_m[own], by_face[face.face_id]
        says = [np.ones(len(uv), dtype=bool)]
        says += [polygon.contains(region, uv) for region in (surface.built_uv_m, surface.open_uv_m)]
        side = np.zeros(len(uv), dtype=int)
        if isinstance(face.frame, CylinderFrame):
            side = np.floor((uv[:, 0] / face.frame.radius_m / (2.0 * np.pi) + 0.5) * MANTLE_SIDES).astype(int)
        for number in np.unique(side):
            counts.append([np.bincount(cell[(side == number) & one], minlength=size) for one in says])
    return np.asarray(counts, dtype=np.float64).reshape(-1, 3, size).transpose(1, 0, 2)


def completion_of(built: float, opened: float, total: float, options: ProgressOptions) -> Completion:
    """Return completion and its bounds from amounts (cells, m2); what is neither built nor open is unknown."""
    if total <= 0.0:
        return Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)
    coverage = min((built + opened) / total, 1.0)
    best = built / (built + opened) if coverage >= options.known_from and built + opened > 0.0 else None
    lower, upper = min(built / total, 1.0), max(1.0 - opened / total, 0.0)
    return Completion(best=best, lower=lower, upper=max(upper, lower), coverage=coverage)


def progress_of(
    element: BimElement,
    surfaces: Sequence[SurfaceState],
    visit_date: date,
    last_seen: Mapping[str, date],
    options: ProgressOptions,
) -> ElementProgress:
    """Return one element's progress from the states of its faces."""
    cells = cell_states(element, surfaces, options)
    built, opened, conflict = (float(np.sum(one)) for one in (cells.built, cells.open, cells.conflict))
    completion = completion_of(built, opened, float(cells.count), options)
    state, why = _state(cells, completion, options)
    notes = [*why, *(note for surface in surfaces for note in surface.notes)]
    if conflict:
        notes.append(f"{conflict:.0f} cells are seen built from one side and open from another: look at the pictures")
    seen_built = sum(surface.built_area_m2 for surface in surfaces)
    seen_open = sum(surface.open_area_m2 for surface in surfaces)
    stations = sorted({name for surface in surfaces for name in surface.stations})
    area, sigma = _as_built(surfaces)
    worst = max((s for s in surfaces if s.offset_m is not None), key=lambda s: abs(s.offset_m or 0.0), default=None)
    tilts = [surface.tilt_rad for surface in surfaces if surface.tilt_rad is not None]
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
        tilt_rad=max(tilts, key=abs) if tilts else None,
        stations=tuple(stations),
        last_seen=visit_date if stations else last_seen.get(element.global_id),
        notes=tuple(dict.fromkeys(notes)),
    )


def _as_built(surfaces: Sequence[SurfaceState]) -> tuple[float | None, float | None]:
    """Add up the faces' as-built areas: what calibration errs by adds up, what the pictures err by is independent."""
    measured = [surface for surface in surfaces if surface.as_built_area_m2 is not None]
    if not measured:
        return None, None
    calibration = sum(surface.as_built_sigma_calibration_m2 for surface in measured)
    image = float(np.linalg.norm([surface.as_built_sigma_image_m2 for surface in measured]))
    return sum(s.as_built_area_m2 or 0.0 for s in measured), float(np.hypot(calibration, image))


def _state(cells: CellStates, completion: Completion, options: ProgressOptions) -> tuple[State, list[str]]:
    """Name the state, and say why where it isn't plain.

    Concrete rises from below: unless nearly all was seen, "complete" needs the top seen built; and where under half
    was seen, "not started" needs the foot seen open. What lies between stays unknown in the bounds either way.
    """
    best = completion.best
    if best is None:
        return "unknown", []
    seen = f"{completion.coverage:.0%} of it was seen"
    if best >= options.complete_from:
        if completion.coverage >= options.nearly_all or _end_is(cells.built, cells, top=True):
            return "complete", [] if completion.coverage >= options.enough_coverage else [f"{seen}, up to its top"]
        return "unknown", [f"{seen}, and that is built; its top was not seen"]
    if best <= options.not_started_to:
        if completion.coverage >= options.enough_coverage or _end_is(cells.open, cells, top=False):
            return "not started", [] if completion.coverage >= options.enough_coverage else [f"{seen}, with its foot"]
        return "unknown", [f"{seen}, and that is open; its foot was not seen"]
    return "part", []


def _end_is(said: BoolArray, cells: CellStates, top: bool) -> bool:
    """Say whether the topmost (or lowest) tenth of the cells was seen, and all that was seen of it says so."""
    decided = cells.built | cells.open
    end = cells.height >= 0.9 * cells.height.max() if top else cells.height <= cells.height.min() + 0.1
    return bool(np.any(decided & end) and np.all(said[decided & end]))
