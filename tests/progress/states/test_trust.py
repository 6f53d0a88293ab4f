from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.evidence import Evidence, Verdict
from asbuilt_bim.progress.states.outlines import looks_like_bars, standing_off, stands_off
from asbuilt_bim.progress.states.trust import (
    WIDER_THAN_A_COLUMN,
    large_enough,
    seen_through,
    trusted,
)
from tests.match.small_site import box, element

OPTIONS = ProgressOptions()
SAMPLES = cell_samples(element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.0)), 0.05)
FRONT = SAMPLES.face == 0
U, V = SAMPLES.uv_m.T
HIGH = np.full(len(U), 10.0)


def near(chosen: BoolArray, offset_m: FloatArray | float, drop_m: float = 0.0) -> Evidence:
    """Return evidence of a surface near the chosen samples, standing off by so much, with 1 cm of noise."""
    noise = np.random.default_rng(3).normal(0.0, 0.01, len(U))
    verdict = np.where(chosen, Verdict.NEAR, Verdict.NOT_MEASURED).astype(np.uint8)
    return Evidence(
        verdict=verdict, sigma_m=np.full(len(U), 0.02), own=verdict, offset_m=offset_m + noise,
        common_m=np.full(len(U), 0.01), drop_m=np.full(len(U), drop_m), tinted=np.zeros(len(U), dtype=bool),
        through=np.zeros(len(U), dtype=bool), surely_through=np.zeros(len(U), dtype=bool),
    )  # fmt: skip


def test_a_large_patch_on_the_design_is_trusted_and_a_small_one_only_when_a_face_backs_it() -> None:
    large, small = FRONT & (U < 1.0), FRONT & (U < 0.4) & (V < 0.5)
    np.testing.assert_array_equal(trusted(SAMPLES, near(large, 0.0), HIGH, False, OPTIONS)[0], large)
    assert not trusted(SAMPLES, near(small, 0.0), HIGH, False, OPTIONS)[0].any()
    np.testing.assert_array_equal(trusted(SAMPLES, near(small, 0.0), HIGH, True, OPTIONS)[0], small)


def test_a_patch_whose_mean_stands_before_the_design_is_formwork() -> None:
    patch = FRONT & (U < 2.0)
    kept, before = trusted(SAMPLES, near(patch, 0.09), HIGH, True, OPTIONS)
    assert not kept.any()
    np.testing.assert_array_equal(before, patch)


def test_a_surface_reaches_to_its_upright_edges_where_the_ring_of_a_sample_looks_past_them() -> None:
    strip, sure = FRONT & (U < 0.4), FRONT & (U > 0.1) & (U < 0.3)
    seen = near(strip, 0.0)
    edged = replace(seen, verdict=np.where(strip & ~sure, Verdict.MIXED, seen.verdict).astype(np.uint8))
    np.testing.assert_array_equal(trusted(SAMPLES, edged, HIGH, True, OPTIONS)[0], strip)
    unsure = replace(seen, verdict=np.where(strip & ~sure, Verdict.NOT_MEASURED, seen.verdict).astype(np.uint8))
    np.testing.assert_array_equal(trusted(SAMPLES, unsure, HIGH, True, OPTIONS)[0], strip)
    timber = replace(edged, tinted=strip & ~sure)
    np.testing.assert_array_equal(trusted(SAMPLES, timber, HIGH, True, OPTIONS)[0], sure)


def test_a_patch_is_as_well_known_as_its_mean_and_no_better_than_the_rig() -> None:
    seen, patch = near(FRONT, 0.0), FRONT
    noisy = replace(seen, sigma_m=np.full(len(U), 0.25))
    np.testing.assert_array_equal(trusted(SAMPLES, noisy, HIGH, True, OPTIONS)[0], patch)
    small = FRONT & (U < 0.4) & (V < 0.4)
    few = replace(near(small, 0.0), sigma_m=np.full(len(U), 0.5))
    assert not trusted(SAMPLES, few, HIGH, True, OPTIONS)[0].any()
    far = replace(noisy, common_m=np.full(len(U), 0.16))
    assert not trusted(SAMPLES, far, HIGH, True, OPTIONS)[0].any()


