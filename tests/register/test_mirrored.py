"""A survey with exchanged or reversed axes is told as that, and no station is placed by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import given_pose, register
from tests.register.test_markers import site


@pytest.mark.parametrize("axes", [([1, 0, 2], [1, 1, 1]), ([0, 1, 2], [-1, 1, 1]), ([0, 1, 2], [1, 1, -1])])
def test_a_survey_with_exchanged_or_reversed_axes_is_named_once_and_places_no_station(
    axes: tuple[list[int], list[int]],
) -> None:
    station, survey = site(5)
    order, signs = (np.array(part) for part in axes)
    wrong = [replace(one, corners_m=frozen(one.corners_m[:, order] * signs)) for one in survey]
    placement = register((station,), wrong, RegisterOptions())
    assert placement.stations == ()
    told, left_out = placement.rejections
    assert (told.code, told.values["seen"], told.values["agree_mirrored"]) == (Reason.SURVEY_MIRRORED, 5, 5)
    assert left_out.code is Reason.STATION_SURVEY_MIRRORED and left_out.subject.name == "A1"


def test_a_survey_whose_markers_are_wrong_each_its_own_way_is_no_mirror_image() -> None:
    station, survey = site(5)
    rng = np.random.default_rng(1)
    wrong = [replace(one, corners_m=frozen(one.corners_m + rng.normal(0.0, 0.5, 3))) for one in survey]
    placement = register((station,), wrong, RegisterOptions())
    assert not any(rejection.code is Reason.SURVEY_MIRRORED for rejection in placement.rejections)


def test_a_station_whose_pose_is_given_stands_there_whatever_the_survey_is() -> None:
    station, survey = site(5)
    wrong = [replace(one, corners_m=frozen(one.corners_m[:, [1, 0, 2]])) for one in survey]
    pose = given_pose("B2", np.eye(4), 0.001, 0.002)
    placement = register((station, replace(station, station="B2")), wrong, RegisterOptions(), given={"B2": pose})
    assert [placed.pose.station for placed in placement.stations] == ["B2"]
