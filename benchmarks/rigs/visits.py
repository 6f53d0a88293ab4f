"""Untouched visits without pictures: calibrations with real noise, matches with real noise, a hundred times over."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, pack, right_from_left_of
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import rectification
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid, rotation_from_vector, vector_from_rotation
from asbuilt_bim.vision.stereo.rig_fit import fit_rig
from asbuilt_bim.vision.stereo.rig_health import StationHealth
from asbuilt_bim.vision.stereo.rig_matches import MATCHES_PER_MEASUREMENT

SIZE = (1280, 960)
CORNER_PX = 0.1  # what a board's corners were found to on generated boards, and a match across its row
MATCH_PX = 0.1
FOREIGN = 0.12  # of the matches
BOARDS, STATIONS = 18, 5


def true_rig(rng: np.random.Generator) -> StereoRig:
    """Return a rig of the kind that sites are photographed with."""
    sides = []
    for _ in range(2):
        K = np.array([[rng.normal(1055, 5), 0, rng.normal(639.5, 6)], [0, 0, rng.normal(479.5, 6)], [0, 0, 1]])
        K[1, 1] = K[0, 0] + rng.normal(0, 0.7)
        lens = [rng.normal(-0.1, 0.01), rng.normal(0.03, 0.01), *rng.normal(0, 2e-4, 2), 0.0]
        sides.append(Intrinsics(K=frozen(K), distortion=frozen(lens), width_px=SIZE[0], height_px=SIZE[1]))
    turn, shift = np.deg2rad(rng.normal(0, 0.5, 3)), [-0.25, *rng.normal(0, 0.002, 2)]
    return StereoRig(left=sides[0], right=sides[1], right_from_left=frozen(rigid(turn, shift)),
                     covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))))  # fmt: skip


def calibrated(true: StereoRig, rng: np.random.Generator) -> StereoRig:
    """Calibrate a rig from noisy corners of boards held all over the frame, with the program's own adjustment."""
    grid = np.stack([*np.meshgrid(np.arange(8) * 0.08, np.arange(6) * 0.08), np.zeros((6, 8))], axis=-1).reshape(-1, 3)
    views, poses = [], []
    while len(views) < BOARDS:
        turn = rotation_from_vector(rng.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))
        place = rng.uniform([-1.0, -0.8, 1.2], [1.0, 0.8, 2.6])
        pose = rigid(turn, place - turn @ grid.mean(axis=0))
        in_left = apply(pose, grid)
        seen = [true.left.project(in_left), true.right.project(apply(true.right_from_left, in_left))]
        if any((px < 0).any() or (px > np.array(SIZE) - 1).any() for px in seen):
            continue
        left, right = (px + rng.normal(0.0, CORNER_PX, px.shape) for px in seen)
        views.append(
            BoardView(name=str(len(views)), left_points_m=grid, left_px=left, right_points_m=grid, right_px=right)
        )
        poses.append(np.r_[vector_from_rotation(turn), pose[:3, 3]])
    made = adjust(pack(true.left, true.right, true.right_from_left), np.array(poses), views)
    return StereoRig(
        left=camera_of(made.shared, 0, SIZE), right=camera_of(made.shared, 1, SIZE),
        right_from_left=right_from_left_of(made.shared),
        covariance=rig_covariance(made), rms_px=made.rms_px, views_used=BOARDS,
    )  # fmt: skip


def visit(true: StereoRig, used: StereoRig, rng: np.random.Generator) -> list[StationHealth]:
    """Return what the stations of one visit say of the calibrated rig, each of a scene of its own."""
    prepared = rectification(used)
    found = []
    for number in range(STATIONS):
        points = _scene(rng)
        photos = true.left.project(points), true.right.project(apply(true.right_from_left, points))
        inside = np.all([((p > 0) & (p < np.array(SIZE) - 1)).all(axis=1) for p in photos], axis=0)
        keep = rng.permutation(np.flatnonzero(inside))[: rng.integers(300, 900)]
        rectified = []
        for photo, lens, turn in zip(
            photos, (used.left, used.right), (prepared.camera.rectified_from_left, prepared.rectified_from_right),
            strict=True,
        ):  # fmt: skip
            rays = lens.rays(photo[keep] + rng.normal(0.0, MATCH_PX / np.sqrt(2), (len(keep), 2))) @ turn.T
            rectified.append(
                rays[:, :2] / rays[:, 2:] * prepared.camera.f_px + [prepared.camera.cx_px, prepared.camera.cy_px]
            )
        left, right = rectified
        foreign = rng.random(len(keep)) < FOREIGN
        right[foreign] += rng.uniform([-25, -6], [25, 6], (int(foreign.sum()), 2))
        fit = fit_rig(left, right, prepared.camera, used, MATCHES_PER_MEASUREMENT)
        if fit is not None:
            found.append(StationHealth(station=f"S{number + 1}", fit=fit, camera=prepared.camera))
    return found


def rigs(count: int, seed: int) -> Iterator[tuple[StereoRig, StereoRig, np.random.Generator]]:
    """Give true rigs, each with a calibration of its own."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        true = true_rig(rng)
        yield true, calibrated(true, rng), rng


def _scene(rng: np.random.Generator) -> FloatArray:
    """Return points (N, 3) on the ground, on one or two walls, and far away, in the left frame."""
    n = 900
    ground = np.c_[rng.uniform(-6, 6, n), np.full(n, rng.uniform(1.2, 1.7)), rng.uniform(2.5, 15, n)]
    walls = []
    for _ in range(rng.integers(1, 3)):
        along = rng.uniform(-3, 3, n)
        yaw, away = rng.uniform(-0.9, 0.9), rng.uniform(3.5, 8)
        walls.append(np.c_[along * np.cos(yaw), rng.uniform(-2.5, 1.5, n), away + along * np.sin(yaw)])
    far = rng.uniform([-25, -12, 10], [25, 2, 50], (n, 3))
    points = np.concatenate([ground, *walls, far])
    return points[points[:, 2] > 1.0]
