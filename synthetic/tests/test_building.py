import numpy as np
import pytest

from asbuilt_synthetic.layout import design
from asbuilt_synthetic.solids import poured, side_area_m2, sides, volume_m3

SEEDS = range(6)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_building_has_the_columns_walls_and_openings_that_are_asked_for(seed):
    b = design(seed)
    columns = [e for e in b.elements if e.ifc_class == "IfcColumn"]
    walls = [e for e in b.elements if e.ifc_class == "IfcWall"]
    assert len(columns) >= 12 and {e.shape for e in columns} == {"rect", "round"}
    assert len(walls) >= 10 and sum(bool(e.openings) for e in walls) >= 2
    assert all(0.299 < d < 0.601 for e in columns for d in (e.length_m, e.width_m))
    assert len({e.global_id for e in b.elements}) == len(b.elements)
    west, east = (next(e for e in walls if e.name.startswith(f"Wall 0{k} back") and e.storey == 0) for k in (1, 2))
    assert west.xy[0] + west.length_m == pytest.approx(east.xy[0]) and west.width_m == east.width_m


@pytest.mark.parametrize("seed", SEEDS)
def test_openings_lie_inside_their_walls(seed):
    for e in design(seed).vertical:
        for o in e.openings:
            assert o.start_m > 0.3 and o.start_m + o.width_m < e.length_m - 0.3
            assert o.sill_m + o.height_m < e.height_m


@pytest.mark.parametrize("fraction", [0.31, 0.55, 1.0])
def test_meshes_are_closed_and_hold_the_volume_and_face_areas_of_the_design(fraction):
    for e in design(3).vertical:
        top = e.height_m * fraction
        part = poured(e, top, 0, 0)
        v = part.vertices_m[part.triangles] - part.vertices_m.mean(0)
        volume = np.einsum("ij,ij->i", v[:, 0], np.cross(v[:, 1], v[:, 2])).sum() / 6
        assert volume == pytest.approx(volume_m3(e, top), rel=1e-3)
        edges = np.sort(
            np.concatenate([part.triangles[:, [0, 1]], part.triangles[:, [1, 2]], part.triangles[:, [2, 0]]])
        )
        assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
        for k, side in enumerate(sides(e)):
            t = v[part.face_id == k]
            area = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2
            assert area == pytest.approx(side_area_m2(e, side, top), rel=1e-3, abs=1e-9)
