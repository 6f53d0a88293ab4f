"""Does the lens model hold? What another model explains of the residuals was no noise of corners."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust
from asbuilt_bim.camera.calibration.parameters import BoardView, layout_of
from asbuilt_bim.camera.lens import COEFFICIENTS, LensModel
from asbuilt_bim.geometry.arrays import FloatArray, IntArray

_OTHER: dict[LensModel, LensModel] = {"five": "rational", "rational": "fisheye", "fisheye": "rational"}
_LESS = 0.9
"""Of the rms: a handful of parameters more take a thousandth off the noise of a thousand corners, never a tenth."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CornerFit:
    """A camera's corners: pixels (N, 2) as seen, residual (N, 2) computed less seen, and the view (N,) of each."""

    pixels: FloatArray
    residual_px: FloatArray
    view: IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class BetterLens:
    """Another model that fits better, and what the present one leaves: the root of the difference of squares."""

    model: LensModel
    left_px: float


def better_lens(views: list[BoardView], adjusted: Adjustment) -> BetterLens | None:
    """Fit the next richer model to the same corners; None where it explains nothing more."""
    present = layout_of(adjusted.shared)
    model = _OTHER[present.lens]
    keeps = COEFFICIENTS["five"] if present.lens == "five" else 0  # rational begins with the same five
    cameras = [
        np.concatenate([camera[: 4 + keeps], np.zeros(COEFFICIENTS[model] - keeps)])
        for camera in (adjusted.shared[present.of_side(side)] for side in (0, 1))
    ]
    try:
        other = adjust(np.concatenate([*cameras, adjusted.shared[-6:]]), adjusted.poses, views)
    except np.linalg.LinAlgError:
        return None
    if not other.rms_px < _LESS * adjusted.rms_px:
        return None
    return BetterLens(model=model, left_px=float(np.sqrt(adjusted.rms_px**2 - other.rms_px**2)))
