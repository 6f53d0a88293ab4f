"""Faces of shapes that are no plain boxes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import bounds
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder


def _only(builder: ModelBuilder, folder: Path) -> BimElement:
    (element,) = read_design(builder.write(folder / "model.ifc")).elements
    return element


def _roles(element: BimElement) -> dict[str, int]:
    return {role: n for role in ("side", "end", "reveal") if (n := sum(f.role == role for f in element.faces))}


def _regular(corners: int, radius: float) -> list[tuple[float, float]]:
    angles = 2.0 * np.pi * (np.arange(corners) + 0.3) / corners
    return [(radius * np.cos(a), radius * np.sin(a)) for a in angles]


def _arc(radius: float, start: float, end: float, steps: int, centre: tuple[float, float]) -> list[tuple[float, float]]:
    angles = np.linspace(start, end, steps + 1)
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angles]


@pytest.mark.parametrize(("corners", "round_one"), [(6, False), (8, False), (12, True), (16, True), (36, True)])
def test_an_octagon_is_flat_sided_and_a_twelve_sided_prism_is_round(
    corners: int, round_one: bool, tmp_path: Path
) -> None:
    builder = ModelBuilder()
    builder.prism("IfcColumn", "C", _regular(corners, 0.3), 3.0)
    faces = _only(builder, tmp_path).faces
    assert len(faces) == (1 if round_one else corners)
    assert isinstance(faces[0].frame, CylinderFrame) == round_one


def test_a_column_with_rounded_corners_has_four_sides_and_four_quarter_mantles(tmp_path: Path) -> None:
    outline: list[tuple[float, float]] = []
    for quarter, (x, y) in enumerate([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)]):
        outline += _arc(0.1, quarter * np.pi / 2.0, (quarter + 1) * np.pi / 2.0, 8, (x, y))
    builder = ModelBuilder()
    builder.prism("IfcColumn", "C", outline, 2.0)
    faces = _only(builder, tmp_path).faces
    cylinders = [face for face in faces if isinstance(face.frame, CylinderFrame)]
    assert (len(faces), len(cylinders)) == (8, 4)
    for face in cylinders:
        u0, _, u1, _ = bounds(face.rings_uv_m)
        assert (u0, u1) == pytest.approx((-np.pi / 4.0 * 0.1, np.pi / 4.0 * 0.1), abs=1e-5)
        assert face.frame.radius_m == pytest.approx(0.1, abs=1e-6)
    flat = [face.area_m2 for face in faces if not isinstance(face.frame, CylinderFrame)]
    assert flat == pytest.approx([0.8] * 4, abs=1e-6)


def test_a_curved_wall_keeps_its_facets_as_sides_and_has_two_ends(tmp_path: Path) -> None:
    outer = _arc(5.0, 0.0, np.pi / 2.0, 12, (0.0, 0.0))
    inner = _arc(4.8, np.pi / 2.0, 0.0, 12, (0.0, 0.0))
    builder = ModelBuilder()
    builder.prism("IfcWall", "bent", outer + inner, 3.0)
    element = _only(builder, tmp_path)
    assert _roles(element) == {"side": 24, "end": 2}
    chord = 2.0 * np.sin(np.pi / 48.0) * 12
    assert element.exposed_area_m2 == pytest.approx(3.0 * (chord * 9.8 + 2 * 0.2), rel=1e-6)


def test_an_l_shaped_wall_has_sides_on_both_legs(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.prism("IfcWall", "L", [(0, 0), (4, 0), (4, 0.2), (0.2, 0.2), (0.2, 3), (0, 3)], 2.5)
    assert _roles(_only(builder, tmp_path)) == {"side": 4, "end": 2}


def test_mitred_ends_are_ends(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.prism("IfcWall", "mitred", [(0, 0), (4, 0), (3.8, 0.2), (0.2, 0.2)], 2.5)
    roles = _roles(_only(builder, tmp_path))
    assert roles == {"side": 2, "end": 2}


def test_the_two_jambs_of_a_door_are_reveals_and_the_back_of_a_niche_is_a_side(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (6.0, 0.3, 3.0))
    builder.opening(wall, (1.0, -0.5, 0.0), (1.0, 1.5, 2.0))  # a door
    builder.opening(wall, (3.0, -0.5, 0.5), (1.0, 0.6, 2.0))  # a niche, 0.1 m deep
    element = _only(builder, tmp_path)
    assert _roles(element) == {"side": 3, "end": 2, "reveal": 4}
    niche = [face for face in element.faces if face.role == "side" and face.area_m2 < 5.0]
    assert niche[0].area_m2 == pytest.approx(2.0)


@pytest.mark.parametrize("down", [False, True])
def test_normals_look_out_whichever_way_a_body_was_extruded(down: bool, tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.prism("IfcColumn", "C", [(0, 0), (0, 0.4), (0.4, 0.4), (0.4, 0)], 3.0, down=down)  # clockwise, too
    element = _only(builder, tmp_path)
    centre = element.vertices_m.mean(axis=0)
    assert len(element.faces) == 4
    for face in element.faces:
        assert (face.frame.origin_m - centre) @ face.frame.normal == pytest.approx(0.2)
    assert element.volume_m3 == pytest.approx(0.48)


def test_a_mirrored_mapped_body_still_looks_outwards(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.mirrored("IfcColumn", "C", (0.4, 0.3, 3.0))
    element = _only(builder, tmp_path)
    assert (element.length_m, element.thickness_m) == pytest.approx((0.8, 0.3))
    centre = (element.vertices_m.min(axis=0) + element.vertices_m.max(axis=0)) / 2.0
    assert centre[0] == pytest.approx(-0.4)
    assert all((face.frame.origin_m - centre) @ face.frame.normal > 0.1 for face in element.faces)
    assert sum(face.area_m2 for face in element.faces) == pytest.approx(2.0 * 1.1 * 3.0)


def test_a_battered_wall_is_lateral_and_its_coordinates_run_along_the_slope(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "lean", (0.0, 0.0, 0.0), (3.0, 0.2, 2.0))
    solid = wall.Representation.Representations[0].Items[0]
    solid.ExtrudedDirection = builder.make("IfcDirection", (0.0, 0.1, 1.0))
    element = _only(builder, tmp_path)
    sides = [face for face in element.faces if face.area_m2 > 3.0]
    assert [face.area_m2 for face in sides] == pytest.approx([3.0 * 2.0] * 2, rel=1e-6)
    assert all(face.role == "side" for face in sides)


def test_every_face_has_an_id_of_its_own_even_between_equal_blocks(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.bare("IfcWall", "twice")
    same = [
        builder.box("IfcBuildingElementPart", f"{i}", (0.0, 0.0, 0.0), (2.0, 0.2, 2.5), level=None) for i in range(2)
    ]
    builder.parts(wall, same)
    faces = _only(builder, tmp_path).faces
    assert len({face.face_id for face in faces}) == len(faces)
