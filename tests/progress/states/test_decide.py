"""What an element's faces are after visits that show it, and after later ones that show nothing of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.completion.element import progress_of
from asbuilt_bim.progress.completion.records import design_face_record
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory
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


@dataclass(frozen=True, kw_only=True)
class Visit:
    """What a visit makes of the wall, and the history with it."""

    surfaces: Sequence[SurfaceState]
    progress: ElementProgress
    history: VisitHistory


def visit(odds: FloatArray, before: Visit | None = None) -> Visit:
    """Judge the wall by what a station says of its samples (N,), after an earlier visit if any."""
    history = before.history if before else EMPTY_HISTORY
    surfaces = judged(odds, [history.earlier(WALL.global_id, face, OPTIONS) for face in WALL.faces])
    one = progress_of(WALL, surfaces, date(2026, 3, 2), history, OPTIONS)
    records = tuple(design_face_record(face, state) for face, state in zip(WALL.faces, surfaces, strict=True))
    after = replace(history, faces={WALL.global_id: records}, elements={WALL.global_id: one})
    return Visit(surfaces=surfaces, progress=one, history=after)


@pytest.mark.parametrize(("clear", "barely"), [(MOST_NATS, -1.0), (3.0, -1.0), (3.0, 1.0)])
def test_what_is_certain_and_what_is_open_stay_as_they_are_where_later_photos_show_nothing(
    clear: float, barely: float
) -> None:
    """Between what is built and what is open lies a strip that photos show barely: that doesn't change either."""
    shown = np.where(UP_M < 1.2, clear, np.where(UP_M < 1.4, barely, -MOST_NATS))
    first = again = visit(np.where(FRONT, shown, 0.0))
    for _ in range(2):
        again = visit(NOTHING, again)
        seen, now = first.progress, again.progress
        assert now.completion.lower == seen.completion.lower and now.cells_built == seen.cells_built > 0.0
        assert now.completion.upper == 1.0 and now.cells_open == 0.0


def test_what_is_known_of_the_levels_stays_however_many_visits_see_nothing() -> None:
    first = again = visit(np.where(FRONT, -6.0, 0.0))
    for _ in range(2):
        again = visit(NOTHING, again)
        kept, was = again.progress.level_evidence, first.progress.level_evidence
        assert kept is not None and was is not None and (kept == was).all() and np.ptp(kept) > 10.0


def test_of_a_face_that_photos_say_too_little_of_no_rows_are_kept() -> None:
    nearly = judged(np.where(FRONT, 0.9 * least_nats(), 0.0))
    assert nearly[0].row_log_odds is None and not nearly[0].built_uv_m


def test_a_side_seen_open_before_another_rose_holds_nothing_back_at_any_later_visit() -> None:
    """The back was open in winter; in spring the front is 1 m high; in summer no photo shows the wall."""
    winter = visit(np.where(BACK, -MOST_NATS, 0.0))
    spring = visit(np.where(FRONT, np.where(UP_M < 1.0, MOST_NATS, -MOST_NATS), 0.0), winter)
    summer = visit(NOTHING, spring)
    assert spring.progress.completion.lower == pytest.approx(1.0 / 3.0, abs=0.03)
    assert summer.progress.completion.lower == spring.progress.completion.lower


def test_where_a_side_is_seen_built_to_the_top_what_was_open_on_another_has_risen() -> None:
    top = np.where(BACK & (UP_M > 1.0), MOST_NATS, 0.0)
    afresh, risen = (
        visit(top, before).progress.completion
        for before in (None, visit(np.where(FRONT & (UP_M < 1.0), -MOST_NATS, 0.0)))
    )
    assert risen.lower == pytest.approx(afresh.lower, abs=0.01) and afresh.lower > 0.95 and risen.best == afresh.best


def test_a_few_samples_that_looked_open_in_what_is_built_dont_make_it_open_later() -> None:
    """One sample in twenty errs."""
    errs = np.random.default_rng(1).random(len(FRONT)) < 0.05
    shown = np.where(UP_M < 1.5, MOST_NATS, -MOST_NATS) * np.where(errs, -1.0, 1.0)
    seen = visit(np.where(FRONT | BACK, shown, 0.0))
    assert visit(NOTHING, seen).progress.completion.lower == seen.progress.completion.lower > 0.4
    foot = visit(np.where(FRONT & (UP_M < 0.7), MOST_NATS, 0.0), seen).progress.completion
    assert foot.lower <= 0.52 and (foot.best or 0.0) <= 0.52  # what was open over it is as likely open still


