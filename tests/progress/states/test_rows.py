"""How clearly each row of a face is built, by what one visit shows."""

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.likelihood import MOST_NATS
from asbuilt_bim.progress.states.rows import of_sides, row_log_odds, sides_of
from tests.match.small_site import FAR, box, element, round_column

WALL = element("W", "wall", box(0, 0, 0, 4.0, 0.25, 3.0))
SPACING_M = ProgressOptions().spacing_m
SIDES = list(sides_of(WALL, SPACING_M))
FRONT = [side for side in SIDES if side.face == 0]
SAMPLES = cell_samples(WALL, SPACING_M)
LOW = SAMPLES.points_m[:, 2] < FAR[2] + 1.0


def test_every_sample_lies_in_one_row_of_one_side_and_rows_are_as_high_as_samples() -> None:
    rows = element_cells(WALL).shape[0], 60
    assert all(side.shape == rows for side in SIDES)
    every = np.concatenate([side.samples for side in SIDES])
    assert sorted(every) == list(range(len(LOW)))


def test_a_lateral_surface_has_eight_sides() -> None:
    sides = list(sides_of(round_column("C", 8.0, 0.0, 0.25, 3.0), SPACING_M))
    assert len(sides) == 8 and len({side.face for side in sides}) == 1


def test_a_row_is_as_clear_as_its_samples_on_average() -> None:
    rows = row_log_odds(FRONT, np.where(LOW, MOST_NATS, -3.0))
    assert set(np.unique(rows)) == {MOST_NATS, -3.0}
    assert (rows[:, :20] == MOST_NATS).all() and (rows[:, 20:] == -3.0).all()
    assert not row_log_odds(FRONT, np.where(LOW, 0.2, 0.0)).any()  # less than half a nat is nothing


@pytest.mark.parametrize("rows", [None, np.ones((3, 60)), np.ones((16, 7))])
def test_rows_of_another_design_are_nobody_s(rows: object) -> None:
    assert of_sides(rows, FRONT) is None  # type: ignore[arg-type]
