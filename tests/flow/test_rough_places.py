"""A rough place as people write it: storeys, grid axes and directions are looked up, and mistakes named."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim.model import GridLine
from asbuilt_bim.errors import ProjectError
from asbuilt_bim.flow.rough_places import check_near, crossing, rough_places
from asbuilt_bim.project.file import NearFile
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.project.read import read_project
from benchmarks.register.design_seen import column, design_of
from benchmarks.sites import SAMPLE

GRID = (
    GridLine(label="B", x1_m=5.0, y1_m=-10.0, x2_m=5.0, y2_m=10.0),
    GridLine(label="C", x1_m=9.0, y1_m=-10.0, x2_m=9.0, y2_m=10.0),
    GridLine(label="3", x1_m=-10.0, y1_m=4.0, x2_m=10.0, y2_m=4.0),
)
DESIGN = design_of([column((0.0, 0.0), 0.4)], grid_lines=GRID)


def visit_with(near: NearFile) -> tuple[Project, Visit]:
    project = read_project(SAMPLE / "project.yaml")
    visit = project.visits[0]
    visit = replace(visit, stations=(replace(visit.stations[0], near=near),))
    return replace(project, visits=(visit,)), visit


def test_a_grid_crossing_is_where_its_axes_cross_in_either_order() -> None:
    assert crossing("B-3", GRID) == pytest.approx([5.0, 4.0])
    assert crossing("3/b", GRID) == pytest.approx([5.0, 4.0])


@pytest.mark.parametrize("text", ["B-9", "B-C", "B", "", "-" * 1000])
def test_axes_that_are_not_there_or_do_not_cross_are_named(text: str) -> None:
    with pytest.raises(ValueError, match="axes"):
        crossing(text, GRID)


def test_looking_counts_from_the_files_own_north() -> None:
    _, visit = visit_with(NearFile(storey="Storey 0", looking="east"))
    turned = replace(DESIGN, north=(1.0, 0.0))  # north is where x points: east is against y
    for design, bearing in ((DESIGN, 90.0), (turned, 180.0)):
        found = rough_places(visit, design)
        assert found is not None
        assert found.places["G1"].bearing_rad == pytest.approx(np.radians(bearing))


def test_a_storey_is_found_by_name_in_any_case_and_a_wrong_one_named_before_anything_is_measured() -> None:
    project, visit = visit_with(NearFile(storey="storey 0 "))
    check_near(project, DESIGN)
    found = rough_places(visit, DESIGN)
    assert found is not None
    assert found.places["G1"].storeys == ("S0",)
    wrong, _ = visit_with(NearFile(storey="Cellar"))
    with pytest.raises(ProjectError, match=r"G1: near: the design has no storey 'Cellar'; it has Storey 0"):
        check_near(wrong, DESIGN)


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("{looking: north}", "needs a storey"),
        ("{x_m: 1.0}", "x_m and y_m, both"),
        ("{grid: B-3, x_m: 1.0, y_m: 2.0}", "not all of them"),
        ("{storey: S, looking: north, bearing_deg: 3}", "not both"),
    ],
)
def test_a_rough_place_said_by_half_or_twice_is_refused(tmp_path: Path, written: str, fault: str) -> None:
    text = (SAMPLE / "project.yaml").read_text(encoding="utf-8")
    (tmp_path / "project.yaml").write_text(text.replace("date: 2026-03-02", f"date: 2026-03-02\n    near: {written}"))
    with pytest.raises(ProjectError, match=fault):
        read_project(tmp_path / "project.yaml")


def test_a_visits_rough_place_is_that_of_its_stations_which_have_none(tmp_path: Path) -> None:
    text = (SAMPLE / "project.yaml").read_text(encoding="utf-8")
    text = text.replace("date: 2026-03-02", "date: 2026-03-02\n    near: {storey: Ground floor}")
    text = text.replace("{name: G2, ", "{name: G2, near: {storey: First floor}, ", 1)
    shutil.copytree(SAMPLE, tmp_path / "site")
    (tmp_path / "site" / "project.yaml").write_text(text, encoding="utf-8")
    visits = read_project(tmp_path / "site" / "project.yaml").visits
    assert [one.near and one.near.storey for one in visits[0].stations[:3]] == [
        "Ground floor",
        "First floor",
        "Ground floor",
    ]
    assert all(one.near is None for one in visits[1].stations)
