"""Stereolabs' factory calibration, SN*.conf: a section for each eye and resolution, and how the right eye stands."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid

SIZES = {
    "4K": (3840, 2160), "QHDPLUS": (3200, 1800), "2K": (2208, 1242), "FHD1200": (1920, 1200), "FHD": (1920, 1080),
    "HD1200": (1920, 1200), "HD": (1280, 720), "SVGA": (960, 600), "VGA": (672, 376),
}  # fmt: skip
"""Photos of one eye by section; DS (downsampled) has none that are saved."""
_MM = 0.001


def is_zed(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is Stereolabs' SN*.conf, or what a failed download left of one."""
    return isinstance(document, Mapping) and any(str(key).startswith(("LEFT_CAM_", "RIGHT_CAM_")) for key in document)


def zed_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of the section that has the photos' size: lengths are millimetres, turns a vector (RX, CV, RZ).

    The lens is that of the sections, k1 k2 p1 p2 k3, which older files don't all hold. LEFT_DISTO, which newer ones
    have beside, is another model of the same lens.

    Raises: RigError where the size isn't known or not there, or where a value is missing.
    Reference: Stereolabs, zed-open-capture, calibration.hpp.
    """
    there = {
        name: size
        for name, size in SIZES.items()
        if all(isinstance(document.get(f"{side}_CAM_{name}"), Mapping) for side in ("LEFT", "RIGHT"))
    }
    stereo = document.get("STEREO")
    if not there or not isinstance(stereo, Mapping):
        raise RigError(
            f"{where}: holds {', '.join(map(str, document))[:120]}; a whole file has LEFT_CAM_HD, RIGHT_CAM_HD and "
            "STEREO: download it again, or copy it from the camera's computer"
        )
    name = chosen_size(there, where, foreign)
    cameras = [_camera(document[f"{side}_CAM_{name}"], there[name], f"{where}: {side}_CAM_{name}") for side in _SIDES]
    turn = [_value(stereo, (f"{key}_{name.lower()}", key), f"{where}: STEREO") for key in ("rx", "cv", "rz")]
    baseline = _value(stereo, ("baseline",), f"{where}: STEREO")
    apart = [_value(stereo, (f"{key}_{name.lower()}", key), f"{where}: STEREO", default=0.0) for key in ("ty", "tz")]
    shift = -_MM * np.array([baseline, *apart])
    return rig_of_unknown_sigma(cameras[0], cameras[1], rigid(np.array(turn), shift))


_SIDES = ("LEFT", "RIGHT")


def chosen_size(there: Mapping[str, tuple[int, int]], where: str, foreign: Foreign) -> str:
    """Return the name of the size that the photos have, of those that a file holds.

    Raises: RigError where it isn't known, or not among them.
    """
    sizes = ", ".join(sorted({f"{w}x{h}" for w, h in there.values()}, key=lambda text: -int(text.split("x")[0])))
    wanted = foreign.size_px or foreign.photo_px
    if wanted is None:
        if len(set(there.values())) == 1:
            return next(iter(there))
        raise RigError(f"{where}: holds the sizes {sizes}; give the photos' one: rig.photo_size_px: [width, height]")
    found = next((name for name, size in there.items() if size == wanted), None)
    if found is None:
        width, height = wanted
        both = any((width, height) == (2 * w, h) for w, h in there.values())
        hint = (
            "these photos hold both eyes side by side: say so (side by side)" if both else "take photos of one of them"
        )
        raise RigError(f"{where}: holds the sizes {sizes}, and the photos are {width}x{height}; {hint}")
    return found


def _camera(section: Plain, size: tuple[int, int], where: str) -> Intrinsics:
    fx, fy, cx, cy = (_value(section, (key,), where) for key in ("fx", "fy", "cx", "cy"))
    lens = [_value(section, (key,), where, default=0.0) for key in ("k1", "k2", "p1", "p2", "k3")]
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(lens), width_px=size[0], height_px=size[1])


def _value(section: Plain, keys: tuple[str, ...], where: str, default: float | None = None) -> float:
    """Return the first of the keys' numbers; a key that is there and holds none is refused, and never the default."""
    if isinstance(section, Mapping):
        for key in keys:
            if key in section:
                found = numbers(section[key])
                if found is None or len(found) != 1:
                    raise RigError(f"{where}: {key} is no number; download the file again")
                return found[0]
    if default is None:
        raise RigError(f"{where}: {keys[-1]} is missing; download the file again")
    return default
