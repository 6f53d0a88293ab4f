"""What an element's faces are after visits that show it, and after later ones that show nothing of it."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.completion.element import progress_of
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.states.decide import decide_element
from asbuilt_bim.progress.states.likelihood import MOST_NATS, decided, least_nats
from asbuilt_bim.progress.states.votes import Votes
from asbuilt_bim.progress.surface import SurfaceState
from tests.match.small_site import FAR, box, element

WALL = element("W", "wall", box(0, 0, 0, 4.0, 0.25, 3.0))
OPTIONS = ProgressOptions()
SAMPLES = cell_samples(WALL, OPTIONS.spacing_m)
FRONT, UP_M = SAMPLES.face == 0, SAMPLES.points_m[:, 2] - FAR[2]
NOTHING = np.zeros(len(FRONT))


def judged(odds: FloatArray, earlier: Sequence[SurfaceState | None] = (None,) * len(WALL.faces)) -> list[SurfaceState]:
    """Decide the wall by what a station says of its samples (N,)."""
    built, opened = decided(odds)
    no = np.zeros(len(odds), dtype=bool)
    by = {"A1": built | opened} if odds.any() else {}
    votes = Votes(
        built=built, open=opened, log_odds=odds, contradicted=no, decided_by=by, before=no, spoken=(), other_colour={}
    )
    return decide_element(WALL, votes, {}, earlier, OPTIONS)


def progress(surfaces: Sequence[SurfaceState]) -> ElementProgress:
    return progress_of(WALL, surfaces, date(2026, 3, 2), EMPTY_HISTORY, OPTIONS)


@pytest.mark.parametrize(("clear", "barely"), [(MOST_NATS, -1.0), (3.0, -1.0), (3.0, 1.0)])
def test_what_is_certain_and_what_is_open_stay_as_they_are_where_later_photos_show_nothing(
    clear: float, barely: float
) -> None:
    """Between what is built and what is open lies a strip that photos show barely: that doesn't change either."""
    shown = np.where(UP_M < 1.2, clear, np.where(UP_M < 1.4, barely, -MOST_NATS))
    surfaces = judged(np.where(FRONT, shown, 0.0))
    seen = progress(surfaces)
    for _ in range(2):
        surfaces = judged(NOTHING, surfaces)
        again = progress(surfaces)
        assert again.completion.lower == seen.completion.lower and again.cells_built == seen.cells_built > 0.0
        assert again.completion.upper == 1.0 and again.cells_open == 0.0


def test_a_face_that_was_seen_all_open_stays_as_clear_as_it_was_seen_however_many_visits_see_nothing() -> None:
    surfaces = first = judged(np.where(FRONT, -6.0, 0.0))
    for _ in range(2):
        surfaces = judged(NOTHING, surfaces)
        kept, was = surfaces[0].row_log_odds, first[0].row_log_odds
        assert kept is not None and was is not None and (kept == was).all() and (kept == -6.0).all()


def test_of_a_face_that_photos_say_too_little_of_no_rows_are_kept() -> None:
    nearly = judged(np.where(FRONT, 0.9 * least_nats(), 0.0))
    assert nearly[0].row_log_odds is None and not nearly[0].built_uv_m
