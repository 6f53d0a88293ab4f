"""MATLAB's calibrations as text: stereoParameters as JSON, Bouguet's toolbox, and a listing of Stereolabs' numbers."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import Foreign, lens_coefficients
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.camera.rig_formats.zed import SIZES, zed_rig
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_UNITS_M = {
    **dict.fromkeys(("millimeters", "millimetres", "mm"), 0.001),
    **dict.fromkeys(("centimeters", "centimetres", "cm"), 0.01),
    **dict.fromkeys(("meters", "metres", "m"), 1.0),
    **dict.fromkeys(("inches", "in"), 0.0254),
}
_FIRST_PIXEL = 1.0  # MATLAB counts pixels from 1
_BOUGUET = ("om", "T", "fc_left", "fc_right", "cc_left", "cc_right", "kc_left", "kc_right")


def is_stereo_parameters(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is jsonencode(toStruct(stereoParams))."""
    return isinstance(document, Mapping) and "CameraParameters1" in document and "CameraParameters2" in document


def stereo_parameters_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of stereoParameters: matrices there multiply rows from the right, and are transposed of ours.

    Raises: RigError for what isn't there, or an unknown unit.
    Reference: MathWorks, stereoParameters and toStruct.
    """
    cameras = [_camera(document[f"CameraParameters{n}"], f"{where}: camera {n}", foreign) for n in (1, 2)]
    unit = str(document.get("WorldUnits", "millimeters")).strip().lower()
    if unit not in _UNITS_M:
        raise RigError(f"{where}: WorldUnits {unit[:40]!r} isn't known; give millimeters, centimeters or meters")
    posed = document.get("PoseCamera2")
    if isinstance(posed, Mapping):  # since R2022b, and not transposed
        turn, shift = numbers(posed.get("R")), numbers(posed.get("Translation"))
        transposed = False
    else:
        turn, shift = numbers(document.get("RotationOfCamera2")), numbers(document.get("TranslationOfCamera2"))
        transposed = True
    if turn is None or len(turn) != 9 or shift is None or len(shift) != 3:
        raise RigError(f"{where}: needs RotationOfCamera2 (9 numbers) and TranslationOfCamera2 (3), or PoseCamera2")
    R = np.reshape(turn, (3, 3))
    pose = nearest_rigid(rigid(R.T if transposed else R, _UNITS_M[unit] * np.array(shift)))
    return rig_of_unknown_sigma(cameras[0], cameras[1], pose)


def _camera(section: Plain, where: str, foreign: Foreign) -> Intrinsics:
    if not isinstance(section, Mapping):
        raise RigError(f"{where}: holds no camera")
    straight, turned = numbers(section.get("K")), numbers(section.get("IntrinsicMatrix"))
    K = _matrix(straight, turned)
    radial, tangential = numbers(section.get("RadialDistortion")), numbers(section.get("TangentialDistortion"))
    size = numbers(section.get("ImageSize"))
    if K is None or radial is None or len(radial) not in (2, 3) or tangential is None or len(tangential) != 2:
        raise RigError(
            f"{where}: needs IntrinsicMatrix or K, RadialDistortion (2 or 3) and TangentialDistortion (2): "
            "jsonencode(toStruct(stereoParams))"
        )
    wanted = foreign.size_px or ((int(size[1]), int(size[0])) if size and len(size) == 2 else foreign.photo_px)
    if wanted is None:
        raise RigError(f"{where}: ImageSize is empty; give rig.photo_size_px: [width, height]")
    K[:2, 2] -= _FIRST_PIXEL
    if abs(K[0, 1]) > 0.0:
        raise RigError(f"{where}: it has a skew of {K[0, 1]:.3g} px; calibrate with EstimateSkew false")
    lens = [*radial[:2], *tangential, *radial[2:], *[0.0] * (3 - len(radial))]
    return Intrinsics(K=frozen(K), distortion=frozen(lens), width_px=wanted[0], height_px=wanted[1])


def _matrix(straight: list[float] | None, turned: list[float] | None) -> FloatArray | None:
    if straight is not None and len(straight) == 9:
        return np.reshape(straight, (3, 3)).copy()
    if turned is not None and len(turned) == 9:
        return np.reshape(turned, (3, 3)).T.copy()
    return None


def is_bouguet(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is the stereo result of Bouguet's toolbox, as assignments."""
    return isinstance(document, Mapping) and all(key in document for key in _BOUGUET)


