"""Of the solids around the elements those that touch are drawn, as they are: openings and clippings off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder


def _wall(builder: ModelBuilder) -> None:
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))


def _clipped(builder: ModelBuilder, product: Any, operator: str, at_m: tuple[float, float, float]) -> None:
    """Change a box by another of two metres, whose corner is at `at_m`."""
    other = builder.box("IfcBeam", "tool", (0.0, 0.0, 0.0), (2.0, 2.0, 2.0))
    second = other.Representation.Representations[0].Items[0]
    second.Position = builder._axes(tuple(1000.0 * v for v in at_m))
    body = product.Representation.Representations[0]
    result = builder.make("IfcBooleanResult", Operator=operator, FirstOperand=body.Items[0], SecondOperand=second)
    body.Items, body.RepresentationType = [result], "CSG"
    builder.file.remove(other)


def _exposed(builder: ModelBuilder, folder: Path) -> tuple[list[str], float]:
    design = read_design(builder.write(folder / "m.ifc"))
    return [obstacle.ifc_class for obstacle in design.obstacles], design.elements[0].exposed_area_m2


WHOLE = 2.0 * 4.2 * 3.0


def test_what_lies_far_away_on_top_or_below_is_left_out(tmp_path: Path) -> None:
    builder = ModelBuilder()
    _wall(builder)
    builder.box("IfcSlab", "above", (-1.0, -1.0, 3.0), (6.0, 6.0, 0.2))
    builder.box("IfcSlab", "below", (-1.0, -1.0, -0.2), (6.0, 6.0, 0.2))
    builder.box("IfcBeam", "far", (0.0, 5.0, 0.0), (6.0, 0.2, 0.2))
    assert _exposed(builder, tmp_path) == ([], pytest.approx(WHOLE))


def test_a_slab_with_an_opening_beside_the_wall_leaves_the_wall_free_there(tmp_path: Path) -> None:
    builder = ModelBuilder()
    _wall(builder)
    slab = builder.box("IfcSlab", "S", (0.0, 0.2, 1.0), (4.0, 2.0, 0.2))
    builder.opening(slab, (1.0, -0.5, -0.1), (1.5, 1.0, 0.4))
    classes, area = _exposed(builder, tmp_path)
    assert classes == ["IfcSlab"]
    assert area == pytest.approx(WHOLE - (4.0 - 1.5) * 0.2, abs=1e-4)


def test_a_beam_that_was_clipped_short_of_the_wall_touches_nothing(tmp_path: Path) -> None:
    builder = ModelBuilder()
    _wall(builder)
    beam = builder.box("IfcBeam", "B", (1.0, 0.2, 1.0), (0.3, 4.0, 0.5))
    _clipped(builder, beam, "DIFFERENCE", (-0.5, -1.5, -0.5))  # takes its first half metre away
    _, area = _exposed(builder, tmp_path)
    assert area == pytest.approx(WHOLE)


def test_a_beam_that_was_united_with_a_block_touches_by_the_block(tmp_path: Path) -> None:
    builder = ModelBuilder()
    _wall(builder)
    beam = builder.box("IfcBeam", "B", (1.0, 1.2, 1.0), (0.3, 4.0, 0.5))
    _clipped(builder, beam, "UNION", (-0.5, -1.0, -0.5))  # reaches the wall, two metres wide and high
    classes, area = _exposed(builder, tmp_path)
    assert classes == ["IfcBeam"]
    assert area == pytest.approx(WHOLE - 2.0 * 2.0, abs=1e-4)
