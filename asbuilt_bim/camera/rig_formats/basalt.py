"""Basalt's calibration (cereal's JSON): cameras in a body's frame, of kb4, pinhole, double sphere or unified models."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.chosen import chosen_pair
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.radial import MODELS, as_fisheye
from asbuilt_bim.camera.rig_formats.rigid_pose import rotation_from_quaternion
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, rigid

_PINHOLE = ("fx", "fy", "cx", "cy")
_LENSES = {
    "pinhole": (),
    "kb4": ("k1", "k2", "k3", "k4"),
    "pinhole-radtan8": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
}
_MOST = 40


def is_basalt(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is Basalt's."""
    inner = document.get("value0") if isinstance(document, Mapping) else None
    return isinstance(inner, Mapping) and "T_imu_cam" in inner and "intrinsics" in inner


def basalt_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of two cameras, whose T_imu_cam is body_from_camera in metres; by default the first and second.

    Raises: RigError for what isn't there, and for models of lens that aren't read.
    Reference: Basalt, doc/Calibration.md.
    """
    inner = document["value0"]
    assert isinstance(inner, Mapping)  # `is_basalt` asked
    poses, lenses, sizes = (inner.get(key) for key in ("T_imu_cam", "intrinsics", "resolution"))
    if not (isinstance(poses, list) and isinstance(lenses, list) and isinstance(sizes, list)):
        raise RigError(f"{where}: needs lists T_imu_cam, intrinsics and resolution, as basalt_calibrate writes them")
    if not len(poses) == len(lenses) == len(sizes) or len(sizes) > _MOST:
        raise RigError(
            f"{where}: holds {len(poses)} poses, {len(lenses)} lenses and {len(sizes)} sizes; one is missing"
        )
    known: dict[str, tuple[int, int]] = {}
    for number, size in enumerate(sizes):
        pair = numbers(size)
        if pair is None or len(pair) != 2:
            raise RigError(f"{where}: resolution {number} is no width and height")
        known[str(number)] = int(pair[0]), int(pair[1])
    cameras, places = [], []
    for name in chosen_pair(known, where, foreign):
        at = f"{where}: camera {name}"
        cameras.append(_camera(lenses[int(name)], known[name], at))
        places.append(_pose(poses[int(name)], at))
    return rig_of_unknown_sigma(cameras[0], cameras[1], inverse(places[1]) @ places[0])


def _camera(section: Plain, size: tuple[int, int], where: str) -> Intrinsics:
    model = str(section.get("camera_type", "")) if isinstance(section, Mapping) else ""
    values = section.get("intrinsics") if isinstance(section, Mapping) else None
    if not isinstance(values, Mapping) or model not in _LENSES | dict(MODELS):
        known = ", ".join([*_LENSES, *MODELS])
        raise RigError(f"{where}: the camera_type {model[:40]!r} isn't read (known: {known}); calibrate as kb4")
    pinhole = _values(values, _PINHOLE, where)
    if model in MODELS:
        return as_fisheye(model, pinhole, _values(values, MODELS[model][1], where), size, where)
    lens = _values(values, _LENSES[model], where) or [0.0] * 5
    fx, fy, cx, cy = pinhole
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(lens), width_px=size[0], height_px=size[1])


def _values(section: Mapping[str, Plain], keys: tuple[str, ...], where: str) -> list[float]:
    found = [numbers(section.get(key)) for key in keys]
    missing = [key for key, one in zip(keys, found, strict=True) if one is None or len(one) != 1]
    if missing:
        raise RigError(f"{where}: {', '.join(missing)}: no number is there; calibrate again")
    return [one[0] for one in found if one]


def _pose(section: Plain, where: str) -> FloatArray:
    keys = ("px", "py", "pz", "qx", "qy", "qz", "qw")
    if not isinstance(section, Mapping):
        raise RigError(f"{where}: its T_imu_cam is no pose; calibrate again")
    x, y, z, *quaternion = _values(section, keys, where)
    turn = rotation_from_quaternion(*quaternion)
    if turn is None:
        raise RigError(f"{where}: its T_imu_cam's quaternion has the length {np.linalg.norm(quaternion):.4g}, not 1")
    return rigid(turn, [x, y, z])
