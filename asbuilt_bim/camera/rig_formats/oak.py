"""Luxonis' OAK cameras: the EEPROM's dump as depthai writes it, and a smaller layout in use; lengths in centimetres."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import Foreign, lens_coefficients
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, rigid

_CM = 0.01
_FISHEYE = 1  # depthai's CameraModel
_MOST_SOCKETS = 16
_SMALL = ("left_intrinsics", "right_intrinsics", "rotation_left_to_right", "translation_left_to_right")


def is_oak(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is an OAK's calibration."""
    return isinstance(document, Mapping) and ("cameraData" in document or all(key in document for key in _SMALL))


def oak_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of an OAK's left and right camera, at the size of the photos.

    Raises: RigError where something is missing, or the photos' size isn't a scaling of the calibration's.
    Reference: depthai-core, EepromData, CameraInfo, Extrinsics.
    """
    if "cameraData" not in document:
        return _small(document, where, foreign)
    sockets = _sockets(document["cameraData"], where)
    stereo = document.get("stereoRectificationData")
    names = foreign.cameras or tuple(
        str(_socket(stereo, f"{side}CameraSocket", default)) for side, default in (("left", 1), ("right", 2))
    )
    chosen = [int(name) if name.isdecimal() and len(name) < 4 else -1 for name in names]
    if len(chosen) != 2 or any(number not in sockets for number in chosen):
        raise RigError(
            f"{where}: has the cameras {', '.join(map(str, sorted(sockets)))}, not {' and '.join(names)[:40]}; name "
            "left and right: rig.cameras: ['1', '2']"
        )
    cameras = [_camera(sockets[number], f"{where}: camera {number}", foreign) for number in chosen]
    pose = inverse(_root_from(chosen[1], sockets, where)) @ _root_from(chosen[0], sockets, where)
    if _root(chosen[0], sockets, where) != _root(chosen[1], sockets, where):
        raise RigError(f"{where}: doesn't say how camera {chosen[1]} stands to camera {chosen[0]}; calibrate here")
    return rig_of_unknown_sigma(cameras[0], cameras[1], pose)


def _small(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    cameras = []
    for side in ("left", "right"):
        parts = {
            "intrinsicMatrix": document[f"{side}_intrinsics"],
            "distortionCoeff": document.get(f"distortion_{side}"),
            "width": document.get("width"),
            "height": document.get("height"),
        }
        cameras.append(_camera(parts, f"{where}: {side}", foreign))
    turn, shift = numbers(document["rotation_left_to_right"]), numbers(document["translation_left_to_right"])
    return rig_of_unknown_sigma(cameras[0], cameras[1], _pose(turn, shift, where))


def _sockets(data: Plain, where: str) -> dict[int, Mapping[str, Plain]]:
    """Return the cameras by socket: the dump lists pairs of both, or maps one to the other."""
    pairs = list(data.items()) if isinstance(data, Mapping) else data
    found: dict[int, Mapping[str, Plain]] = {}
    for pair in pairs if isinstance(pairs, list) else []:
        if not isinstance(pair, list | tuple) or len(pair) != 2 or not isinstance(pair[1], Mapping):
            continue
        number = numbers(pair[0])
        if number and len(number) == 1 and 0 <= number[0] < 100:
            found[int(number[0])] = pair[1]
    if not 2 <= len(found) <= _MOST_SOCKETS:
        raise RigError(f"{where}: cameraData holds {len(found)} cameras; dump the calibration again")
    return found


def _socket(section: Plain, key: str, default: int) -> int:
    found = numbers(section.get(key)) if isinstance(section, Mapping) else None
    return int(found[0]) if found and len(found) == 1 and found[0] >= 0 else default


def _root(number: int, sockets: Mapping[int, Mapping[str, Plain]], where: str) -> int:
    """Return the camera that a chain of poses ends at.

    Raises: RigError where it goes round in a circle.
    """
    seen = [number]
    while (to := _next(sockets.get(seen[-1]))) in sockets:
        if to in seen:
            raise RigError(
                f"{where}: the poses of cameras {', '.join(map(str, seen))} go round in a circle; dump it again"
            )
        seen.append(to)
    return seen[-1]


def _root_from(number: int, sockets: Mapping[int, Mapping[str, Plain]], where: str) -> FloatArray:
    """Return the pose (4, 4) of a camera in the one that its chain ends at."""
    root, found = _root(number, sockets, where), np.eye(4)
    while number != root:
        pose = sockets[number]["extrinsics"]
        assert isinstance(pose, Mapping)  # `_next` asked
        shift = pose.get("translation")
        at = (
            [number_ for axis in "xyz" for number_ in numbers(shift.get(axis)) or []]
            if isinstance(shift, Mapping)
            else None
        )
        found = _pose(numbers(pose.get("rotationMatrix")), at, f"{where}: camera {number}") @ found
        number = _next(sockets[number])
    return found


def _next(camera: Mapping[str, Plain] | None) -> int:
    pose = camera.get("extrinsics") if camera is not None else None
    return _socket(pose, "toCameraSocket", -1)


def _pose(turn: list[float] | None, shift: list[float] | None, where: str) -> FloatArray:
    if turn is None or len(turn) != 9 or shift is None or len(shift) != 3:
        raise RigError(f"{where}: needs a rotation of 9 numbers and a translation of 3; dump the calibration again")
    return nearest_rigid(rigid(np.reshape(turn, (3, 3)), _CM * np.array(shift)))


def _camera(section: Mapping[str, Plain], where: str, foreign: Foreign) -> Intrinsics:
    K, lens = numbers(section.get("intrinsicMatrix")), numbers(section.get("distortionCoeff"))
    width, height = (numbers(section.get(key)) for key in ("width", "height"))
    if K is None or len(K) != 9 or lens is None or not width or not height:
        raise RigError(f"{where}: needs intrinsicMatrix, distortionCoeff, width and height; dump the calibration again")
    fisheye = numbers(section.get("cameraType")) == [_FISHEYE]
    coefficients = lens_coefficients(lens[:4] if fisheye else lens, "equidistant" if fisheye else "plumb_bob", where)
    camera = Intrinsics(
        K=frozen(np.reshape(K, (3, 3))), distortion=coefficients, width_px=int(width[0]), height_px=int(height[0])
    )
    return _at_size(camera, foreign.size_px or foreign.photo_px, where)


def _at_size(camera: Intrinsics, wanted: tuple[int, int] | None, where: str) -> Intrinsics:
    """Return the camera at the photos' size: scaled alike both ways, or its width kept and as many rows cut each side.

    Raises: RigError for another size.
    """
    there = camera.width_px, camera.height_px
    if wanted is None or wanted == there:
        return camera
    scale = wanted[0] / there[0]
    rows = wanted[1] / scale
    is_scaled = 0.1 <= scale <= 4.0 and abs(rows - there[1]) < 1e-6 * there[1]
    is_cut = scale == 1.0 and 0.5 * there[1] < rows < there[1]
    if not is_scaled and not is_cut:
        raise RigError(
            f"{where}: is calibrated at {there[0]}x{there[1]}, and the photos are {wanted[0]}x{wanted[1]}; take them "
            f"at {there[0]}x{there[1]}"
        )
    K = camera.K.copy()
    K[:2] *= scale
    K[:2, 2] += 0.5 * scale - 0.5
    K[1, 2] -= 0.5 * (there[1] * scale - wanted[1])
    return Intrinsics(K=frozen(K), distortion=camera.distortion, width_px=wanted[0], height_px=wanted[1])
