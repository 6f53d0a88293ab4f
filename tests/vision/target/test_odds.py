from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.vision.target.circle import SpaceCircle, fit_circle, outlines_of
from asbuilt_bim.vision.target.disc import find_discs
from asbuilt_bim.vision.target.find import TargetOptions, find_target
from asbuilt_bim.vision.target.odds import LEAST_ODDS, SURE_ODDS, log_odds
from asbuilt_bim.vision.target.pairing import pairings, sharpened
from asbuilt_bim.vision.target.search import sought
from tests.vision.flat_scene import CAMERA, centre_px, disc, pair_of, rectangle

TOLD = TargetOptions(diameter_m=0.30)
CIRCLE = SpaceCircle(
    centre_px=np.array([600.0, 500.0]),
    disparity_px=40.0,
    radius_m=0.1515,
    normal=np.array([0.3, 0.1, -1.0]) / np.sqrt(1.1),
    covariance=np.diag([0.01, 0.01, 0.16, 1e-4])
    + np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, -0.0036], [0, 0, -0.0036, 0]]),
    rms_px=0.2,
)


def test_a_disc_is_likelier_the_target_than_a_square_of_its_size() -> None:
    pair = pair_of([disc((0.1, 0.1, 7.0))])
    (found, *_) = pairings(find_discs(pair.left), find_discs(pair.right), CAMERA, 0.30)
    assert log_odds(found, 0.30) > SURE_ODDS
    assert log_odds(found, 0.315) < log_odds(found, 0.30)
    square = replace(found.left, support=0.6, astray=0.15, further=0.15, overrun=0.1)  # its sides and its corners
    misfit = replace(found.circle, rms_px=0.2)
    assert log_odds(replace(found, left=square, right=square, circle=misfit), 0.30) < LEAST_ODDS - 3.0
    sighting, _ = find_target(pair_of([rectangle((0.1, 0.1, 7.0), 0.27, 0.27)]), TOLD)
    assert sighting is None


def test_an_edge_further_out_speaks_louder_against_a_disc_than_one_further_in_which_a_cover_may_have() -> None:
    pair = pair_of([disc((0.1, 0.1, 7.0))])
    (found, *_) = pairings(find_discs(pair.left), find_discs(pair.right), CAMERA, 0.30)
    covered = replace(found.left, support=0.8, astray=0.2, further=0.0)
    misplaced = replace(found.left, support=0.8, astray=0.0, further=0.2)
    odds = [log_odds(replace(found, left=side, right=side), 0.30) for side in (covered, misplaced)]
    assert odds[0] > odds[1] + 2.0


def test_a_size_that_is_not_sure_says_less_for_the_target() -> None:
    pair = pair_of([disc((0.1, 0.1, 7.0))])
    (found, *_) = pairings(find_discs(pair.left), find_discs(pair.right), CAMERA, 0.30)
    unsure = replace(found.circle, radius_m=0.15, covariance=found.circle.covariance + np.diag([0, 0, 0, 0.03**2]))
    sure = replace(found.circle, radius_m=0.15)
    odds = [log_odds(replace(found, circle=circle), 0.30) for circle in (sure, unsure)]
    assert odds[0] > odds[1] + 1.0


def test_a_half_disc_of_the_told_width_is_not_the_target() -> None:
    sighting, _ = find_target(pair_of([disc((0.1, 0.1, 6.0), hidden_share=0.48)]), TOLD)
    assert sighting is None


def test_an_outline_of_one_photo_leads_to_the_disc_in_both() -> None:
    target = disc((0.1, 0.1, 5.0), yaw_deg=30.0)
    pair = pair_of([target])
    for lefts, rights in ((find_discs(pair.left), ()), ((), find_discs(pair.right))):
        found = sought(pair, lefts, rights, 0.30)
        assert found and np.abs(found[0].circle.centre_px - centre_px(target)).max() < 0.15
        assert found[0].circle.disparity_px == pytest.approx(CAMERA.f_px * CAMERA.baseline_m / 5.0, rel=0.003)


def test_a_radius_that_is_held_keeps_a_covers_edge_from_shrinking_the_circle() -> None:
    guides = outlines_of(CIRCLE, CAMERA)
    assert guides[0] is not None and guides[1] is not None
    outlines = [guide.outline(120) for guide in guides]
    nearer = 1.5 * (np.arange(120) < 50)[:, None]  # the cover's edge, a little inside
    edges = [points - nearer * outward for points, outward in outlines]
    free = fit_circle(*edges, guides[0], guides[1], CAMERA)
    held = fit_circle(*edges, guides[0], guides[1], CAMERA, held_m=CIRCLE.radius_m)
    assert free is not None and held is not None
    assert held.radius_m == pytest.approx(CIRCLE.radius_m, rel=1e-9) and free.radius_m < 0.995 * CIRCLE.radius_m


def test_the_told_diameter_sharpens_the_distance_where_it_isnt_in_doubt() -> None:
    better = sharpened(CIRCLE, TOLD)
    assert CIRCLE.disparity_px < better.disparity_px < 40.4 and 0.15 < better.radius_m < CIRCLE.radius_m
    assert better.covariance[2, 2] < 0.5 * CIRCLE.covariance[2, 2]
    assert sharpened(CIRCLE, TargetOptions()) is CIRCLE
    leaning = sharpened(CIRCLE, TOLD, lean=0.02)
    half_way_px = 0.5 * (CIRCLE.disparity_px + better.disparity_px)
    assert CIRCLE.disparity_px < leaning.disparity_px < half_way_px
    knocked = replace(CIRCLE, radius_m=0.16, covariance=0.01 * CIRCLE.covariance)
    assert sharpened(knocked, TOLD) is knocked
