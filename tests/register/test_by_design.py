"""Stations placed by the design alone: right where it is told apart, refused where it isn't."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.register.by_design.place import pose_by_design
from asbuilt_bim.register.options import RegisterOptions
from benchmarks.register.design_seen import column as box_column
from benchmarks.register.design_seen import design_of, measured, wall
from tests.register.designed_scene import TRUE, hall, rough

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


def grid(bay_m: float) -> list[object]:
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
    half = [wall((-6.0, 6.0), (6.0, 6.0)), wall((6.0, 6.0), (6.0, -6.0)), box_column((3.0, 4.0), 0.5)]
    other = [wall((6.0, -6.0), (-6.0, -6.0)), wall((-6.0, -6.0), (-6.0, 6.0)), box_column((-3.0, -4.0), 0.5)]
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
