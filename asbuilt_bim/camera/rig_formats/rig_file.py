"""The rig file: a calibrated rig as YAML, without losing a digit."""

import itertools
import operator
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import COEFFICIENT_NAMES, COEFFICIENTS, LensModel, reach
from asbuilt_bim.camera.rig import OTHER_PROGRAMS, PARAMETERS, RigWidth, StereoRig
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.storage.atomic_write import replace_bytes, writing
from asbuilt_bim.storage.schemas import all_faults

FORMAT, VERSION = "asbuilt-bim/rig", 1
_HEADER = "# yaml-language-server: $schema=https://asbuilt-bim.org/schemas/rig-1.json\n"
_ROTATION_TOLERANCE = 1e-6
_MOST = 1e12
BASELINES_M = 0.02, 3.0
_MOST_LENS = 10.0  # sigma of a coefficient: the prior of a lens is under one
MOST_LOST = 0.25
"""Of the frame: what lies beyond the lens's own field isn't measured on, and rectification leaves it out. An OAK-D's
own lens loses 14 %; one that loses more than a quarter is no calibration of these photos."""
_LEAST_FISHEYE_RAD = np.deg2rad(35.0)  # half the angle of view: a narrower lens is no fisheye
_TOLERANCE = 1e-6  # of the sigmas' product; a calibration's own is symmetric to 1e-10


def rig_text(rig: StereoRig) -> str:
    """Return a rig as YAML text that is read back to the last digit."""
    return _HEADER + yaml.safe_dump(_plain(rig), sort_keys=False, default_flow_style=None, width=120)


def write_rig(rig: StereoRig, path: Path) -> None:
    """Write a rig, whole or not at all, to a YAML file that `reader.read_rig` reads back to the last digit.

    Raises: OutputError where it can't be written.
    """
    with writing(path):
        replace_bytes(path, rig_text(rig).encode())


def own_rig(content: object, where: str) -> StereoRig:
    """Make a rig of what a rig file of this program holds; `where` names the file.

    Raises: RigError with every bad key.
    """
    problems = list(itertools.islice(_no_numbers(content), 5))
    problems += [] if problems else all_faults("rig-1", content)
    if isinstance(content, dict) and not problems:
        problems = [text for side in ("left", "right") if (text := _lens_problem(side, content[side]))]
        problems += _covariance_size(content)
    if problems or not isinstance(content, dict):
        raise RigError(f"{where}:\n  " + "\n  ".join(sorted(problems)))
    return _rig(content)


def checked_rig(rig: StereoRig) -> StereoRig:
    """Return a rig that was made in Python as it would come out of its file: the same is refused, arrays are copied.

    Raises: RigError with every bad key: shapes, NaN, and what makes a rig impossible.
    """
    where = "the rig that was given"
    try:
        made = own_rig(_plain(rig), where)
    except (AttributeError, TypeError, ValueError, IndexError) as error:
        raise RigError(
            f"{where}: it holds no arrays of numbers and sizes ({error!s:.120}); read_rig makes one"
        ) from error
    if problems := rig_problems(made):
        raise RigError(f"{where}:\n  " + "\n  ".join(problems))
    return made


