from __future__ import annotations

import numpy as np

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.progress.states.votes import mistaken
from tests.match.small_site import box, element

SAMPLES = cell_samples(element("C", "column", box(0, 0, 0, 0.4, 0.4, 3.0)), 0.05)
FRONT, BACK, V = SAMPLES.face == 0, SAMPLES.face == 2, SAMPLES.uv_m[:, 1]


def test_a_side_hardly_seen_open_is_mistaken_where_another_is_well_measured_and_only_there() -> None:
    firm, opened = np.where(FRONT & (V < 2.0), 100.0, 0.0), np.where(BACK, 5.0, 0.0)
    np.testing.assert_array_equal(mistaken(SAMPLES, firm, opened), BACK & (V < 2.0))


def test_two_sides_known_equally_well_contradict_each_other_and_neither_is_overruled() -> None:
    firm, opened = np.where(FRONT, 20.0, 0.0), np.where(BACK, 5.0, 0.0)
    assert not mistaken(SAMPLES, firm, opened).any()


def test_a_side_does_not_overrule_itself() -> None:
    assert not mistaken(SAMPLES, np.where(FRONT, 100.0, 0.0), np.where(FRONT, 5.0, 0.0)).any()
