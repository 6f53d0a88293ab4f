"""Stations placed by the design alone: right where it is told apart, refused where it isn't."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.fitting import BUILT_M
from asbuilt_bim.register.by_design.notes import design_notes
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import register
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.solve import project_both
from asbuilt_bim.vision.markers.find import MarkerSighting
from benchmarks.register.design_seen import Box, design_of, measured, standing, wall
from benchmarks.register.design_seen import column as box_column
from tests.register.designed_scene import TRUE, hall, pose_by_design, rough

OPTIONS = RegisterOptions()


def test_a_station_at_a_corner_of_walls_and_columns_is_placed_to_millimetres() -> None:
    design = design_of(hall())
    pose, reasons = pose_by_design(measured(design, TRUE), rough(off_m=(0.9, -0.8), off_deg=15.0), design, OPTIONS)
    assert pose is not None, reasons
    assert pose.method == "design"
    assert pose.by_design is not None
    assert np.abs(pose.world_from_left - TRUE).max() < 0.01
    assert np.all(np.sqrt(np.diag(pose.covariance)[3:]) < 0.02)


def test_what_stands_beside_its_design_does_not_pull() -> None:
    built = [*hall(), box_column((1.2, 5.6), 0.3)]
    design = design_of([*hall(), box_column((1.2, 5.3), 0.3)])
    pose, _ = pose_by_design(measured(design_of(built), TRUE), rough(), design, OPTIONS)
    assert pose is not None
    assert np.abs(pose.world_from_left[:3, 3] - TRUE[:3, 3]).max() < 0.01


def test_what_is_not_built_yet_costs_nothing() -> None:
    more = [box_column((x, 9.0), 0.4) for x in (-4.0, -2.0, 0.0, 2.0)]
    design = design_of([*hall(), *more])
    pose, _ = pose_by_design(measured(design_of(hall()), TRUE), rough(), design, OPTIONS)
    assert pose is not None
    assert np.abs(pose.world_from_left - TRUE).max() < 0.01


def test_a_bare_wall_places_nothing_since_it_slides_along_it() -> None:
    design = design_of([wall((-30.0, 6.0), (30.0, 6.0))])
    pose, reasons = pose_by_design(measured(design, TRUE), rough(), design, OPTIONS)
    assert pose is None
    assert {one.code for one in reasons} <= {Reason.DESIGN_NOT_FOUND, Reason.DESIGN_TOO_LITTLE_SEEN}


def grid(bay_m: float) -> list[Box]:
    return [box_column((x * bay_m, y * bay_m + 4.0), 0.4) for x in range(-4, 5) for y in range(3)]


def test_a_grid_of_equal_columns_is_refused_where_only_the_storey_is_known() -> None:
    design = design_of(grid(5.0))
    pose, reasons = pose_by_design(measured(design, TRUE), rough(anywhere=True), design, OPTIONS)
    assert pose is None
    assert [one.code for one in reasons] == [Reason.DESIGN_AMBIGUOUS]


def test_a_grid_of_equal_columns_is_told_apart_by_a_rough_place() -> None:
    design = design_of(grid(5.0))
    pose, reasons = pose_by_design(measured(design, TRUE), rough(), design, OPTIONS)
    assert pose is not None, reasons
    assert np.abs(pose.world_from_left[:3, 3] - TRUE[:3, 3]).max() < 0.01


def test_bays_closer_than_the_rough_place_are_refused() -> None:
    design = design_of(grid(1.2))
    pose, reasons = pose_by_design(measured(design, TRUE), rough(off_m=(0.5, 0.0)), design, OPTIONS)
    assert pose is None
    assert [one.code for one in reasons] == [Reason.DESIGN_AMBIGUOUS]


def test_a_hall_symmetric_about_its_middle_is_refused_without_a_bearing() -> None:
    half = [wall((-6.0, 6.0), (6.0, 6.0)), wall((6.0, 6.0), (6.0, -6.0))]
    other = [wall((6.0, -6.0), (-6.0, -6.0)), wall((-6.0, -6.0), (-6.0, 6.0))]
    for x, y in ((3.0, 4.0), (-2.0, 3.0), (4.5, 1.0), (0.5, 4.5)):
        half.append(box_column((x, y), 0.5))
        other.append(box_column((-x, -y), 0.5))
    design = design_of([*half, *other])
    pose, reasons = pose_by_design(measured(design, TRUE), rough(bearing=False), design, OPTIONS)
    assert pose is None
    assert [one.code for one in reasons] == [Reason.DESIGN_AMBIGUOUS]
    sure, _ = pose_by_design(measured(design, TRUE), rough(), design, OPTIONS)
    assert sure is not None


def test_two_storeys_alike_are_refused_where_none_is_named() -> None:
    design = design_of([*hall(), *hall(3.0)], storeys=(0.0, 3.0))
    pose, reasons = pose_by_design(measured(design_of(hall()), TRUE), rough(storeys=()), design, OPTIONS)
    assert pose is None
    assert [one.code for one in reasons] == [Reason.DESIGN_AMBIGUOUS]


def test_a_mirrored_site_is_never_taken_for_the_design() -> None:
    mirrored = design_of([part.mirrored() for part in hall()])
    pose, reasons = pose_by_design(measured(mirrored, TRUE), rough(), design_of(hall()), OPTIONS)
    assert pose is None
    assert [one.code for one in reasons] == [Reason.DESIGN_NOT_FOUND]


@pytest.mark.parametrize("seed", range(8))
def test_errors_are_within_their_sigmas(seed: int) -> None:
    design = design_of(hall())
    pose, reasons = pose_by_design(measured(design, TRUE, seed=seed), rough(), design, OPTIONS)
    assert pose is not None, reasons
    pull = (pose.world_from_left[:3, 3] - TRUE[:3, 3]) / np.sqrt(np.diag(pose.covariance)[3:])
    assert np.abs(pull).max() < 4.0


def test_coordinates_far_from_the_origin_change_nothing() -> None:
    shift = np.array([4.0e5, 5.6e6, 300.0])
    far = TRUE.copy()
    far[:3, 3] += shift
    design = design_of(hall(), shift=shift)
    pose, reasons = pose_by_design(measured(design, far), rough(shift=shift), design, OPTIONS)
    assert pose is not None, reasons
    assert np.abs(pose.world_from_left - far).max() < 0.01


def sees(station: StationMeasurement, pose: np.ndarray, marks: dict[int, np.ndarray]) -> StationMeasurement:
    """Return a station that sees prints, too, by their corners (4, 3) in the world."""
    seen = []
    for tag, corners in marks.items():
        pixels, _ = project_both(station.camera, pose, corners)
        seen.append(
            MarkerSighting(marker_id=tag, left_px=frozen(pixels[:, :2]), right_px=frozen(pixels[:, 2:]), sigma_px=0.1)
        )
    return replace(station, markers=tuple(seen))


def prints() -> dict[int, np.ndarray]:
    """Return prints nobody surveyed, on the hall's wall."""
    square = 0.1 * np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]])
    return {
        k: square + np.array([x, 6.9, z]) for k, (x, z) in enumerate([(-1.8, 1.2), (0.9, 2.2), (1.4, 0.9), (-0.6, 1.9)])
    }