def rig_problems(rig: StereoRig) -> list[str]:
    """Say what makes a rig impossible, one line a key; nothing for a rig that can be."""
    problems = []
    for side, camera in (("left", rig.left), ("right", rig.right)):
        if not np.all(np.isfinite(camera.K)) or not np.all(np.isfinite(camera.distortion)):
            problems.append(f"{side}: K and distortion must be finite numbers")
            continue
        fx, fy, longest = camera.K[0, 0], camera.K[1, 1], max(camera.width_px, camera.height_px)
        fits = 0.2 * longest < fx < 20 * longest and 0.8 * fy < fx < 1.25 * fy
        if not fits:
            problems.append(f"{side}.K: focal lengths {fx:.1f}, {fy:.1f} px don't fit a picture {longest} px long")
        if not (0 <= camera.K[0, 2] < camera.width_px and 0 <= camera.K[1, 2] < camera.height_px):
            problems.append(f"{side}.K: the principal point lies outside the picture")
        if abs(camera.K[0, 1]) + abs(camera.K[1, 0]) + np.abs(camera.K[2] - [0.0, 0.0, 1.0]).sum() > 1e-9:
            problems.append(f"{side}.K: must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
        elif fits and (lost := _without_direction(camera)) > MOST_LOST:
            problems.append(
                f"{side}.distortion: the lens folds back inside the picture, so {lost:.0%} of it have no direction "
                f"(limit {MOST_LOST:.0%}); calibrate with boards or points out to the corners of the frame, or another "
                "model of lens"
            )
    turn, last = rig.right_from_left[:3, :3], rig.right_from_left[3]
    if not np.all(np.isfinite(rig.right_from_left)):
        return [*problems, "right_from_left: must be finite numbers"]
    off = float(np.abs(turn @ turn.T - np.eye(3)).max())
    if off > _ROTATION_TOLERANCE or np.linalg.det(turn) < 0 or np.abs(last - [0, 0, 0, 1]).max() > 0:
        problems.append(f"right_from_left: is no rigid transform (its rotation is off by {off:.2g})")
    return problems + _stance(rig, turned=not problems) + ([] if problems else covariance_problems(rig))


def _stance(rig: StereoRig, *, turned: bool) -> list[str]:
    """Say what is wrong with where the right camera stands; `turned` where its rotation is one."""
    low, high = BASELINES_M
    if not low <= rig.baseline_m <= high:
        units = [name for name, per_m in (("millimetres", 1000), ("centimetres", 100)) if _a_baseline(rig, per_m)]
        hint = f"; it looks like {' or '.join(units)}" if units else ""
        return [f"right_from_left: baseline {rig.baseline_m:.4g} m, limit {low:g} to {high:g} m; give metres{hint}"]
    if not turned:
        return []
    turn = rig.right_from_left[:3, :3]
    x, y, z = (float(part) for part in -turn.T @ rig.right_from_left[:3, 3])  # the right camera's centre
    if x < -0.5 * rig.baseline_m:
        return [
            f"right_from_left: left and right are swapped: the right camera stands {-x:.3f} m to the LEFT of the left "
            "one; exchange them, or write x_right = R x_left + T"
        ]
    if x < 0.5 * rig.baseline_m:
        up, before = "below" if y > 0 else "above", "before" if z > 0 else "behind"
        return [
            f"right_from_left: the right camera stands {abs(y):.3f} m {up} and {abs(z):.3f} m {before} the left one, "
            f"and {x:.3f} m to its right; a rig's cameras stand side by side: hold it level, or "
            "write x_right = R x_left + T"
        ]
    return []


def _a_baseline(rig: StereoRig, per_m: int) -> bool:
    return BASELINES_M[0] <= rig.baseline_m / per_m <= BASELINES_M[1]


def _no_numbers(content: object, where: str = "") -> Iterator[str]:
    """Yield by key the numbers that no rig holds: NaN, infinite, or of hundreds of digits."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _no_numbers(value, f"{where}.{key}" if where else str(key))
    elif isinstance(content, list):
        for index, value in enumerate(content):
            yield from _no_numbers(value, f"{where}[{index}]")
    elif isinstance(content, int | float) and not -_MOST < content < _MOST:
        shown = f"{content:g}" if isinstance(content, float) else f"{str(content)[:20]}..."
        yield f"{where}: {shown} is no number of a rig (limit ±{_MOST:.0e})"


def _lens_problem(side: str, camera: dict[str, Any]) -> str:
    """Say where a lens's model and its coefficients don't belong together; "" where they do.

    Without `lens` a list of 5 or 8 tells by itself; one of 4 may be a fisheye, or OpenCV's k1 k2 p1 p2.
    """
    count, lens = len(camera["distortion"]), camera.get("lens", "")
    if not lens and count == COEFFICIENTS["fisheye"]:
        return f"{side}.lens: is missing; write `lens: fisheye`, or add a fifth 0 to k1 k2 p1 p2"
    if lens and COEFFICIENTS[lens] != count:
        return f"{side}.distortion: {count} numbers, {COEFFICIENTS[lens]} belong to a {lens} lens"
    return ""


def _covariance_size(content: dict[str, Any]) -> list[str]:
    """Say where a covariance has neither the pinholes' and the pose's rows only, nor those of both lenses, too."""
    if (rows := content.get("covariance")) is None:
        return []
    lenses = len(content["left"]["distortion"]) + len(content["right"]["distortion"])
    sizes = len(PARAMETERS), len(PARAMETERS) + lenses
    if len(rows) in sizes and all(len(row) == len(rows) for row in rows):
        return []
    return [
        f"covariance: must be {sizes[0]} x {sizes[0]}, or with these lenses {sizes[1]} x {sizes[1]} numbers; copy it "
        "whole from the calibration, or leave it out"
    ]


def _without_direction(camera: Intrinsics) -> float:
    """Return the share of the picture whose pixels have no direction: the lens's polynomial folds back before them."""
    if camera.lens == "fisheye":  # its corners may lie beyond 88 degrees
        return 1.0 if reach(camera.distortion) < np.tan(_LEAST_FISHEYE_RAD) else 0.0
    across, down = np.linspace(-0.5, camera.width_px - 0.5, 33), np.linspace(-0.5, camera.height_px - 0.5, 33)
    rays = camera.rays(np.stack(np.meshgrid(across, down), axis=-1))
    return float(np.isnan(rays[..., 0]).mean())


def _plain(rig: StereoRig) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "left": _plain_camera(rig.left),
        "right": _plain_camera(rig.right),
        "right_from_left": np.asarray(rig.right_from_left).tolist(),
        "covariance": np.asarray(rig.covariance).tolist(),
        "rms_px": float(rig.rms_px),
        "views_used": int(rig.views_used),
        "camera_model": rig.camera_model,
        "camera_serial": rig.camera_serial,
        "camera_serial_right": rig.camera_serial_right,
        "exif_orientation": rig.exif_orientation,
        "focal_length_mm": float(rig.focal_length_mm),
        **({} if rig.width == OTHER_PROGRAMS else {"trusted_to": _plain_width(rig.width)}),
    }


