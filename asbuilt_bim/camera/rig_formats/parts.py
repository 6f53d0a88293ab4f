"""Rigs in parts: a file for each camera, and one that says how they stand (OpenCV's R and T, or VINS' body_T_cam)."""

from collections.abc import Mapping, Sequence
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.metashape import calibration_camera, is_calibration
from asbuilt_bim.camera.rig_formats.opencv import Foreign, lens_coefficients, photo_size
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, rigid

_MATRIX = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M")
_LENS = ("distortion_coefficients", "distCoeffs", "Distortion_Coefficients", "dist_coeffs", "D")
_BODY = ("body_T_cam0", "body_T_cam1")


def is_pose(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document says how two cameras stand, and nothing of their lenses."""
    if not isinstance(document, Mapping) or is_camera(document):
        return False
    return all(key in document for key in ("R", "T")) or all(key in document for key in _BODY)


def is_camera(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is one camera's calibration."""
    if not isinstance(document, Mapping):
        return False
    has_matrix = any(key in document for key in _MATRIX) and any(key in document for key in _LENS)
    return has_matrix or "projection_parameters" in document or is_calibration(document)


def rig_of_parts(
    cameras: Sequence[Mapping[str, Plain]], pose: Mapping[str, Plain], where: str, foreign: Foreign
) -> StereoRig:
    """Make a rig of two cameras' files, left first, and the file that says how they stand.

    Raises: RigError for what isn't there.
    """
    left, right = (
        _camera(one, f"{where}: {side}", foreign) for one, side in zip(cameras, ("left", "right"), strict=True)
    )
    return rig_of_unknown_sigma(left, right, _pose(pose, where, foreign))


def named_cameras(pose: Mapping[str, Plain]) -> tuple[str, str] | None:
    """Return the two cameras' files that a VINS configuration names, None where it names none in its own folder."""
    names = [pose.get(key) for key in ("cam0_calib", "cam1_calib")]
    plain = [name for name in names if isinstance(name, str) and 0 < len(name) < 200 and not set(name) & set("/\\\0:")]
    return (plain[0], plain[1]) if len(plain) == 2 else None


def _pose(document: Mapping[str, Plain], where: str, foreign: Foreign) -> FloatArray:
    if all(key in document for key in _BODY):
        left, right = (_matrix(document[key], f"{where}: {key}") for key in _BODY)
        return inverse(right) @ left
    turn, shift = numbers(document["R"]), numbers(document["T"])
    if turn is None or len(turn) not in (3, 9) or shift is None or len(shift) != 3:
        raise RigError(f"{where}: R needs 9 (or 3) numbers and T 3")
    R = np.reshape(turn, (3, 3)) if len(turn) == 9 else np.array(turn)
    return nearest_rigid(rigid(R, np.array(shift) * foreign.metres_per_unit))


def _matrix(value: Plain, where: str) -> FloatArray:
    entries = numbers(value)
    if entries is None or len(entries) != 16:
        raise RigError(f"{where}: needs a 4 x 4 matrix")
    return nearest_rigid(np.reshape(entries, (4, 4)))


def _camera(document: Mapping[str, Plain], where: str, foreign: Foreign) -> Intrinsics:
    if is_calibration(document):
        return calibration_camera(document, where)
    size = foreign.size_px or photo_size(document) or foreign.photo_px
    if size is None:
        raise RigError(f"{where}: it doesn't say how large the photos are; give rig.photo_size_px: [width, height]")
    if "projection_parameters" in document:
        return _camodocal(document, size, where)
    K = numbers(next((document[key] for key in _MATRIX if key in document), None))
    lens = numbers(next((document[key] for key in _LENS if key in document), None))
    if K is None or len(K) != 9 or lens is None:
        raise RigError(f"{where}: needs a camera matrix of 9 numbers and distortion coefficients")
    model = str(document.get("distortion_model", "equidistant" if foreign.fisheye else "plumb_bob"))
    coefficients = lens_coefficients(lens, model, where)
    return Intrinsics(K=frozen(np.reshape(K, (3, 3))), distortion=coefficients, width_px=size[0], height_px=size[1])


def _camodocal(document: Mapping[str, Plain], size: tuple[int, int], where: str) -> Intrinsics:
    """Read the cameras of camodocal and VINS: PINHOLE k1 k2 p1 p2, or KANNALA_BRANDT k2 to k5 of the angle."""
    model = str(document.get("model_type", "")).upper()
    if model not in ("PINHOLE", "KANNALA_BRANDT"):
        raise RigError(f"{where}: the model_type {model[:40]!r} isn't read; calibrate as PINHOLE or KANNALA_BRANDT")
    straight = model == "PINHOLE"
    keys = ("fx", "fy", "cx", "cy") if straight else ("mu", "mv", "u0", "v0")
    pinhole = _values(document["projection_parameters"], keys, where)
    bent = document.get("distortion_parameters") if straight else document["projection_parameters"]
    lens = _values(bent, ("k1", "k2", "p1", "p2") if straight else ("k2", "k3", "k4", "k5"), where)
    fx, fy, cx, cy = pinhole
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen([*lens, 0.0] if straight else lens), width_px=size[0], height_px=size[1])


def _values(section: Plain, keys: tuple[str, ...], where: str) -> list[float]:
    found = [numbers(section.get(key)) for key in keys] if isinstance(section, Mapping) else []
    if len(found) != len(keys) or any(one is None or len(one) != 1 for one in found):
        raise RigError(f"{where}: needs {', '.join(keys)}, a number each")
    return [one[0] for one in found if one]
