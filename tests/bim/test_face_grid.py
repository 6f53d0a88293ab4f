"""Grids over faces: the short way gives what asking point by point gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim import cells as cells_module
from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.bim.face_grid import face_grid, inside_grid
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.polygon import Region, contains
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder

_WALL = polygon.difference(polygon.box(0.0, 0.0, 5.0, 3.0), polygon.box(1.0, 0.8, 2.2, 2.1))
_STEP = polygon.union([polygon.box(0.0, 0.0, 2.0, 1.0), polygon.box(0.0, 1.0, 1.0, 2.0)])
_APART = polygon.union([polygon.box(0.0, 0.0, 1.0, 3.0), polygon.box(2.0, 0.0, 3.0, 3.0)])
_GABLE = polygon.polygon([np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 3.0], [0.0, 2.0]])])


@pytest.mark.parametrize("region", [polygon.box(0.0, 0.0, 5.0, 3.0), _WALL, _STEP, _APART, _GABLE])
@pytest.mark.parametrize("spacing_m", [0.05, 0.2, 0.37])
def test_a_grid_lies_inside_where_each_of_its_points_does(region: Region, spacing_m: float) -> None:
    grid, _ = face_grid(region, spacing_m)
    points = np.stack(np.meshgrid(grid.u_m, grid.v_m, indexing="ij"), axis=-1)
    assert np.array_equal(grid.inside, contains(region, points))
    assert grid.inside.any()


def test_points_on_a_border_are_asked_one_by_one() -> None:
    u, v = np.array([0.5, 1.0, 2.2, 3.0]), np.array([0.8, 1.0, 2.5])
    points = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    assert np.array_equal(inside_grid(_WALL, u, v), contains(_WALL, points))


def test_cells_are_laid_out_once_for_an_element(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (5.0, 0.2, 3.0))
    (wall,) = read_design(builder.write(tmp_path / "model.ifc")).elements
    laid_out: list[object] = []
    before = cells_module._cells

    def counted(element):  # type: ignore[no-untyped-def]
        laid_out.append(element)
        return before(element)

    monkeypatch.setattr(cells_module, "_cells", counted)
    monkeypatch.setattr(cells_module, "_OF_FORM", {})
    assert element_cells(wall) is element_cells(wall)
    assert laid_out == [wall]


def test_cells_are_laid_out_once_for_a_form_and_anew_for_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    builder = ModelBuilder(turn_deg=31.0)
    for number, height_m in enumerate((3.0, 3.0, 2.5)):
        builder.box("IfcColumn", f"C{number}", (4.0 * number, 0.0, 0.0), (0.4, 0.3, height_m))
    builder.box("IfcColumn", "touched", (12.0, 0.0, 0.0), (0.4, 0.3, 3.0))
    builder.box("IfcSlab", "S", (11.0, 0.3, 1.0), (3.0, 3.0, 0.5))
    elements = read_design(builder.write(tmp_path / "model.ifc")).elements
    columns = sorted(elements, key=lambda column: column.name)
    laid_out: list[str] = []
    before = cells_module._cells

    def counted(element):  # type: ignore[no-untyped-def]
        laid_out.append(element.name)
        return before(element)

    monkeypatch.setattr(cells_module, "_cells", counted)
    monkeypatch.setattr(cells_module, "_OF_FORM", {})
    found = [element_cells(column) for column in columns]
    assert laid_out == ["C0", "C2", "touched"]
    assert [one.element for one in found] == [column.global_id for column in columns]
    for column, one in zip(columns, found, strict=True):
        np.testing.assert_array_equal(one.weight, before(column).weight)


def test_a_cell_is_real_where_a_sample_of_it_is_exposed(tmp_path: Path) -> None:
    builder = ModelBuilder(turn_deg=31.0)
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (5.0, 0.2, 3.0))
    builder.box("IfcColumn", "C", (7.0, 0.0, 0.0), (0.4, 0.3, 3.0))
    builder.box("IfcSlab", "S", (6.0, 0.3, 1.0), (3.0, 3.0, 0.5))
    for element in read_design(builder.write(tmp_path / "model.ifc")).elements:
        samples = cell_samples(element, 0.025)
        seen = np.bincount(samples.cell, minlength=element_cells(element).weight.size) > 0
        assert np.array_equal(element_cells(element).weight.ravel() > 0.0, seen)
