"""Cells and samples: an opening is no cell, every exposed square metre is sampled once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim import cells
from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder
from tests.match.small_site import box, element


def _only(builder: ModelBuilder, folder: Path, name: str) -> BimElement:
    design = read_design(builder.write(folder / "model.ifc"))
    return next(element for element in design.elements if element.name == name)


@pytest.fixture
def wall(tmp_path: Path) -> BimElement:
    builder = ModelBuilder(turn_deg=40.0, origin_m=(1e4, -2e4, 7.0))
    made = builder.box("IfcWall", "W", (1.0, 0.0, 0.0), (4.0, 0.25, 3.0), turn_deg=15.0)
    builder.opening(made, (1.0, -0.5, 0.0), (1.0, 1.5, 2.0))
    return _only(builder, tmp_path, "W")


def test_a_wall_is_divided_into_quarter_metres_and_a_door_is_no_cell(wall: BimElement) -> None:
    cells = element_cells(wall)
    assert cells.shape == (16, 12)
    door = np.zeros(cells.shape, dtype=bool)
    door[4:8, 0:8] = True
    # the wall's x may run either way along it
    assert (cells.weight[door] == 0.0).all() or (cells.weight[door[::-1]] == 0.0).all()
    assert cells.count == 16 * 12 - 4 * 8
    assert cells.weight.max() == 1.0


def test_samples_carry_the_exposed_area_once_without_the_reveals(wall: BimElement) -> None:
    samples = cell_samples(wall)
    wanted = sum(face.exposed_area_m2 for face in wall.faces if face.role != "reveal")
    assert samples.area_m2.sum() == pytest.approx(wanted, rel=1e-9)
    assert {wall.faces[i].role for i in np.unique(samples.face)} == {"side", "end"}
    assert samples.step_m.max() < 0.06


def test_samples_lie_on_the_element_in_their_own_cell_and_look_out(wall: BimElement) -> None:
    samples, cells = cell_samples(wall), element_cells(wall)
    own = samples.points_m @ wall.axis_from_world[:3, :3].T + wall.axis_from_world[:3, 3]
    column, row = samples.cell // cells.shape[1], samples.cell % cells.shape[1]
    assert (np.abs(own[:, 0] / 4.0 * 16 - column - 0.5) <= 0.5 + 1e-6).all()
    assert (np.abs(own[:, 2] / 3.0 * 12 - row - 0.5) <= 0.5 + 1e-6).all()
    sides = np.isin(samples.face, [i for i, face in enumerate(wall.faces) if face.role == "side"])
    outward = samples.normals @ wall.axis_from_world[:3, :3].T
    assert (outward[sides, 1] * own[sides, 1] > 0.0).all()
    for number, face in enumerate(wall.faces):
        chosen = samples.face == number
        np.testing.assert_allclose(face.frame.from_uv(samples.uv_m[chosen]), samples.points_m[chosen], atol=1e-9)


def test_a_small_wall_has_at_least_four_by_four_cells(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "low", (0.0, 0.0, 0.0), (0.6, 0.2, 0.5))
    assert element_cells(_only(builder, tmp_path, "low")).shape == (4, 4)


def test_a_column_is_divided_over_its_height_only(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.cylinder("R", (0.0, 0.0, 0.0), 0.2, 2.9)
    column = _only(builder, tmp_path, "R")
    cells, samples = element_cells(column), cell_samples(column)
    assert cells.shape == (1, 29) and cells.count == 29
    assert samples.area_m2.sum() == pytest.approx(2.0 * np.pi * 0.2 * 2.9, rel=1e-3)
    assert len(np.unique(samples.cell)) == 29


def test_a_height_that_a_slab_encloses_is_no_cell(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.2))
    builder.box("IfcSlab", "S", (-2.0, -2.0, 3.0), (4.0, 4.0, 0.2))
    cells = element_cells(_only(builder, tmp_path, "C"))
    assert cells.shape == (1, 32)
    assert (cells.weight[0, 30:] == 0.0).all() and (cells.weight[0, :30] == 1.0).all()


def test_samples_are_laid_out_once_for_a_design_of_usual_size(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = [element(f"W{number}", "wall", box(0, number, 0, 3.0, 0.25, 2.8)) for number in range(40)]
    first = [cell_samples(wall) for wall in walls]
    assert all(cell_samples(wall) is laid_out for wall, laid_out in zip(walls, first, strict=True))
    monkeypatch.setattr(cells, "_MOST_SAMPLES", 3 * len(first[0].face))
    monkeypatch.setattr(cells, "_SAMPLES", {})
    few = [cell_samples(wall) for wall in walls[:4]]
    assert cell_samples(walls[3]) is few[3] and cell_samples(walls[0]) is not few[0]


def test_each_sample_knows_its_place_in_its_faces_grid_and_the_border_boxes_that_are_its_own() -> None:
    strips = polygon.union([polygon.box(0.0, 0.0, 1.07, 2.8), polygon.box(2.0, 0.0, 3.0, 2.8)])
    samples = cell_samples(element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.8), {0: strips}))
    for index in np.unique(samples.face):
        own = samples.face == index
        low = samples.uv_m[own].min(axis=0)
        np.testing.assert_allclose(low + samples.place[own] * samples.step_m[own], samples.uv_m[own], atol=1e-9)
    assert len(samples.owner) == len(samples.past_uv_m) > 0
    assert set(samples.face[samples.owner]) == {0}
    off = np.abs(samples.past_uv_m - samples.uv_m[samples.owner]) / samples.step_m[samples.owner]
    assert off.sum(axis=1).max() <= 1.0 + 1e-9  # the sample beside it
