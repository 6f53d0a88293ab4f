"""Lenses of other models (double sphere, unified, field of view) as the fisheye that bends alike within the frame."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import WIDEST_RAD
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen

WORST_PX = 0.05
"""How far the fisheye may be off the file's own model anywhere in the frame: a twentieth of what rows are judged by."""
_STEPS = 400
_FEWEST_RAD = np.deg2rad(20.0)


def _double_sphere(angle: FloatArray, xi: float, alpha: float) -> FloatArray:
    """Usenko, Demmel & Cremers 2018, equations 40 to 45."""
    shifted = xi + np.cos(angle)
    second = np.sqrt(np.sin(angle) ** 2 + shifted**2)
    bent: FloatArray = np.sin(angle) / (alpha * second + (1.0 - alpha) * shifted)
    return bent


def _unified(angle: FloatArray, alpha: float, beta: float = 1.0) -> FloatArray:
    """Khomutenko, Garcia & Martinet 2016 (eucm); with beta 1 the unified model (ucm)."""
    across, along = np.sin(angle), np.cos(angle)
    bent: FloatArray = across / (alpha * np.sqrt(beta * across**2 + along**2) + (1.0 - alpha) * along)
    return bent


def _omni(angle: FloatArray, xi: float) -> FloatArray:
    """Mei & Rives 2007, without its plumb-bob terms."""
    bent: FloatArray = np.sin(angle) / (np.cos(angle) + xi)
    return bent


def _field_of_view(angle: FloatArray, w: float) -> FloatArray:
    """Devernay & Faugeras 2001."""
    bent: FloatArray = np.arctan(2.0 * np.tan(angle) * np.tan(w / 2.0)) / w
    return bent


MODELS: Mapping[str, tuple[Callable[..., FloatArray], tuple[str, ...]]] = {
    "ds": (_double_sphere, ("xi", "alpha")),
    "eucm": (_unified, ("alpha", "beta")),
    "ucm": (_unified, ("alpha",)),
    "omni": (_omni, ("xi",)),
    "fov": (_field_of_view, ("w",)),
}
"""By name: how far from the middle an angle off the axis is seen, for a focal length of 1; and its parameters."""


def as_fisheye(
    model: str, pinhole: Sequence[float], shape: Sequence[float], size: tuple[int, int], where: str
) -> Intrinsics:
    """Return the fisheye that is nearest to a camera (fx fy cx cy, and the model's own numbers), within its frame.

    Raises: RigError where no fisheye comes within `WORST_PX`.
    """
    bend = MODELS[model][0]
    fx, fy, cx, cy = pinhole
    corners = np.array([[x, y] for x in (-0.5, size[0] - 0.5) for y in (-0.5, size[1] - 0.5)])
    furthest = float(np.linalg.norm((corners - [cx, cy]) / [fx, fy], axis=1).max())
    angle = np.linspace(1e-3, WIDEST_RAD, _STEPS)
    with np.errstate(all="ignore"):
        seen = bend(angle, *shape)
        middle = float(bend(np.array([1e-6]), *shape)[0] / 1e-6)
    grows = np.isfinite(seen) & (np.diff(seen, prepend=0.0) > 0.0)
    end = min(int(np.argmin(grows)) if not grows.all() else _STEPS, int(np.searchsorted(seen, 1.02 * furthest)) + 1)
    if not (np.isfinite(middle) and middle > 0.0) or end < 5 or angle[end - 1] < _FEWEST_RAD:
        raise RigError(f"{where}: the {model} lens has impossible numbers; calibrate as pinhole-equi (kb4)")
    angle, seen = angle[:end], seen[:end] / middle
    powers = angle[:, None] ** np.array([3, 5, 7, 9])
    lens = np.linalg.lstsq(powers, seen - angle, rcond=None)[0]
    worst = float(np.abs(powers @ lens + angle - seen).max()) * middle * max(fx, fy)
    if not worst <= WORST_PX:
        raise RigError(
            f"{where}: the {model} lens differs by {worst:.2f} px from the nearest fisheye (limit {WORST_PX:g} px); "
            "calibrate as pinhole-equi (kb4)"
        )
    K = frozen([[fx * middle, 0.0, cx], [0.0, fy * middle, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(lens), width_px=size[0], height_px=size[1])
