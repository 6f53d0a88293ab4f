"""Faces measured on ray-cast photos, against the exact truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.level import pixel_rays
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import ring_area
from asbuilt_bim.geometry.transform import rigid
from asbuilt_bim.measure import finish, station_faces
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.outline.ends import model
from asbuilt_bim.measure.planes.refine import pictures, refine_plane
from asbuilt_bim.measure.station_faces import (
    FaceOptions,
    StationFaces,
    judge_face,
    lies,
    measure_faces,
    thumbnail,
)
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.masks.segment import InstanceSource
from asbuilt_bim.vision.scene.geometric import segment_scene
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.scene.sky import find_sky
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map, grey
from tests.measure.box_world import site, true_area, true_q


def rig_of(pair: RectifiedPair) -> StereoRig:
    camera = pair.camera
    k = np.array([[camera.f_px, 0.0, camera.cx_px], [0.0, camera.f_px, camera.cy_px], [0.0, 0.0, 1.0]])
    one = Intrinsics(K=k, distortion=np.zeros(5), width_px=camera.width_px, height_px=camera.height_px)
    covariance = np.diag([0.3, 0.3, 0.4, 0.4, 0.3, 0.3, 0.4, 0.4, 2e-4, 2e-4, 5e-5, 2e-5, 2e-5, 5e-5]) ** 2
    return StereoRig(
        left=one, right=one, right_from_left=rigid(np.eye(3), [-camera.baseline_m, 0.0, 0.0]), covariance=covariance
    )


def measured(pair: RectifiedPair, source: InstanceSource = InstanceSource.GEOMETRY) -> StationFaces:
    depth = depth_map(pair, SemiGlobalMatcher())
    scene = read_scene(pair, depth)
    instances, sky = segment_scene(pair, scene), find_sky(pair, depth)
    instances = [replace(one, source=source) for one in instances]
    return measure_faces(pair, scene, instances, rig_of(pair), FaceOptions(), sky=sky)


@pytest.fixture(scope="module")
def found() -> StationFaces:
    return measured(site()[1])


def face_at(found: StationFaces, x: float, y: float) -> MeasuredFace:
    import cv2

    hits = [
        face for face in found.faces if cv2.pointPolygonTest(face.outline_px[0].astype(np.float32), (x, y), False) > 0
    ]
    assert len(hits) == 1
    return hits[0]


@pytest.mark.parametrize(
    ("name", "x", "y", "limit"),
    [
        ("wall/0", 570, 300, 0.015),
        ("column/0", 262, 300, 0.015),
        ("wall/3", 470, 300, 0.06),
        ("column/3", 218, 300, 0.06),
    ],
)
def test_a_face_wholly_in_view_has_its_area(found: StationFaces, name: str, x: float, y: float, limit: float) -> None:
    truth = true_area(site()[0], name)
    face = face_at(found, x, y)
    assert face.area_m2 == pytest.approx(truth, rel=limit)
    assert abs(face.area_m2 - truth) < 3.5 * face.area_sigma_m2
    assert face.whole


def test_area_is_greens_theorem_on_the_outline(found: StationFaces) -> None:
    for face in found.faces:
        outer, *holes = face.outline_uv_m
        assert ring_area(outer) > 0.0
        assert face.area_m2 == pytest.approx(ring_area(outer) + sum(ring_area(hole) for hole in holes), rel=1e-9)


def test_outlines_in_pixels_and_in_metres_are_the_same_places(found: StationFaces) -> None:
    camera = site()[1].camera
    for face in found.faces:
        for metric, px in zip(face.outline_uv_m, face.outline_px, strict=True):
            assert camera.project(face.frame.from_uv(metric)) == pytest.approx(px, abs=1e-6)


def test_normals_point_at_the_camera_and_v_points_up(found: StationFaces) -> None:
    up = site()[2].T @ np.array([0.0, -1.0, 0.0])
    for face in found.faces:
        if isinstance(face.frame, PlaneFrame):
            assert face.frame.plane.distance_m(np.zeros(3)) > 0.0
            assert face.frame.v @ up > 0.99


def test_the_round_column_is_a_cylinder_with_its_radius(found: StationFaces) -> None:
    rounds = [face for face in found.faces if isinstance(face.frame, CylinderFrame)]
    assert len(rounds) == 1
    face = rounds[0]
    assert isinstance(face.frame, CylinderFrame)
    assert face.label == "column"
    assert face.frame.radius_m == pytest.approx(0.2, rel=0.04)
    # the visible arc, 2 acos(r / D) r, times the height of 2.6 m
    distance = float(np.hypot(0.05, 4.6))
    assert face.area_m2 == pytest.approx(2.0 * np.arccos(0.2 / distance) * 0.2 * 2.6, rel=0.06)


def test_sigma_has_a_part_of_its_own_and_a_part_of_the_rig(found: StationFaces) -> None:
    wall = face_at(found, 570, 300)
    assert 0.0005 < wall.area_sigma_image_m2 / wall.area_m2 < 0.02
    assert 0.001 < wall.area_sigma_calibration_m2 / wall.area_m2 < 0.1
    assert wall.area_sigma_m2 == pytest.approx(np.hypot(wall.area_sigma_image_m2, wall.area_sigma_calibration_m2))
    side = face_at(found, 218, 300)
    assert side.area_sigma_image_m2 / side.area_m2 > wall.area_sigma_image_m2 / wall.area_m2


def test_a_face_at_the_frames_border_is_cut() -> None:
    _, pair, _ = site()
    valid = np.array(pair.valid_left)
    valid[:, 600:] = False
    left = np.array(pair.left)
    left[:, 600:] = 0
    cut = measured(replace(pair, left=left, valid_left=valid))
    wall = face_at(cut, 550, 300)
    assert wall.cut_by_frame
    assert not wall.whole


def test_a_plane_is_refined_to_hundredths_from_a_poor_start() -> None:
    world, pair, level = site()
    camera = pair.camera
    rays = pixel_rays(camera.width_px, camera.height_px, camera.f_px, camera.cx_px, camera.cy_px)
    mask = np.zeros(pair.valid_left.shape, dtype=bool)
    mask[180:430, 490:650] = True
    truth = true_q(world, "wall/0", camera, level)
    start = truth + np.array([3.0, -2.0, 0.3])
    fit = refine_plane(pictures(grey(pair.left), grey(pair.right), pair.valid_right), rays, mask, start)
    assert fit is not None
    miss = rays[mask] @ (fit.q_px - truth)
    assert np.abs(miss).max() < 0.03
    assert np.sqrt(np.mean((rays[mask] @ (start - truth)) ** 2)) > 0.4


def test_a_surface_without_texture_is_not_refined() -> None:
    _, pair, _ = site()
    camera = pair.camera
    rays = pixel_rays(camera.width_px, camera.height_px, camera.f_px, camera.cx_px, camera.cy_px)
    blank = np.full(pair.valid_left.shape, 120.0, dtype=np.float32)
    mask = np.zeros(pair.valid_left.shape, dtype=bool)
    mask[200:300, 300:400] = True
    assert refine_plane(pictures(blank, blank, pair.valid_right), rays, mask, np.array([0.0, 0.0, 30.0])) is None


def test_what_is_too_narrow_is_named_and_left_out() -> None:
    _, pair, _ = site()
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    strict = FaceOptions(least_width_px=60.0)
    kept = measure_faces(pair, scene, segment_scene(pair, scene), rig_of(pair), strict)
    assert all(face.width_px >= 60.0 for face in kept.faces)
    narrow = [one for one in kept.rejections if one.code is Reason.FACE_NARROW]
    assert narrow
    assert {one.values["limit_px"] for one in narrow} == {60.0}
    # the report tells by this that a face was left out, and not its station; no face that was kept has its number
    assert {(one.subject.kind, one.subject.station) for one in narrow} == {(SubjectKind.FACE, pair.name)}
    named = {one.subject.name for one in narrow}
    assert len(named) == len(narrow)
    assert named.isdisjoint(face.face_id for face in kept.faces)


def test_a_face_whose_sigma_is_over_a_fifth_of_its_area_is_seen_and_not_measurable_and_has_its_place() -> None:
    _, pair, _ = site()
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    assert FaceOptions().most_sigma_share == 0.20
    usual = measure_faces(pair, scene, segment_scene(pair, scene), rig_of(pair), FaceOptions())
    strict = FaceOptions(most_sigma_share=1e-6)  # no face is as sure as that
    kept = measure_faces(pair, scene, segment_scene(pair, scene), rig_of(pair), strict)
    assert not kept.faces
    seen = [one for one in kept.rejections if one.code is Reason.FACE_UNCERTAIN]
    assert len(seen) >= len(usual.faces)
    boxes = [one.values["box_px"] for one in seen]
    for face in usual.faces:  # its box is the one of the face that would have been measured
        low, high = face.outline_px[0].min(axis=0), face.outline_px[0].max(axis=0)
        assert (*np.floor(low).astype(int), *np.ceil(high).astype(int)) in boxes
    assert all(isinstance(value, int) for box in boxes for value in box)  # type: ignore[union-attr]
    text = str(words_of(seen[0]))
    assert "seen, not measurable" in text and "m²" not in text and "limit 0 %" in text


@pytest.mark.parametrize(("source", "open_m2"), [(InstanceSource.GEOMETRY, 0.7), (InstanceSource.GIVEN, 0.0)])
def test_who_draws_a_mask_says_where_the_face_ends(
    source: InstanceSource, open_m2: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finish, "_open_sigma", lambda *_: 0.7)
    flat = [one for one in measured(site()[1], source).faces if isinstance(one.frame, PlaneFrame)]
    assert flat and {one.area_sigma_open_m2 for one in flat} == {open_m2}


@pytest.mark.parametrize(("lost", "box"), [(1, (10, 20, 91, 61)), (4, None)])
def test_a_face_with_corners_that_no_pixel_shows_is_named_by_the_box_of_the_others(
    lost: int, box: tuple[int, ...] | None
) -> None:
    face = measured(site()[1]).faces[0]
    ring = np.array([[5.0, 5.0], [10.4, 20.0], [90.2, 60.5], [50.0, 30.0]])
    ring[:lost] = np.nan
    rejections: list[Rejection] = []
    judge_face(replace(face, outline_px=(ring,)), [], rejections, FaceOptions(most_sigma_share=1e-6))
    assert rejections[0].values.get("box_px") == box


@pytest.mark.parametrize(("lean_deg", "lying"), [(0.0, False), (40.0, False), (50.0, True), (90.0, True)])
def test_a_plane_that_leans_by_over_half_a_right_angle_lies(lean_deg: float, lying: bool) -> None:
    lean = np.radians(lean_deg)
    for up in (-1.0, 1.0):
        q = 30.0 * np.array([0.0, up * np.sin(lean), np.cos(lean)])
        assert lies(q, np.array([0.0, 1.0, 0.0])) is lying


def test_ground_is_no_wall_unless_somebody_drew_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a real slope four of seven "walls" lay by 50 to 64 degrees: from 6 cm of base they had looked upright."""
    monkeypatch.setattr(station_faces, "lies", lambda q, down: True)
    found = measured(site()[1])
    assert not [face for face in found.faces if isinstance(face.frame, PlaneFrame)]
    drawn = measured(site()[1], InstanceSource.GIVEN)
    assert [face for face in drawn.faces if isinstance(face.frame, PlaneFrame)]


def test_the_thumbnail_is_a_jpeg_without_exif() -> None:
    data = thumbnail(site()[1])
    assert data[:2] == b"\xff\xd8"
    assert b"Exif" not in data


def test_a_face_tells_how_likely_it_was_seen_whole(found: StationFaces) -> None:
    assert all(0.0 < face.whole_probability < 1.0 for face in found.faces)
    assert all((face.whole_probability >= model().limit) == face.whole for face in found.faces)
