"""Rigs that other programs wrote: OpenCV's FileStorage, YAML or XML, under the names in common use."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.camera.rig_file import rig_problems
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_NAMES = {
    "K_left": ("K1", "M1", "cameraMatrix1", "camera_matrix_1", "left_camera_matrix", "LEFT.K"),
    "D_left": ("D1", "dist1", "distCoeffs1", "dist_coeffs_1", "left_distortion", "LEFT.D"),
    "K_right": ("K2", "M2", "cameraMatrix2", "camera_matrix_2", "right_camera_matrix", "RIGHT.K"),
    "D_right": ("D2", "dist2", "distCoeffs2", "dist_coeffs_2", "right_distortion", "RIGHT.D"),
    "R": ("R", "rotation"),
    "T": ("T", "translation"),
}


def read_opencv_rig(paths: Sequence[Path], size_px: tuple[int, int], metres_per_unit: float = 1.0) -> StereoRig:
    """Read a rig from OpenCV YAML or XML files, such as `stereo.yml` or `intrinsics.yml` with `extrinsics.yml`.

    Those files don't say how large the photos are (`size_px`: width, height) nor in which unit T is
    (`metres_per_unit`: 0.001 for millimetres). Their covariance isn't known and stays zero.

    Raises: RigError with what is missing, or where the rig can't be right.
    """
    found: dict[str, FloatArray] = {}
    for path in paths:
        found |= _matrices(path)
    files = ", ".join(str(path) for path in paths)
    missing = [f"{key} (as {', '.join(_NAMES[key][:3])})" for key in _NAMES if key not in found]
    if missing:
        raise RigError(f"rig file {files}: OpenCV matrices are missing: {'; '.join(missing)}")
    turn = found["R"] if found["R"].shape == (3, 3) else found["R"].reshape(-1)[:3]
    rig = StereoRig(
        left=_camera(found["K_left"], found["D_left"], size_px),
        right=_camera(found["K_right"], found["D_right"], size_px),
        right_from_left=frozen(rigid(turn, found["T"].reshape(-1)[:3] * metres_per_unit)),
        covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))),
    )
    problems = rig_problems(rig)
    if problems:
        raise RigError(f"rig file {files}:\n  " + "\n  ".join(problems))
    return rig


def _camera(K: FloatArray, distortion: FloatArray, size_px: tuple[int, int]) -> Intrinsics:
    lens = distortion.ravel()
    padded = np.zeros(5 if len(lens) <= 5 else 8)
    padded[: min(len(lens), 8)] = lens[:8]
    if np.any(lens[8:]):
        raise RigError("rig file: thin-prism and tilted lenses (12 or 14 coefficients) are not read; calibrate here")
    return Intrinsics(K=frozen(K), distortion=frozen(padded), width_px=size_px[0], height_px=size_px[1])


def _matrices(path: Path) -> dict[str, FloatArray]:
    """Return the matrices of one file under our names."""
    try:
        text = path.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise RigError(f"rig file {path}: it can't be read ({error.strerror or error})") from error
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except cv2.error as error:
        raise RigError(f"rig file {path}: OpenCV can't read it ({error.err})") from error
    matrices: dict[str, FloatArray] = {}
    for ours, theirs in _NAMES.items():
        for name in theirs:
            node = storage.getNode(name)
            matrix = node.mat() if not node.empty() and node.isMap() else None
            if matrix is not None:
                matrices[ours] = np.asarray(matrix, dtype=np.float64)
                break
    storage.release()
    return matrices
