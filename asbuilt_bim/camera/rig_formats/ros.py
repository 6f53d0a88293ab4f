"""Rigs as ROS keeps them: a camera_info file of each camera, the baseline in the right one's projection matrix."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import rectification
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import MODEL_NAMES, lens_coefficients
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import RigError, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_FOCAL_SHARE, _ROWS_PX = 1e-4, 0.01
"""By rounding alone: rectification gives both cameras one focal length and one row."""
_KEYS = {
    "K": (("camera_matrix", "K", "k"), 9),
    "R": (("rectification_matrix", "R", "r"), 9),
    "P": (("projection_matrix", "P", "p"), 12),
}


def is_camera_info(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is a camera_info: a calibration file, or a message as `rostopic echo` shows it."""
    return isinstance(document, Mapping) and "distortion_model" in document and _first(document, "P") is not None


def ros_rig(left: Mapping[str, Plain], right: Mapping[str, Plain], where: str) -> StereoRig:
    """Make a rig of two camera_info documents.

    Rectification turns each camera by its R; then the right one stands at (-P[0, 3] / P[0, 0], 0, 0) of the left.

    Raises: RigError for what isn't there, and for files whose projection holds no baseline.
    Reference: ROS sensor_msgs/CameraInfo.
    """
    _refuse_projections(left, right, where)
    cameras, turns, shifts = [], [], []
    for side, document in (("left", left), ("right", right)):
        camera, turn, shift = _camera(document, f"{where}: {side}")
        cameras.append(camera)
        turns.append(turn)
        shifts.append(shift)
    if shifts[1] == shifts[0]:
        raise RigError(
            f"{where}: both projection matrices say the same place, so there is no baseline; give a STEREO "
            "calibration's files, left first"
        )
    right_from_left = rigid(turns[1].T @ turns[0], turns[1].T @ [shifts[1] - shifts[0], 0.0, 0.0])
    return rig_of_unknown_sigma(cameras[0], cameras[1], right_from_left)


def _refuse_projections(left: Mapping[str, Plain], right: Mapping[str, Plain], where: str) -> None:
    """Refuse a pair whose projections differ in more than the columns: then its R and P rectify nothing.

    Raises: RigError with the code `RIG_PROJECTIONS_CONTRADICT`.
    """
    first, second = _first(left, "P"), _first(right, "P")
    if first is None or second is None:
        return
    one, two = np.reshape(first, (3, 4)), np.reshape(second, (3, 4))
    focal, rows = abs(one[0, 0] / max(two[0, 0], 1e-9) - 1.0), abs(float(one[1, 2] - two[1, 2]))
    if focal <= _FOCAL_SHARE and rows <= _ROWS_PX:
        return
    subject, focal_px = about(SubjectKind.RIG), (float(one[0, 0]), float(two[0, 0]))
    raise RigError(
        f"{where}: the projection matrices aren't of one rectified pair: focal lengths {one[0, 0]:.2f} and "
        f"{two[0, 0]:.2f} px, rows {rows:.1f} px apart. Take the files of a STEREO calibration, or the camera's own",
        [rejected(Reason.RIG_PROJECTIONS_CONTRADICT, subject, focal_px=focal_px, rows_px=rows)],
    )


def _first(document: Mapping[str, Plain], key: str) -> list[float] | None:
    names, count = _KEYS[key]
    name = next((name for name in names if name in document), None)
    values = numbers(document[name]) if name is not None else None
    return values if values is not None and len(values) == count else None


def _camera(document: Mapping[str, Plain], where: str) -> tuple[Intrinsics, FloatArray, float]:
    """Return a camera, its rectifying rotation (3, 3), and the shift along x of its rectified frame, in metres."""
    K, R, P = (_first(document, key) for key in _KEYS)
    width, height = (numbers(document.get(f"image_{n}", document.get(n))) for n in ("width", "height"))
    name = next((n for n in ("distortion_coefficients", "D", "d") if n in document), "")
    lens = numbers(document[name]) if name else None
    if K is None or R is None or P is None or lens is None or not width or not height:
        raise RigError(
            f"{where}: needs image_width, image_height, camera_matrix, distortion_coefficients, "
            "rectification_matrix and projection_matrix, as camera_calibration writes them"
        )
    if P[0] <= 0.0:
        raise RigError(f"{where}: projection_matrix has the focal length {P[0]:g}; the camera is not calibrated")
    turn = nearest_rigid(rigid(np.reshape(R, (3, 3)), np.zeros(3)))[:3, :3]
    camera = Intrinsics(
        K=frozen(np.reshape(K, (3, 3))),
        distortion=lens_coefficients(lens, str(document.get("distortion_model", "")), where),
        width_px=int(width[0]),
        height_px=int(height[0]),
    )
    return camera, turn, P[3] / P[0]


def ros_texts(rig: StereoRig) -> tuple[str, str]:
    """Return the left and the right camera_info of a rig, rectified as this program does.

    Raises: RigError where the rig can't be rectified.
    """
    prepared = rectification(rig)
    camera = prepared.camera
    P = np.column_stack([camera.K, np.zeros(3)])
    right_P = P.copy()
    right_P[0, 3] = -camera.f_px * camera.baseline_m
    return (
        _text("left", rig.left, camera.rectified_from_left, P),
        _text("right", rig.right, prepared.rectified_from_right, right_P),
    )


def _text(name: str, camera: Intrinsics, turn: FloatArray, P: FloatArray) -> str:
    lines = [f"image_width: {camera.width_px}", f"image_height: {camera.height_px}", f"camera_name: {name}"]
    for key, matrix in (
        ("camera_matrix", camera.K), ("distortion_coefficients", camera.distortion[None]),
        ("rectification_matrix", turn), ("projection_matrix", P),
    ):  # fmt: skip
        if key == "distortion_coefficients":
            lines.append(f"distortion_model: {MODEL_NAMES[camera.lens]}")
        data = ", ".join(repr(number) for number in matrix.ravel().tolist())
        lines += [f"{key}:", f"  rows: {matrix.shape[0]}", f"  cols: {matrix.shape[1]}", f"  data: [{data}]"]
    return "\n".join(lines) + "\n"
