import json
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_synthetic.layout import design
from asbuilt_synthetic.lens import directions
from asbuilt_synthetic.meshes import box
from asbuilt_synthetic.scene import first_face
from asbuilt_synthetic.solids import side_area_m2, sides
from asbuilt_synthetic.surface import cell_built, cells, samples
from asbuilt_synthetic.truth import element_samples, pixel_truth, station_truth
from asbuilt_synthetic.truth_file import truth_document


def test_depth_and_normal_of_a_pixel_fit_the_plane_of_its_face(site_scene):
    station = site_scene.stations[0]
    truth = pixel_truth(site_scene, station)
    left_from_world = np.linalg.inv(station.world_from_left)
    y, x = np.nonzero(truth.face >= 0)
    pick = np.random.default_rng(0).choice(len(y), 400)
    y, x = y[pick], x[pick]
    points = directions(site_scene.rig.left, np.c_[x, y].astype(float)) * truth.depth_m[y, x, None]
    planes = 0
    for p, n, f in zip(points, truth.normal[y, x], truth.face[y, x], strict=True):
        face = site_scene.faces[f]
        if face.kind == "plane":
            normal = left_from_world[:3, :3] @ face.normal
            origin = left_from_world[:3, :3] @ face.origin_m + left_from_world[:3, 3]
            assert abs((p - origin) @ normal) < 1e-4
            assert np.allclose(n, normal, atol=1e-4)
            planes += 1
    assert planes > 50
    assert np.isinf(truth.depth_m[truth.element < 0]).any()


def test_what_is_visible_of_a_face_is_at_most_what_is_built_and_that_at_most_the_design(site_scene):
    for station in site_scene.stations:
        for f in station_truth(site_scene, station).faces:
            design_m2 = site_scene.faces[f.face].design_area_m2
            assert 0 < f.visible_area_m2 <= f.built_area_m2 + 1e-9 <= design_m2 + 1e-6
            if f.wholly_in_view and site_scene.faces[f.face].kind == "plane":
                assert f.visible_area_m2 == pytest.approx(f.built_area_m2)


def test_a_post_before_a_face_takes_it_out_of_whole_view(site_scene):
    station, face = next(
        (s, f)
        for s in site_scene.stations
        for f in station_truth(site_scene, s).faces
        if f.wholly_in_view and site_scene.faces[f.face].kind == "plane"
    )
    eye = station.world_from_left[:3, 3]
    building = design(site_scene.seed)
    element = next(e for e in building.vertical if e.global_id == site_scene.faces[face.face].element)
    side = sides(element)[face.face - first_face(building)[element.global_id]]
    along = building.world_from_local[:3, :3] @ element.local_from_element[:3, :3] @ side.along
    aim = site_scene.faces[face.face].origin_m + along * side.length_m / 2 + np.array([0, 0, 0.4])
    at = eye + 0.6 * (aim - eye)
    post = box("post", (-0.02, -0.02, -3), (0.02, 0.02, 3), "timber").placed(np.eye(4))
    moved = replace(post, vertices_m=post.vertices_m + at)
    hidden = replace(site_scene, bodies=(*site_scene.bodies, moved))
    after = {f.face: f for f in station_truth(hidden, station).faces}[face.face]
    assert not after.wholly_in_view and after.visible_area_m2 < face.visible_area_m2


def test_samples_add_up_to_the_design_area_and_touching_faces_are_not_exposed():
    building = design(3)
    for e in building.vertical:
        s = samples(building, e, 0.5, 0.1)
        for k, side in enumerate(sides(e)):
            assert s.area_m2[s.side == k].sum() == pytest.approx(side_area_m2(e, side), rel=1e-6)
            assert s.area_m2[(s.side == k) & s.built].sum() == pytest.approx(
                side_area_m2(e, side, e.height_m / 2), rel=1e-6
            )
    west, east = (
        next(e for e in building.vertical if e.name.startswith(f"Wall 0{k} back") and e.storey == 0) for k in (1, 2)
    )
    ends = (samples(building, west, 1.0, 0.1), 3), (samples(building, east, 1.0, 0.1), 2)
    for s, side_index in ends:
        assert not s.exposed[s.side == side_index].any()
        assert s.exposed[s.side == 5 - side_index].mean() > 0.9


def test_cells_tile_the_element_and_follow_the_pour():
    for e in design(3).vertical:
        c = cells(e)
        share = np.prod(c[:, :, 1] - c[:, :, 0], axis=1).sum()
        holes = sum(o.width_m * o.height_m for o in e.openings) / (e.length_m * e.height_m)
        assert share == pytest.approx(1 - holes)
        assert cell_built(e, 1.0).all() and not cell_built(e, 0.0).any()
        assert cell_built(e, 0.5).mean() == pytest.approx(0.5, abs=0.12)


def test_the_document_is_plain_json_and_its_storeys_agree_with_the_elements(site_scene):
    document = json.loads(json.dumps(truth_document(site_scene.seed, [site_scene])))
    assert document["format"] == "asbuilt-synthetic/truth" and document["version"] == 1
    visit = document["visits"][0]
    by_id = {e.global_id: e for e in site_scene.elements}
    for e in visit["elements"]:
        fraction = by_id[e["global_id"]].built_height_fraction
        assert e["state"] == ("complete" if fraction == 1 else "part" if fraction else "not started")
        assert len(e["cell_built"]) == len(e["cell_visible"]) == e["cells"]
        assert e["completion"] == pytest.approx(e["completion_by_cells"], abs=0.06)
    for storey in visit["storeys"]:
        mine = [
            s
            for s, e in zip(element_samples(site_scene), site_scene.elements, strict=True)
            if e.storey == storey["name"]
        ]
        built = sum(s.area_m2[s.built & s.exposed].sum() for s in mine)
        assert storey["built_area_m2"] == pytest.approx(built, abs=1e-3)
        assert 0 <= storey["completion_by_area"] <= 1
