from __future__ import annotations

import itertools

import cv2
import numpy as np

from asbuilt_bim.vision.target.red import red_blobs


def test_a_whole_disc_is_not_crowded_out_by_large_odd_things() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    for x, y in itertools.product((30, 120, 210, 300, 390, 480), (20, 190)):
        cv2.line(score, (x, y), (x + 70, y + 140), 0.5, 14)
        cv2.line(score, (x + 70, y), (x, y + 140), 0.5, 14)
    cv2.circle(score, (320, 400), 20, 0.9, -1)
    blobs = red_blobs(score)
    assert len(blobs) == 9 and sum(blob.elliptic < 0.8 for blob in blobs) == 8
    assert abs(blobs[0].box_px[0] - 300) < 3 and abs(blobs[0].box_px[2] - 41) < 4


def test_a_disc_that_a_bar_cuts_in_two_leaves_both_pieces() -> None:
    score = np.zeros((480, 640), dtype=np.float32)
    cv2.circle(score, (320, 240), 24, 0.9, -1)
    score[:, 315:324] = 0.0
    boxes = sorted(blob.box_px for blob in red_blobs(score))
    assert [box[0] < 315 for box in boxes] == [True, False]
