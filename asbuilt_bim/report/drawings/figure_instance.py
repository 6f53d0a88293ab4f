"""One wall or column as the paper's figures 10, 11 and 13: its mask, its boundary in pixels, itself in metres."""

from collections.abc import Sequence

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.measure.algorithm_1 import boundary_pixels
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.report.drawings.colours import bgr
from asbuilt_bim.report.drawings.lettering import draw_text
from asbuilt_bim.report.drawings.plot import INK, PALETTE, TEXT_PX, blank, draw_axes, draw_rings, fitted_axes, fixed
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.of_faces import source_text

WIDTH, HEIGHT = 1500, 660
PANEL = 440.0
GAP_M = 0.15
"""Between the faces of one wall or column when they are laid side by side."""


def instance_figure(found: PairMeasurement, number: int) -> ByteImage:
    """Draw instance `number` (from 0) in three panels, each face in its own colour.

    The third panel lays the faces side by side, each in its own plane; with method paper it shows X_w and Y_w.
    """
    faces = [face for face in found.faces if face.instance == number]
    faces = sorted(faces, key=lambda face: float(face.outline_px[0][:, 0].mean()))
    instance = found.detail.instances[number]
    image = blank(WIDTH, HEIGHT)
    top, height = 90.0, 470.0
    _photo_panel(image, found, number, faces, (30.0, top, PANEL, height))
    contour = boundary_pixels(instance.mask)
    rings = [ring for face in faces for ring in face.outline_px]
    axes = fitted_axes((570.0, top, 390.0, height), np.concatenate([contour, *rings]), down=True)
    draw_axes(image, axes, "(b) boundary, pixels of the rectified photo", "x (px)", "y (px)")
    draw_rings(image, axes, [contour], "#9aa3ad", fill=0.0, thick=1)
    for index, face in enumerate(faces):
        draw_rings(image, axes, face.outline_px, PALETTE[index % len(PALETTE)], fill=0.0)
    laid = _laid_out(found, faces)
    axes = fitted_axes(
        (1060.0, top, 410.0, height), np.concatenate([ring for part in laid for ring in part]), down=False
    )
    published = found.options.method == "paper"
    names = ("X_w (m)", "-Y_w (m)") if published else ("along the faces (m)", "height (m)")
    title = "(c) real-world coordinates, eq. 5 and 6" if published else "(c) reconstruction in metres"
    draw_axes(image, axes, title, *names)
    for index, part in enumerate(laid):
        draw_rings(image, axes, part, PALETTE[index % len(PALETTE)])
    _legend(image, found, faces, 0.0 + top + height + 3.2 * TEXT_PX)
    draw_text(
        image,
        f"{instance.label} {number + 1} ({wording.plain(source_text(instance.source, instance.segmenter))[:60]})",
        30.0,
        30.0,
        20.0,
        INK,
    )
    return image


def face_name(face: MeasuredFace) -> str:
    """Return a face's number, without its station."""
    return face.face_id.rpartition("/")[2]


def size_text(face: MeasuredFace) -> str:
    """Write a face's width and height; on a cylinder the width is the diameter."""
    size = f"{face.width_m:.2f} x {face.height_m:.2f} m"
    return f"diameter {size}" if isinstance(face.frame, CylinderFrame) else size


def _photo_panel(
    image: ByteImage, found: PairMeasurement, number: int, faces: Sequence[MeasuredFace], box: tuple[float, ...]
) -> None:
    """Show the photo round the instance, its mask tinted and the faces' outlines on it."""
    left, top, width, height = (round(value) for value in box)
    instance = found.detail.instances[number]
    pair = found.detail.shown
    x0, y0, x1, y1 = instance.box_px
    margin = max(12, round(0.08 * max(x1 - x0, y1 - y0)))
    x0, y0 = max(0, x0 - margin), max(0, y0 - margin)
    x1, y1 = min(pair.left.shape[1], x1 + margin), min(pair.left.shape[0], y1 + margin)
    crop = pair.left[y0:y1, x0:x1].astype(np.float32)
    mask = instance.mask[y0:y1, x0:x1]
    crop[mask] = 0.65 * crop[mask] + 0.35 * np.array(bgr("#009e73"), dtype=np.float32)
    scale = min(width / (x1 - x0), height / (y1 - y0))
    method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
    shown = cv2.resize(np.clip(crop, 0, 255).astype(np.uint8), None, fx=scale, fy=scale, interpolation=method)
    for index, face in enumerate(faces):
        rings = [fixed((ring - [x0, y0] + 0.5) * scale - 0.5) for ring in face.outline_px]
        cv2.polylines(shown, rings, True, bgr(PALETTE[index % len(PALETTE)]), 2, cv2.LINE_AA, 4)
    h, w = min(shown.shape[0], height), min(shown.shape[1], width)
    off = (width - w) // 2
    image[top : top + h, left + off : left + off + w] = shown[:h, :w]
    draw_text(image, "(a) photo and mask", left, top - 2.2 * TEXT_PX, 1.15 * TEXT_PX, INK)


def _laid_out(found: PairMeasurement, faces: Sequence[MeasuredFace]) -> list[tuple[FloatArray, ...]]:
    """Return each face's rings (N, 2) in metres: side by side by their u, upright by their height over one level."""
    if found.options.method == "paper":
        return [face.outline_uv_m for face in faces]
    up = found.detail.measurement.vertical
    laid: list[tuple[FloatArray, ...]] = []
    at = 0.0
    for face in faces:
        low, high = face.outline_uv_m[0][:, 0].min(), face.outline_uv_m[0][:, 0].max()
        rings = []
        for ring in face.outline_uv_m:
            height = ring[:, 1] if up is None else face.frame.from_uv(ring) @ up
            rings.append(np.stack([ring[:, 0] - low + at, height], axis=-1))
        laid.append(tuple(rings))
        at += float(high - low) + GAP_M
    foot = min(float(ring[:, 1].min()) for part in laid for ring in part)
    return [tuple(ring - [0.0, foot] for ring in part) for part in laid]


def _legend(image: ByteImage, found: PairMeasurement, faces: Sequence[MeasuredFace], top: float) -> None:
    """Write each face's numbers in its colour, and their sum."""
    stated = found.options.method == "default"
    across, down = 30.0, top + TEXT_PX
    for index, face in enumerate(faces):
        area = wording.area(face.area_m2, face.area_sigma_m2 if stated else None)
        text = f"face {face_name(face)}: {size_text(face)}, A = {area}"
        x, y = across + 490.0 * (index % 3), down + 1.6 * TEXT_PX * (index // 3)
        if y > HEIGHT - 4:
            break
        cv2.rectangle(
            image, (round(x), round(y - 0.8 * TEXT_PX)), (round(x + TEXT_PX), round(y + 0.1 * TEXT_PX)),
            bgr(PALETTE[index % len(PALETTE)]), -1,
        )  # fmt: skip
        draw_text(image, text, x + 1.5 * TEXT_PX, y, TEXT_PX, INK)
