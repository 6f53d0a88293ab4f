from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import (
    box,
    element,
    looking,
    measured,
    model,
    placement,
    round_column,
    shifted,
    station,
    turned,
)

POSE = looking([2.0, -6.0, 1.6], [2.0, 0.0, 1.4])
LEFT, RIGHT = box(0, 0, 0, 2, 0.25, 3), box(2, 0, 0, 2.5, 0.25, 3)
WALLS = [element("L", "wall", LEFT), element("R", "wall", RIGHT)]


def front(index: int = 0) -> PlaneFrame:
    frame = WALLS[index].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    return frame


def matched(*faces: MeasuredFace, elements: object = None) -> MatchResult:
    design = model(elements if elements is not None else WALLS)  # type: ignore[arg-type]
    return match_faces(placement(station("A1", POSE, [LEFT, RIGHT], faces)), design, MatchOptions())


def test_a_face_on_its_design_face_keeps_its_whole_area() -> None:
    face = measured("A1/1", POSE, front(), polygon.box(0.0, 0.0, 2.0, 3.0))
    result = matched(face)
    (match,) = result.matches
    assert match.design_face == "L-0"
    assert match.whole and match.area_m2 == pytest.approx(6.0)
    assert abs(match.offset_m) < 1e-6
    assert polygon.area(match.outline_uv_m) == pytest.approx(6.0)


def test_one_outline_over_two_collinear_walls_is_divided_at_their_border() -> None:
    face = measured("A1/1", POSE, front(), polygon.box(0.5, 0.0, 3.5, 3.0))
    result = matched(face)
    areas = {match.design_face: match.area_m2 for match in result.matches}
    assert areas == {"L-0": pytest.approx(4.5), "R-0": pytest.approx(4.5)}
    assert not any(match.whole for match in result.matches)
    assert sum(match.overlap for match in result.matches) == pytest.approx(1.0)


def test_what_passes_the_border_within_the_tolerance_counts_and_what_passes_further_does_not() -> None:
    within = matched(measured("A1/1", POSE, front(), polygon.box(-0.05, 0.0, 1.0, 3.0))).matches[0]
    assert within.area_m2 == pytest.approx(3.15)
    beyond = matched(measured("A1/1", POSE, front(), polygon.box(-1.0, 0.0, 1.0, 3.0)))
    assert beyond.matches[0].area_m2 == pytest.approx(3.3)
    assert beyond.unmatched[0].code is Reason.FACE_PAST_DESIGN


@pytest.mark.parametrize(("offset", "code"), [(0.4, Reason.FACE_BEFORE), (-0.4, Reason.FACE_BEHIND)])
def test_a_parallel_surface_too_far_off_is_unmatched_and_says_by_how_much(offset: float, code: Reason) -> None:
    result = matched(measured("A1/1", POSE, shifted(front(), offset), polygon.box(0.2, 0.2, 1.8, 2.8)))
    assert result.matches == ()
    (left_out,) = result.unmatched
    assert (left_out.code, left_out.subject.name, left_out.subject.station) == (code, "A1/1", "A1")
    assert left_out.values["offset_m"] == pytest.approx(0.4) and "0.40 m" in words_of(left_out).value


def test_a_surface_turned_too_far_is_unmatched() -> None:
    result = matched(measured("A1/1", POSE, turned(front(), np.radians(25)), polygon.box(0.2, 0.2, 1.0, 2.8)))
    assert result.matches == ()
    assert result.unmatched[0].code is Reason.FACE_TURNED


def test_front_and_back_of_a_thin_wall_are_told_apart() -> None:
    thin = [element("T", "wall", box(0, 0, 0, 3, 0.08, 3))]
    back = thin[0].faces[2].frame
    assert isinstance(back, PlaneFrame)
    behind = looking([1.5, 6.0, 1.6], [1.5, 0.0, 1.4])
    face = measured("A1/1", behind, back, polygon.box(0.2, 0.0, 2.8, 3.0))
    result = match_faces(placement(station("A1", behind, [LEFT], [face])), model(thin), MatchOptions())
    assert [match.design_face for match in result.matches] == ["T-2"]


