"""A pose that would put a marker into the camera's own plane is no pose, and no error either."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register import solve
from asbuilt_bim.register.solve import Sighted, solve_pose
from tests.match.small_site import CAMERA

SQUARE_PX = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]])


def test_a_marker_beside_the_camera_gives_no_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    beside = np.array([[1.0, 1.0, 1e-9], [1.3, 1.0, 2e-9], [1.3, 0.7, 1e-9], [1.0, 0.7, 3e-9]])
    seen = Sighted(
        name="0", world_m=frozen(beside), left_px=frozen(SQUARE_PX + 200.0), right_px=frozen(SQUARE_PX + 180.0),
        sigma_px=0.2, sigma_m=0.002,
    )  # fmt: skip
    monkeypatch.setattr(solve, "_start", lambda *_: np.eye(4))
    assert solve_pose(CAMERA, [seen]) is None
