from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.depth_reference import DepthReference
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register import agree
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import ControlPoint, given_pose, pose_from_control_points, register
from asbuilt_bim.register.pose import StationPose, SurveyedMarker
from asbuilt_bim.register.solve import Sighted, Solution, project_both, solve_pose
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.scale.codec import plain_digest
from asbuilt_bim.scale.share import AmongProcesses
from asbuilt_bim.vision.markers.find import MarkerSighting
from tests.register.test_solve import PLACES, camera, looking_north, marker_corners

MORE = (*PLACES, (-0.3, 0.5, 3.6), (1.8, -0.2, 5.5))


def site(count: int, seed: int = 0) -> tuple[StationMeasurement, list[SurveyedMarker]]:
    rng = np.random.default_rng(seed)
    pose = looking_north()
    markers, survey = [], []
    for index, place in enumerate(MORE[:count]):
        corners = marker_corners(pose, *place)
        pixels = project_both(camera(), pose, corners)[0] + rng.normal(0, 0.1, (4, 4))
        survey.append(
            SurveyedMarker(marker_id=index, corners_m=frozen(corners + rng.normal(0, 0.001, (4, 3))), sigma_m=0.002)
        )
        markers.append(
            MarkerSighting(marker_id=index, left_px=frozen(pixels[:, :2]), right_px=frozen(pixels[:, 2:]), sigma_px=0.1)
        )
    station = StationMeasurement(
        station="A1", camera=camera(), faces=(), target=None, markers=tuple(markers),
        depth_ref=DepthReference(png=b"", sigma_png=b"", scale=2), vertical=None, rejections=(), seconds={},
        left_digest="", right_digest="", thumbnail_jpeg=b"",
    )  # fmt: skip
    return station, survey


def test_markers_place_the_station_within_a_few_millimetres() -> None:
    station, survey = site(3)
    placement = register((station,), survey, RegisterOptions())
    assert placement.rejections == ()
    pose = placement.stations[0].pose
    assert np.linalg.norm(pose.world_from_left[:3, 3] - looking_north()[:3, 3]) < 0.01
    assert pose.markers_used == (0, 1, 2)
    assert pose.residual_px < 0.6


def test_two_markers_are_enough_and_one_is_too_few() -> None:
    assert len(register((site(2)[0],), site(2)[1], RegisterOptions()).stations) == 1
    placement = register((site(1)[0],), site(1)[1], RegisterOptions())
    assert placement.stations == ()
    (few,) = placement.rejections
    assert (few.code, few.values["found"], few.values["needed"]) == (Reason.MARKERS_TOO_FEW, 1, 2)


def test_where_no_marker_at_all_was_read_the_family_may_be_another() -> None:
    station, survey = site(2)
    blind = register((replace(station, markers=()),), survey, RegisterOptions())
    assert "check markers.family" in words_of(blind.rejections[0]).remedy
    one = register((replace(station, markers=station.markers[:1]),), survey, RegisterOptions())
    assert "check markers.family" not in words_of(one.rejections[0]).remedy


def test_a_wrongly_surveyed_marker_is_named_and_the_station_kept() -> None:
    station, survey = site(4)
    true = register((station,), survey, RegisterOptions()).stations[0].pose
    survey[2] = replace(survey[2], corners_m=frozen(survey[2].corners_m + np.array([0.06, 0.0, 0.0])))
    placement = register((station,), survey, RegisterOptions())
    assert [words_of(r).what for r in placement.rejections] == ["station A1, marker 2"]
    assert placement.stations[0].pose.markers_used == (0, 1, 3)
    moved = placement.stations[0].pose.world_from_left[:3, 3] - true.world_from_left[:3, 3]
    assert np.linalg.norm(moved) < 0.01


def test_a_marker_surveyed_with_its_corners_turned_is_named() -> None:
    station, survey = site(3)
    survey[1] = replace(survey[1], corners_m=frozen(np.roll(survey[1].corners_m, 1, axis=0)))
    placement = register((station,), survey, RegisterOptions())
    assert [(r.code, r.subject.name) for r in placement.rejections] == [(Reason.MARKER_CONTRADICTS, "1")]
    assert len(placement.stations) == 1


