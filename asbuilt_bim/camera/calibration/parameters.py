"""The numbers that an adjustment moves: two cameras and their relative pose as one vector, and corners from it.

Shared parameters (S,): of each camera fx fy cx cy and its lens's coefficients, left first; then the rotation vector and
the translation of right_from_left. How many there are tells the lens model.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import COEFFICIENTS, LENS_MODELS, LensModel
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, freeze, frozen
from asbuilt_bim.geometry.transform import rigid, vector_from_rotation

_PINHOLE = 4  # fx fy cx cy
_POSE = 6
CORNER_SIGMA_PX = 0.1  # what a corner is usually good for, to weigh the prior against corners
_LENS_PRIOR: dict[LensModel, tuple[float, ...]] = {
    "five": (1.0, 0.5, 0.02, 0.02, 0.25),
    "rational": (1.0, 0.5, 0.02, 0.02, 0.25, 1.0, 0.5, 0.25),
    "fisheye": (0.3, 0.3, 0.3, 0.3),
}
"""Sigma of the coefficients before any photo is seen: what lenses of each kind have. It keeps the higher terms from
running wild in the parts of the frame that no board covered, and weighs nothing where boards do."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardView:
    """One pair of photos of the board: the corners (N, 3), (M, 3) in metres on it, and their pixels in each photo."""

    name: str
    left_points_m: FloatArray
    left_px: FloatArray
    right_points_m: FloatArray
    right_px: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Where what stands among the shared parameters of rigs with one model of lens."""

    lens: LensModel

    @property
    def camera(self) -> int:
        """Return how many numbers a camera has."""
        return _PINHOLE + COEFFICIENTS[self.lens]

    @property
    def shared(self) -> int:
        """Return how many shared parameters there are."""
        return 2 * self.camera + _POSE

    @property
    def rig_rows(self) -> IntArray:
        """Return where the numbers of `StereoRig.covariance` stand (S,): pinholes, pose, the left and right lens."""
        pinhole, lens = np.arange(_PINHOLE), np.arange(_PINHOLE, self.camera)
        rows = np.concatenate(
            [pinhole, self.camera + pinhole, 2 * self.camera + np.arange(_POSE), lens, self.camera + lens]
        )
        return freeze(rows.astype(np.int32))

    def prior_weight(self, sigma_px: float = CORNER_SIGMA_PX) -> FloatArray:
        """Return the weights (S,) that draw lenses to none, beside corners of this sigma; zero for all else."""
        lens = (sigma_px / np.array(_LENS_PRIOR[self.lens])) ** 2
        return np.concatenate([*[np.r_[np.zeros(_PINHOLE), lens]] * 2, np.zeros(_POSE)])

    def of_side(self, side: int) -> BoolArray:
        """Say which parameters (S,) are the left (0) or right (1) camera's."""
        mask = np.zeros(self.shared, dtype=bool)
        mask[side * self.camera : (side + 1) * self.camera] = True
        return mask


_LAYOUTS = {layout.shared: layout for layout in (Layout(lens=lens) for lens in LENS_MODELS)}


def layout_of(shared: FloatArray) -> Layout:
    """Return the layout of shared parameters (S,), from their number."""
    return _LAYOUTS[len(shared)]


def pack(left: Intrinsics, right: Intrinsics, right_from_left: FloatArray) -> FloatArray:
    """Write two cameras with one model of lens and their relative pose as the shared parameters (S,)."""
    cameras = [np.r_[c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], c.distortion] for c in (left, right)]
    turn = vector_from_rotation(right_from_left[:3, :3])
    packed: FloatArray = np.concatenate([*cameras, turn, right_from_left[:3, 3]])
    return packed


def camera_of(shared: FloatArray, side: int, size: tuple[int, int]) -> Intrinsics:
    """Read the left (0) or right (1) camera out of the shared parameters."""
    fx, fy, cx, cy, *distortion = shared[layout_of(shared).of_side(side)]
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(distortion), width_px=size[0], height_px=size[1])


def right_from_left_of(shared: FloatArray) -> FloatArray:
    """Read the relative pose (4, 4) out of the shared parameters."""
    return frozen(rigid(shared[-6:-3], shared[-3:]))


def view_residual(shared: FloatArray, pose: FloatArray, view: BoardView) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a view's residual (R,), and its Jacobians against the shared parameters (R, S) and its pose (R, 6).

    `pose` is left_from_board as rotation vector and translation. Analytic: the chain rule over OpenCV's projection.
    """
    layout = layout_of(shared)
    left, right = shared[layout.of_side(0)], shared[layout.of_side(1)]
    left_px, left_pose, left_camera = _project(view.left_points_m, pose[:3], pose[3:], left)
    turn, shift, *parts = cv2.composeRT(
        pose[:3, None].copy(), pose[3:, None].copy(), shared[-6:-3, None].copy(), shared[-3:, None].copy()
    )
    right_px, right_pose, right_camera = _project(view.right_points_m, _flat(turn), _flat(shift), right)
    composed = np.empty((2, _POSE, _POSE))  # of the board's pose and of the rig's: turn and shift of both together
    for k, part in enumerate(parts):  # r1 t1 r2 t2 of the turn, then of the shift
        rows, columns = 3 * (k // 4), 3 * (k % 2)
        composed[(k // 2) % 2, rows : rows + 3, columns : columns + 3] = part
    by_board, by_rig = right_pose @ composed[0], right_pose @ composed[1]
    n, m = len(left_px), len(right_px)
    by_shared = np.zeros((n + m, layout.shared))
    by_shared[:n, : layout.camera], by_shared[n:, layout.camera : -_POSE] = left_camera, right_camera
    by_shared[n:, -_POSE:] = by_rig
    residual = np.concatenate([left_px - view.left_px.ravel(), right_px - view.right_px.ravel()])
    return residual, by_shared, np.concatenate([left_pose, by_board])


def _flat(vector: object) -> FloatArray:
    return np.array(vector, dtype=np.float64).ravel()


def _project(
    points: FloatArray, turn: FloatArray, shift: FloatArray, camera: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pixels (2 N,), and their Jacobians by the pose (2 N, 6) and by the camera (2 N, C)."""
    if not len(points):
        return np.zeros(0), np.zeros((0, _POSE)), np.zeros((0, len(camera)))
    K = np.array([[camera[0], 0.0, camera[2]], [0.0, camera[1], camera[3]], [0.0, 0.0, 1.0]])
    at, lens = points.reshape(-1, 1, 3).copy(), camera[_PINHOLE:].copy()
    if len(lens) == COEFFICIENTS["fisheye"]:
        pixels, jacobian = cv2.fisheye.projectPoints(at, turn, shift, K, lens)
        by = np.asarray(jacobian, dtype=np.float64)  # f c k, rotation, translation, skew
        return np.asarray(pixels, dtype=np.float64).ravel(), by[:, 8:14], by[:, :8]
    pixels, jacobian = cv2.projectPoints(at, turn, shift, K, lens)
    by = np.asarray(jacobian, dtype=np.float64)  # rotation, translation, f c k
    return np.asarray(pixels, dtype=np.float64).ravel(), by[:, :6], by[:, 6 : 6 + len(camera)]