def test_what_hangs_over_what_is_open_is_complete_at_no_later_visit() -> None:
    """A cage's top looked like concrete, and the wall was open under it."""
    hangs = np.where(UP_M < 1.5, MOST_NATS, np.where(UP_M > 2.8, MOST_NATS, -MOST_NATS))
    seen = visit(np.where(FRONT, hangs, 0.0))
    assert seen.progress.state == "part"
    assert visit(NOTHING, seen).progress.state == "unknown"
    assert visit(np.where(BACK & (UP_M < 1.0), MOST_NATS, 0.0), seen).progress.state != "complete"


def test_what_was_open_over_what_another_side_shows_built_holds_the_best_estimate_back() -> None:
    """The back was open over 1 m in winter; in spring the front's foot alone is seen, built."""
    winter = visit(np.where(BACK, np.where(UP_M < 1.0, MOST_NATS, -MOST_NATS), 0.0))
    foot = np.where(FRONT & (UP_M < 0.8), MOST_NATS, 0.0)
    held, afresh = visit(foot, winter).progress, visit(foot).progress
    assert held.completion.best == pytest.approx(1.0 / 3.0, abs=0.05) and (afresh.completion.best or 0.0) > 0.95
    assert held.completion.lower <= 1.0 / 3.0 + 0.03 and held.completion.upper == 1.0
    summer = visit(np.where(SAMPLES.face == 1, foot[FRONT].max() * (UP_M < 0.8), 0.0), visit(foot, winter)).progress
    assert summer.completion.best == pytest.approx(1.0 / 3.0, abs=0.05)  # what the winter saw, not the spring


def test_where_a_part_of_a_wall_has_risen_the_rest_has_most_likely_risen_as_high() -> None:
    """The front was open in winter; in spring photos show a part of its length, built to the top, or half open."""
    winter, part = visit(np.where(FRONT, -MOST_NATS, 0.0)), FRONT & (ALONG_M < 1.6)
    risen = visit(np.where(part, MOST_NATS, 0.0), winter).progress.completion
    low = visit(np.where(part, np.where(UP_M < 1.2, MOST_NATS, -MOST_NATS), 0.0), winter).progress.completion
    assert risen.best == 1.0 and low.best == pytest.approx(0.4, abs=0.03)
    assert max(risen.lower, low.lower) <= 0.45  # of what nobody sees nothing is certain


def test_a_wall_half_high_of_which_another_side_rises_later_stands_contradicted_by_nobody() -> None:
    winter = visit(np.where(FRONT, np.where(UP_M < 1.4, MOST_NATS, -MOST_NATS), 0.0))
    one = visit(np.where(BACK & (ALONG_M < 2.0), MOST_NATS, 0.0), winter).progress
    assert one.completion.lower >= 1.4 / 3.0 - 0.02 and not one.cells_conflict


def test_what_was_built_and_looks_open_now_is_unknown_until_a_second_visit_says_so_too() -> None:
    built, opened = (np.where(FRONT, nats, 0.0) for nats in (MOST_NATS, -MOST_NATS))
    first = visit(built)
    gone = visit(opened, first)
    assert first.progress.state == "complete" and gone.progress.state == "unknown"
    assert visit(opened, gone).progress.state == "not started"


def test_what_was_not_started_and_shows_no_foot_now_may_have_begun_since() -> None:
    """In winter all of it was open; in spring its upper half alone is seen, open."""
    winter = visit(np.where(FRONT, -MOST_NATS, 0.0))
    spring = visit(np.where(FRONT & (UP_M > 1.5), -MOST_NATS, 0.0), winter).progress
    assert winter.progress.state == "not started" and spring.state == "unknown"
    assert spring.completion.upper == pytest.approx(0.5, abs=0.03)


def test_a_strip_that_is_as_high_as_the_rest_was_leaves_the_rest_as_uncertain_as_it_is() -> None:
    """Three walls in four were 1 m high in winter; in spring the last quarter is, and nobody looks at the others."""
    low = np.where(UP_M < 1.0, MOST_NATS, -MOST_NATS)
    winter = visit(np.where(FRONT & (ALONG_M < 3.0), low, 0.0))
    spring = visit(np.where(BACK & (ALONG_M > 3.0), low, 0.0), winter).progress.completion
    assert spring.lower == pytest.approx(1.0 / 3.0, abs=0.05) and spring.best == pytest.approx(1.0 / 3.0, abs=0.05)
    assert spring.upper > 0.75


def test_a_glimpse_of_a_row_takes_nothing_of_what_was_open_under_it() -> None:
    """One sample in five of the front's top looks built: too little for its rows to be shown."""
    glimpse = FRONT & (UP_M > 2.5) & (np.floor(ALONG_M / OPTIONS.spacing_m) % 5 == 0)
    winter = visit(np.where(BACK, -MOST_NATS, 0.0))
    seen = visit(np.where(glimpse, MOST_NATS, 0.0), winter).progress
    assert seen.completion.lower == 0.0 and (seen.completion.best or 0.0) == 0.0