def test_two_markers_that_contradict_each_other_refuse_the_station() -> None:
    station, survey = site(2)
    survey[1] = replace(survey[1], corners_m=frozen(survey[1].corners_m + np.array([0.0, 0.0, 0.3])))
    placement = register((station,), survey, RegisterOptions())
    assert placement.stations == ()
    assert placement.rejections[0].code is Reason.MARKERS_DISAGREE


def test_a_mirrored_survey_is_refused() -> None:
    station, survey = site(3)
    mirrored = [replace(m, corners_m=frozen(m.corners_m * [1.0, -1.0, 1.0])) for m in survey]
    placement = register((station,), mirrored, RegisterOptions())
    assert placement.stations == ()
    assert "x east, y north, z up" in words_of(placement.rejections[0]).remedy


def test_an_id_that_the_survey_lacks_is_named_and_the_station_kept() -> None:
    station, survey = site(3)
    placement = register((station,), survey[:2], RegisterOptions())
    assert len(placement.stations) == 1
    assert placement.rejections[0].code is Reason.MARKER_NOT_SURVEYED


def test_where_nothing_is_surveyed_no_marker_is_said_to_be_lacking() -> None:
    """They tie the stations to each other: to take them down would harm."""
    station, _ = site(3)
    placement = register((station,), [], RegisterOptions())
    assert Reason.MARKER_NOT_SURVEYED not in {one.code for one in placement.rejections}
    assert [one.code for one in placement.rejections] == [Reason.MARKERS_TOO_FEW]


def test_markers_close_together_and_far_away_are_too_uncertain() -> None:
    pose = looking_north()
    station, survey = site(2)
    markers = []
    for index, x in enumerate((5.0, 5.3)):
        corners = marker_corners(pose, x, 0.0, 14.0, size=0.1)
        pixels = project_both(camera(), pose, corners)[0]
        markers.append(MarkerSighting(marker_id=index, left_px=pixels[:, :2], right_px=None, sigma_px=0.5))
        survey[index] = SurveyedMarker(marker_id=index, corners_m=frozen(corners), sigma_m=0.005)
    placement = register((replace(station, markers=tuple(markers)),), survey, RegisterOptions())
    assert placement.stations == ()
    (unsure,) = placement.rejections
    assert unsure.code is Reason.POSE_UNCERTAIN and unsure.values["sigma_m"] > unsure.values["limit_m"]  # type: ignore


def test_a_given_pose_counts_with_its_sigma_beside_the_markers_that_it_sees() -> None:
    station, survey = site(1)
    true = looking_north()
    for sigma_rad, sigma_m, moves in ((1e-6, 1e-6, False), (0.003, 0.02, True)):
        off = true.copy()
        off[:3, 3] += sigma_m
        given = given_pose("A1", off, sigma_rad, sigma_m)
        (placed,) = register((station,), survey, RegisterOptions(), given={"A1": given}).stations
        step = np.linalg.norm(placed.pose.world_from_left[:3, 3] - off[:3, 3])
        assert (step > 0.1 * sigma_m) if moves else step < 1e-5


def test_a_given_pose_without_a_marker_in_view_is_taken_as_it_is() -> None:
    station, survey = site(1)
    given = given_pose("A1", looking_north(), 0.001, 0.01)
    placement = register((replace(station, markers=()),), survey, RegisterOptions(), given={"A1": given})
    assert placement.stations[0].pose is given
    assert placement.rejections == ()


def test_control_points_place_the_station_and_a_wrong_click_is_named() -> None:
    station, _ = site(1)
    pose = looking_north()
    local = np.array(
        [[-2, -1, 6], [2, -1.2, 5], [1.5, 1, 7], [-1.5, 1.1, 4], [0.2, -0.9, 8], [0.5, 0.6, 5], [-0.7, 0.1, 9.0]]
    )
    world = local @ pose[:3, :3].T + pose[:3, 3]
    pixels = project_both(camera(), pose, world)[0][:, :2]
    pixels[4] += [25.0, 0.0]
    points = [
        ControlPoint(name=f"P{i}", world_m=w, left_px=p) for i, (w, p) in enumerate(zip(world, pixels, strict=True))
    ]
    placement = register((station,), (), RegisterOptions(), control_points={"A1": points})
    assert placement.stations[0].pose.method == "control_points"
    assert [words_of(r).what for r in placement.rejections] == ["station A1, control point P4"]


