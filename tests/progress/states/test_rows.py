"""How clearly each row of a face is built: now, and what is left of it at later visits."""

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.likelihood import MOST_NATS, least_nats
from asbuilt_bim.progress.states.rows import Before, of_sides, row_log_odds, sides_of
from tests.match.small_site import FAR, box, element, round_column

WALL = element("W", "wall", box(0, 0, 0, 4.0, 0.25, 3.0))
SPACING_M = ProgressOptions().spacing_m
SIDES = list(sides_of(WALL, SPACING_M))
FRONT = [side for side in SIDES if side.face == 0]
SAMPLES = cell_samples(WALL, SPACING_M)
LOW = SAMPLES.points_m[:, 2] < FAR[2] + 1.0
NOTHING = np.zeros(len(LOW), dtype=bool)
FIRST = Before(built=NOTHING, stands=NOTHING, open=NOTHING, rows=None)


def test_every_sample_lies_in_one_row_of_one_side_and_rows_are_as_high_as_samples() -> None:
    rows = element_cells(WALL).shape[0], 60
    assert all(side.shape == rows for side in SIDES)
    every = np.concatenate([side.samples for side in SIDES])
    assert sorted(every) == list(range(len(LOW)))


def test_a_lateral_surface_has_eight_sides() -> None:
    sides = list(sides_of(round_column("C", 8.0, 0.0, 0.25, 3.0), SPACING_M))
    assert len(sides) == 8 and len({side.face for side in sides}) == 1


def test_a_row_is_as_clear_as_its_samples_on_average() -> None:
    rows = row_log_odds(FRONT, np.where(LOW, MOST_NATS, -3.0), FIRST)
    assert rows is not None and set(np.unique(rows)) == {MOST_NATS, -3.0}
    assert (rows[:, :20] == MOST_NATS).all() and (rows[:, 20:] == -3.0).all()
    assert row_log_odds(FRONT, np.where(LOW, 0.2, 0.0), FIRST) is None  # less than half a nat is nothing


def test_what_stands_stays_as_clear_as_it_was_seen_however_many_visits_see_nothing() -> None:
    seen = row_log_odds(FRONT, np.where(LOW, 6.0, 0.0), FIRST)
    again = seen
    for _ in range(5):
        again = row_log_odds(FRONT, np.zeros(len(LOW)), Before(built=LOW, stands=LOW, open=NOTHING, rows=again))
    assert again == pytest.approx(seen)


def test_a_row_that_nothing_shows_is_what_it_was_and_what_is_gone_says_nothing() -> None:
    seen = row_log_odds(FRONT, np.where(LOW, 6.0, -6.0), FIRST)
    again = row_log_odds(FRONT, np.zeros(len(LOW)), Before(built=LOW, stands=LOW, open=NOTHING, rows=seen))
    assert again is not None and (again == seen).all()
    gone = row_log_odds(FRONT, np.zeros(len(LOW)), Before(built=LOW, stands=NOTHING, open=NOTHING, rows=seen))
    assert gone is not None and (gone[:, :20] == 0.0).all() and (gone[:, 20:] == -6.0).all()
    elsewhere = np.where(SAMPLES.face == 0, 0.0, 6.0)  # another side is seen: of this one what was open is kept alone
    some = Before(built=LOW, stands=LOW, open=~LOW, rows=seen)
    assert (row_log_odds(FRONT, elsewhere, some) == seen).all()
    risen = row_log_odds(FRONT, elsewhere, Before(built=LOW, stands=LOW, open=NOTHING, rows=seen))
    assert risen is not None and (risen[:, :20] == 6.0).all() and (risen[:, 20:] == 0.0).all()


def test_a_row_of_which_a_strip_was_built_is_open_where_the_rest_is_seen_open_for_the_first_time() -> None:
    front = SAMPLES.face == 0
    strip = LOW & front & (SAMPLES.uv_m[:, 0] < 0.05)
    seen = row_log_odds(FRONT, np.where(strip, MOST_NATS, 0.0), FIRST)
    assert seen is not None and (seen[0, :20] == 2.0).all()
    before = Before(built=strip, stands=strip, open=NOTHING, rows=seen)
    for nats in (0.0, MOST_NATS):
        rows = row_log_odds(FRONT, np.where(strip, nats, -6.0), before)
        assert rows is not None and (rows[0, :20] == -3.0).all()
    again = row_log_odds(FRONT, np.where(strip, 0.0, -6.0), replace(before, open=front & ~strip))
    assert again is not None and (again[0, :20] == 2.0).all()  # what was open then counts in it already


@pytest.mark.parametrize("rows", [None, np.ones((3, 60)), np.ones((16, 7))])
def test_of_a_result_without_rows_or_of_another_design_what_was_built_counts_as_barely_decided(rows: object) -> None:
    assert of_sides(rows, FRONT) is None  # type: ignore[arg-type]
    left = row_log_odds(FRONT, np.zeros(len(LOW)), Before(built=LOW, stands=LOW, open=NOTHING, rows=rows))  # type: ignore[arg-type]
    assert left is not None and (left[:, :20] == np.round(least_nats())).all()
