"""Stations are linked by prints that nobody surveyed, and what is wrong with one is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import given_pose, register
from asbuilt_bim.report.wording.reasons import words_of
from tests.register.linked_scene import (
    centre_alone,
    codes,
    errors,
    poses,
    prints,
    shown_by,
    stations,
    survey,
)

OPTIONS = RegisterOptions()


def test_stations_that_see_no_surveyed_print_are_placed_by_those_that_nobody_surveyed() -> None:
    measured = stations()
    placement = register(measured, survey([0, 1, 2, 3]), OPTIONS)
    assert len(placement.stations) == 6 and codes(placement) == []
    methods = {placed.pose.station: placed.pose.method for placed in placement.stations}
    assert methods["A0"] == "markers" and methods["A5"] == "linked"
    for name, error in errors(placement).items():
        assert np.linalg.norm(error[3:]) < 0.03, name
        assert np.degrees(np.linalg.norm(error[:3])) < 0.3, name


def test_without_such_a_link_they_are_not_placed_as_before() -> None:
    alone = [replace(one, markers=tuple(m for m in one.markers if m.marker_id < 4)) for one in stations()]
    placement = register(alone, survey([0, 1, 2, 3]), OPTIONS)
    assert "A5" not in {placed.pose.station for placed in placement.stations}
    assert Reason.MARKERS_TOO_FEW in codes(placement)


def test_sigmas_hold_in_a_monte_carlo_and_grow_along_the_chain() -> None:
    """Of 15 visits, which tell the mean pull to 5 %: a sigma 3.2 times too small is found."""
    pulls, sigmas = [], []
    for seed in range(15):
        placement = register(stations(seed), survey([0, 1, 2, 3]), OPTIONS)
        found = errors(placement)
        for placed in placement.stations:
            sigma = np.sqrt(np.diag(placed.pose.covariance))
            pulls.append(found[placed.pose.station] / sigma)
            sigmas.append((int(placed.pose.station[1:]), float(np.linalg.norm(sigma[3:]))))
    assert len(pulls) > 75
    assert np.sqrt(np.mean(np.square(pulls))) < 1.2 and np.abs(pulls).max() < 5.0
    near, far = (np.median([sigma for k, sigma in sigmas if k == at]) for at in (0, 5))
    assert far > 1.5 * near


def test_the_order_of_the_stations_changes_nothing() -> None:
    measured = stations()
    first = register(measured, survey([0, 1, 2, 3]), OPTIONS)
    other = register(measured[::-1], survey([3, 2, 1, 0]), OPTIONS)
    by_name = {placed.pose.station: placed.pose for placed in other.stations}
    for placed in first.stations:
        np.testing.assert_array_equal(placed.pose.world_from_left, by_name[placed.pose.station].world_from_left)


def test_a_visit_whose_prints_are_all_surveyed_is_placed_as_each_station_is_alone() -> None:
    measured, known = stations(), survey(range(14))
    together = {one.pose.station: one.pose for one in register(measured, known, OPTIONS).stations}
    for one in measured:
        (alone,) = register([one], known, OPTIONS).stations
        np.testing.assert_array_equal(alone.pose.world_from_left, together[one.station].world_from_left)


def test_prints_surveyed_by_their_centre_alone_place_a_visit() -> None:
    known = [centre_alone(one) for one in survey([0, 3, 8, 12])]
    placement = register(stations(), known, OPTIONS)
    assert len(placement.stations) == 6
    assert max(np.linalg.norm(error[3:]) for error in errors(placement).values()) < 0.02


def test_centres_of_a_mirrored_survey_place_nothing_and_are_told_so() -> None:
    known = [centre_alone(one) for one in survey([0, 2, 4, 7, 9, 12])]
    mirrored = [replace(one, corners_m=frozen(one.corners_m[:, [1, 0, 2]])) for one in known]
    placement = register(stations(), mirrored, OPTIONS)
    assert placement.stations == () and Reason.SURVEY_MIRRORED in codes(placement)


def test_one_given_pose_places_the_whole_visit() -> None:
    given = given_pose("A2", poses()["A2"], 1e-4, 0.001)
    placement = register(stations(), [], OPTIONS, given={"A2": given})
    assert len(placement.stations) == 6
    assert max(np.linalg.norm(error[3:]) for error in errors(placement).values()) < 0.03


def test_a_given_pose_that_contradicts_the_prints_is_named_with_how_far_it_is_off_in_height() -> None:
    wrong = poses()["A2"].copy()
    wrong[2, 3] += 3.2
    placement = register(stations(), survey(range(14)), OPTIONS, given={"A2": given_pose("A2", wrong, 1e-3, 0.01)})
    (told,) = [one for one in placement.rejections if one.code is Reason.POSE_CONTRADICTS]
    assert told.subject.name == "A2" and float(str(told.values["up_m"])) == pytest.approx(-3.2, abs=0.05)
    assert np.linalg.norm(errors(placement)["A2"][3:]) < 0.02


def test_a_print_seen_in_one_photo_only_helps() -> None:
    measured = stations()
    one_eyed = [
        replace(one, markers=tuple(replace(m, right_px=None) if m.marker_id % 2 else m for m in one.markers))
        for one in measured
    ]
    blind = [replace(one, markers=tuple(m for m in one.markers if m.marker_id % 2 == 0)) for one in measured]
    sigma = {}
    for key, visit in (("helped", one_eyed), ("without", blind)):
        placement = register(visit, survey(range(7)), OPTIONS)
        covariances = {placed.pose.station: placed.pose.covariance for placed in placement.stations}
        sigma[key] = float(np.trace(covariances["A2"][3:, 3:]))
    assert sigma["helped"] < 0.8 * sigma["without"]


def test_a_surveyed_print_that_was_moved_is_named_once_with_the_distance() -> None:
    there = prints()
    there[5] = there[5] + np.array([0.30, 0.0, 0.0])
    measured = stations(there=there)
    assert len(shown_by(measured, 5)) >= 2
    placement = register(measured, survey(range(14)), OPTIONS)
    (told,) = placement.rejections
    assert told.code is Reason.MARKER_MOVED and told.subject.name == "5"
    assert float(str(told.values["away_m"])) == pytest.approx(0.30, abs=0.02)
    assert len(placement.stations) == 6 and "survey it again" in words_of(told).remedy


def test_two_exchanged_prints_are_named_together() -> None:
    there = prints()
    there[4], there[6] = there[6], there[4]
    placement = register(stations(there=there), survey(range(14)), OPTIONS)
    (told,) = placement.rejections
    assert told.code is Reason.MARKERS_EXCHANGED and {told.values["one"], told.values["other"]} == {4, 6}
    assert len(placement.stations) == 6


def test_two_exchanged_prints_are_named_where_one_of_them_alone_holds_its_stations() -> None:
    there = prints()
    there[3], there[12] = there[12], there[3]
    apart = [one for one in stations(there=there) if one.station in ("A0", "A1", "A5")]
    assert [len(shown_by(apart, number)) for number in (12, 3)] == [2, 1]
    placement = register(apart, survey([0, 1, 2, 3, 4, 12]), OPTIONS)
    told = [one for one in placement.rejections if one.code is Reason.MARKERS_EXCHANGED]
    assert [(one.values["one"], one.values["other"]) for one in told] == [(3, 12)]
    assert {one.pose.station for one in placement.stations} == {"A0", "A1"}
    assert all(np.abs(error[3:]).max() < 0.02 for error in errors(placement).values())


def test_prints_are_remembered_and_place_the_next_visit_without_a_survey() -> None:
    first = register(stations(1), survey([0, 1, 2, 3]), OPTIONS)
    assert set(first.tags) == set(range(4, 14)) - {n for n in range(14) if not shown_by(stations(1), n)}
    later = register(stations(2), [], OPTIONS, remembered=first.tags)
    assert len(later.stations) >= 5
    for name, error in errors(later).items():
        assert np.linalg.norm(error[3:]) < 0.05, name


def test_a_print_that_was_moved_between_visits_is_named_with_the_distance() -> None:
    first = register(stations(1), survey([0, 1, 2, 3]), OPTIONS)
    there = prints()
    there[6] = there[6] + np.array([0.0, 0.0, 0.4])
    later = register(stations(2, there=there), survey([0, 1, 2, 3]), OPTIONS, remembered=first.tags)
    (told,) = later.rejections
    assert told.code is Reason.MARKER_MOVED_SINCE and told.subject.name == "6"
    assert float(str(told.values["away_m"])) == pytest.approx(0.4, abs=0.05)
    assert len(later.stations) == 6
    moved = later.tags[6].centre_m - there[6].mean(axis=0)
    assert np.linalg.norm(moved) < 0.05


def test_a_station_of_another_site_with_the_same_prints_is_not_placed() -> None:
    measured = list(stations())
    other = replace(stations(7)[3], station="X1")
    rng = np.random.default_rng(8)
    numbers = rng.permutation([mark.marker_id for mark in other.markers])
    mixed = tuple(replace(mark, marker_id=int(n)) for mark, n in zip(other.markers, numbers, strict=True))
    placement = register([*measured, replace(other, markers=mixed)], survey([0, 1, 2, 3]), OPTIONS)
    assert "X1" not in {placed.pose.station for placed in placement.stations}
    assert len(placement.stations) == 6
    assert any(one.subject.at_station == "X1" for one in placement.rejections)
