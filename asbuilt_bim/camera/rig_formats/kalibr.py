"""Rigs of Kalibr (camchain.yaml) and of the EuRoC data sets (a sensor.yaml each side)."""

import re
from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.chosen import chosen_pair
from asbuilt_bim.camera.rig_formats.opencv import Foreign, lens_coefficients
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.radial import MODELS, as_fisheye
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse

_SIDES = ("cam0", "cam1")
_CAMERA = re.compile(r"cam\d{1,2}")
_RADIAL = {"ds": ("xi", "alpha"), "eucm": ("alpha", "beta")}
"""Kalibr's models that a fisheye can stand for; their numbers come before fu fv cu cv."""


def is_camchain(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is Kalibr's camchain."""
    return isinstance(document, Mapping) and isinstance(document.get("cam0"), Mapping | int | list)


def is_euroc(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is one camera of the EuRoC form."""
    return isinstance(document, Mapping) and "T_BS" in document and "intrinsics" in document


def camchain_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of two cameras of the chain, by default cam0 and cam1; each pose T_cn_cnm1 is from the camera before.

    Raises: RigError where it is open which two, for other camera or lens models, or what isn't there.
    Reference: Kalibr wiki, "yaml formats".
    """
    there = sorted((str(key) for key in document if _CAMERA.fullmatch(str(key))), key=lambda name: int(name[3:]))
    if len(there) < 2 or there != [f"cam{number}" for number in range(len(there))]:
        raise RigError(
            f"{where}: holds {', '.join(there)[:80]}; a stereo rig is cam0 (left) and cam1 (right), and a chain has "
            "all numbers between"
        )
    sizes = {name: _size(document[name], f"{where}: {name}") for name in there} if len(there) > 2 else {}
    names = chosen_pair(sizes, where, foreign) if sizes else _SIDES
    left, right = (_camera(document[name], f"{where}: {name}") for name in names)
    first, second = (_from_cam0(document, there.index(name), where) for name in names)
    return rig_of_unknown_sigma(left, right, second @ inverse(first))


def _size(camera: Plain, where: str) -> tuple[int, int]:
    size = numbers(camera.get("resolution")) if isinstance(camera, Mapping) else None
    if size is None or len(size) != 2:
        raise RigError(f"{where}: needs resolution [w, h]")
    return int(size[0]), int(size[1])


def _from_cam0(document: Mapping[str, Plain], number: int, where: str) -> FloatArray:
    """Return the transform (4, 4) from cam0's frame to that of a camera further on in the chain."""
    found = np.eye(4)
    for k in range(1, number + 1):
        camera = document[f"cam{k}"]
        pose = camera.get("T_cn_cnm1") if isinstance(camera, Mapping) else None
        found = _pose(pose, f"{where}: cam{k}.T_cn_cnm1") @ found
    return found


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
    if model in _RADIAL:
        return _radial(camera, model, where)
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


def _radial(camera: Mapping[str, Plain], model: str, where: str) -> Intrinsics:
    entries, lens = numbers(camera.get("intrinsics")), numbers(camera.get("distortion_coeffs", []))
    count = len(_RADIAL[model])
    if entries is None or len(entries) != count + 4 or lens is None or any(lens):
        raise RigError(f"{where}: needs intrinsics [{', '.join(MODELS[model][1])}, fu, fv, cu, cv] and no distortion")
    return as_fisheye(model, entries[count:], entries[:count], _size(camera, where), where)


def _pose(value: Plain, where: str) -> FloatArray:
    """Return a transform (4, 4), its rotation made orthogonal to the last digit where the file's is rounded."""
    entries = numbers(value)
    if entries is None or len(entries) != 16:
        raise RigError(f"{where}: needs a 4 x 4 matrix")
    matrix = np.reshape(entries, (4, 4))
    return nearest_rigid(matrix)


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
