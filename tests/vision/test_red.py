from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.vision.red import red_blobs


def test_a_whole_disc_is_not_crowded_out_by_what_pairs_of_red_pieces_make() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    for x in (30, 120, 210, 300, 390, 480):  # brick walls between windows: each two of them have an elliptic hull
        cv2.ellipse(score, (x + 40, 150), (38, 120), 0, 0, 360, 0.5, -1)
    cv2.circle(score, (320, 400), 20, 0.9, -1)
    blobs = red_blobs(score, 8)
    assert sum(blob.joined for blob in blobs) >= 4
    assert any(abs(blob.box_px[0] - 300) < 3 and abs(blob.box_px[2] - 41) < 4 for blob in blobs)