def bouguet_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of om, T, fc, cc and kc of both sides: x_right = R(om) x_left + T, in the unit of the squares.

    Raises: RigError for what isn't there.
    Reference: Bouguet, Camera Calibration Toolbox for Matlab, stereo.
    """
    found = {key: numbers(document[key]) or [] for key in _BOUGUET}
    wrong = [key for key, values in found.items() if len(values) != {"o": 3, "T": 3, "f": 2, "c": 2, "k": 5}[key[0]]]
    if wrong:
        raise RigError(f"{where}: {', '.join(wrong)}: another number of values than the toolbox writes")
    nx, ny = (numbers(document.get(key)) for key in ("nx", "ny"))
    size = foreign.size_px or ((int(nx[0]), int(ny[0])) if nx and ny else foreign.photo_px)
    if size is None:
        raise RigError(f"{where}: nx and ny are missing; give rig.photo_size_px: [width, height]")
    cameras = []
    for side in ("left", "right"):
        (fx, fy), (cx, cy) = found[f"fc_{side}"], found[f"cc_{side}"]
        K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        lens = lens_coefficients(found[f"kc_{side}"], "plumb_bob", f"{where}: {side}")
        cameras.append(Intrinsics(K=K, distortion=lens, width_px=size[0], height_px=size[1]))
    pose = rigid(np.array(found["om"]), foreign.metres_per_unit * np.array(found["T"]))
    return rig_of_unknown_sigma(cameras[0], cameras[1], pose)


def zed_listings(document: Plain) -> dict[str, dict[str, Plain]]:
    """Return the cameras of a listing like `ZED.FHD.L.fx = 1398.7`, each as an SN*.conf would hold it, by name."""
    found: dict[str, dict[str, Plain]] = {}
    for name, parts in document.items() if isinstance(document, Mapping) else ():
        stereo = parts.get("E") if isinstance(parts, Mapping) else None
        if not isinstance(parts, Mapping) or not isinstance(stereo, Mapping):
            continue
        sections: dict[str, Plain] = {}
        turns: dict[str, Plain] = {
            key.lower(): value for key, value in stereo.items() if not isinstance(value, Mapping)
        }
        for size in SIZES:
            eyes, turn = parts.get(size), stereo.get(size)
            if not isinstance(eyes, Mapping) or not isinstance(turn, Mapping):
                continue
            sections |= {f"LEFT_CAM_{size}": eyes.get("L"), f"RIGHT_CAM_{size}": eyes.get("R")}
            for axis, key in (("RX", "rx"), ("RY", "cv"), ("CV", "cv"), ("RZ", "rz")):
                turns |= {f"{key}_{size.lower()}": turn[axis]} if axis in turn else {}
        if sections:
            found[str(name)] = {**sections, "STEREO": turns}
    return found


def zed_listing_rig(listings: Mapping[str, Mapping[str, Plain]], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of the listed camera that is named, or of the only one.

    Raises: RigError where it is open which.
    """
    names = list(listings)
    chosen = foreign.cameras[:1] if foreign.cameras else tuple(names) if len(names) == 1 else ()
    if not chosen or chosen[0] not in listings:
        raise RigError(
            f"{where}: holds the cameras {', '.join(names)[:80]}; say which: "
            f"rig.cameras: [{names[0][:20]}], or --rig-cameras {names[0][:20]}"
        )
    return zed_rig(listings[chosen[0]], where, foreign)
