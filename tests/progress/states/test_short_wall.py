"""A wall that is shorter than its design: what its photos show of its end is not taken for its sides."""

from __future__ import annotations

import pytest

from asbuilt_bim.geometry import polygon
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.surface import SurfaceState
from tests.match.small_site import box, element, looking, measured, model, placement, station

LONG_M, BUILT_M = 3.6, 3.0
DESIGN = model([element("W", "wall", box(0, 0, 0, LONG_M, 0.25, 2.8))])
BUILT = box(0, 0, 0, BUILT_M, 0.25, 2.8)
AROUND = [box(-30, -30, -0.3, 60, 90, 0.3), box(-30, 12, 0, 60, 0.5, 12)]
ASLANT = looking([9.0, -2.0, 1.5], [2.5, 0.0, 1.4])  # it sees the end, and the front at a grazing angle


def front_with_end(high_m: float | None) -> SurfaceState:
    """Return the front's state where the wall's real end was measured down from its head to that height, or not."""
    end = element("R", "wall", BUILT).faces[1].frame
    seen = [] if high_m is None else [measured("A1/1", ASLANT, end, polygon.box(0.0, high_m, 0.25, 2.8))]
    matched = match_faces(placement(station("A1", ASLANT, [BUILT, *AROUND], seen)), DESIGN, MatchOptions())
    assert len(matched.unmatched) == len(seen)  # it fits no design face: that end is elsewhere
    return classify_surface(matched, DESIGN, EMPTY_HISTORY, ProgressOptions())[0]


def past_end_m2(front: SurfaceState, low_m: float = 0.0, high_m: float = 2.8) -> float:
    past_m = BUILT_M + 1.5 * ProgressOptions().spacing_m  # a sample beside what stands goes with its neighbours
    return polygon.area(polygon.intersection(front.built_uv_m, polygon.box(past_m, low_m, LONG_M, high_m)))


def test_no_side_is_built_past_an_end_that_was_measured_within_the_design() -> None:
    assert past_end_m2(front_with_end(None)) > 0.1  # looked at aslant, the end lies within what concrete may stand off
    front = front_with_end(0.0)
    assert past_end_m2(front) < 0.05
    assert front.built_area_m2 == pytest.approx(BUILT_M * 2.8, rel=0.05)  # what stands is built all the same


def test_an_end_says_nothing_of_heights_where_it_was_not_measured() -> None:
    front, bare = front_with_end(1.4), front_with_end(None)
    assert past_end_m2(front, 1.6) < 0.05 < past_end_m2(bare, 1.6)
    assert past_end_m2(front, 0.0, 1.0) == pytest.approx(past_end_m2(bare, 0.0, 1.0), rel=0.1)
