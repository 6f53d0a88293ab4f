"""What to photograph next: the right side, from a place that the design leaves free, the most valuable first."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel, Task
from asbuilt_bim.geometry import polygon
from asbuilt_bim.progress.completion.element import progress_of
from asbuilt_bim.progress.completion.wanted_views import wanted_views
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import StationRecord, WantedView
from asbuilt_bim.progress.surface import SurfaceState, unseen
from asbuilt_bim.report.page.rows import next_rows
from asbuilt_bim.report.page.write import page_html
from tests.match.small_site import FAR, box, element, model, round_column
from tests.report.sample_report import sample_report

DAY = date(2026, 3, 16)
LONG = element("long", "wall", box(0.0, 0.0, 0.0, 8.0, 0.2, 3.0))
SHORT = element("short", "wall", box(0.0, 2.2, 0.0, 4.0, 0.2, 3.0))


def wanted(design: BimModel, seen: dict[str, SurfaceState] | None = None) -> tuple[WantedView, ...]:
    surfaces = {f.face_id: unseen(f) for e in design.elements for f in e.faces} | (seen or {})
    elements = {
        e.global_id: progress_of(e, [surfaces[f.face_id] for f in e.faces], DAY, EMPTY_HISTORY, ProgressOptions())
        for e in design.elements
    }
    return wanted_views(design, elements, surfaces, sample_report().stations, DAY)


def built(whole: BimElement) -> dict[str, SurfaceState]:
    return {
        face.face_id: replace(
            unseen(face), built_uv_m=face.exposed_uv_m, unknown_uv_m=(), unknown_area_m2=0.0,
            built_area_m2=face.exposed_area_m2, stations={"A1": 1.0},
        )
        for face in whole.faces
    }  # fmt: skip


def test_the_side_with_room_before_it_is_named_the_larger_wall_first() -> None:
    first, second = wanted(model([SHORT, LONG]))
    assert (first.element, second.element) == ("long", "short")
    assert first.face_id == "long-0" and second.face_id == "short-2"  # 2 m lie between the two
    assert first.stand_x_m == pytest.approx(FAR[0] + 4.0) and first.stand_y_m == pytest.approx(FAR[1] - 6.0)
    assert first.look_z_m == pytest.approx(FAR[2] + 1.5) and first.unseen_m2 == pytest.approx(24.0)
    assert first.nearest_station and first.nearest_m is not None


def test_of_two_sides_alike_it_is_the_one_before_which_a_person_stands_on_the_floor() -> None:
    posts = [element(name, "column", box(x, 8.0, 0.0, 0.2, 0.2, 3.0)) for name, x in (("a", 0.0), ("b", 7.8))]
    design = model([LONG, *posts])
    long = next(view for view in wanted(design) if view.element == "long")
    assert long.face_id == "long-2" and long.stand_y_m == pytest.approx(FAR[1] + 6.2)
    half = replace(unseen(LONG.faces[2]), unknown_uv_m=polygon.box(0.0, 0.0, 4.0, 3.0), unknown_area_m2=12.0)
    outside = next(view for view in wanted(design, {"long-2": half}) if view.element == "long")
    assert outside.face_id == "long-0"  # much more is unseen of it


def test_where_another_wall_stands_near_a_nearer_place_is_named() -> None:
    other = element("other", "wall", box(-1.0, -5.0, 0.0, 10.0, 0.2, 3.0))
    views = {view.element: view for view in wanted(model([LONG, SHORT, other]))}
    assert views["long"].stand_y_m == pytest.approx(FAR[1] - 4.5)
    boxed = [element(str(n), "wall", shape) for n, shape in enumerate([
        box(-2.0, 0.0, 0.0, 0.2, 2.0, 3.0), box(2.0, 0.0, 0.0, 0.2, 2.0, 3.0), box(-2.0, 2.0, 0.0, 4.2, 0.2, 3.0),
        box(-2.0, -0.2, 0.0, 4.2, 0.2, 3.0),
    ])]  # fmt: skip
    column = round_column("column", 0.1, 1.0, 0.3, 3.0)
    views = {view.element: view for view in wanted(model([*boxed, column]))}
    assert views["column"].stand_x_m is None and views["column"].nearest_m is None
    assert views["0"].stand_x_m is not None  # from outside


def test_what_is_known_is_not_asked_for_and_what_the_plan_has_not_begun_comes_last() -> None:
    later = Task(
        global_id="T", name="later", identification="", elements=("long",), schedule_start=datetime(2026, 4, 1),
        schedule_finish=None,
    )  # fmt: skip
    known = element("known", "wall", box(20.0, 0.0, 0.0, 8.0, 0.2, 3.0))
    views = wanted(model([LONG, SHORT, known], tasks=(later,)), built(known))
    assert [(view.element, view.begun) for view in views] == [("short", True), ("long", False)]


def test_what_should_stand_by_now_comes_before_what_is_larger_and_has_only_begun() -> None:
    def task(name: str, finish: datetime, *elements: str) -> Task:
        return Task(
            global_id=name, name=name, identification="", elements=elements, schedule_start=datetime(2026, 3, 1),
            schedule_finish=finish,
        )  # fmt: skip

    due = (task("due", datetime(2026, 3, 15, 17), "short"), task("under way", datetime(2026, 3, 29), "long"))
    assert [view.element for view in wanted(model([LONG, SHORT], tasks=due))] == ["short", "long"]
    today = (task("due", datetime(2026, 3, 16, 17), "short"), due[1])  # not late before tomorrow
    assert [view.element for view in wanted(model([LONG, SHORT], tasks=today))] == ["long", "short"]
    again = (*due, task("later", datetime(2026, 4, 2), "short"))  # a later task makes it, too
    assert [view.element for view in wanted(model([LONG, SHORT], tasks=again))] == ["long", "short"]


def test_a_wall_that_is_half_seen_is_asked_for_where_it_was_not_seen() -> None:
    half = polygon.box(0.0, 0.0, 4.0, 3.0)
    rest = polygon.box(4.0, 0.0, 8.0, 3.0)
    front = replace(unseen(LONG.faces[0]), built_uv_m=half, unknown_uv_m=rest, built_area_m2=12.0, unknown_area_m2=12.0)
    hidden = replace(unseen(LONG.faces[2]), unknown_uv_m=polygon.box(0.0, 0.0, 3.0, 3.0), unknown_area_m2=9.0)
    (view,) = wanted(model([LONG]), {"long-0": front, "long-2": hidden})
    assert view.look_x_m == pytest.approx(FAR[0] + 6.0)
    assert view.open_m2 == pytest.approx(0.5 * LONG.exposed_area_m2, rel=0.05)


def test_a_place_is_told_by_the_way_to_it_and_by_the_compass_where_north_is_known() -> None:
    report = sample_report()
    face = next(face for face in report.faces if face.kind == "plane")
    station = next(one for one in report.stations if one.world_from_left is not None)
    assert station.world_from_left is not None
    x, y = station.world_from_left[:2, 3].tolist()
    view = WantedView(
        element=face.element, face_id=face.face_id, begun=False, open_m2=3.25, unseen_m2=1.5, look_x_m=x + 9.0,
        look_y_m=y, look_z_m=1.0, stand_x_m=x + 3.0, stand_y_m=y, nearest_station=station.name, nearest_m=3.0,
    )  # fmt: skip

    def told(north: tuple[float, float] | None) -> str:
        (row,) = next_rows(replace(report, wanted_views=(view,), north=north))
        return row.words.replace("\N{NO-BREAK SPACE}", " ").split("From where ")[1]

    plain = told(None)
    assert plain.startswith(f"{station.name} stood it is 3 m towards the ") and plain.endswith(" of the plan.")
    assert told((0.0, 1.0)) == f"{plain[:-1]} (east)."
    assert told((1.0, 0.0)) == f"{plain[:-1]} (north)."
    assert told((1.0, 1.0)) == f"{plain[:-1]} (north-east)."
    assert told((-1.0, 0.0)) == f"{plain[:-1]} (south)."


def test_the_page_names_the_element_the_side_and_the_place() -> None:
    report = sample_report()
    face = next(face for face in report.faces if face.kind == "plane")
    view = WantedView(
        element=face.element, face_id=face.face_id, begun=False, open_m2=3.25, unseen_m2=1.5, look_x_m=10.0,
        look_y_m=20.0, look_z_m=1.0, stand_x_m=10.0, stand_y_m=14.0, nearest_station="A1", nearest_m=2.34,
    )  # fmt: skip
    report = replace(report, wanted_views=(view, replace(view, stand_x_m=None, stand_y_m=None), *[view] * 12))
    rows = next_rows(report)
    told = rows[0].words.replace("\N{NO-BREAK SPACE}", " ")
    assert told.startswith("Stand at 1 on the plan, outside the building, 6 m before the side towards ")
    assert "From where A1 stood it is 2 m towards the left of the plan." in told
    assert "no 3 m free" in rows[1].words and rows[1].words.startswith("The side towards ")
    page = page_html(report, {})
    assert "What to photograph next" in page and "2 more elements come up once these are photographed" in page
    assert "What to photograph next" not in page_html(replace(report, wanted_views=()), {})


def test_the_nearest_station_is_one_on_the_elements_own_floor() -> None:
    def station(name: str, x: float, z: float) -> StationRecord:
        place = np.eye(4)
        place[:3, 3] = FAR + np.array([x, -6.0, z])
        return replace(sample_report().stations[0], name=name, world_from_left=place)

    surfaces = {f.face_id: unseen(f) for f in LONG.faces}
    elements = {"long": progress_of(LONG, list(surfaces.values()), DAY, EMPTY_HISTORY, ProgressOptions())}
    stations = [station("above", 4.0, 4.7), station("here", 7.0, 1.6), station("below", 4.0, -1.5)]
    (view,) = wanted_views(model([LONG]), elements, surfaces, stations, DAY)
    assert view.nearest_station == "here"
    (lonely,) = wanted_views(model([LONG]), elements, surfaces, stations[:1], DAY)
    assert (lonely.nearest_station, lonely.nearest_m) == ("", None)