def two_stations() -> tuple[dict[str, np.ndarray], list[StationMeasurement]]:
    other = standing(1.1, 1.0, 0.0)
    design = design_of(hall())
    first = sees(measured(design, TRUE, name="A1"), TRUE, prints())
    second = sees(replace(measured(design, other, name="A2"), faces=()), other, prints())
    return {"A1": TRUE, "A2": other}, [first, second]


def test_one_station_that_the_design_places_places_the_others_by_markers_nobody_surveyed() -> None:
    true, stations = two_stations()
    places = RoughPlaces(places={"A1": rough()}, design=design_of(hall()))
    placement = register(stations, (), OPTIONS, rough=places)
    found = {one.pose.station: one.pose for one in placement.stations}
    assert {name: pose.method for name, pose in found.items()} == {"A1": "design", "A2": "linked"}
    for name, pose in found.items():
        assert np.abs(pose.world_from_left[:3, 3] - true[name][:3, 3]).max() < 0.02
    assert not placement.rejections
    assert placement.tags.keys() == prints().keys()
    assert [note.code for note in design_notes(placement.stations)] == [Reason.PLACED_BY_DESIGN]


def test_a_station_without_a_rough_place_is_never_placed_by_the_design() -> None:
    _, stations = two_stations()
    placement = register(stations, (), OPTIONS, rough=RoughPlaces(places={}, design=design_of(hall())))
    assert not placement.stations


def test_a_surveyed_station_stays_where_its_markers_put_it_whatever_the_rough_place_says() -> None:
    _, stations = two_stations()
    survey = [
        SurveyedMarker(marker_id=tag, corners_m=frozen(corners), sigma_m=0.002) for tag, corners in prints().items()
    ]
    places = RoughPlaces(places={"A1": rough(off_m=(9.0, 9.0))}, design=design_of(hall()))
    alone = {one.pose.station: one.pose for one in register(stations, survey, OPTIONS).stations}
    placed = {one.pose.station: one.pose for one in register(stations, survey, OPTIONS, rough=places).stations}
    assert placed.keys() == alone.keys() == {"A1", "A2"}
    for name, pose in placed.items():
        assert pose.method == alone[name].method == "markers"
        assert np.array_equal(pose.world_from_left, alone[name].world_from_left)


def test_a_place_in_the_design_that_markers_contradict_is_left_out_and_named() -> None:
    _, stations = two_stations()
    step = np.array([3.0, 0.0, 0.0])
    survey = [SurveyedMarker(marker_id=tag, corners_m=frozen(prints()[tag] + step), sigma_m=0.002) for tag in (1, 2, 3)]
    other = replace(stations[0], markers=tuple(mark for mark in stations[0].markers if mark.marker_id in (0, 3)))
    places = RoughPlaces(places={"A1": rough()}, design=design_of(hall()))
    placement = register([other, stations[1]], survey, OPTIONS, rough=places)
    assert Reason.DESIGN_POSE_CONTRADICTS in {one.code for one in placement.rejections}
    assert "design" not in {one.pose.method for one in placement.stations}


def test_the_sigma_of_a_pose_by_the_design_is_never_under_what_is_built_off_it() -> None:
    design = design_of(hall())
    pose, _ = pose_by_design(measured(design, TRUE), rough(), design, OPTIONS)
    assert pose is not None
    assert np.sqrt(pose.covariance[5, 5]) >= BUILT_M
    along_and_across = np.linalg.eigvalsh(pose.covariance[3:5, 3:5])
    assert np.sqrt(along_and_across[0]) > 0.4 * BUILT_M
