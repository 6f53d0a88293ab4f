"""Rigs in OpenCV's files (FileStorage, YAML or XML), under the names in common use, read and written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_NAMES = {
    "K_left": ("K1", "M1", "cameraMatrix1", "camera_matrix_1", "left_camera_matrix", "LEFT.K", "K_left"),
    "D_left": ("D1", "dist1", "distCoeffs1", "dist_coeffs_1", "left_distortion", "LEFT.D", "D_left"),
    "K_right": ("K2", "M2", "cameraMatrix2", "camera_matrix_2", "right_camera_matrix", "RIGHT.K", "K_right"),
    "D_right": ("D2", "dist2", "distCoeffs2", "dist_coeffs_2", "right_distortion", "RIGHT.D", "D_right"),
    "R": ("R", "rotation"),
    "T": ("T", "translation"),
}
_WIDTHS, _HEIGHTS = ("image_width", "imageWidth", "width"), ("image_height", "imageHeight", "height")
_MODEL = "distortion_model"
MODEL_NAMES: dict[LensModel, str] = {
    "five": "plumb_bob",
    "rational": "rational_polynomial",
    "fisheye": "equidistant",
}
"""What ROS calls our lenses, in its own files and in OpenCV's that we write: four numbers don't tell a fisheye."""
_SIZES = ("image_size", "imageSize", "size", "resolution")


@dataclass(frozen=True, slots=True, kw_only=True)
class Foreign:
    """What files of other programs don't always say.

    `size_px` of the photos, the unit of T, that a lens is a fisheye (OpenCV's files); `cameras`: left and right where a
    file holds more than two, by the file's own names. `photo_px` is the size of the photos at hand: a file that says
    its own size isn't overruled by it.
    """

    size_px: tuple[int, int] | None = None
    metres_per_unit: float = 1.0
    fisheye: bool = False
    cameras: tuple[str, ...] = ()
    photo_px: tuple[int, int] | None = None


def is_opencv(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document holds OpenCV's matrices under one of the known names."""
    return isinstance(document, Mapping) and any(name in document for names in _NAMES.values() for name in names)


def opencv_rig(document: Mapping[str, Plain], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of OpenCV's matrices; the right camera's pose is x_right = R x_left + T, as stereoCalibrate gives it.

    Raises: RigError with everything that is missing or has another shape.
    """
    found: dict[str, list[float]] = {}
    problems = []
    for own, theirs in _NAMES.items():
        name = next((name for name in theirs if name in document), None)
        values = numbers(document[name]) if name is not None else None
        if values is None:
            problems.append(f"{own} (as {', '.join(theirs[:3])})")
        else:
            found[own] = values
    if problems:
        raise RigError(f"{where}: OpenCV matrices are missing or hold no numbers: {'; '.join(problems)}")
    size = foreign.size_px or photo_size(document) or foreign.photo_px
    if size is None:
        raise RigError(
            f"{where}: it doesn't say how large the photos are; give rig.photo_size_px: [width, height], or "
            "add image_width and image_height to it"
        )
    for key, counts in {"K_left": (9,), "K_right": (9,), "R": (3, 9), "T": (3,)}.items():
        if len(found[key]) not in counts:
            raise RigError(f"{where}: {key} holds {len(found[key])} numbers, not {' or '.join(map(str, counts))}")
    model = _model(document, foreign, where)
    turn = np.array(found["R"])
    shift = np.array(found["T"]) * foreign.metres_per_unit
    return rig_of_unknown_sigma(
        _camera(found["K_left"], found["D_left"], size, f"{where}: left", model),
        _camera(found["K_right"], found["D_right"], size, f"{where}: right", model),
        rigid(turn.reshape(3, 3) if len(turn) == 9 else turn, shift),
    )


def _model(document: Mapping[str, Plain], foreign: Foreign, where: str) -> str:
    """Return the lenses' model: OpenCV's own files don't say it. This program's do, in ROS's words.

    Raises: RigError where the file and the project contradict each other.
    """
    model_name = str(document.get(_MODEL, ""))
    if not model_name:
        return "equidistant" if foreign.fisheye else "plumb_bob"
    if foreign.fisheye and model_name != "equidistant":
        raise RigError(
            f"{where}: its {_MODEL} is {model_name[:40]!r}, and rig.fisheye says another; correct one of them"
        )
    return model_name


def _camera(K: list[float], lens: list[float], size: tuple[int, int], where: str, model: str) -> Intrinsics:
    coefficients = lens_coefficients(lens, model, where)
    return Intrinsics(K=frozen(np.reshape(K, (3, 3))), distortion=coefficients, width_px=size[0], height_px=size[1])


def lens_coefficients(lens: list[float], model: str, where: str) -> FloatArray:
    """Return a lens's coefficients as `Intrinsics` holds them.

    Raises: RigError for models and lengths that aren't read.
    """
    if model in ("equidistant", "fisheye", "kannala_brandt"):
        if len(lens) != 4:
            raise RigError(f"{where}: {len(lens)} distortion coefficients, a fisheye has 4")
        return frozen(lens)
    if model not in ("", "none", "plumb_bob", "radtan", "radial-tangential", "rational_polynomial"):
        raise RigError(
            f"{where}: the distortion model {model[:40]!r} isn't read; known are plumb_bob, radtan, "
            "rational_polynomial, equidistant: calibrate with one of them, or here"
        )
    if len(lens) in (1, 2, 3) or any(lens[8:]):
        raise RigError(
            f"{where}: {len(lens)} distortion coefficients; 0, 4, 5 or 8 are read (thin-prism and tilted lenses, 12 or "
            "14, are not): calibrate here"
        )
    padded = np.zeros(8 if any(lens[5:8]) else 5)
    padded[: min(len(lens), len(padded))] = lens[: len(padded)]
    return frozen(padded)


def photo_size(document: Mapping[str, Plain]) -> tuple[int, int] | None:
    """Return the photos' size where the file says it."""
    for name in _SIZES:
        if name in document and (pair := numbers(document[name])) is not None and len(pair) == 2:
            return int(pair[0]), int(pair[1])
    found = []
    for names in (_WIDTHS, _HEIGHTS):
        name = next((name for name in names if name in document), "")
        value = numbers(document[name]) if name else None
        if value is None or len(value) != 1:
            return None
        found.append(int(value[0]))
    return found[0], found[1]


def opencv_text(rig: StereoRig) -> str:
    """Return a rig as OpenCV's YAML: K1 D1 K2 D2 R T as stereoCalibrate names them, metres, with the photos' size.

    Raises: RigError where the cameras have other sizes or models of lens: the file holds one of each.
    """
    sizes, lenses = ({(c.width_px, c.height_px) for c in (rig.left, rig.right)}, {rig.left.lens, rig.right.lens})
    if len(sizes) > 1 or len(lenses) > 1:
        raise RigError(
            "OpenCV's file holds one size of photos and one model of lens for both cameras; write rig or ros"
        )
    lines = ["%YAML:1.0", "---", f"image_width: {rig.left.width_px}", f"image_height: {rig.left.height_px}"]
    lines.append(f"{_MODEL}: {MODEL_NAMES[rig.left.lens]}")
    for name, matrix in (
        ("K1", rig.left.K), ("D1", rig.left.distortion[None]), ("K2", rig.right.K), ("D2", rig.right.distortion[None]),
        ("R", rig.right_from_left[:3, :3]), ("T", rig.right_from_left[:3, 3:]),
    ):  # fmt: skip
        data = ", ".join(_digits(number) for number in matrix.ravel().tolist())
        rows, columns = matrix.shape
        lines += [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}", "   dt: d"]
        lines.append(f"   data: [ {data} ]")
    return "\n".join(lines) + "\n"


def _digits(number: float) -> str:
    """Write a number so that it is read back to the last digit, with the dot that OpenCV's reader asks for."""
    text = repr(number)
    return text if "." in text or "n" in text else text.replace("e", ".e") if "e" in text else f"{text}."
