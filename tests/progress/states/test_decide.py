"""What an element's faces are after visits that show it, and after later ones that show nothing of it."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
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
FRONT, BACK, UP_M = SAMPLES.face == 0, SAMPLES.face == 2, SAMPLES.points_m[:, 2] - FAR[2]
ALONG_M = SAMPLES.points_m[:, 0] - SAMPLES.points_m[:, 0].min()
NOTHING = np.zeros(len(FRONT))


def judged(
    odds: FloatArray, earlier: Sequence[SurfaceState | None] = (None,) * len(WALL.faces), of: BimElement = WALL
) -> list[SurfaceState]:
    """Decide a wall by what a station says of its samples (N,)."""
    built, opened = decided(odds)
    no = np.zeros(len(odds), dtype=bool)
    by = {"A1": built | opened} if odds.any() else {}
    votes = Votes(
        built=built, open=opened, log_odds=odds, contradicted=no, decided_by=by, before=no, spoken=(), other_colour={}
    )
    return decide_element(of, votes, {}, earlier, OPTIONS)


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


def test_a_side_seen_open_before_another_rose_holds_nothing_back_at_any_later_visit() -> None:
    """The back was open in winter; in spring the front is 1 m high; in summer no photo shows the wall."""
    winter = judged(np.where(BACK, -MOST_NATS, 0.0))
    spring = judged(np.where(FRONT, np.where(UP_M < 1.0, MOST_NATS, -MOST_NATS), 0.0), winter)
    summer = judged(NOTHING, spring)
    assert progress(spring).completion.lower == pytest.approx(1.0 / 3.0, abs=0.03)
    assert progress(summer).completion.lower == progress(spring).completion.lower
    kept = polygon.area(spring[2].was_open_uv_m)
    assert kept == pytest.approx(4.0 * 2.0, abs=0.3) == polygon.area(summer[2].was_open_uv_m)  # over 1 m alone


def test_where_the_foot_of_a_side_that_was_open_is_seen_built_what_was_open_under_it_has_risen() -> None:
    top = np.where(BACK & (UP_M > 1.0), MOST_NATS, 0.0)
    afresh, risen = judged(top), judged(top, judged(np.where(FRONT & (UP_M < 1.0), -MOST_NATS, 0.0)))
    assert progress(risen).completion == progress(afresh).completion and progress(afresh).completion.lower > 0.95


def test_a_few_samples_that_looked_open_in_what_is_built_dont_make_it_open_later() -> None:
    """One sample in twenty errs."""
    errs = np.random.default_rng(1).random(len(FRONT)) < 0.05
    shown = np.where(UP_M < 1.5, MOST_NATS, -MOST_NATS) * np.where(errs, -1.0, 1.0)
    seen = judged(np.where(FRONT | BACK, shown, 0.0))
    again = judged(NOTHING, seen)
    assert progress(again).completion.lower == progress(seen).completion.lower > 0.4
    foot = progress(judged(np.where(FRONT & (UP_M < 0.7), MOST_NATS, 0.0), seen)).completion
    assert foot.lower <= 0.52 and (foot.best or 0.0) <= 0.52  # what was open over it is open still


def test_what_hangs_over_what_is_open_is_complete_at_no_later_visit() -> None:
    """A cage's top looked like concrete, and the wall was open under it."""
    hangs = np.where(UP_M < 1.5, MOST_NATS, np.where(UP_M > 2.8, MOST_NATS, -MOST_NATS))
    seen = judged(np.where(FRONT, hangs, 0.0))
    assert progress(seen).state == "part"
    assert progress(judged(NOTHING, seen)).state == "unknown"
    assert progress(judged(np.where(BACK & (UP_M < 1.0), MOST_NATS, 0.0), seen)).state != "complete"


def test_what_was_open_over_what_another_side_shows_built_holds_the_best_estimate_back() -> None:
    """The back was open in winter; in spring the front's foot alone is seen, built."""
    foot = np.where(FRONT & (UP_M < 1.0), MOST_NATS, 0.0)
    held, afresh = progress(judged(foot, judged(np.where(BACK, -MOST_NATS, 0.0)))), progress(judged(foot))
    assert held.completion.best == pytest.approx(1.0 / 3.0, abs=0.05) and afresh.completion.best == 1.0
    assert held.completion.lower <= 1.0 / 3.0 + 0.03 and held.completion.upper == 1.0


def test_where_most_of_what_was_open_has_risen_the_rest_is_taken_for_open_no_more() -> None:
    """The front was open in winter; in spring photos show a part of its length, built to the top, or half open."""
    winter, part = judged(np.where(FRONT, -MOST_NATS, 0.0)), FRONT & (ALONG_M < 1.6)
    risen = judged(np.where(part, MOST_NATS, 0.0), winter)
    low = judged(np.where(part, np.where(UP_M < 1.2, MOST_NATS, -MOST_NATS), 0.0), winter)
    assert not risen[0].was_open_uv_m and progress(risen).completion.best == 1.0
    assert polygon.area(low[0].was_open_uv_m) == pytest.approx(2.4 * 3.0, abs=0.3)


def test_a_glimpse_of_a_row_takes_nothing_of_what_was_open_under_it() -> None:
    """One sample in five of the front's top looks built: too little for its rows to be shown."""
    glimpse = FRONT & (UP_M > 2.5) & (np.floor(ALONG_M / OPTIONS.spacing_m) % 5 == 0)
    seen = judged(np.where(glimpse, MOST_NATS, 0.0), judged(np.where(BACK, -MOST_NATS, 0.0)))
    assert polygon.area(seen[2].was_open_uv_m) == pytest.approx(4.0 * 3.0, abs=0.01)
