"""From the states of an element's faces to its cells: built, open, in conflict or unknown, and within what bounds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import Cells, CellSamples, cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.borders import well_inside, wherever_it_lies
from asbuilt_bim.progress.surface import SurfaceState

ROUND_SIDES = 8
"""Sides that a round column is taken to have."""

BORDER_SAMPLES = 2.0
"""How far a border of built and open may lie from where it shows: a sample that it cuts, and one that depth smears."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellStates:
    """The cells of an element, each (n,) over its real cells only; `height` is their row from below, 0..1.

    `least` and `most` are the shares of each cell that are built at least and at most. A built cell has 1 and 1, an
    open one 0 and 0, an unknown one 0 and 1. Where a pour line may run through the cell they lie between.
    `unsettled` are those that a side says is built and that don't count so: in conflict, outvoted, or in the air.
    """

    built: BoolArray
    open: BoolArray
    conflict: BoolArray
    unsettled: BoolArray
    least: FloatArray
    most: FloatArray
    height: FloatArray

    @property
    def count(self) -> int:
        """Return how many cells there are."""
        return len(self.built)


def cell_states(element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions) -> CellStates:
    """Decide each cell by its sides: built if any side is seen built, open if any is seen open, both is a conflict.

    A side decides a cell when enough of its samples there say the same, the unknown ones counted against it; fewer do
    where not one contradicts, nor did when it was last seen. At a pour line, where no side is clear, the sides are
    counted together: no conflict.
    What hangs in the air isn't concrete, whatever else it may be: it stays unknown.

    Sides contradict one another in one cell by a mistake. Where they do in more cells than are decided, the element
    isn't what the design says, or where: a column that stands beside it is built on the one side and open on the other.
    Then nothing is decided.

    Where borders may lie elsewhere, the bounds hold what stays built or open wherever they lie. An element of which
    next to nothing lies inside them by as much is unknown.
    """
    cells = element_cells(element)
    real = cells.weight.ravel() > 0.0
    height = np.tile((np.arange(cells.shape[1]) + 0.5) / cells.shape[1], cells.shape[0])[real]
    no = np.zeros(int(real.sum()), dtype=bool)
    if not any(surface.built_uv_m or surface.open_uv_m for surface in surfaces):
        return CellStates(built=no, open=no, conflict=no, unsettled=no, least=0.0 * no, most=1.0 - no, height=height)
    counts = _counts(element, cells, surfaces, options)[:, :, real]
    total, built, opened, was_open = counts
    decided = built + opened
    share = built / np.maximum(decided, 1.0)
    needed = np.where(built * (opened + was_open) > 0.0, options.decided_share, options.sole_share) * total
    says_built = (built >= needed) & (built > 0.0)
    says_open = (opened >= needed) & (opened > 0.0) & ~says_built
    enough = says_built | says_open
    clear = enough & ((share >= options.clear_share) | (share <= 1.0 - options.clear_share))
    any_built, any_open = says_built.any(axis=0), says_open.any(axis=0)
    both = any_built & any_open
    conflict = both & (clear & says_built).any(axis=0) & (clear & says_open).any(axis=0)
    sums = np.where(enough, counts, 0.0).sum(axis=1)
    is_built = np.where(both, (sums[1] >= sums[2]) & ~conflict, any_built)
    is_open = np.where(both, (sums[1] < sums[2]) & ~conflict, any_open)
    is_built &= ~_hanging(cells, is_built, is_open)
    if conflict.sum() > np.sum(is_built | is_open):
        torn = conflict | is_built | is_open
        return CellStates(
            built=no, open=no, conflict=torn, unsettled=torn, least=0.0 * no, most=1.0 - no, height=height
        )
    least, most = _bounds(element, cells, (is_built, is_open), sums, options)
    doubted = conflict | (any_built & ~is_built)
    found = CellStates(
        built=is_built, open=is_open, conflict=conflict, unsettled=doubted, least=least, most=most, height=height
    )
    doubtful = any(surface.border_m for surface in surfaces)
    return _wherever_they_lie(found, element, surfaces, options) if doubtful else found


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
    were, kept = (
        _counts(element, cells, given, options).sum(axis=1)[1:3, cells.weight.ravel() > 0.0]
        for given in (surfaces, stays)
    )
    share = kept / np.maximum(were, 1.0)
    least = np.minimum(found.least * share[0], inner.least)
    most = np.maximum(1.0 - (1.0 - found.most) * share[1], inner.most)
    return replace(found, least=least, most=most)


