"""The numbers that a rig's covariance is about, and where both photos' pixels point to when one of them moves."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import bend
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, vector_from_rotation

_STEP = 1e-5
_PINHOLE = 4


def rig_numbers(rig: StereoRig) -> FloatArray:
    """Return the rig as the numbers (P,) that its covariance (P, P) is about."""
    pinhole = [camera.K[i, j] for camera in (rig.left, rig.right) for i, j in ((0, 0), (1, 1), (0, 2), (1, 2))]
    pose = rig.right_from_left
    numbers: list[FloatArray] = [np.array(pinhole), vector_from_rotation(pose[:3, :3]), pose[:3, 3]]
    if rig.knows_lenses:
        numbers += [rig.left.distortion, rig.right.distortion]
    return np.concatenate(numbers)


def with_numbers(rig: StereoRig, numbers: FloatArray) -> StereoRig:
    """Return a rig of other numbers (P,), in the order of `rig_numbers`."""
    cameras = []
    lens = len(PARAMETERS)
    for side, camera in enumerate((rig.left, rig.right)):
        K = np.array(camera.K)
        K[[0, 1, 0, 1], [0, 1, 2, 2]] = numbers[_PINHOLE * side : _PINHOLE * (side + 1)]
        distortion = camera.distortion
        if rig.knows_lenses:
            distortion = frozen(numbers[lens : lens + len(distortion)])
            lens += len(distortion)
        cameras.append(replace(camera, K=frozen(K), distortion=distortion))
    pose = rigid(numbers[len(PARAMETERS) - 6 : len(PARAMETERS) - 3], numbers[len(PARAMETERS) - 3 : len(PARAMETERS)])
    return replace(rig, left=cameras[0], right=cameras[1], right_from_left=frozen(pose))


def in_pixels(rig: StereoRig) -> np.ndarray:
    """Say which of the numbers (P,) are counted in pixels."""
    which = np.zeros(len(rig.covariance), dtype=bool)
    which[: len(PARAMETERS)] = [name.startswith(("f", "c")) for name in PARAMETERS]
    return which


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenPoints:
    """Points as both photos show them: rays (N, 2) as x/z and y/z of each camera, and their slopes (N, 2, P)."""

    rig: StereoRig
    left: FloatArray
    right: FloatArray
    left_slopes: FloatArray
    right_slopes: FloatArray

    def rays(self, change: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return rays (N, 3), (N, 3) of the left and the right camera, and right_from_left, after a change (P,).

        The pixels of the photos stay; the rig's numbers change.
        """
        left = np.ones((len(self.left), 3))
        right = np.ones((len(self.right), 3))
        left[:, :2] = self.left + self.left_slopes @ change
        right[:, :2] = self.right + self.right_slopes @ change
        at = len(PARAMETERS) - 6
        pose = np.array(self.rig.right_from_left)
        turned = vector_from_rotation(pose[:3, :3]) + change[at : at + 3]
        pose[:3, :3], pose[:3, 3] = rotation_from_vector(turned), pose[:3, 3] + change[at + 3 : at + 6]
        return left, right, pose


def seen_points(rig: StereoRig, left_xy: FloatArray, right_xy: FloatArray) -> SeenPoints:
    """Prepare points that stand at x/z, y/z (N, 2), (N, 2) in each camera's own frame."""
    slopes = []
    for side, (camera, xy) in enumerate(((rig.left, left_xy), (rig.right, right_xy))):
        own = np.zeros((len(xy), 2, len(rig.covariance)))
        found = _ray_slopes(camera, xy)
        own[:, :, _PINHOLE * side : _PINHOLE * (side + 1)] = found[:, :, :_PINHOLE]
        if rig.knows_lenses:
            start = len(PARAMETERS) + (0 if side == 0 else len(rig.left.distortion))
            own[:, :, start : start + len(camera.distortion)] = found[:, :, _PINHOLE:]
        slopes.append(own)
    return SeenPoints(rig=rig, left=left_xy, right=right_xy, left_slopes=slopes[0], right_slopes=slopes[1])


def _ray_slopes(camera: Intrinsics, xy: FloatArray) -> FloatArray:
    """Return how x/z, y/z (N, 2) of fixed pixels change with fx, fy, cx, cy and the lens's coefficients (N, 2, 4 + C).

    A pixel is f bend(xy) + c: what moves it by a number, the ray makes up for.
    """
    focal = camera.K[[0, 1], [0, 1]]
    bent = bend(camera.distortion, xy)
    moved = np.zeros((len(xy), 2, _PINHOLE + len(camera.distortion)))  # of the bent coordinates
    moved[:, 0, 0], moved[:, 1, 1] = bent[:, 0] / focal[0], bent[:, 1] / focal[1]
    moved[:, 0, 2], moved[:, 1, 3] = 1.0 / focal
    for k, step in enumerate(_STEP * np.eye(len(camera.distortion))):
        moved[:, :, _PINHOLE + k] = (bend(camera.distortion + step, xy) - bend(camera.distortion - step, xy)) / _STEP
    moved[:, :, _PINHOLE:] *= 0.5
    across = [
        (bend(camera.distortion, xy + step) - bend(camera.distortion, xy - step)) / (2 * _STEP)
        for step in _STEP * np.eye(2)
    ]
    by_ray = np.stack(across, axis=-1)
    return np.asarray(-np.linalg.solve(by_ray, moved), dtype=np.float64)
