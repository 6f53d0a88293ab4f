"""A survey in another origin lays everything beside the design the same way, and is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.survey_shift import survey_shift
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.register.pose import Placement
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import Box, box, element, looking, measured, model, placement, station

POSE = looking([2.0, -6.0, 1.6], [2.0, 0.0, 1.4])
SHAPES = [box(4 * n, 3 * (n % 2), 0, 2.5 - 2.2 * (n % 2), 0.3 + 2.2 * (n % 2), 3) for n in range(6)]
SITE = [element(f"E{n}", "wall", shape) for n, shape in enumerate(SHAPES)]


def told(
    move: Sequence[float],
    *,
    own: Sequence[Sequence[float]] = ((0, 0, 0),) * 6,
    cut_m: float = 0.0,
    faces: Sequence[int] = (0, 1),
    elements: Sequence[int] = range(6),
) -> tuple[Rejection, ...]:
    """Return what is said where every element is measured so far off: all by `move`, each by its `own`.

    Of each face `cut_m` are not poured yet; elements are measured on `faces`.
    """
    seen = []
    for number, one in ((number, SITE[number]) for number in elements):
        for index in faces:
            face = one.faces[index]
            assert isinstance(face.frame, PlaneFrame)
            frame = replace(face.frame, origin_m=frozen(face.frame.origin_m + np.add(move, own[number])))
            width = float(np.ptp(face.rings_uv_m[0][0][:, 0]))
            name = f"A1/{number}{index}"
            seen.append(measured(name, POSE, frame, polygon.box(0.0, 0.0, width, 3.0 - cut_m)))
    stand = [(low + off, high + off) for (low, high), off in zip(SHAPES, np.add(move, own), strict=True)]
    placed = placement(station("A1", POSE, stand, seen))
    return survey_shift(match_faces(placed, model(SITE), MatchOptions()), model(SITE))


@pytest.mark.parametrize(
    ("move", "says"),
    [
        ((0.05, 0.0, 0.0), "by +0.05 m in x;"),
        ((0.0, -0.30, 0.0), "by -0.30 m in y;"),
        ((0.10, 0.07, 0.20), "by +0.10 m in x, +0.07 m in y, +0.20 m in z;"),
        ((0.0, 0.0, -0.15), "by -0.15 m in z;"),
    ],
)
def test_a_survey_that_is_moved_is_named_with_its_move(move: tuple[float, float, float], says: str) -> None:
    (warning,) = told(move)
    assert words_of(warning).what == "survey" and says in words_of(warning).reason
    assert ("12 of 12 faces" if move[0] or move[1] else "24 more tops and bottoms of faces") in words_of(warning).reason


def test_a_site_that_stands_where_it_is_designed_is_never_named() -> None:
    assert told((0.0, 0.0, 0.0)) == ()
    assert told((0.015, -0.01, 0.01)) == ()


def test_elements_that_are_off_each_in_its_own_way_are_no_moved_survey() -> None:
    own = [(0.06, 0.0, 0.0), (-0.05, 0.05, 0.0), (0.0, -0.06, 0.0), (0.0, 0.0, 0.0), (0.05, 0.05, 0.0), (0.0, 0.0, 0.0)]
    assert told((0.0, 0.0, 0.0), own=own) == ()


def test_two_elements_that_are_off_alike_are_no_moved_survey() -> None:
    assert told((0.0, 0.0, 0.0), own=[(0.08, 0.08, 0.0)] * 2 + [(0.0, 0.0, 0.0)] * 4) == ()
    assert told((0.08, 0.08, 0.0), elements=(0, 1)) == ()
    assert told((0.08, 0.08, 0.0), elements=(0, 1, 2)) != ()


def test_walls_poured_in_part_and_feet_that_are_hidden_are_no_survey_of_another_height() -> None:
    assert told((0.0, 0.0, 0.0), cut_m=0.4) == ()
    assert told((0.0, 0.0, 0.2), cut_m=0.2) == ()  # a kicker of 20 cm before each foot
    assert told((0.0, 0.0, 0.2), cut_m=0.6) == ()  # and 40 cm not poured yet


def test_along_walls_of_one_direction_no_move_is_made_up() -> None:
    assert told((0.30, 0.0, 0.0), faces=(0, 2)) == ()
    (warning,) = told((0.30, 0.10, 0.0), faces=(0, 2))
    assert warning.values["move_x_m"] == 0.0 and warning.values["move_y_m"] == pytest.approx(0.10, abs=0.005)


def test_photos_of_another_site_fit_nothing_and_are_named() -> None:
    own = [(0.3 * n, 2.0 - 0.7 * n, 0.0) for n in range(6)]
    (warning,) = told((0.0, 0.0, 0.0), own=own, faces=(0,))
    assert (warning.code, warning.values) == (Reason.DESIGN_UNLIKE, {"faces": 6})


def test_three_faces_that_fit_nothing_say_nothing_yet() -> None:
    own = [(0.3 * n, 2.0 - 0.7 * n, 0.0) for n in range(6)]
    assert told((0.0, 0.0, 0.0), own=own, faces=(0,), elements=(0, 1, 2)) == ()
    assert told((0.0, 0.0, 0.0), own=own, faces=(0,), elements=(0, 1, 2, 3, 4)) != ()


def test_photos_of_another_site_of_which_a_few_faces_fit_by_chance_are_named() -> None:
    own = [(0.0, 0.0, 0.0)] + [(0.2 * n, 2.0 - 0.7 * n, 0.0) for n in range(1, 6)]
    (warning,) = told((0.0, 0.0, 0.0), own=own)
    assert (warning.code, warning.values) == (Reason.DESIGN_HARDLY_ALIKE, {"fits": 2, "faces": 12})


def test_two_whole_walls_that_fit_among_forty_pieces_of_clutter_are_of_this_site() -> None:
    whole = []
    for index in (0, 2):
        face = SITE[0].faces[index]
        whole.append(measured(f"A1/0{index}", POSE, face.frame, polygon.box(0.0, 0.0, 2.5, 3.0)))
    frame = SITE[0].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    for number in range(38):
        off = np.array([0.05 * number, 0.4 + 0.05 * number, 0.2])
        clutter = replace(frame, origin_m=frozen(frame.origin_m + off))
        whole.append(measured(f"A1/9{number:02}", POSE, clutter, polygon.box(0.0, 0.0, 0.2, 0.3)))
    placed = placement(station("A1", POSE, SHAPES, whole))
    assert survey_shift(match_faces(placed, model(SITE), MatchOptions()), model(SITE)) == ()


def test_a_few_faces_that_fit_beside_formwork_are_of_this_site() -> None:
    own = [(0.0, 0.0, 0.0)] * 2 + [(0.2 * n, 2.0 - 0.7 * n, 0.0) for n in range(2, 6)]
    assert told((0.0, 0.0, 0.0), own=own) == ()
    assert told((0.0, 0.0, 0.0), own=own[1:] + own[:1], elements=(0, 1, 2, 3, 4)) == ()  # two of ten


def clutter(count: int) -> list[MeasuredFace]:
    """Return measured faces, each of which lies beside the design in its own way."""
    frame = SITE[0].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    offs = [np.array([0.05 * number, -0.4 - 0.05 * number, 0.2]) for number in range(count)]
    moved = [replace(frame, origin_m=frozen(frame.origin_m + off)) for off in offs]
    region = polygon.box(0.0, 0.0, 0.2, 0.3)
    return [measured(f"A1/9{number:02}", POSE, one, region) for number, one in enumerate(moved)]


def two_stations(stand: Sequence[Box], count: int) -> Placement:
    """Return a station that measured only clutter, and one beside it; what they both see is `stand`."""
    beside = looking([12.0, -6.0, 1.6], [12.0, 0.0, 1.4])
    return placement(station("A1", POSE, stand, clutter(count)), station("A2", beside, stand))


@pytest.mark.parametrize("count", [6, 46])
def test_where_depth_shows_three_elements_in_their_place_faces_of_other_things_are_no_other_site(count: int) -> None:
    placed = two_stations(SHAPES, count)
    assert survey_shift(match_faces(placed, model(SITE), MatchOptions()), model(SITE)) == ()


def test_where_depth_shows_no_three_elements_faces_of_other_things_are_of_another_site() -> None:
    for stand in (SHAPES[:2], [(low + 0.3, high + 0.3) for low, high in SHAPES], []):
        placed = two_stations(stand, 46)
        (warning,) = survey_shift(match_faces(placed, model(SITE), MatchOptions()), model(SITE))
        assert warning.code is Reason.DESIGN_UNLIKE