def unsettled(element: BimElement, surfaces: Sequence[SurfaceState], options: ProgressOptions) -> BoolArray:
    """Say of every cell by its number (`CellSamples.cell`) whether what looks built in it doesn't count so."""
    real = element_cells(element).weight.ravel() > 0.0
    found = np.zeros(real.size, dtype=bool)
    found[real] = cell_states(element, surfaces, options).unsettled
    return found


def _hanging(cells: Cells, built: BoolArray, opened: BoolArray) -> BoolArray:
    """Say which built cells (n,) hang over open ones: concrete rises from below.

    In each upright line of cells the height is sought up to which all should be built, and over which open, so that the
    fewest contradict. What is built over that height is a mistake: a stack beside a column, a cage taken for concrete.
    """
    score = np.where(_on_grid(cells, built), 1, 0) - np.where(_on_grid(cells, opened), 1, 0)
    below = np.pad(np.cumsum(score, axis=1), ((0, 0), (1, 0)))  # for each height the sum under it
    level = below.shape[1] - 1 - np.argmax(below[:, ::-1], axis=1)  # of equally good heights the highest
    over = np.arange(score.shape[1])[None, :] >= level[:, None]
    hanging: BoolArray = ((score > 0) & over)[cells.weight > 0.0]
    return hanging


def _bounds(
    element: BimElement,
    cells: Cells,
    states: tuple[BoolArray, BoolArray],
    sums: FloatArray,
    options: ProgressOptions,
) -> tuple[FloatArray, FloatArray]:
    """Return how much of each cell (n,) is built at least and at most, from its samples: all, built, open ... (4, n).

    A pour line may run through a built cell under one that isn't, and through an open cell over one that isn't. These
    cells count by their samples. Concrete rises from
    below: an open cell under a built one is as likely a mistake as an opening, and counts as built at most.
    """
    built, opened = states
    height_m = element.height_m / cells.shape[1]
    blur = BORDER_SAMPLES * options.spacing_m / max(height_m, options.spacing_m)
    share = np.maximum(sums[1:] / np.maximum(sums[0], 1.0) - blur, 0.0)
    least, most = built.astype(np.float64), (~opened).astype(np.float64)
    edge = built & _next_to(cells, ~built, 1)
    least[edge] = share[0][edge]
    edge = opened & _next_to(cells, ~opened, -1)
    most[edge] = 1.0 - share[1][edge]
    most[opened & _under(cells, built)] = 1.0
    return least, most


def _on_grid(cells: Cells, flags: BoolArray) -> BoolArray:
    grid = np.zeros(cells.shape, dtype=bool)
    grid[cells.weight > 0.0] = flags
    return grid


def _next_to(cells: Cells, flags: BoolArray, up: int) -> BoolArray:
    """Say which real cells (n,) have a flagged one that many cells further up."""
    padded = np.pad(_on_grid(cells, flags), 1)
    shifted: BoolArray = np.roll(padded, -up, axis=1)[1:-1, 1:-1][cells.weight > 0.0]
    return shifted


def _under(cells: Cells, flags: BoolArray) -> BoolArray:
    """Say which real cells (n,) have a flagged one anywhere over them."""
    so_far = np.logical_or.accumulate(_on_grid(cells, flags)[:, ::-1], axis=1)[:, ::-1]
    under: BoolArray = so_far[cells.weight > 0.0]
    return under


def _counts(
    element: BimElement, cells: Cells, surfaces: Sequence[SurfaceState], options: ProgressOptions
) -> FloatArray:
    """Return how many samples each side has in each cell, all, built, open, and open once: (4, sides, cells).

    A lateral surface is taken as eight sides, since no station sees half of it.
    """
    samples: CellSamples = cell_samples(element, options.spacing_m)
    size = cells.shape[0] * cells.shape[1]
    by_face = {surface.face_id: surface for surface in surfaces}
    counts = []
    for index, face in enumerate(element.faces):
        own = samples.face == index
        cell, uv, surface = samples.cell[own], samples.uv_m[own], by_face[face.face_id]
        inside = [np.ones(len(uv), dtype=bool)]
        regions = surface.built_uv_m, surface.open_uv_m, surface.was_open_uv_m
        inside += [polygon.contains(region, uv) for region in regions]
        side = np.zeros(len(uv), dtype=int)
        if isinstance(face.frame, CylinderFrame):
            side = np.floor((uv[:, 0] / face.frame.radius_m / (2.0 * np.pi) + 0.5) * ROUND_SIDES).astype(int)
        for number in np.unique(side):
            counts.append([np.bincount(cell[(side == number) & one], minlength=size) for one in inside])
    return np.asarray(counts, dtype=np.float64).reshape(-1, 4, size).transpose(1, 0, 2)
