"""The depth map in colours with its scale, and how far the measured surface lies off each face."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.report.drawings.colours import TARGET_COLOUR, bgr
from asbuilt_bim.report.drawings.label_placing import Box, free_box
from asbuilt_bim.report.drawings.lettering import draw_text, shade, text_width
from asbuilt_bim.report.drawings.overlay import narrowed
from asbuilt_bim.report.drawings.overlay_labels import anchor_of
from asbuilt_bim.report.drawings.plot import INK, PAPER, TEXT_PX, blank, colour_bar, fixed, tick_text, ticks

PICTURE_WIDTH = 1100
HOLE = "#3a3f45"
SMOOTH_PX = 9
"""The matcher's own window: what is finer than it is noise, not surface."""
LEAST_RANGE_M = 0.005
BELOW_TITLE = np.array([0.0, round(3 * TEXT_PX)])


def depth_figure(found: PairMeasurement) -> ByteImage:
    """Draw the depth map that the areas come from, near in red and far in blue; what has no depth is dark grey."""
    depth = found.detail.depth
    z = depth.depth_m
    known = np.isfinite(z)
    if not known.any():
        return _framed(np.full((*z.shape, 3), bgr(HOLE), dtype=np.uint8), "no pixel has a depth")[0]
    near, far = np.quantile(z[known], [0.01, 0.97])
    low, high = 1.0 / far, 1.0 / near  # even steps of disparity: what stereo resolves
    share = np.clip((1.0 / np.where(known, z, far) - low) / max(high - low, 1e-9), 0.0, 1.0)
    image = _coloured(share)
    image[~known] = bgr(HOLE)
    names = {"stereo": "stereo, left-right checked", "paper": "network's, scaled by the target (eq. 4)"}
    title = f"depth Z along the camera's axis: {names.get(depth.method, 'stereo, holes filled by a network')}"
    canvas, scale = _framed(image, title)
    if found.target is not None:
        centre, radius = (found.target.left_px + 0.5) * scale - 0.5, found.target.radius_px * scale
        at = fixed(centre + BELOW_TITLE)
        cv2.circle(canvas, (int(at[0]), int(at[1])), round((radius + 3) * 16), bgr(TARGET_COLOUR), 2, cv2.LINE_AA, 4)
        text = f"target Z {found.target.depth_m:.3f} m"
        wide = text_width(text, TEXT_PX)
        left = min(max(float(centre[0]) - 0.5 * wide, 4.0), canvas.shape[1] - 134.0 - wide)
        below = float(at[1] / 16 + radius) + 1.8 * TEXT_PX
        foot = below if below < canvas.shape[0] - 6 else float(at[1] / 16 - radius) - TEXT_PX
        shade(canvas, left - 4.0, foot - 1.1 * TEXT_PX, wide + 8.0, 1.5 * TEXT_PX)
        draw_text(canvas, text, left, foot, TEXT_PX, PAPER)
    marks = [((1.0 / v - low) / (high - low), f"{tick_text(v)} m") for v in _depth_ticks(near, far)]
    _bar(canvas, _coloured(np.linspace(0.0, 1.0, 256)[:, None]), marks)
    return canvas


def flatness_figure(found: PairMeasurement) -> ByteImage:
    """Draw how far the measured surface lies off each face: blue behind it, red before it, smoothed a little."""
    pair = found.detail.shown
    image = np.round(0.35 * pair.left + 0.65 * 230.0).astype(np.uint8)
    shown = [(face, *_deviation(found, face)) for face in found.faces]
    spreads = [float(np.sqrt(np.mean(np.square(off[inside])))) for _, inside, off in shown if inside.any()]
    # the usual face fills the scale; a far one, all noise, may run over it
    most = max(ticks(0.0, 3.0 * float(np.median(spreads)), 3)[-1] if spreads else 0.0, LEAST_RANGE_M)
    for _, inside, off in shown:
        image[inside] = _diverging(np.clip(off[inside] / most, -1.0, 1.0))
    canvas, scale = _framed(image, "deviation from each face along its normal, and its rms (matching noise included)")
    taken: list[Box] = []
    for face, inside, _ in shown:
        rings = tuple((ring + 0.5) * scale - 0.5 for ring in face.outline_px)
        moved = [fixed(ring + BELOW_TITLE) for ring in rings]
        cv2.polylines(canvas, moved, True, bgr(INK), 1, cv2.LINE_AA, 4)
        anchor, _ = anchor_of(rings, canvas.shape[1], canvas.shape[0])
        if anchor is not None and inside.any():
            text = f"{face.face_id.rpartition('/')[2]}: {1000.0 * face.flatness_rms_m:.1f} mm"
            wide, bounds = text_width(text, TEXT_PX) + 8.0, (canvas.shape[1] - 130.0, float(canvas.shape[0]))
            left, top, _, high = free_box((anchor[0], anchor[1] + 3 * TEXT_PX), wide, 1.5 * TEXT_PX, bounds, taken)
            shade(canvas, left, top, wide, high)
            draw_text(canvas, text, left + 4.0, top + 1.1 * TEXT_PX, TEXT_PX, PAPER)
    bar = _diverging(np.linspace(-1.0, 1.0, 255)).reshape(-1, 1, 3)
    marks = [(0.5 + 0.5 * v / most, f"{1000.0 * v:+.4g} mm" if v else "0") for v in ticks(-most, most, 8)]
    _bar(canvas, bar, marks)
    return canvas