def test_a_narrow_strip_at_an_empty_walls_end_is_its_neighbour_but_one_beside_a_pole_goes_on() -> None:
    strip, pole = FRONT & (U < 0.3), FRONT & (U > 0.3) & (U < 0.5)
    seen = near(strip, 0.0)
    assert trusted(SAMPLES, seen, HIGH, True, OPTIONS)[0].any()
    assert not trusted(SAMPLES, seen, HIGH, True, OPTIONS, WIDER_THAN_A_COLUMN)[0].any()
    poled = verdicts(seen, pole, Verdict.BEFORE, Verdict.BEFORE)
    np.testing.assert_array_equal(trusted(SAMPLES, poled, HIGH, True, OPTIONS, WIDER_THAN_A_COLUMN)[0], strip)


def test_a_surface_does_not_reach_sideways_by_a_pour_line_where_starter_bars_stand() -> None:
    wall, bars = FRONT & (V < 1.0), FRONT & (V > 1.0) & (U < 1.0)
    seen = near(wall | bars, 0.0)
    verdict = np.where(bars & (U > 0.3), Verdict.MIXED, seen.verdict)
    own = np.where(FRONT & (V > 1.0) & (np.floor(U / 0.05) % 3 == 0), Verdict.BEHIND, seen.own)
    barred = replace(seen, verdict=verdict.astype(np.uint8), own=own.astype(np.uint8))
    kept, _ = trusted(SAMPLES, barred, HIGH, True, OPTIONS)
    assert not np.any(kept & (V > 1.0) & (U > 0.3))
    assert np.all(kept[wall & (V < 0.95)])  # its last row is the pour line's


def test_a_bar_that_stands_on_concrete_is_not_concrete_though_its_depth_lies_on_the_design() -> None:
    wall, bar = FRONT & (V < 1.0), FRONT & (V > 1.0) & (U > 1.0) & (U < 1.1)
    kept, _ = trusted(SAMPLES, near(wall | bar, 0.0), HIGH, True, OPTIONS)
    np.testing.assert_array_equal(kept, wall)


def verdicts(seen: Evidence, chosen: BoolArray, verdict: Verdict, own: Verdict) -> Evidence:
    """Return evidence with other verdicts, of the ring and of the own pixel, at the chosen samples."""
    return replace(
        seen,
        verdict=np.where(chosen, verdict, seen.verdict).astype(np.uint8),
        own=np.where(chosen, own, seen.own).astype(np.uint8),
    )


def test_a_blurred_strip_does_not_divide_a_patch_but_a_strip_that_is_seen_through_does() -> None:
    pieces, strip = FRONT & (U < 0.3) & (V < 0.44), FRONT & (V > 0.2) & (V < 0.25)
    blurred = near(pieces & ~strip, 0.0)
    np.testing.assert_array_equal(trusted(SAMPLES, blurred, HIGH, True, OPTIONS)[0], pieces & ~strip)
    apart = verdicts(blurred, strip, Verdict.MIXED, Verdict.BEHIND)
    assert not trusted(SAMPLES, apart, HIGH, True, OPTIONS)[0].any()


def test_a_hole_that_a_bar_divides_is_as_large_as_what_depth_shows_in_both_its_halves() -> None:
    bar = FRONT & (U > 0.2) & (U < 0.25)
    halves = FRONT & (U < 0.44) & (V < 0.3) & ~bar
    none = np.zeros(len(U), dtype=bool)
    assert not large_enough(SAMPLES, halves, halves, 0.1, none).any()
    np.testing.assert_array_equal(large_enough(SAMPLES, halves, halves, 0.1, bar), halves)
    assert not large_enough(SAMPLES, halves, halves & (U < 0.2), 0.1, bar).any()


def test_a_hole_that_a_board_before_it_divides_is_one_hole_and_one_that_a_wall_divides_is_two() -> None:
    hole = FRONT & (U < 0.3)
    for width_m, joined in ((0.3, True), (0.6, False)):
        low, high = 0.2 + width_m, 0.4 + width_m
        board = FRONT & (V > 0.2) & (low > V)
        halves = hole & ~board & (high > V)  # two of 0.06 m2, where 0.10 are asked
        kept = large_enough(SAMPLES, halves, halves, 0.1, ~FRONT, board)
        np.testing.assert_array_equal(kept, halves if joined else halves & False)


