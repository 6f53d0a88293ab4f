"""Stations of one visit placed by the design together: what ties them, and what they have in common."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.chances import OF_SITE, Possible, chances
from asbuilt_bim.register.by_design.fitting import MISTAKEN, SHARES
from asbuilt_bim.register.by_design.joint import looked_for, poses_by_design
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import register
from asbuilt_bim.register.point_links import PointLink
from benchmarks.register.design_seen import column, design_of, measured, standing
from tests.register.designed_scene import TRUE, hall, pose_by_design, rough
from tests.register.test_by_design import prints, sees

OPTIONS = RegisterOptions()
OTHER = standing(1.1, 1.0, 0.0)


def at_odds(*log_odds: float) -> list[FloatArray]:
    """Return places of these odds, whatever the share."""
    return [np.full(len(SHARES), one) for one in log_odds]


def test_one_place_of_one_station_is_as_likely_as_its_odds_say() -> None:
    (shares,) = chances([Possible(by_share=at_odds(5.0), faces=0)])
    right = OF_SITE * (1.0 - MISTAKEN) * np.exp(5.0)
    other = OF_SITE * (1.0 - MISTAKEN) + OF_SITE * MISTAKEN + 1.0 - OF_SITE
    assert shares == pytest.approx([right / (right + other)])


def test_stations_that_stand_in_the_design_make_it_likelier_for_a_weak_one() -> None:
    weak = Possible(by_share=at_odds(5.0), faces=4)
    strong = Possible(by_share=at_odds(20.0), faces=8)
    alone = chances([weak])[0][0]
    beside = chances([weak, strong, strong])[0][0]
    assert 1.0 - beside < 0.2 * (1.0 - alone)


def test_stations_that_stand_nowhere_in_the_design_speak_against_one_that_seems_to() -> None:
    seems = Possible(by_share=at_odds(8.0), faces=4)
    nowhere = Possible(by_share=[], faces=12)
    assert chances([seems])[0][0] > 0.999
    assert 1.0 - chances([seems, *[nowhere] * 4])[0][0] > 10.0 * (1.0 - chances([seems])[0][0])


def weak_ones(*, marked: bool) -> tuple[list[StationMeasurement], dict[str, FloatArray], RoughPlaces]:
    """Return two stations that see two faces each; `marked`: and the same prints, which nobody surveyed."""
    design = design_of(hall())
    first, second = measured(design, TRUE, name="A1"), measured(design, OTHER, name="A2")
    stations = [replace(first, faces=first.faces[:2]), replace(second, faces=(second.faces[0], second.faces[5]))]
    if marked:
        stations = [sees(stations[0], TRUE, prints()), sees(stations[1], OTHER, prints())]
    there = replace(rough(), level_m=OTHER[:2, 3] + (0.2, 0.3), bearing_rad=0.05)
    return stations, {"A1": TRUE, "A2": OTHER}, RoughPlaces(places={"A1": rough(), "A2": there}, design=design)


def test_stations_that_show_too_little_each_are_placed_where_prints_tie_them() -> None:
    stations, true, places = weak_ones(marked=True)
    for one in stations:
        alone = poses_by_design(looked_for([one], places, OPTIONS), OPTIONS)[one.station]
        assert [why.code for why in alone[1]] == [Reason.DESIGN_NOT_FOUND]
    placement = register(stations, (), OPTIONS, rough=places)
    assert {one.pose.station for one in placement.stations} == {"A1", "A2"}
    for one in placement.stations:
        assert np.abs(one.pose.world_from_left[:3, 3] - true[one.pose.station][:3, 3]).max() < 0.05


def test_points_tie_stations_as_prints_do() -> None:
    stations, true, places = weak_ones(marked=False)
    link = PointLink(
        first="A1", second="A2", first_from_second=inverse(TRUE) @ OTHER, covariance=frozen(np.diag([1e-6] * 6)),
        by_disparity=frozen(np.zeros(6)), points=40,
    )  # fmt: skip
    looked = looked_for(stations, places, OPTIONS)
    assert all(pose is None for pose, _ in poses_by_design(looked, OPTIONS).values())
    for name, (pose, reasons) in poses_by_design(looked, OPTIONS, [link]).items():
        assert pose is not None, reasons
        assert np.abs(pose.world_from_left[:3, 3] - true[name][:3, 3]).max() < 0.05


def test_a_mirrored_hall_is_refused_whatever_ties_its_stations() -> None:
    stations, _, places = weak_ones(marked=True)
    design = design_of([part.mirrored() for part in hall()])
    placement = register(stations, (), OPTIONS, rough=replace(places, design=design))
    assert not placement.stations


def test_the_order_of_stations_changes_nothing() -> None:
    stations, _, places = weak_ones(marked=True)
    one = {found.pose.station: found.pose for found in register(stations, (), OPTIONS, rough=places).stations}
    other = {found.pose.station: found.pose for found in register(stations[::-1], (), OPTIONS, rough=places).stations}
    assert one.keys() == other.keys() == {"A1", "A2"}
    for name, pose in one.items():
        assert np.array_equal(pose.world_from_left, other[name].world_from_left)


def test_columns_alone_place_a_station_though_none_shows_a_turn() -> None:
    boxes = [column((-2.0, 5.0), 0.3), column((0.2, 6.5), 0.4), column((1.9, 4.6), 0.35), column((3.0, 7.2), 0.5)]
    design = design_of(boxes)
    station = measured(design, TRUE)
    assert all(face.width_m < 0.6 for face in station.faces)
    pose, reasons = pose_by_design(station, rough(), design, OPTIONS)
    assert pose is not None, reasons
    assert np.abs(pose.world_from_left[:3, 3] - TRUE[:3, 3]).max() < 0.03