def _deviation(found: PairMeasurement, face: MeasuredFace) -> tuple[BoolArray, FloatArray]:
    """Return where a face was measured (H, W) and how far before it the surface lies there (H, W), metres."""
    depth, camera = found.detail.depth, found.detail.pair.camera
    canvas = np.zeros(depth.valid.shape, dtype=np.uint8)
    cv2.fillPoly(canvas, [fixed(ring) for ring in face.outline_px], (1,), cv2.LINE_8, 4)
    inside = (canvas > 0) & depth.valid & found.instance_of(face).mask
    rows, columns = np.nonzero(inside)
    off = np.zeros(depth.valid.shape)
    if rows.size == 0:
        return inside, off
    points = camera.points(np.stack([columns, rows], axis=-1), depth.disparity_px[inside])
    frame = face.frame
    off[inside] = frame.distance_m(points) if isinstance(frame, CylinderFrame) else frame.plane.distance_m(points)
    weight = cv2.boxFilter(inside.astype(np.float64), -1, (SMOOTH_PX, SMOOTH_PX), normalize=False)
    smooth = cv2.boxFilter(off, -1, (SMOOTH_PX, SMOOTH_PX), normalize=False) / np.maximum(weight, 1.0)
    return inside, np.asarray(smooth)


def _framed(image: ByteImage, title: str) -> tuple[ByteImage, float]:
    """Return the picture on a canvas with room for a title above and a bar to the right, and its scale."""
    small = narrowed(image, PICTURE_WIDTH)
    top = round(3 * TEXT_PX)
    canvas = blank(small.shape[1] + 130, small.shape[0] + top)
    canvas[top:, : small.shape[1]] = small
    draw_text(canvas, title, 10.0, 1.9 * TEXT_PX, 1.15 * TEXT_PX, INK)
    return canvas, small.shape[1] / image.shape[1]


def _bar(canvas: ByteImage, colours: ByteImage, marks: list[tuple[float, str]]) -> None:
    top = 3 * TEXT_PX + 20.0
    colour_bar(canvas, (canvas.shape[1] - 115.0, top, 20.0, canvas.shape[0] - top - 20.0), colours, marks)


def _coloured(share: FloatArray) -> ByteImage:
    levels = np.round(share * 255.0).astype(np.uint8)
    return np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_TURBO), dtype=np.uint8)


def _diverging(values: FloatArray) -> ByteImage:
    """Return colours (N, 3) BGR of values (N,) from -1 (blue) over 0 (near white) to 1 (red)."""
    stops = np.array([bgr(c) for c in ("#2166ac", "#92c5de", "#f7f7f7", "#f4a582", "#b2182b")], dtype=np.float64)
    at = (values + 1.0) * 2.0
    mixed = np.stack([np.interp(at, np.arange(5), stops[:, channel]) for channel in range(3)], axis=-1)
    return np.round(mixed).astype(np.uint8)


def _depth_ticks(near: float, far: float) -> list[float]:
    """Return round distances, closer where the scale is wide."""
    round_ = np.array([0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 15, 20, 30, 50, 100])
    inside = round_[(round_ >= near) & (round_ <= far)]
    kept: list[float] = []
    for value in inside:
        if not kept or (1.0 / kept[-1] - 1.0 / value) / (1.0 / near - 1.0 / far) > 0.035:
            kept.append(float(value))
    return kept
