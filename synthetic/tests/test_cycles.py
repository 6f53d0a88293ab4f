"""The path tracer puts known points where the true cameras see them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip("bpy", reason="the path tracer needs Blender's Python wheel")

import handmade

from asbuilt_synthetic import cycles
from asbuilt_synthetic.cycles_lens import canvas_for, photo_map
from asbuilt_synthetic.cycles_mesh import surface_coordinates, triangle_normals
from asbuilt_synthetic.model import CameraTruth, FloatArray, Scene, Station

LIMIT_PX = 0.05


@pytest.fixture(scope="module")
def site() -> Scene:
    return handmade.site()


def projected(site: Scene, side: str, station: int, points_m: FloatArray) -> FloatArray:
    camera = site.rig.left if side == "left" else site.rig.right
    camera_from_world = np.linalg.inv(cycles.world_from_camera(site, site.stations[station], side))
    local = points_m @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    return cv2.projectPoints(local, np.zeros(3), np.zeros(3), camera.K, camera.distortion)[0].reshape(-1, 2)


def corner_errors(photo: np.ndarray, expected: FloatArray) -> FloatArray:
    grey = cv2.cvtColor(photo, cv2.COLOR_RGB2GRAY)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)
    found = cv2.cornerSubPix(grey, expected.astype(np.float32).reshape(-1, 1, 2).copy(), (5, 5), (-1, -1), criteria)
    return found.reshape(-1, 2) - expected


@pytest.fixture(scope="module")
def boards_only(site: Scene) -> Scene:
    boards = tuple(decal for decal in site.decals if decal.name.startswith("board"))
    return replace(site, bodies=(), decals=boards)


@pytest.mark.parametrize("side", cycles.SIDES)
def test_chessboard_corners_over_the_whole_frame_lie_where_opencv_projects_them(boards_only: Scene, side: str) -> None:
    photo = cycles.render(boards_only, boards_only.stations[1], side, samples=8)
    camera: CameraTruth = boards_only.rig.left if side == "left" else boards_only.rig.right
    size = np.array([camera.width_px, camera.height_px])
    places, errors = [], []
    for decal in boards_only.decals:
        expected = projected(boards_only, side, 1, handmade.checker_corners(decal))
        inside = expected[np.all((expected > 8) & (expected < size - 9), axis=1)]
        error = corner_errors(photo, inside)
        assert np.abs(error.mean(axis=0)).max() < LIMIT_PX, decal.name
        places.append(inside)
        errors.append(error)
    every = np.concatenate(places)
    assert len(every) > 200 and (every.min(axis=0) < 40).all() and (every.max(axis=0) > size - 60).all()
    assert np.abs(np.concatenate(errors).mean(axis=0)).max() < 0.02


def test_the_target_is_an_ellipse_of_red_at_its_projected_place(site: Scene) -> None:
    disc = site.stations[0].disc
    assert disc is not None
    lonely = replace(site, bodies=(), decals=(handmade.backdrop(disc),))
    photo = cycles.render(lonely, lonely.stations[0], "left", samples=8).astype(float)
    red = photo[..., 0] - 0.5 * (photo[..., 1] + photo[..., 2])
    rows, columns = np.nonzero(red > 0.4 * red.max())
    around = handmade.disc_outline(disc)
    outline = projected(lonely, "left", 0, around).astype(np.float32)
    centroid = cv2.moments(outline.reshape(-1, 1, 2))
    expected = np.array([centroid["m10"], centroid["m01"]]) / centroid["m00"]
    assert np.abs([columns.mean(), rows.mean()] - expected).max() < 0.1
    assert len(rows) == pytest.approx(centroid["m00"], rel=0.02)


def test_pinhole_canvas_holds_every_ray_of_the_distorted_photo(site: Scene) -> None:
    for camera in (site.rig.left, site.rig.right):
        canvas = canvas_for(camera, 1.25)
        columns, rows = photo_map(camera, canvas)
        assert columns.min() > 4 and rows.min() > 4
        assert columns.max() < canvas.width_px - 5 and rows.max() < canvas.height_px - 5


def test_ideal_camera_needs_no_resampling() -> None:
    ideal = CameraTruth(
        K=np.array([[900.0, 0, 319.5], [0, 900.0, 239.5], [0, 0, 1.0]]),
        distortion=np.zeros(5),
        width_px=640,
        height_px=480,
    )
    canvas = canvas_for(ideal, 1.0)
    assert canvas.blender_shift == pytest.approx((0.0, 0.0), abs=1e-3)
    columns, rows = photo_map(ideal, canvas)
    assert np.allclose(np.diff(columns, axis=1), 1.0, atol=1e-3) and np.allclose(np.diff(rows, axis=0), 1.0, atol=1e-3)


def test_surface_coordinates_run_in_metres_along_and_up_each_face() -> None:
    body = handmade.box("wall", (0, 0, 0), (4.0, 0.3, 2.5), "concrete")
    unfolded = surface_coordinates(body.vertices_m - handmade.ORIGIN_M, body.triangles)
    normals = triangle_normals(body.vertices_m - handmade.ORIGIN_M, body.triangles)
    front = unfolded.uv_m[normals[:, 1] < -0.5].reshape(-1, 2)
    assert front.min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert front.max(axis=0) == pytest.approx([4.0, 2.5], abs=1e-9)


def test_unknown_material_is_named_with_its_body(site: Scene) -> None:
    odd = replace(site, bodies=(replace(site.bodies[0], material="cheese"),), decals=())
    with pytest.raises(KeyError, match="body ground: no material 'cheese'"):
        cycles.Studio(odd)


def test_a_photo_that_is_there_is_not_taken_again(boards_only: Scene, tmp_path: Path) -> None:
    def path_of(station: Station, side: str) -> Path:
        return tmp_path / f"{station.name}_{side}.png"

    for station in boards_only.stations:
        for side in cycles.SIDES:
            path_of(station, side).write_bytes(b"there")
    assert cycles.render_site(boards_only, path_of, lambda path, photo: pytest.fail(f"wrote {path}")) == []
