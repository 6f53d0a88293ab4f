"""Elements are judged each on its own: in how many processes changes not a byte of the report."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from typing import Any

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.states import votes
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.colour import Palette
from asbuilt_bim.progress.states.evidence import OpenView, StationView, open_view
from asbuilt_bim.progress.states.learn_colour import visit_colours
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.scale.codec import plain_digest
from asbuilt_bim.scale.share import AmongProcesses, Share, in_turn
from tests.match.small_site import box, element, looking, measured, model, placement, station

WALLS = [box(1.5 * number, 0.0, 0.0, 1.0, 0.25, 2.8) for number in range(5)]
DESIGN = model([element(f"W{number}", "wall", wall) for number, wall in enumerate(WALLS)])
AROUND = [box(-30, -30, -0.3, 60, 90, 0.3), box(-30, 12, 0, 60, 0.5, 12)]


@pytest.fixture(scope="module")
def matched() -> MatchResult:
    """Two stations before five walls: the first two stand, and of one of them an outline was measured."""
    poses = {"A1": looking([2.0, -5.0, 1.6], [2.0, 0.0, 1.5]), "A2": looking([4.5, -5.0, 1.6], [4.5, 0.0, 1.5])}
    front = DESIGN.elements[0].faces[0]
    faces = [measured("A1/1", poses["A1"], front.frame, front.exposed_uv_m)]
    stations = [
        station(name, pose, [*WALLS[:2], *AROUND], faces if name == "A1" else []) for name, pose in poses.items()
    ]
    return match_faces(placement(*stations), DESIGN, MatchOptions())


def _reports(matched: MatchResult, share: Share) -> list[ProgressReport]:
    history, reports = EMPTY_HISTORY, []
    for day in (date(2026, 3, 2), date(2026, 3, 16)):
        surfaces = classify_surface(matched, DESIGN, history, ProgressOptions(), share=share)
        reports.append(summarise(surfaces, matched, DESIGN, history, day))
        history = remember(history, reports[-1])
    return reports


def test_two_processes_judge_as_one_does_to_the_byte(matched: MatchResult) -> None:
    alone = _reports(matched, AmongProcesses(workers=1, least_items=0))
    shared = _reports(matched, AmongProcesses(workers=2, least_items=0))
    assert {one.state for one in alone[0].elements} >= {"complete", "not started"}
    assert [plain_digest(one, ProgressReport) for one in shared] == [plain_digest(one, ProgressReport) for one in alone]


def test_two_processes_look_at_pictures_as_one_does(matched: MatchResult) -> None:
    grey = np.full((240, 320, 3), 140.0)
    pictures = {"A1": grey + np.array([20.0, 0.0, -30.0]), "A2": grey}  # reddish, and without colour
    stations = tuple(
        replace(one, measurement=replace(one.measurement, thumbnail_jpeg=jpeg(pictures[one.pose.station])))
        for one in matched.stations
    )
    alone, shared = (
        visit_colours(
            replace(matched, stations=stations), ProgressOptions(), AmongProcesses(workers=workers, least_items=0)
        )
        for workers in (1, 2)
    )
    assert alone.keys() == shared.keys() == {"A1"}
    assert plain_digest(alone["A1"].palette, Palette) == plain_digest(shared["A1"].palette, Palette)
    assert alone["A1"].faces.keys() == shared["A1"].faces.keys() == {"A1/1"}
    np.testing.assert_array_equal(alone["A1"].faces["A1/1"], shared["A1"].faces["A1/1"])


def jpeg(picture: FloatArray) -> bytes:
    return bytes(cv2.imencode(".jpg", picture.astype(np.uint8))[1])


def test_two_processes_match_stations_as_one_does_to_the_byte(matched: MatchResult) -> None:
    stations = placement(*matched.stations)
    alone, shared = (
        match_faces(stations, DESIGN, MatchOptions(), AmongProcesses(workers=workers, least_items=0))
        for workers in (1, 2)
    )
    assert len(alone.matches) == 1
    for kind in ("matches", "unmatched", "unobserved"):
        one, other = getattr(alone, kind), getattr(shared, kind)
        assert [plain_digest(part, type(part)) for part in one] == [plain_digest(part, type(part)) for part in other]


def test_what_is_shared_is_asked_once_a_visit_and_stays_in_the_order_of_the_design(matched: MatchResult) -> None:
    asked: list[int] = []

    def counted(work: Any, items: Sequence[Any]) -> Sequence[Any]:
        asked.append(len(items))
        return in_turn(work, items)

    surfaces = classify_surface(matched, DESIGN, EMPTY_HISTORY, ProgressOptions(), ["W3"], counted)
    assert asked == [2, 4], "the stations' pictures, then the elements that don't stand beside their design"
    assert [one.face_id for one in surfaces] == [face.face_id for one in DESIGN.elements for face in one.faces]


def test_a_station_is_opened_only_where_it_faces_what_is_judged(
    matched: MatchResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []

    def counted(view: StationView) -> OpenView:
        opened.append(view.pose.station)
        return open_view(view)

    away = station("far", looking([2.0, -500.0, 1.6], [2.0, 0.0, 1.5]), AROUND)
    back = station("back", looking([2.0, -5.0, 1.6], [2.0, -9.0, 1.5]), AROUND)
    monkeypatch.setattr(votes, "open_view", counted)
    stations = placement(*matched.stations, away, back).stations
    with_others = replace(matched, stations=stations)
    surfaces = classify_surface(with_others, DESIGN, EMPTY_HISTORY, ProgressOptions())
    assert set(opened) == {"A1", "A2"}
    alone = classify_surface(matched, DESIGN, EMPTY_HISTORY, ProgressOptions())
    assert plain_digest(surfaces, tuple[SurfaceState, ...]) == plain_digest(alone, tuple[SurfaceState, ...])


def test_stations_wait_compressed_and_few_are_open_at_once(matched: MatchResult) -> None:
    first = matched.stations[0]
    many = [replace(first, pose=replace(first.pose, station=f"A1c{number}")) for number in range(40)]
    classify_surface(replace(matched, stations=(*matched.stations, *many)), DESIGN, EMPTY_HISTORY, ProgressOptions())
    assert open_view.cache_info().currsize <= 8
    view = StationView(placed=first)
    arrays = open_view(view)
    assert len(pickle.dumps(view)) < 0.1 * (arrays.disparity_px.nbytes + arrays.sigma_px.nbytes)
