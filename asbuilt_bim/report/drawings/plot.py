"""Axes on a picture: ticks, a grid, rings and a colour bar, drawn with OpenCV; no plotting library is needed."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray, IntArray
from asbuilt_bim.report.drawings.colours import bgr
from asbuilt_bim.report.drawings.lettering import draw_text, text_width

INK, GRID, PAPER = "#20262d", "#dfe3e8", "#ffffff"
TEXT_PX = 15.0
PALETTE = ("#e69f00", "#0072b2", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#8a8a00", "#7a5195")
"""Told apart by colour-blind eyes too (after Okabe and Ito)."""
_SHIFT = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """A box on a canvas (pixels) that shows a range of values, one scale for both axes; `down`: y grows downwards."""

    left: float
    top: float
    width: float
    height: float
    x0: float
    y0: float
    scale: float  # pixels per unit
    down: bool

    def place(self, points: FloatArray) -> FloatArray:
        """Return canvas pixels (N, 2) of values (N, 2)."""
        x = self.left + (points[:, 0] - self.x0) * self.scale
        y = (points[:, 1] - self.y0) * self.scale
        return np.stack([x, self.top + y if self.down else self.top + self.height - y], axis=-1)


def blank(width: int, height: int) -> ByteImage:
    """Return a white canvas."""
    return np.full((height, width, 3), 255, dtype=np.uint8)


def fitted_axes(box: tuple[float, float, float, float], points: FloatArray, *, down: bool) -> Axes:
    """Return axes in `box` (left, top, width, height) that show all points (N, 2) at one scale, with a margin."""
    left, top, width, height = box
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    scale = float(min(width / (1.12 * size[0]), height / (1.12 * size[1])))
    middle = 0.5 * (low + high)
    return Axes(
        left=left, top=top, width=width, height=height, x0=float(middle[0] - 0.5 * width / scale),
        y0=float(middle[1] - 0.5 * height / scale), scale=scale, down=down,
    )  # fmt: skip


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round numbers (1, 2 or 5 times a power of ten apart) from `low` to `high`, at most `most` or so."""
    rough = (high - low) / max(most, 1)
    power = 10.0 ** np.floor(np.log10(max(rough, 1e-12)))
    step = next(power * k for k in (1.0, 2.0, 5.0, 10.0) if power * k >= rough * (1.0 - 1e-9))
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [round(k * step, 10) for k in range(first, last + 1)]


def tick_text(value: float) -> str:
    """Write a tick without needless digits."""
    return f"{value + 0.0:.6g}"


def draw_axes(image: ByteImage, axes: Axes, title: str, x_name: str, y_name: str) -> None:
    """Draw frame, grid, ticks and names; the title stands above, the name of y above its ticks."""
    right, bottom = axes.left + axes.width, axes.top + axes.height
    for value in ticks(axes.x0, axes.x0 + axes.width / axes.scale):
        x = axes.left + (value - axes.x0) * axes.scale
        _line(image, (x, axes.top), (x, bottom), GRID, 1)
        text = tick_text(value)
        draw_text(image, text, x - 0.5 * text_width(text, TEXT_PX), bottom + 1.3 * TEXT_PX, TEXT_PX, INK)
    for value in ticks(axes.y0, axes.y0 + axes.height / axes.scale):
        y = float(axes.place(np.array([[axes.x0, value]]))[0, 1])
        _line(image, (axes.left, y), (right, y), GRID, 1)
        text = tick_text(value)
        draw_text(image, text, axes.left - text_width(text, TEXT_PX) - 8.0, y + 0.35 * TEXT_PX, TEXT_PX, INK)
    for a, b in (
        ((axes.left, axes.top), (right, axes.top)),
        ((right, axes.top), (right, bottom)),
        ((right, bottom), (axes.left, bottom)),
        ((axes.left, bottom), (axes.left, axes.top)),
    ):
        _line(image, a, b, INK, 1)
    draw_text(image, y_name, axes.left - 0.5 * TEXT_PX, axes.top - 0.6 * TEXT_PX, TEXT_PX, INK)
    draw_text(image, x_name, right - text_width(x_name, TEXT_PX), bottom + 2.6 * TEXT_PX, TEXT_PX, INK)
    draw_text(image, title, axes.left, axes.top - 2.2 * TEXT_PX, 1.15 * TEXT_PX, INK)


def draw_rings(
    image: ByteImage, axes: Axes, rings: Sequence[FloatArray], colour: str, *, fill: float = 0.25, thick: int = 2
) -> None:
    """Draw a polygon's rings (values), tinted inside; holes stay clear."""
    placed = [fixed(axes.place(ring)) for ring in rings]
    if fill > 0.0:
        tinted = image.copy()
        cv2.fillPoly(tinted, placed, bgr(colour), cv2.LINE_AA, _SHIFT)
        cv2.addWeighted(tinted, fill, image, 1.0 - fill, 0.0, dst=image)
    cv2.polylines(image, placed, True, bgr(colour), thick, cv2.LINE_AA, _SHIFT)


def colour_bar(
    image: ByteImage, box: tuple[float, float, float, float], colours: ByteImage, marks: Sequence[tuple[float, str]]
) -> None:
    """Draw a bar of colours (N, 1, 3), the first at the foot, in `box`; marks (share of the height, text) beside it."""
    left, top, width, height = (round(value) for value in box)
    bar = cv2.resize(colours[::-1], (width, height), interpolation=cv2.INTER_LINEAR)
    image[top : top + height, left : left + width] = bar.reshape(height, width, 3)
    cv2.rectangle(image, (left, top), (left + width, top + height), bgr(INK), 1, cv2.LINE_AA)
    for share, text in marks:
        y = top + (1.0 - share) * height
        _line(image, (left + width, y), (left + width + 5, y), INK, 1)
        draw_text(image, text, left + width + 9.0, y + 0.35 * TEXT_PX, TEXT_PX, INK)


def fixed(points: FloatArray) -> IntArray:
    """Return points in OpenCV's fixed-point pixels."""
    scaled: FloatArray = np.round(np.asarray(points, dtype=np.float64) * 2**_SHIFT)
    return scaled.astype(np.int32)


def _line(image: ByteImage, start: tuple[float, float], stop: tuple[float, float], colour: str, thick: int) -> None:
    a, b = fixed(np.array([start, stop]))
    cv2.line(image, a, b, bgr(colour), thick, cv2.LINE_AA, _SHIFT)