def test_nothing_is_seen_through_below_a_surface_that_stands_there_whatever_its_colour() -> None:
    cage, free = FRONT & (V > 1.0) & (V < 1.5), FRONT & (V > 1.5)
    seen = verdicts(near(FRONT & (V < 1.0), 0.0), cage, Verdict.MIXED, Verdict.BEHIND)
    none = np.zeros(len(U), dtype=bool)
    open_above = verdicts(seen, free, Verdict.BEHIND, Verdict.BEHIND)
    assert np.all(seen_through(SAMPLES, open_above, none, OPTIONS)[cage & (V > 1.1)])
    formwork = verdicts(open_above, FRONT & (V > 1.8), Verdict.OTHER, Verdict.NEAR)
    assert not seen_through(SAMPLES, formwork, none, OPTIONS).any()


def test_a_cage_is_seen_through_at_its_height_up_to_its_top_and_concrete_under_it_is_not() -> None:
    wall, cage = FRONT & (V < 1.0), FRONT & (V > 1.0)
    bars = cage & ((np.floor(U / 0.05) % 2 == 0) | (np.floor(V / 0.05) % 8 == 0))
    seen = verdicts(near(wall, 0.0), bars, Verdict.MIXED, Verdict.NEAR)
    seen = verdicts(seen, cage & ~bars, Verdict.MIXED, Verdict.BEHIND)
    through = seen_through(SAMPLES, seen, wall, OPTIONS)
    assert np.all(through[cage & (V > 1.1)]) and not through[~cage].any()
    solid = verdicts(seen, cage & ~bars & (V < 1.8), Verdict.MIXED, Verdict.NEAR)
    assert not seen_through(SAMPLES, solid, wall, OPTIONS)[cage & (V < 1.65)].any()
    formwork = verdicts(seen, FRONT & (V > 1.9), Verdict.OTHER, Verdict.NEAR)
    assert not seen_through(SAMPLES, formwork, wall, OPTIONS).any()


def test_low_over_the_foot_depth_can_not_tell_the_element_from_the_ground() -> None:
    kept, _ = trusted(SAMPLES, near(FRONT, 0.0, drop_m=0.2), V, False, OPTIONS)
    np.testing.assert_array_equal(kept, FRONT & (V > 0.2))


MATCH = FaceMatch(
    station="A1", face_id="A1/1", design_face="W-0", element="W", outline_uv_m=(), area_m2=0.3,
    area_sigma_calibration_m2=0.0, area_sigma_image_m2=0.0, whole=True, overlap=1.0, offset_m=0.0,
    offset_sigma_m=0.005, angle_rad=0.0, tilt_rad=None, score=1.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("area_m2", "offset_m", "sigma_m", "bars"),
    [
        (0.3, 0.0, 0.005, False),
        (0.3, -0.05, 0.005, True),
        (0.3, 0.0, 0.03, True),
        (2.0, -0.05, 0.005, False),
        (0.05, 0.0, 0.005, True),
    ],
)  # fmt: skip
def test_a_small_face_that_can_not_be_told_from_steel_behind_its_cover_counts_for_nothing(
    area_m2: float, offset_m: float, sigma_m: float, bars: bool
) -> None:
    match = replace(MATCH, area_m2=area_m2, offset_m=offset_m, offset_sigma_m=sigma_m)
    assert looks_like_bars(match, OPTIONS) is bars


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_face_stands_off_its_design_only_by_more_than_it_may_err(side: float) -> None:
    assert stands_off(replace(MATCH, offset_m=0.08 * side), OPTIONS)
    assert not stands_off(replace(MATCH, offset_m=0.08 * side, offset_sigma_m=0.03), OPTIONS)


def test_what_lies_in_the_outline_of_a_plane_that_stands_off_is_not_that_surface() -> None:
    wall = element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.0))
    half = replace(MATCH, station="A1", offset_m=-0.12, outline_uv_m=polygon.box(0.0, 0.0, 1.5, 2.0))
    by_face = {wall.faces[0].face_id: (half,)}
    np.testing.assert_array_equal(standing_off(wall, SAMPLES, "A1", by_face, OPTIONS), FRONT & (U < 1.5))
    assert not standing_off(wall, SAMPLES, "A2", by_face, OPTIONS).any()
    on_it = {wall.faces[0].face_id: (replace(half, offset_m=-0.02),)}
    assert not standing_off(wall, SAMPLES, "A1", on_it, OPTIONS).any()
