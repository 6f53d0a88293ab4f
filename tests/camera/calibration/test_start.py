from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.pairing import median_relative
from asbuilt_bim.camera.calibration.parameters import layout_of, pack
from asbuilt_bim.camera.calibration.start import start_camera
from asbuilt_bim.camera.calibration.zhang import first_estimate, pose_vectors
from asbuilt_bim.camera.lens import LENS_MODELS, LensModel
from tests.camera.virtual import SIZE, parameters, rig, views


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_boards_alone_give_the_rig_with_every_lens_and_its_sigma_holds(lens: LensModel) -> None:
    true = rig(lens)
    seen, _ = views(true, 14, 0.1, seed=1)
    kept, left, right, poses = first_estimate(seen, SIZE, lens, [])
    assert len(kept) == 14 and left.lens == lens
    found = adjust(pack(left, right, median_relative(poses)), pose_vectors(poses), kept)
    rows = layout_of(found.shared).rig_rows[:14]
    error = found.shared[rows] - parameters(true)
    score = error @ np.linalg.solve(rig_covariance(found)[:14, :14], error)
    assert score < 36.1  # 14 degrees of freedom: one in a thousand is larger
    assert found.rms_px == pytest.approx(0.1 * np.sqrt(2), rel=0.1)


def test_focal_lengths_are_tried_where_zhangs_method_gives_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    true = rig()
    seen, _ = views(true, 8, 0.1, seed=1)
    corners = [(view.left_points_m, view.left_px) for view in seen]
    good, _, _ = start_camera(corners, SIZE, "five")

    def fails(*_: object) -> None:
        raise cv2.error("no camera")

    def nonsense(points: object, pixels: object, size: object, *_: object) -> object:
        K = np.array([[90.0, 0.0, 10.0], [0.0, 9000.0, 10.0], [0.0, 0.0, 1.0]])
        still = [np.array([[0.0], [0.0], [1.0]])] * len(seen)
        return 1e3, K, np.zeros(5), [np.zeros((3, 1))] * len(seen), still

    for bad in (fails, nonsense):
        monkeypatch.setattr(cv2, "calibrateCamera", bad)
        found, _, rms = start_camera(corners, SIZE, "five")
        assert abs(found.K[0, 0] - good.K[0, 0]) < 1.0 and np.median(rms) < 0.2
