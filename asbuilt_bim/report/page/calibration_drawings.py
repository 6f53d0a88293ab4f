"""Drawings of a calibration: where corners were seen and how they were missed, what the lens leaves, view by view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCES_M, AreaEffect
from asbuilt_bim.camera.calibration.calibrate import Calibration, ViewFit
from asbuilt_bim.camera.calibration.lens_check import CornerFit
from asbuilt_bim.camera.intrinsics import Intrinsics

CELLS = (16, 12)
MOST_ARROWS = 900
_ARROW_SHARE = 0.04  # of the frame's width: the length of an arrow of the scale's residual


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell of the frame in pixels, how many corners it holds, and that as a shade 0 to 1."""

    x: float
    y: float
    corners: int
    shade: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrow:
    """One corner's residual, drawn larger: from where it was seen, towards where the rig puts it."""

    x: float
    y: float
    dx: float
    dy: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameDrawing:
    """One camera's frame: coverage and residuals. `scale_px` is the residual that `scale_length` pixels stand for."""

    side: str
    width: int
    height: int
    cell_width: float
    cell_height: float
    cells: tuple[Cell, ...]
    arrows: tuple[Arrow, ...]
    scale_px: float
    scale_length: float
    left_out: int  # arrows too many to draw


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewBar:
    """One view's line: its fit, and both rms as shares of the longest bar."""

    view: ViewFit
    left_share: float
    right_share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MapCell:
    """One cell of a frame in pixels, sigma of an area there, and that as a shade 0 to 1; None where nothing is seen."""

    x: float
    y: float
    sigma: float | None
    shade: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaMap:
    """Sigma of a square metre's area over the left frame, at one distance."""

    distance_m: float
    width: int
    height: int
    cell_width: float
    cell_height: float
    cells: tuple[MapCell, ...]


def area_maps(effect: AreaEffect, camera: Intrinsics) -> tuple[AreaMap, ...]:
    """Draw what calibration does to an area over the left frame, at each distance; all with one scale of shades."""
    down, across = effect.maps.shape[1:]
    width, height = camera.width_px / across, camera.height_px / down
    darkest = float(np.nanmax(effect.maps))
    return tuple(
        AreaMap(
            distance_m=distance_m, width=camera.width_px, height=camera.height_px, cell_width=width, cell_height=height,
            cells=tuple(
                MapCell(
                    x=x * width, y=y * height, sigma=float(one[y, x]) if np.isfinite(one[y, x]) else None,
                    shade=float(one[y, x]) / darkest if np.isfinite(one[y, x]) else 0.0,
                )
                for y in range(down)
                for x in range(across)
            ),
        )
        for distance_m, one in zip(DISTANCES_M, effect.maps, strict=True)
    )  # fmt: skip


def arrow_scale_px(fits: Sequence[CornerFit]) -> float:
    """Return the residual that both frames' scale stands for: a round number that one in ten is longer than."""
    lengths = np.concatenate([np.linalg.norm(fit.residual_px, axis=1) for fit in fits])
    return _nice(float(np.quantile(lengths, 0.9)) if len(lengths) else 0.1)


def frame_drawing(side: str, camera: Intrinsics, fit: CornerFit, scale_px: float) -> FrameDrawing:
    """Draw one camera's corners over its frame, an arrow of `scale_px` as long as the scale."""
    size = np.array([camera.width_px, camera.height_px], dtype=np.float64)
    at = np.clip(np.floor((fit.pixels + 0.5) / size * CELLS), 0, np.array(CELLS) - 1).astype(int)
    counts = np.zeros((CELLS[1], CELLS[0]), dtype=int)
    np.add.at(counts, (at[:, 1], at[:, 0]), 1)
    full = max(float(np.quantile(counts[counts > 0], 0.9)) if counts.any() else 1.0, 1.0)
    width, height = size / CELLS
    cells = tuple(
        Cell(x=x * width, y=y * height, corners=int(counts[y, x]), shade=min(1.0, float(counts[y, x]) / full))
        for y in range(CELLS[1])
        for x in range(CELLS[0])
    )
    factor = _ARROW_SHARE * size[0] / scale_px
    every = max(1, int(np.ceil(len(fit.pixels) / MOST_ARROWS)))
    arrows = tuple(
        Arrow(x=float(p[0]), y=float(p[1]), dx=float(r[0] * factor), dy=float(r[1] * factor))
        for p, r in zip(fit.pixels[::every], fit.residual_px[::every], strict=True)
    )
    return FrameDrawing(
        side=side, width=camera.width_px, height=camera.height_px, cell_width=float(width), cell_height=float(height),
        cells=cells, arrows=arrows, scale_px=scale_px, scale_length=float(_ARROW_SHARE * size[0]),
        left_out=len(fit.pixels) - len(arrows),
    )  # fmt: skip


def _nice(value: float) -> float:
    """Round up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-3)))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * 0.999))


def view_bars(calibration: Calibration) -> tuple[ViewBar, ...]:
    """Return the views, the worst first."""
    longest = max((max(v.rms_left_px, v.rms_right_px) for v in calibration.views), default=1.0) or 1.0
    ordered = sorted(calibration.views, key=lambda v: -max(v.rms_left_px, v.rms_right_px))
    return tuple(
        ViewBar(view=view, left_share=view.rms_left_px / longest, right_share=view.rms_right_px / longest)
        for view in ordered
    )
