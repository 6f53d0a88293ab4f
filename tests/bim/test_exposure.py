"""Exposed surface: what touches is taken off, to the centimetre, and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.geometry.polygon import bounds, contains
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder


def _read(builder: ModelBuilder, folder: Path) -> BimModel:
    return read_design(builder.write(folder / "model.ifc"))


def _named(design: BimModel, name: str) -> BimElement:
    return next(element for element in design.elements if element.name == name)


def test_a_free_standing_column_is_exposed_all_round(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.3, 0.5, 3.0))
    builder.box("IfcSlab", "floor", (-2.0, -2.0, -0.2), (4.0, 4.0, 0.2))
    column = _named(_read(builder, tmp_path), "C")
    assert column.exposed_area_m2 == pytest.approx(2.0 * (0.3 + 0.5) * 3.0, abs=1e-6)


def test_a_slab_that_abuts_a_wall_takes_its_own_thickness_off_one_side(tmp_path: Path) -> None:
    builder = ModelBuilder(turn_deg=31.0, origin_m=(2e5, 5e6, 100.0))
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (5.0, 0.2, 3.0))
    builder.box("IfcSlab", "S", (0.0, 0.2, 2.8), (5.0, 3.0, 0.2))
    wall = _named(_read(builder, tmp_path), "W")
    sides = sorted(face.exposed_area_m2 for face in wall.faces if face.role == "side")
    assert sides == pytest.approx([15.0 - 5.0 * 0.2, 15.0], abs=1e-4)


def test_two_walls_that_meet_at_a_corner_hide_the_joint(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "long", (0.0, 0.0, 0.0), (4.0, 0.25, 3.0))
    builder.box("IfcWall", "short", (0.25, 0.25, 0.0), (2.0, 0.25, 3.0), turn_deg=90.0)
    design = _read(builder, tmp_path)
    long, short = _named(design, "long"), _named(design, "short")
    assert long.exposed_area_m2 == pytest.approx(2.0 * 12.0 + 2.0 * 0.75 - 0.75, abs=1e-4)
    assert short.exposed_area_m2 == pytest.approx(2.0 * 6.0 + 0.75, abs=1e-4)


def test_two_collinear_walls_keep_their_sides_and_lose_the_ends_that_touch(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "left", (0.0, 0.0, 0.0), (3.0, 0.2, 3.0))
    builder.box("IfcWall", "right", (3.0, 0.0, 0.0), (3.0, 0.2, 3.0))
    for name in ("left", "right"):
        wall = _named(_read(builder, tmp_path), name)
        assert wall.exposed_area_m2 == pytest.approx(2.0 * 9.0 + 0.6, abs=1e-4)


def test_a_gap_of_two_centimetres_is_no_contact(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (3.0, 0.2, 3.0))
    builder.box("IfcColumn", "C", (3.02, 0.0, 0.0), (0.3, 0.3, 3.0))
    wall = _named(_read(builder, tmp_path), "W")
    assert wall.exposed_area_m2 == pytest.approx(sum(face.area_m2 for face in wall.faces))


def test_a_slab_round_a_round_column_takes_a_ring_off(tmp_path: Path) -> None:
    builder = ModelBuilder(turn_deg=11.0)
    builder.cylinder("R", (0.0, 0.0, 0.0), 0.25, 3.2)
    builder.box("IfcSlab", "S", (-2.0, -2.0, 3.0), (4.0, 4.0, 0.2))
    (face,) = _named(_read(builder, tmp_path), "R").faces
    assert face.area_m2 - face.exposed_area_m2 == pytest.approx(2.0 * np.pi * 0.25 * 0.2, rel=1e-3)
    assert bounds(face.exposed_uv_m)[3] == pytest.approx(3.0, abs=1e-6)


def test_a_wall_that_meets_a_round_column_hides_its_own_width_of_the_lateral_surface(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.cylinder("R", (0.0, 0.0, 0.0), 0.3, 3.0)
    builder.box("IfcWall", "W", (0.2, -0.1, 0.0), (3.0, 0.2, 3.0))
    (face,) = _named(_read(builder, tmp_path), "R").faces
    hidden = 2.0 * np.arcsin(0.1 / 0.305) * 0.3 * 3.0
    assert face.area_m2 - face.exposed_area_m2 == pytest.approx(hidden, rel=0.03)
    towards_wall = face.frame.to_uv(face.frame.origin_m + np.array([0.3, 0.0, 1.5]))
    assert not contains(face.exposed_uv_m, towards_wall[None])[0]
    assert contains(face.exposed_uv_m, face.frame.to_uv(face.frame.origin_m + np.array([-0.3, 0.1, 1.5]))[None])[0]


def test_a_hairline_that_a_neighbour_leaves_free_is_not_counted_as_surface(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (3.0, 0.2, 3.0))
    builder.box("IfcWall", "next", (3.0, 0.004, 0.0), (3.0, 0.2, 3.0))
    wall = _named(_read(builder, tmp_path), "W")
    ends = sorted(face.exposed_area_m2 for face in wall.faces if face.role == "end")
    assert ends == pytest.approx([0.0, 0.6], abs=1e-9)
