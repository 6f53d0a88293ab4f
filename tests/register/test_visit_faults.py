"""Faults of a whole visit are told by their names, where no station alone shows them: each seed was silent once."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import ControlPoint, register
from asbuilt_bim.register.pose import Placement
from benchmarks.register.faults import (
    Fault,
    mirrored_survey,
    named,
    pose_of_another_storey,
    station_of_another_site,
    two_exchanged,
)
from benchmarks.register.place import errors
from benchmarks.register.visits import ORIGIN_M, simulated


def placed(fault: Fault) -> Placement:
    visit = fault.visit
    return register(visit.measured, visit.survey, RegisterOptions(), given=fault.given, remembered=fault.remembered)


@pytest.mark.parametrize("seed", [3004, 3009])
def test_a_mirrored_survey_is_told_where_the_prints_of_each_wall_are_their_own_mirror_image(seed: int) -> None:
    fault = mirrored_survey(seed)
    placement = placed(fault)
    assert named(fault, placement) and not placement.stations


def test_exchanged_prints_are_not_taken_for_a_mirrored_survey() -> None:
    fault = two_exchanged(3000)
    assert named(fault, placed(fault))


def test_a_station_of_another_site_whose_prints_would_lie_behind_it_leaves_the_others_placed() -> None:
    fault = station_of_another_site(3019)
    placement = placed(fault)
    alone = register(fault.visit.measured[:-1], fault.visit.survey, RegisterOptions())
    assert named(fault, placement)
    assert {one.pose.station for one in placement.stations} == {one.pose.station for one in alone.stations}
    assert len(placement.stations) >= 10


def test_a_given_pose_a_storey_off_is_told_though_one_print_alone_holds_its_station() -> None:
    fault = pose_of_another_storey(3047)
    placement = placed(fault)
    assert named(fault, placement)
    assert Reason.STATION_ON_ONE_MARKER in {one.code for one in placement.rejections}


def test_points_clicked_at_one_station_place_the_others_too_far_from_the_origin_as_sites_are() -> None:
    visit = simulated(3000, 12)
    corners = {one.marker_id: one.corners_m + ORIGIN_M for one in visit.prints}
    first = max(visit.measured, key=lambda one: len(one.markers))
    points = [
        ControlPoint(name=f"{mark.marker_id}-{k}", world_m=corners[mark.marker_id][k], left_px=frozen(mark.left_px[k]))
        for mark in first.markers
        for k in range(4)
    ]
    placement = register(visit.measured, (), RegisterOptions(), control_points={first.station: points})
    found, sigmas = errors(placement, visit)
    assert len(found) > 1 and np.abs(found / sigmas).max() < 5.0
    assert {one.pose.station for one in placement.stations} > {first.station}
