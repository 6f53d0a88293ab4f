"""From the states of an element's faces to its cells: built, open, in conflict or unknown, and within what bounds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.cells import Cells, cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.borders import well_inside, wherever_it_lies
from asbuilt_bim.progress.states.likelihood import least_nats
from asbuilt_bim.progress.states.pour import Levels, Model, Shown, levels, model
from asbuilt_bim.progress.states.rows import and_under, of_sides, rows_shape, sides_of
from asbuilt_bim.progress.surface import SurfaceState


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellStates:
    """The cells of an element, each (n,) over its real cells only; `height` is their row from below, 0..1.

    `least`, `most` and `likely` are the shares of each cell that are built at least, at most and most likely. `seen`
    are cells of which a side was decided, `conflict` those in which sides contradict one another and nothing decides.
    `levels` is how high it likely reaches.
    """

    built: BoolArray
    open: BoolArray
    conflict: BoolArray
    seen: BoolArray
    least: FloatArray
    most: FloatArray
    likely: FloatArray
    height: FloatArray
    levels: Levels

    @property
    def count(self) -> int:
        """Return how many cells there are."""
        return len(self.built)


def cell_states(
    element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions, before: FloatArray | None = None
) -> CellStates:
    """Decide each cell by how high the element's concrete reaches: built, open, or unknown where both are likely.

    `before` is the evidence of earlier visits (`pour.levels`). Where borders may lie elsewhere, the bounds hold what
    stays built or open wherever they lie. An element of which next to nothing lies inside them by as much is unknown.
    """
    found = decided_cells(element, shown_rows(element, surfaces, options), model(), before)
    doubtful = any(surface.border_m for surface in surfaces)
    return _wherever_they_lie(found, element, surfaces, options) if doubtful else found


def decided_cells(element: BimElement, shown: Shown, fitted: Model, before: FloatArray | None = None) -> CellStates:
    """Decide each cell by what each side shows in each row, and by the evidence of earlier visits.

    Nothing is certain that nobody saw, but for what lies under concrete that was seen, or over a place seen open. What
    its own sides show otherwise than the level says is unknown: it may be an opening, or hang over one.
    """
    cells = element_cells(element)
    found = levels(shown, (element.length_m, element.height_m), fitted, before)
    chance = found.built()
    says_built, says_open, shows = (
        np.asarray(one.any(axis=0)) for one in (shown.built > shown.open, shown.open > shown.built, shown.decided > 0.0)
    )
    hole, hangs = says_open & ~says_built, says_built & ~says_open
    over = np.logical_or.accumulate(says_open, axis=1)
    sure = (chance >= 1.0 - fitted.doubt) & and_under(says_built) & ~hole
    out = (chance <= fitted.doubt) & over & ~hangs
    built, opened = (np.asarray(_of_cells(one, cells).all(axis=1)) for one in (sure, out))
    against = shows if found.torn > 0.5 else says_built & says_open
    torn = np.asarray(_of_cells(against, cells).any(axis=1)) & ~built & ~opened
    least, lacks, likely, seen = (
        _of_cells(one, cells).mean(axis=1) for one in (sure, out, (chance > 0.5) & ~hole, shows)
    )
    height = np.tile((np.arange(cells.shape[1]) + 0.5) / cells.shape[1], (cells.shape[0], 1))
    return CellStates(
        built=built, open=opened, conflict=torn, seen=(seen >= 0.5) & ~torn,
        least=least, most=1.0 - lacks, likely=likely, height=height[cells.weight > 0.0], levels=found,
    )  # fmt: skip


def _of_cells(rows: BoolArray | FloatArray, cells: Cells) -> NDArray[Any]:
    """Return what is said of each row (nx, rows) by real cells: (n, rows of a cell)."""
    return rows.reshape(*cells.shape, -1)[cells.weight > 0.0]


def _wherever_they_lie(
    found: CellStates, element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions
) -> CellStates:
    """Return cells whose bounds hold what stays built or open wherever borders lie; unknown where little is sure.

    Little is sure where next to nothing lies inside the borders by as much as they may lie elsewhere.
    """
    sure = cell_states(element, [well_inside(surface) for surface in surfaces], options)
    if np.mean(sure.built | sure.open) < options.known_from:
        return sure
    cells = element_cells(element)
    stays = [wherever_it_lies(surface, along=cells.shape[0] > 1) for surface in surfaces]
    inner = cell_states(element, stays, options)
    were, kept = (shown_rows(element, given, options) for given in (surfaces, stays))
    built, opened = (
        _of_cells(now.sum(axis=0), cells).sum(axis=1) / np.maximum(_of_cells(was.sum(axis=0), cells).sum(axis=1), 1.0)
        for now, was in ((kept.built, were.built), (kept.open, were.open))
    )
    least = np.minimum(found.least * built, inner.least)
    most = np.maximum(1.0 - (1.0 - found.most) * opened, inner.most)
    return replace(found, least=least, most=most)


def shown_rows(element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions) -> Shown:
    """Return what each side shows in each row: how many samples are built, open, measured as a face, and how clearly.

    An element of which nothing is known shows no side. Of a row that a side shows too little of, only the log-odds are
    told.
    """
    if not any(one.built_uv_m or one.open_uv_m or one.row_log_odds is not None for one in surfaces):
        nothing = np.zeros((0, *rows_shape(element, options.spacing_m)))
        return Shown(built=nothing, open=nothing, measured=nothing, log_odds=nothing)
    samples, by_face = cell_samples(element, options.spacing_m), {surface.face_id: surface for surface in surfaces}
    sides, each = list(sides_of(element, options.spacing_m)), list[FloatArray]()
    built, opened, outlined = (np.zeros(len(samples.face), dtype=bool) for _ in range(3))
    for index, face in enumerate(element.faces):
        own, surface = np.flatnonzero(samples.face == index), by_face[face.face_id]
        for flags, region in (
            (built, surface.built_uv_m), (opened, surface.open_uv_m), (outlined, surface.outline_uv_m),
        ):  # fmt: skip
            flags[own] = polygon.contains(region, samples.uv_m[own])
        of_face = [side for side in sides if side.face == index]
        kept = of_sides(surface.row_log_odds, of_face)  # where nobody kept it, no clearer than what is barely decided
        sure = [least_nats() * (side.share(built) - side.share(opened)) for side in of_face]
        each += sure if kept is None else [*kept]
    every, of_built, of_open, measured = (
        np.array([side.count(flags) for side in sides]) for flags in (built | True, built, opened, built & outlined)
    )
    enough = of_built + of_open >= options.shown_share * every
    return Shown(
        built=of_built * enough, open=of_open * enough, measured=np.minimum(measured, of_built) * enough,
        log_odds=np.array(each),
    )  # fmt: skip
