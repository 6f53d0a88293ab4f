from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.vision.target.red import red_blobs


def test_a_whole_disc_is_not_crowded_out_by_large_odd_things() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    for x in (30, 120, 210, 300, 390, 480):
        cv2.line(score, (x, 60), (x + 70, 200), 0.5, 14)
        cv2.line(score, (x + 70, 60), (x, 200), 0.5, 14)
    cv2.circle(score, (320, 400), 20, 0.9, -1)
    blobs = red_blobs(score, 8)
    assert len(blobs) == 5 and sum(blob.elliptic < 0.8 for blob in blobs) == 4
    assert abs(blobs[0].box_px[0] - 300) < 3 and abs(blobs[0].box_px[2] - 41) < 4


def test_a_disc_that_a_bar_cuts_in_two_leaves_both_pieces() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    cv2.circle(score, (320, 240), 24, 0.9, -1)
    score[:, 315:324] = 0.0
    boxes = sorted(blob.box_px for blob in red_blobs(score, 8))
    assert [box[0] < 315 for box in boxes] == [True, False]
