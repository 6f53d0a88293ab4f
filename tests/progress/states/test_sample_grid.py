from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.geometry import polygon
from asbuilt_bim.progress.states.sample_grid import above, patches, share_around, strips
from tests.match.small_site import box, element, round_column

SAMPLES = cell_samples(element("W", "wall", box(0, 0, 0, 2.0, 0.25, 2.0)), 0.05)
FRONT = SAMPLES.face == 0
U, V = SAMPLES.uv_m.T


def test_patches_hang_together_on_one_face_only() -> None:
    chosen = (FRONT & (U < 0.5)) | (FRONT & (U > 1.5)) | (SAMPLES.face == 2)
    labels = patches(SAMPLES, chosen)
    assert len(np.unique(labels[chosen])) == 3
    assert np.all(labels[~chosen] == 0)


def test_patches_hang_together_over_the_seam_of_a_round_column() -> None:
    samples = cell_samples(round_column("R", 1.0, 1.0, 0.2, 3.0), 0.05)
    u = samples.uv_m[:, 0]
    ends = (u < u.min() + 0.15) | (u > u.max() - 0.15)
    assert len(np.unique(patches(samples, ends)[ends])) == 1
    wall = FRONT & ((U < 0.15) | (U > 1.85))
    assert len(np.unique(patches(SAMPLES, wall)[wall])) == 2


def test_above_looks_up_its_own_upright_line_and_no_other() -> None:
    found = above(SAMPLES, FRONT & (U < 0.5) & (V > 1.0) & (V < 1.1))
    np.testing.assert_array_equal(found, FRONT & (U < 0.5) & (V < 1.05))


def test_a_share_counts_only_among_those_asked() -> None:
    flags, among = FRONT & (U < 1.0), FRONT & ((U < 1.0) | (V < 1.0))
    share = share_around(SAMPLES, flags, among)
    assert np.all(share[FRONT & (U < 0.8) & (V < 1.8)] == 1.0)
    assert np.all(share[FRONT & (U > 1.3)] == 0.0)


def test_strips_cover_what_their_samples_stand_for() -> None:
    chosen = FRONT & ((U < 0.5) | (V > 1.5)) & ~((V > 0.7) & (V < 0.8))
    low, high = strips(SAMPLES, np.flatnonzero(chosen))
    region = polygon.boxes(low[:, 0] - 1e-6, low[:, 1], high[:, 0] + 1e-6, high[:, 1])
    assert polygon.area(region) == pytest.approx(SAMPLES.area_m2[chosen].sum(), rel=1e-4)
    np.testing.assert_array_equal(polygon.contains(region, SAMPLES.uv_m[FRONT]), chosen[FRONT])
