"""Where lengths are doubtful, bounds hold what may lie elsewhere for it, now and at later visits; states may stay."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from functools import partial

import numpy as np
import pytest

from asbuilt_bim.geometry import polygon
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport
from asbuilt_bim.progress.states.borders import well_inside, wherever_it_lies
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.surface import unseen
from asbuilt_bim.register.pose import PlacedStation, SurveyedMarker
from asbuilt_bim.register.scale import ScaleDoubt, scale_doubt
from tests.match.small_site import FAR, box, placement
from tests.progress.test_surface import BACKDROP, DAY, DESIGN, WALL, only, see

HEIGHT_M, ELSEWHERE_M = 2.8, 0.12
LATER = date(2026, 3, 16)
DOUBT = ScaleDoubt(share=0.015, places_m=np.array([[1.5, 8.0, 1.4]]) + FAR)  # 12 to 13 cm at the wall


def judged(
    *stations: PlacedStation, doubt: ScaleDoubt | None, history: VisitHistory = EMPTY_HISTORY, day: date = DAY
) -> ProgressReport:
    matched = match_faces(placement(*stations), DESIGN, MatchOptions())
    surfaces = classify_surface(matched, DESIGN, history, ProgressOptions(), doubt=doubt)
    return summarise(surfaces, matched, DESIGN, history, day)


def built_to(height_m: float, doubt: ScaleDoubt | None) -> ElementProgress:
    return only(judged(see([box(0, 0, 0, 3.0, 0.25, height_m), BACKDROP], height_m), doubt=doubt))


def holds(bounds: Completion, height_m: float) -> bool:
    return bounds.lower <= height_m / HEIGHT_M <= bounds.upper


@pytest.mark.parametrize("seen_m", [1.24, 1.4, 1.56])
def test_a_pour_line_may_lie_higher_and_lower_by_what_lengths_are_doubtful_by(seen_m: float) -> None:
    plain, doubtful = (built_to(seen_m, doubt).completion for doubt in (None, DOUBT))
    assert not (holds(plain, seen_m - ELSEWHERE_M) and holds(plain, seen_m + ELSEWHERE_M))
    assert holds(doubtful, seen_m - ELSEWHERE_M) and holds(doubtful, seen_m + ELSEWHERE_M)
    assert doubtful.upper - doubtful.lower < 0.4 and doubtful.best == pytest.approx(plain.best, abs=0.05)


def test_a_whole_wall_stays_complete_and_an_empty_place_not_started_each_with_wider_bounds() -> None:
    whole = built_to(HEIGHT_M, DOUBT)
    assert whole.state == "complete" and 0.8 < whole.completion.lower < 1.0 - ELSEWHERE_M / HEIGHT_M
    empty = only(judged(see([BACKDROP]), doubt=DOUBT))
    assert empty.state == "not started" and ELSEWHERE_M / HEIGHT_M < empty.completion.upper < 0.2


def test_what_is_thinner_than_the_doubt_is_unknown() -> None:
    far = ScaleDoubt(share=0.2, places_m=DOUBT.places_m)
    one = built_to(HEIGHT_M, far)
    assert one.state == "unknown" and (one.completion.lower, one.completion.upper) == (0.0, 1.0)


def test_of_what_stays_built_wherever_its_borders_lie_nobody_knows_how_clear_its_rows_are() -> None:
    built = replace(unseen(DESIGN.elements[0].faces[0]), built_uv_m=polygon.box(0.0, 0.0, 3.0, 1.4), border_m=0.2)
    for one in (well_inside, partial(wherever_it_lies, along=True)):
        left = one(replace(built, row_log_odds=np.full((12, 55), 8.0)))
        assert left.row_log_odds is None and 0.0 < polygon.area(left.built_uv_m) < 4.2


def test_a_later_visit_that_sees_nothing_keeps_the_doubt_and_one_that_sees_it_again_lifts_it() -> None:
    wall = see([WALL, BACKDROP], HEIGHT_M)
    history = remember(EMPTY_HISTORY, judged(wall, doubt=DOUBT))
    hidden = only(judged(doubt=None, history=history, day=LATER))
    assert 0.8 < hidden.completion.lower < 1.0 - ELSEWHERE_M / HEIGHT_M
    again = only(judged(see([WALL, BACKDROP], HEIGHT_M, name="B1"), doubt=None, history=history, day=LATER))
    assert again.completion.lower == 1.0


def test_the_scale_may_be_right_at_any_marker_that_was_seen_and_at_any_station_where_none_was() -> None:
    wall, points = see([WALL], HEIGHT_M), np.array([[1.5, 0.0, 1.4]]) + FAR
    near, far, other = (
        SurveyedMarker(marker_id=number, corners_m=np.full((4, 3), [1.5, away, 1.4]) + FAR, sigma_m=0.002)
        for number, away in ((1, 3.0), (2, 10.0), (7, 90.0))
    )
    by_markers = scale_doubt(placement(wall), (near, far, other), 0.01)
    assert by_markers is not None and by_markers.reach_m(points) == pytest.approx([0.1])
    by_station = scale_doubt(placement(wall), (other,), 0.01)
    assert by_station is not None and by_station.reach_m(points) == pytest.approx([0.05], abs=0.001)
    assert scale_doubt(placement(wall), (near,), 0.0) is None and scale_doubt(placement(), (near,), 0.01) is None