def _plain_width(width: RigWidth) -> dict[str, Any]:
    return {
        "turn_rad": [float(one) for one in width.turn_rad],
        "lens_px": float(width.lens_px),
        "scale_share": float(width.scale_share),
    }


def _plain_camera(camera: Intrinsics) -> dict[str, Any]:
    return {
        "K": np.asarray(camera.K).tolist(),
        "lens": camera.lens,
        "distortion": np.asarray(camera.distortion).tolist(),
        "width_px": _whole(camera.width_px),
        "height_px": _whole(camera.height_px),
    }


def _whole(number: int) -> int:
    """Return a size that may be numpy's as a plain whole number.

    Raises: TypeError for one that isn't whole.
    """
    return operator.index(number)


def _rig(content: dict[str, Any]) -> StereoRig:
    size = len(PARAMETERS)
    return StereoRig(
        left=_camera(content["left"]),
        right=_camera(content["right"]),
        right_from_left=frozen(content["right_from_left"]),
        covariance=frozen(content.get("covariance", np.zeros((size, size)))),
        rms_px=float(content.get("rms_px", 0.0)),
        views_used=content.get("views_used", 0),
        camera_model=content.get("camera_model", ""),
        camera_serial=content.get("camera_serial", ""),
        camera_serial_right=content.get("camera_serial_right", ""),
        exif_orientation=content.get("exif_orientation", 0),
        focal_length_mm=float(content.get("focal_length_mm", 0.0)),
        width=_width(content["trusted_to"]) if "trusted_to" in content else OTHER_PROGRAMS,
    )


def _width(content: dict[str, Any]) -> RigWidth:
    pitch, yaw, roll, down, ahead = (float(one) for one in content["turn_rad"])
    return RigWidth(
        turn_rad=(pitch, yaw, roll, down, ahead),
        lens_px=float(content["lens_px"]),
        scale_share=float(content["scale_share"]),
    )


def _camera(content: dict[str, Any]) -> Intrinsics:
    return Intrinsics(
        K=frozen(content["K"]),
        distortion=frozen(content["distortion"]),
        width_px=content["width_px"],
        height_px=content["height_px"],
    )


def covariance_problems(rig: StereoRig) -> list[str]:
    """Say what makes a covariance none, or the rig unknown: a sigma as large as what it belongs to."""
    spread = np.diag(rig.covariance)
    if not np.all(np.isfinite(rig.covariance)) or np.any(spread < 0):
        return ["covariance: variances must be finite and not negative"]
    pixels = [limit for camera in (rig.left, rig.right) for limit in _pixels(camera)]
    lenses = [name for side in ("left", "right") for name in _coefficients(side, getattr(rig, side).lens)]
    names = [*PARAMETERS, *lenses][: len(spread)]
    limits = np.array([*pixels, 1.0, 1.0, 1.0, *[rig.baseline_m] * 3, *[_MOST_LENS] * len(lenses)])[: len(spread)]
    units = ["px"] * 8 + ["rad"] * 3 + ["m"] * 3 + [""] * len(lenses)
    sigmas = np.sqrt(spread)
    if wide := [i for i in range(len(limits)) if sigmas[i] > limits[i]]:
        i = wide[0]
        return [
            f"covariance: row {i} ({names[i]}) says ±{sigmas[i]:.3g} {units[i]}, limit {limits[i]:.3g} "
            f"{units[i]}: that is no calibration; calibrate again, or leave covariance out (then the rig "
            "is trusted to 0.02 degrees and 0.2 px of lens)"
        ]
    scale = np.where(sigmas > 0, sigmas, 1.0)
    shares = rig.covariance / np.outer(scale, scale)
    off = np.abs(shares - shares.T)
    if off.max() > _TOLERANCE:
        row, column = (int(i) for i in np.unravel_index(off.argmax(), off.shape))
        return [
            f"covariance: isn't symmetric: row {row}, column {column} holds {rig.covariance[row, column]:.4g} and its "
            f"mirror {rig.covariance[column, row]:.4g}; copy it whole from the calibration"
        ]
    least = float(np.linalg.eigvalsh((shares + shares.T) / 2.0)[0])
    if least < -_TOLERANCE:
        return [
            f"covariance: is none: a combination of its rows has a negative variance ({least:.2g} of what the diagonal "
            "says); copy it whole from the calibration"
        ]
    return []


def _coefficients(side: str, lens: LensModel) -> list[str]:
    return [f"{name}_{side}" for name in COEFFICIENT_NAMES[lens]]


def _pixels(camera: Intrinsics) -> tuple[float, float, float, float]:
    """Return what fx, fy, cx and cy can be unsure by at most: themselves, or the picture."""
    return float(camera.K[0, 0]), float(camera.K[1, 1]), float(camera.width_px), float(camera.height_px)
