"""The page of a plan: every station on the drawing and on the list, and names out of files as text."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.read.floors import read_floors
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.visits.expected import VisitPlan, expected_stations
from asbuilt_bim.progress.visits.plan_visit import plan_visit
from asbuilt_bim.progress.visits.tags import helpful_tags
from asbuilt_bim.project.options import Options
from asbuilt_bim.report.page.visit import MADE_BY, places_of, plan_page, plan_promise, walk_parts
from asbuilt_bim.report.wording.of_page.visit_words import (
    NOTHING_DUE,
    list_words,
    promise_words,
    still_words,
    tag_words,
)
from tests.ifc.models import ModelBuilder
from tests.progress.visits.test_plan_visit import stereo_rig
from tests.report.sample_report import sample_report

EVIL = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> VisitPlan:
    model = ModelBuilder(storeys=1)
    model.box("IfcWall", EVIL, (7.9, 0.0, 0.0), (0.2, 8.0, 3.0))
    model.box("IfcSlab", "Slab", (0.0, 0.0, -0.2), (16.0, 12.0, 0.2))
    path = model.write(tmp_path_factory.mktemp("ifc") / "hall.ifc")
    return planned(read_design(path), path)


def test_after_a_result_a_plan_says_why_its_list_is_not_the_reports(plan: VisitPlan) -> None:
    asked = replace(plan, known=replace(plan.known, stations=sample_report().stations))
    assert list_words(less_today=False) in walk_parts(asked).remarks
    assert list_words(less_today=False) not in walk_parts(plan).remarks
    today = replace(asked, visit=replace(asked.visit, asked_m2=asked.visit.asked_m2 + 5.0))
    assert list_words(less_today=True) in walk_parts(today).remarks


def planned(design: BimModel, path: object) -> VisitPlan:
    rig, day = stereo_rig(), date(2026, 3, 2)
    visit = plan_visit(design, read_floors([str(path)]), rig, {one.global_id for one in design.elements}, {})
    known = replace(monitor((), (), (), design, EMPTY_HISTORY, day, Options()), project_name=EVIL)
    return VisitPlan(
        day=day,
        known=known,
        visit=visit,
        stations=expected_stations(visit, rig, (), design.elements, 2048),
        tags=helpful_tags(visit, rig, (), 0.25, design.elements),
        due=design.elements,
        later=0,
        has_dates=False,
    )


def test_every_station_and_tag_has_its_place_on_the_drawing_and_its_row_on_the_list(plan: VisitPlan) -> None:
    parts = walk_parts(plan)
    assert plan.stations and len(parts.rows) == len(plan.stations)
    (drawing,) = parts.plans
    assert [view.number for view in drawing.views] == [row.number for row in parts.rows]
    assert [mark.name for mark in drawing.marks] == [name for name, _ in parts.tags] and parts.tags
    assert all("Stand " in row.place and "Look towards" in row.look and "±" in row.sigma for row in parts.rows)
    assert all("2 are needed" in row.tags and not row.enough for row in parts.rows)


def test_a_station_that_no_tags_would_place_promises_nothing(plan: VisitPlan) -> None:
    assert plan.unplaced == tuple(one.planned.number for one in plan.stations) and plan.placed_m2 == 0.0
    words = plan_promise(plan)
    assert words.startswith("No station") and "fewer than 2 surveyed tags" in words
    first, *rest = (replace(one, tags=(1, 2)) for one in plan.stations)
    some = replace(plan, stations=(first, *(replace(one, tags=()) for one in rest)))
    assert 0.0 < some.placed_m2 <= plan.visit.seen_m2
    assert plan_promise(some).startswith("One station shows")
    otherwise = replace(plan, by_tags=False)  # poses, points or rough places say where they stood
    assert otherwise.unplaced == () and otherwise.placed_m2 == pytest.approx(plan.visit.seen_m2)
    assert "tags" not in plan_promise(otherwise)


def test_a_name_out_of_the_ifc_file_is_text_on_the_page(plan: VisitPlan) -> None:
    page = plan_page(plan, with_result=False)
    assert b"<img" not in page and b"&lt;img" in page
    assert MADE_BY in page[:2048] and b"://" not in page


def test_a_station_of_today_is_marked_on_the_storey_that_it_stands_on(plan: VisitPlan) -> None:
    pose = plan.stations[0].planned.world_from_left
    (mark,) = places_of({"A1": pose}, plan)
    assert (mark.storey, mark.name) == (plan.due[0].storey, "A1")
    below = pose.copy()
    below[2, 3] = -50.0
    assert places_of({"A1": below}, plan) == ()


def test_the_words_say_nothing_of_stations_where_nothing_is_due() -> None:
    assert promise_words(0, 0.0, 0.0, "2026-03-02") == NOTHING_DUE == still_words(0.0, 0.0, 0, 0.0)
    assert promise_words(1, 9.0, 10.0, "2026-03-02").startswith("One station shows 9.0")
    assert "No other station" in still_words(10.0, 1.0, 0, 0.0)
    assert tag_words((4, 9), 2) == "4, 9" and "needed" in tag_words((4,), 2)


def test_a_station_that_no_tag_of_the_list_helps_is_told_what_helps_it() -> None:
    some = promise_words(5, 9.0, 10.0, "2026-03-02", (4, 5), 1.0, (4,))
    assert "put up the tags T1, T2" in some and "Station 4: no tag of the list helps there; note where" in some
    none = promise_words(5, 9.0, 10.0, "2026-03-02", (4, 5), 1.0, (4, 5))
    assert "T1" not in none and "survey tags in its view" in none


def test_what_more_stations_would_show_never_counts_one_of_them_twice() -> None:
    told = still_words(100.0, 60.0, 7, 53.2, (4,), 49.5)
    assert "6 more stations would show another 50 m². Station 4 would add 3.7 m²" in told.replace(
        "\N{NO-BREAK SPACE}", " "
    )
    alone = still_words(100.0, 60.0, 1, 3.7, (1,), 0.0)
    assert "(40 %) of what is due. Station 1 would add" in alone and "another" not in alone