def test_control_points_of_which_fewer_than_half_agree_place_no_station() -> None:
    """Of 96 points with y counted from below 12 agreed by chance: five elements were judged from a wrong place."""
    station, _ = site(1)
    pose, rng = looking_north(), np.random.default_rng(2)
    local = rng.uniform([-2.0, -1.2, 4.0], [2.0, 1.2, 9.0], (16, 3))
    world = local @ pose[:3, :3].T + pose[:3, 3]
    pixels = project_both(camera(), pose, world)[0][:, :2]
    pixels[6:] += rng.uniform(40.0, 90.0, (10, 2))
    points = [
        ControlPoint(name=f"P{i}", world_m=w, left_px=p) for i, (w, p) in enumerate(zip(world, pixels, strict=True))
    ]
    pose_found, (refused,) = pose_from_control_points(station, points, RegisterOptions())
    assert pose_found is None and refused.code is Reason.CONTROL_POINTS_DISAGREE
    assert refused.values == {"agree": 6, "found": 16, "needed": 9}


def test_points_that_opencv_gives_up_on_place_no_station(monkeypatch: pytest.MonkeyPatch) -> None:
    def gives_up(*_: object, **__: object) -> None:
        raise cv2.error("computeOmega")

    monkeypatch.setattr(cv2, "solvePnP", gives_up)
    station, _ = site(1)
    points = [
        ControlPoint(name=f"P{i}", world_m=np.array([i, i % 3, 5.0]), left_px=np.array([100.0 + 9 * i, 200.0]))
        for i in range(7)
    ]
    pose, (refused,) = pose_from_control_points(station, points, RegisterOptions())
    assert pose is None and refused.code is Reason.CONTROL_POINTS_DISAGREE


def test_no_set_of_markers_is_solved_twice_where_one_marker_contradicts(monkeypatch: pytest.MonkeyPatch) -> None:
    station, survey = site(6)
    survey[2] = replace(survey[2], corners_m=frozen(survey[2].corners_m + np.array([0.3, 0.0, 0.0])))
    solved: list[frozenset[str]] = []

    def counted(camera: RectifiedCamera, seen: Sequence[Sighted]) -> Solution | None:
        solved.append(frozenset(one.name for one in seen))
        return solve_pose(camera, seen)

    monkeypatch.setattr(agree, "solve_pose", counted)
    placement = register((station,), survey, RegisterOptions())
    assert 2 not in placement.stations[0].pose.markers_used
    assert len(solved) == len(set(solved)) > 5


def test_two_processes_place_stations_as_one_does_to_the_byte() -> None:
    first, survey = site(6)
    survey[2] = replace(survey[2], corners_m=frozen(survey[2].corners_m + np.array([0.3, 0.0, 0.0])))
    stations = [replace(first, station=name, markers=first.markers[n:]) for n, name in enumerate("ABC")]
    shares = [AmongProcesses(workers=workers, least_items=0) for workers in (1, 2)]
    alone, shared = (register(stations, survey, RegisterOptions(), share=share) for share in shares)
    kept = [one.measurement for one in shared.stations]
    assert kept == [one.measurement for one in alone.stations] == stations[: len(kept)] != []
    poses = [[plain_digest(one.pose, StationPose) for one in found.stations] for found in (alone, shared)]
    assert poses[0] == poses[1]
    assert alone.rejections == shared.rejections != ()


def test_where_nobody_surveyed_a_marker_that_is_the_reason_and_not_their_number() -> None:
    placement = register((site(2)[0],), (), RegisterOptions())
    (few,) = (one for one in placement.rejections if one.code is Reason.MARKERS_TOO_FEW)
    told = str(words_of(few))
    assert placement.stations == () and "no marker is surveyed" in told and "near" in told and "limit" not in told
