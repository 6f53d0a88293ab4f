"""A survey that is turned, metres off or on another storey is named: its faces form the design's pattern elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.survey_shift import survey_shift
from asbuilt_bim.report.wording.of_design import LEAST_MOVE_M, LEAST_TURN_DEG
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import FAR, box, element, looking, measured, model, placement, station

POSE = looking([6.0, -8.0, 1.6], [6.0, 0.0, 1.4])
STOREY_M = 3.2
COLUMNS = [(0.0, 0.0, 0.4, 0.5), (4.4, 0.0, 0.5, 0.4), (9.1, 0.0, 0.4, 0.4), (0.0, 5.3, 0.3, 0.6), (9.1, 5.3, 0.5, 0.5)]
WALLS = [(1.0, 8.0, 3.2, 0.2), (5.6, 7.0, 0.25, 2.4), (10.0, 0.1, 3.5, 0.2)]
UPPER = [(2.0, 2.0, 0.2, 3.0), (4.0, 6.5, 2.2, 0.2), (7.5, 4.5, 0.24, 2.0)]


def storey(number: int, plan: Sequence[tuple[float, float, float, float]]) -> list[BimElement]:
    """Return boxes (x, y, length, width) that stand on a storey's floor."""
    shapes = [box(x, y, number * STOREY_M, dx, dy, 2.9) for x, y, dx, dy in plan]
    return [element(f"{number}E{n}", "wall", shape) for n, shape in enumerate(shapes)]


def design(*plans: Sequence[tuple[float, float, float, float]]) -> BimModel:
    """Return a design with a storey for each plan."""
    one = model([made for number, plan in enumerate(plans) for made in storey(number, plan)])
    ground = one.storeys[0]
    storeys = [
        replace(ground, global_id=f"S{n}", elevation_m=ground.elevation_m + n * STOREY_M) for n in range(len(plans))
    ]
    return replace(one, storeys=tuple(storeys))


def told(
    site: BimModel,
    *,
    turn_deg: float = 0.0,
    move: Sequence[float] = (0, 0, 0),
    own_m: float = 0.0,
    built: Sequence[BimElement] = (),
    seed: int = 5,
) -> tuple[Rejection, ...]:
    """Return what is said where all that is built (the lowest storey) is measured turned about its middle and moved.

    Each element is off by `own_m` (one sigma in x and y) besides.
    """
    rng = np.random.default_rng(seed)
    middle = FAR + np.array([6.0, 4.0, 0.0])
    turn = rigid(rotation_from_vector(np.array([0.0, 0.0, np.radians(turn_deg)])), np.zeros(3))
    carried = rigid(np.eye(3), middle + np.asarray(move, float)) @ turn @ rigid(np.eye(3), -middle)
    seen = []
    for one in built or [one for one in site.elements if one.global_id.startswith("0")]:
        own: FloatArray = rigid(np.eye(3), np.append(rng.normal(0.0, own_m, 2), 0.0)) if own_m else np.eye(4)
        for index in range(4):
            frame = one.faces[index].frame
            assert isinstance(frame, PlaneFrame)
            width = float(np.ptp(one.faces[index].rings_uv_m[0][0][:, 0]))
            region = polygon.box(0.0, 0.0, width, 2.9)
            seen.append(measured(f"A1/{one.global_id}{index}", POSE, frame.moved(carried @ own), region))
    return survey_shift(match_faces(placement(station("A1", POSE, [], seen)), site, MatchOptions()), site)


@pytest.mark.parametrize("turn_deg", [0.5, -1.0, 3.0, 90.0, -90.0, 179.0])
def test_a_survey_that_is_turned_is_named_with_its_turn(turn_deg: float) -> None:
    (warning,) = told(design(COLUMNS + WALLS), turn_deg=turn_deg)
    assert warning.code is Reason.SURVEY_SHIFTED and f"turned by {turn_deg:+.1f} deg" in words_of(warning).reason
    assert "32 of 32 faces fit when moved back" in words_of(warning).reason


def test_a_survey_that_is_metres_off_is_named_with_its_move() -> None:
    (warning,) = told(design(COLUMNS + WALLS), move=(4.5, -7.2, 0.0))
    assert (
        "the same move: by +4.50 m in x, -7.20 m in y; 32 of 32 faces fit when moved back, 0 as"
        in words_of(warning).reason
    )


def test_a_survey_that_is_turned_and_raised_is_named_with_both() -> None:
    (warning,) = told(design(COLUMNS + WALLS), turn_deg=90.0, move=(0.0, 0.0, 0.35))
    assert "turned by +90.0 deg" in words_of(warning).reason and "+0.35 m in z;" in words_of(warning).reason


def test_a_survey_that_is_a_storey_too_high_or_too_low_is_named() -> None:
    (warning,) = told(design(COLUMNS + WALLS, COLUMNS + UPPER), move=(0.0, 0.0, STOREY_M))
    assert (
        "the same move: by +3.20 m in z; 32 of 32 faces fit when moved back, 20 as they are" in words_of(warning).reason
    )
    (warning,) = told(design(COLUMNS + WALLS, COLUMNS + UPPER), move=(0.0, 0.0, -STOREY_M))
    assert "the same move: by -3.20 m in z; 32 of 32 faces" in words_of(warning).reason


@pytest.mark.parametrize("rise_m", [0.8, 1.2, -1.5, STOREY_M + 0.9])
def test_a_survey_of_any_other_height_is_named_with_it(rise_m: float) -> None:
    (warning,) = told(design(COLUMNS + WALLS, COLUMNS + UPPER), move=(0.0, 0.0, rise_m))
    assert f"{rise_m:+.2f} m in z;" in words_of(warning).reason


@pytest.mark.parametrize("own_m", [0.0, 0.01])
def test_a_site_in_its_place_is_never_said_to_be_elsewhere(own_m: float) -> None:
    assert told(design(COLUMNS + WALLS, COLUMNS + UPPER), own_m=own_m) == ()
    assert told(design(COLUMNS + WALLS, COLUMNS + WALLS), own_m=own_m) == ()


def test_storeys_of_one_plan_say_nothing_of_the_height() -> None:
    assert told(design(COLUMNS + WALLS, COLUMNS + WALLS), move=(0.0, 0.0, STOREY_M)) == ()


def test_elements_that_are_off_by_centimetres_each_its_own_way_are_not_said_to_be_turned() -> None:
    for seed in range(6):
        one = told(design(COLUMNS + WALLS, COLUMNS + UPPER), own_m=0.04, seed=seed)
        shifts = [warning.values for warning in one if warning.code is Reason.SURVEY_SHIFTED]
        told_moves = [(abs(float(str(one["turn_rad"]))), abs(float(str(one["move_z_m"])))) for one in shifts]
        assert not any(turn >= np.radians(LEAST_TURN_DEG) or rise >= LEAST_MOVE_M for turn, rise in told_moves)


def test_another_building_is_not_found_elsewhere_in_the_design() -> None:
    others = storey(0, [(y + 1.3, x - 0.7, 1.4 * dx, 0.7 * dy) for x, y, dx, dy in UPPER + COLUMNS])
    assert not any(one.code is Reason.SURVEY_SHIFTED for one in told(design(COLUMNS + WALLS), built=others))


def test_walls_of_one_direction_are_not_said_to_be_elsewhere_along_them() -> None:
    site = design([(0.0, 4.0 * n, 5.0 + n, 0.2) for n in range(4)])
    ends_away = [replace(one, faces=tuple(one.faces[index] for index in (0, 2, 0, 2))) for one in site.elements]
    assert told(site, move=(3.0, 0.0, 0.0), built=ends_away) == ()
