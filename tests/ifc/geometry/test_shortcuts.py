"""What reading leaves out for speed, it leaves out only where the long way says the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim import exposure
from asbuilt_bim.geometry import polygon
from asbuilt_bim.ifc.geometry import cylinders, roles
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder


@pytest.mark.parametrize(("turn_deg", "none"), [(90.0, True), (32.0, True), (30.0, False), (6.0, False)])
def test_only_facets_that_all_turn_too_far_for_an_arc_are_passed_over(turn_deg: float, none: bool) -> None:
    angles = np.radians([0.0, turn_deg, 180.0, 270.0])
    normals = np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=1)
    assert cylinders._none_alike(normals) is none


@pytest.mark.parametrize("width_m", [0.004, 0.0099, 0.0101, 0.05, 0.3])
@pytest.mark.parametrize("length_m", [0.02, 0.3, 3.0, 30.0])
def test_what_counts_as_wide_by_its_girth_is_never_a_sliver(width_m: float, length_m: float) -> None:
    bent = [(0, 0), (length_m, 0), (length_m, width_m), (width_m, width_m), (width_m, length_m), (0, length_m)]
    for ring in (polygon.box(0.0, 0.0, length_m, width_m)[0][0], np.array(bent, dtype=np.float64)):
        kept = bool(polygon.grown(polygon.polygon([ring]), -exposure.SLIVER_M / 2.0))
        assert kept or not exposure._is_wide((ring,))
    assert exposure._is_wide(polygon.box(0.0, 0.0, 3.0, 0.3)[0])


def test_a_plain_wall_casts_no_rays_and_has_no_sliver_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (5.0, 0.2, 3.0))
    builder.box("IfcSlab", "S", (0.0, 0.2, 1.0), (5.0, 2.8, 0.2))
    path = builder.write(tmp_path / "model.ifc")
    for module, name in ((roles, "crossings"), (exposure, "grown")):
        monkeypatch.setattr(module, name, lambda *asked, called=name: pytest.fail(f"{called} was called"))
    (wall,) = read_design(path).elements
    assert sorted(face.role for face in wall.faces) == ["end", "end", "side", "side"]
    assert min(face.exposed_area_m2 - face.area_m2 for face in wall.faces) < -0.9  # the slab was taken off