def test_the_nearer_of_two_parallel_design_faces_has_the_outline_and_nothing_counts_twice() -> None:
    doubled = [element("A", "wall", box(0, 0, 0, 3, 0.25, 3)), element("B", "wall", box(0, -0.07, 0, 3, 0.25, 3))]
    frame = doubled[0].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    result = matched(measured("A1/1", POSE, frame, polygon.box(0.0, 0.0, 3.0, 3.0)), elements=doubled)
    assert [match.element for match in result.matches] == ["A"]
    assert sum(match.area_m2 for match in result.matches) == pytest.approx(9.0)


def test_a_wall_end_called_a_column_still_matches() -> None:
    end_pose = looking([8.0, -2.0, 1.6], [4.5, 0.1, 1.4])
    end = WALLS[1].faces[1].frame
    assert isinstance(end, PlaneFrame)
    face = measured("A1/1", end_pose, end, polygon.box(0.0, 0.0, 0.25, 3.0), label="column")
    result = match_faces(placement(station("A1", end_pose, [RIGHT], [face])), model(WALLS), MatchOptions())
    assert [match.design_face for match in result.matches] == ["R-1"]


def test_a_lateral_surface_is_matched_across_its_seam_and_told_by_its_axis() -> None:
    columns = [round_column("C1", 1.0, 0.0, 0.25, 3.0), round_column("C2", 3.0, 0.0, 0.25, 3.0)]
    frame = columns[0].faces[0].frame
    assert isinstance(frame, CylinderFrame)
    # Seen from -y: the visible arc is about the angle -pi/2; zero turned so that the seam lies within it.
    seam = CylinderFrame(
        origin_m=frame.origin_m, axis=frame.axis, zero=np.array([0.0, 1.0, 0.0]), radius_m=frame.radius_m
    )
    arc = polygon.box(np.pi * 0.25 - 0.3, 0.0, np.pi * 0.25 + 0.3, 3.0)
    face = measured("A1/1", POSE, seam, arc, label="column")
    (match,) = matched(face, elements=columns).matches
    assert match.element == "C1"
    assert polygon.area(match.outline_uv_m) == pytest.approx(1.8, rel=1e-3)
    assert match.area_m2 == pytest.approx(1.8)


def test_every_measured_face_is_matched_or_unmatched_and_unseen_faces_are_unobserved() -> None:
    far = measured("A1/2", POSE, shifted(front(), 1.5), polygon.box(0.2, 0.2, 1.0, 1.0))
    near = measured("A1/1", POSE, front(), polygon.box(0.2, 0.2, 1.0, 1.0))
    result = matched(near, far)
    assert {m.face_id for m in result.matches} | {r.subject.name for r in result.unmatched} == {
        "A1/1",
        "A1/2",
    }
    assert "L-2" in result.unobserved and "L-0" not in result.unobserved


@settings(max_examples=25, deadline=None)
@given(
    u0=st.floats(-0.5, 3.0), width=st.floats(0.2, 3.0), v0=st.floats(-0.5, 2.0), height=st.floats(0.2, 2.0),
    offset=st.floats(-0.2, 0.2),
)  # fmt: skip
@example(u0=1.768774824551338, width=1.0, v0=2.225073858507e-311, height=1.0, offset=0.0)  # below the least float
def test_parts_never_add_up_to_more_than_the_face(
    u0: float, width: float, v0: float, height: float, offset: float
) -> None:
    face = measured("A1/1", POSE, shifted(front(), offset), polygon.box(u0, v0, u0 + width, v0 + height))
    result = matched(face)
    assert sum(match.area_m2 for match in result.matches) <= face.area_m2 * (1 + 1e-6)
