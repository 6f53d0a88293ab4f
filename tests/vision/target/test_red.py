from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.vision.target.red import red_blobs, redness


def test_a_whole_disc_is_not_crowded_out_by_what_pairs_of_red_pieces_make() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    for x in (30, 120, 210, 300, 390, 480):  # brick walls between windows: each two of them have an elliptic hull
        cv2.ellipse(score, (x + 40, 150), (38, 120), 0, 0, 360, 0.5, -1)
    cv2.circle(score, (320, 400), 20, 0.9, -1)
    blobs = red_blobs(np.zeros((480, 640, 3), dtype=np.uint8), score, 8)
    assert sum(blob.joined for blob in blobs) >= 4
    assert any(abs(blob.box_px[0] - 300) < 3 and abs(blob.box_px[2] - 41) < 4 for blob in blobs)


def test_a_disc_before_something_as_red_in_another_light_is_a_blob_of_its_own() -> None:
    image = np.full((480, 640, 3), 90, dtype=np.uint8)
    cv2.rectangle(image, (300, 240), (360, 420), (20, 20, 120), -1)
    cv2.ellipse(image, (325, 230), (20, 36), 20, 0, 360, (30, 30, 200), -1)
    blobs = red_blobs(image, redness(image), 8)
    assert any(abs(blob.area_px - np.pi * 20 * 36) < 150 and blob.elliptic > 0.95 for blob in blobs)
