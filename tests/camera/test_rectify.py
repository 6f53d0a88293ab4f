from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.lens import LENS_MODELS, LensModel
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import PhotoError, RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import apply, rigid
from tests.camera.virtual import rig

POINTS = np.random.default_rng(1).uniform([-2, -1.5, 3], [2, 1.5, 9], (300, 3))


def in_right(prepared, points):  # type: ignore[no-untyped-def]
    turned = apply(rig().right_from_left, points) @ prepared.rectified_from_right.T
    camera = prepared.camera
    return camera.f_px * turned[:, :2] / turned[:, 2:] + [camera.cx_px, camera.cy_px]


def disparity_of(camera, points):  # type: ignore[no-untyped-def]
    return camera.f_px * camera.baseline_m / (points @ camera.rectified_from_left[2])


def test_rows_correspond_and_disparity_is_f_b_over_z() -> None:
    prepared = rectification(rig())
    left, right = prepared.camera.project(POINTS), in_right(prepared, POINTS)
    assert np.abs(left[:, 1] - right[:, 1]).max() < 1e-9
    assert np.abs(left[:, 0] - right[:, 0] - disparity_of(prepared.camera, POINTS)).max() < 1e-9


def test_pixel_and_disparity_give_the_point_back() -> None:
    camera = rectification(rig()).camera
    assert np.abs(camera.points(camera.project(POINTS), disparity_of(camera, POINTS)) - POINTS).max() < 1e-9


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_maps_lead_to_where_the_lens_shows_the_point_to_a_twentieth_of_a_pixel(lens: LensModel) -> None:
    one = rig(lens)
    prepared = rectification(one)
    for maps, valid, at, seen in (
        (prepared.left_map, prepared.valid_left, prepared.camera.project(POINTS), one.left.project(POINTS)),
        (
            prepared.right_map,
            prepared.valid_right,
            in_right(prepared, POINTS),
            one.right.project(apply(one.right_from_left, POINTS)),
        ),
    ):
        x, y = at.astype(np.float32).T
        inside = (x > 1) & (y > 1) & (x < maps.shape[1] - 2) & (y < maps.shape[0] - 2)
        found = cv2.remap(np.array(maps), x[:, None], y[:, None], cv2.INTER_LINEAR)[:, 0]
        assert np.count_nonzero(inside) > 250
        assert np.abs(found - seen)[inside].max() < 0.05
        assert valid[y[inside].astype(int), x[inside].astype(int)].all()


def test_a_polynomial_that_folds_back_shows_nothing_twice() -> None:
    """k1 = -0.5 folds back at tan 0.816; what lies further out would come a second time from within the photo."""
    one = rig()
    left = replace(one.left, distortion=frozen([-0.5, 0.0, 0.0, 0.0, 0.0]))
    prepared = rectification(replace(one, left=left))
    camera = prepared.camera
    rows, columns = np.nonzero(prepared.valid_left)
    rays = camera.rays(np.stack([columns, rows], axis=-1))
    assert np.linalg.norm(rays[:, :2] / rays[:, 2:], axis=1).max() < 0.82


def test_every_pixel_of_both_photos_is_in_the_frame() -> None:
    prepared = rectification(rig())
    for maps, valid in ((prepared.left_map, prepared.valid_left), (prepared.right_map, prepared.valid_right)):
        for corner in ([0, 0], [1279, 0], [1279, 959], [0, 959], [640, 0], [0, 480]):
            assert np.linalg.norm(maps - np.array(corner, np.float32), axis=-1).min() < 1.0
        assert not valid[0].all() and valid[valid.shape[0] // 2, valid.shape[1] // 2]


def test_rectified_pictures_of_one_texture_correspond_row_by_row() -> None:
    prepared = rectification(rig())
    yy, xx = np.mgrid[0:960, 0:1280]
    smooth = np.stack([127 + 100 * np.sin(xx / 37.0) * np.sin(yy / 29.0)] * 3, axis=-1).astype(np.uint8)
    pair = rectify(prepared, smooth, smooth, "A")
    at = prepared.left_map[500, 700]
    expected = 127 + 100 * np.sin(at[0] / 37.0) * np.sin(at[1] / 29.0)
    assert pair.left[500, 700, 0] == pytest.approx(expected, abs=2.0)
    assert (pair.left[~pair.valid_left] == 0).all()


def test_a_picture_of_another_size_is_refused() -> None:
    small = np.zeros((480, 640, 3), np.uint8)
    with pytest.raises(PhotoError, match="station A: the left photo has 640 x 480 pixels, the rig 1280 x 960"):
        rectify(rectification(rig()), small, small, "A")


def test_a_rig_with_left_and_right_swapped_is_refused() -> None:
    one = rig()
    swapped = StereoRig(
        left=one.left,
        right=one.right,
        right_from_left=frozen(rigid(np.eye(3), [0.25, 0, 0])),
        covariance=one.covariance,
    )
    with pytest.raises(RigError, match="left and right look swapped"):
        rectification(swapped)
