"""Masks written as COCO lie on the original photo, around pixel areas, with their holes."""

from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.report.coco import LabelledPhoto, coco_document, labelled
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource

K = frozen([[500.0, 0.0, 160.0], [0.0, 500.0, 120.0], [0.0, 0.0, 1.0]])
PLAIN = Intrinsics(K=K, distortion=frozen(np.zeros(5)), width_px=320, height_px=240)
BENT = Intrinsics(K=K, distortion=frozen([-0.25, 0.1, 0.001, -0.001, 0.0]), width_px=320, height_px=240)
CAMERA = RectifiedCamera(
    f_px=500.0, cx_px=160.0, cy_px=120.0, baseline_m=0.25, width_px=320, height_px=240, rectified_from_left=np.eye(3)
)


def document(mask: np.ndarray, photo: Intrinsics = PLAIN) -> dict:
    instance = Instance(label="column", score=0.87654, mask=mask, box_px=(0, 0, 1, 1), source=InstanceSource.GEOMETRY)
    one = labelled(instance, photo, CAMERA)
    return coco_document([LabelledPhoto(file_name="v/A1_left.jpg", width_px=320, height_px=240, instances=(one,))])


def rectangle() -> np.ndarray:
    mask = np.zeros((240, 320), bool)
    mask[40:200, 100:180] = True
    return mask


def drawn(segmentation: list[list[float]]) -> np.ndarray:
    """The pixels whose centres a COCO polygon holds, drawn ten times as large."""
    canvas = np.zeros((2400, 3200), np.uint8)
    for flat in segmentation:
        points = np.round(np.array(flat).reshape(-1, 1, 2) * 10 - 0.5).astype(np.int32)
        cv2.fillPoly(canvas, [points], 1)
    return canvas[5::10, 5::10] > 0


def test_a_rectangle_keeps_its_pixels_to_within_a_border() -> None:
    (found,) = document(rectangle())["annotations"]
    x, y, width, height = found["bbox"]
    assert abs(x - 100) + abs(y - 40) + abs(width - 80) + abs(height - 160) < 2.0
    assert abs(found["area"] / (80 * 160) - 1) < 0.01
    assert np.count_nonzero(drawn(found["segmentation"]) ^ rectangle()) < 2 * (80 + 160)
    assert (found["category_id"], found["score"], found["iscrowd"]) == (2, 0.877, 0)


def test_a_hole_stays_a_hole() -> None:
    mask = rectangle()
    mask[100:140, 120:160] = False
    (found,) = document(mask)["annotations"]
    (ring,) = found["segmentation"]
    assert not drawn([ring])[105:135, 125:155].any()
    assert abs(found["area"] / (80 * 160 - 40 * 40) - 1) < 0.02


def test_two_parts_are_two_polygons_and_crumbs_are_none() -> None:
    mask = rectangle()
    mask[110:130] = False
    mask[5:8, 5:8] = True
    (found,) = document(mask)["annotations"]
    assert len(found["segmentation"]) == 2


def test_the_lens_bends_the_rings_back_onto_the_original_photo() -> None:
    (found,) = document(rectangle(), BENT)["annotations"]
    expected = BENT.project(CAMERA.rays(np.array([[99.5, 39.5], [179.5, 199.5]]))) + 0.5
    ring = np.array(found["segmentation"][0]).reshape(-1, 2)
    for corner in expected:
        assert np.linalg.norm(ring - corner, axis=1).min() < 0.8


def test_images_and_categories_are_named() -> None:
    whole = document(rectangle())
    assert whole["images"] == [{"id": 1, "file_name": "v/A1_left.jpg", "width": 320, "height": 240}]
    assert [c["name"] for c in whole["categories"]] == ["wall", "column"]
