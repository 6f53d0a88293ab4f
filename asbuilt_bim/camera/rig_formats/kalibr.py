"""Rigs of Kalibr (camchain.yaml) and of the EuRoC data sets (a sensor.yaml each side)."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import lens_coefficients
from asbuilt_bim.camera.rig_formats.text import Plain, numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse

_SIDES = ("cam0", "cam1")


def is_camchain(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is Kalibr's camchain."""
    return isinstance(document, Mapping) and "cam0" in document


def is_euroc(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is one camera of the EuRoC form."""
    return isinstance(document, Mapping) and "T_BS" in document and "intrinsics" in document


def camchain_rig(document: Mapping[str, Plain], where: str) -> StereoRig:
    """Make a rig of cam0 (left) and cam1 (right), whose pose T_cn_cnm1 is right_from_left in metres.

    Raises: RigError for another number of cameras, other camera or lens models, or what isn't there.
    Reference: Kalibr wiki, "yaml formats".
    """
    cameras = sorted(key for key in document if str(key).startswith("cam"))
    if tuple(cameras) != _SIDES:
        raise RigError(
            f"{where}: holds {', '.join(map(str, cameras))[:80]}; a stereo rig is cam0 (left) and cam1 (right)"
        )
    left, right = (_camera(document[side], f"{where}: {side}") for side in _SIDES)
    second = document["cam1"]
    pose = second.get("T_cn_cnm1") if isinstance(second, Mapping) else None
    return rig_of_unknown_sigma(left, right, _pose(pose, f"{where}: cam1.T_cn_cnm1"))


def euroc_rig(left: Mapping[str, Plain], right: Mapping[str, Plain], where: str) -> StereoRig:
    """Make a rig of two sensor files, whose T_BS is body_from_camera in metres.

    Raises: RigError as `camchain_rig` does.
    """
    cameras = [_camera(one, f"{where}: {side}") for one, side in ((left, "left"), (right, "right"))]
    body_from_left = _pose(left.get("T_BS"), f"{where}: left T_BS")
    body_from_right = _pose(right.get("T_BS"), f"{where}: right T_BS")
    return rig_of_unknown_sigma(cameras[0], cameras[1], inverse(body_from_right) @ body_from_left)


def _camera(camera: Plain, where: str) -> Intrinsics:
    if not isinstance(camera, Mapping):
        raise RigError(f"{where}: holds no camera")
    model = str(camera.get("camera_model", "pinhole"))
    if model != "pinhole":
        raise RigError(
            f"{where}: the camera model {model[:40]!r} isn't read; calibrate as pinhole-radtan or pinhole-equi"
        )
    pinhole, size = numbers(camera.get("intrinsics")), numbers(camera.get("resolution"))
    lens = numbers(camera.get("distortion_coeffs", camera.get("distortion_coefficients")))
    if pinhole is None or len(pinhole) != 4 or size is None or len(size) != 2 or lens is None:
        raise RigError(f"{where}: needs intrinsics [fu, fv, cu, cv], resolution [w, h] and distortion coefficients")
    fx, fy, cx, cy = pinhole
    return Intrinsics(
        K=frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
        distortion=lens_coefficients(lens, str(camera.get("distortion_model", "radtan")), where),
        width_px=int(size[0]),
        height_px=int(size[1]),
    )


def _pose(value: Plain, where: str) -> FloatArray:
    """Return a transform (4, 4), its rotation made orthogonal to the last digit where the file's is rounded."""
    entries = numbers(value)
    if entries is None or len(entries) != 16:
        raise RigError(f"{where}: needs a 4 x 4 matrix")
    matrix = np.reshape(entries, (4, 4))
    return nearest_rigid(matrix)


def nearest_rigid(matrix: FloatArray) -> FloatArray:
    """Return a matrix (4, 4) whose rotation, off by the file's rounding, is made a rotation; larger faults stay."""
    u, sizes, v = np.linalg.svd(matrix[:3, :3])
    if np.abs(sizes - 1.0).max() > 1e-4 or np.linalg.det(u @ v) < 0.0:
        return matrix
    mended = matrix.copy()
    mended[:3, :3] = u @ v
    return mended


def camchain_text(rig: StereoRig) -> str:
    """Return a rig as Kalibr's camchain.

    Raises: RigError for lenses that Kalibr's models don't hold: k3, and the rational ones.
    """
    lines = []
    for name, camera in zip(_SIDES, (rig.left, rig.right), strict=True):
        if camera.lens == "rational" or (camera.lens == "five" and camera.distortion[4] != 0.0):
            raise RigError(
                f"{name}: Kalibr's radtan lens has k1 k2 p1 p2 only, this one is {camera.lens} with k3; write another "
                "format, or calibrate with rig.boards.distortion: fisheye"
            )
        model = "equidistant" if camera.lens == "fisheye" else "radtan"
        pinhole = [camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]]
        lines += [f"{name}:"]
        if name == "cam1":
            rows = "".join(f"\n  - {_row(row)}" for row in rig.right_from_left)
            lines += [f"  T_cn_cnm1:{rows}"]
        lines += [
            f"  cam_overlaps: [{1 - int(name[-1])}]", "  camera_model: pinhole",
            f"  distortion_coeffs: {_row(camera.distortion[:4])}", f"  distortion_model: {model}",
            f"  intrinsics: {_row(pinhole)}", f"  resolution: [{camera.width_px}, {camera.height_px}]",
            f"  rostopic: /{name}/image_raw",
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _row(values: FloatArray | list[float]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"
