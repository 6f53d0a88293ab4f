"""Draws a stereo rig that is not perfect: lenses with distortion, a right camera slightly turned."""

from __future__ import annotations

import numpy as np

from asbuilt_synthetic.model import CameraTruth, FloatArray, RigTruth

WIDTH_PX, HEIGHT_PX = 1280, 960


def rig_truth(seed: int) -> RigTruth:
    """Draw the rig of a seed: f about 1050 px, baseline 0.25 m within 1.5 mm."""
    rng = np.random.default_rng([seed, 6])
    f = rng.uniform(1032, 1078)
    centre = np.array([0.25 + rng.uniform(-0.0015, 0.0015), *rng.uniform(-0.002, 0.002, 2)])
    turn = np.deg2rad(rng.uniform(0.2, 0.6, 3) * rng.choice([-1, 1], 3))
    right_from_left = np.eye(4)
    right_from_left[:3, :3] = rotation(turn)
    right_from_left[:3, 3] = -right_from_left[:3, :3] @ centre
    return RigTruth(left=_camera(rng, f), right=_camera(rng, f + rng.uniform(-6, 6)), right_from_left=right_from_left)


def rotation(turn_rad: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector."""
    angle = float(np.linalg.norm(turn_rad))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn_rad / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def _camera(rng: np.random.Generator, f_px: float) -> CameraTruth:
    fx, fy = f_px, f_px * (1 + rng.uniform(-8e-4, 8e-4))
    cx, cy = (WIDTH_PX - 1) / 2 + rng.uniform(-12, 12), (HEIGHT_PX - 1) / 2 + rng.uniform(-12, 12)
    k1 = rng.uniform(-0.15, -0.05)
    distortion = np.array([k1, -0.35 * k1 * rng.uniform(0.4, 1.2), *rng.uniform(-4e-4, 4e-4, 2), 0.0])
    return CameraTruth(
        K=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]),
        distortion=distortion,
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
    )
