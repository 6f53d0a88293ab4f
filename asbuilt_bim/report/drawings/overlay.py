"""`overlays/<station>.jpg`: the rectified left photo with the measured faces and the target drawn on it."""

import cv2
import numpy as np

from asbuilt_bim.errors import OutputError
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray, IntArray
from asbuilt_bim.progress.report import StationRecord
from asbuilt_bim.report.drawings.colours import TARGET_COLOUR, bgr
from asbuilt_bim.report.drawings.lettering import draw_text, shade, text_width
from asbuilt_bim.report.drawings.overlay_labels import Label
from asbuilt_bim.report.drawings.overlay_layout import Known, Outline, OverlayLayout, overlay_layout
from asbuilt_bim.report.drawings.private import Shower

MAX_WIDTH_PX = 1280  # what a screen shows; the photos themselves stay with the project
JPEG_QUALITY = 88
_SHIFT = 4  # OpenCV's sub-pixel bits
_INK, _PAPER = "#ffffff", "#20262d"


def draw_overlay(picture_jpeg: bytes, station: StationRecord, known: Known, shower: Shower) -> bytes:
    """Return the overlay of one station as JPEG bytes, with what may be shown; encoded anew, so that no EXIF passes.

    Raises:
        OutputError: the picture can't be decoded.
    """
    image = decode_picture(picture_jpeg, f"station {station.name}")
    image = shower.shown(image, station).copy()
    layout = overlay_layout(station, known, image.shape[1], image.shape[0])
    title = f"{station.name}   {station.day.isoformat()}"
    return encode_picture(draw_layout(image, layout, title), JPEG_QUALITY)


def draw_layout(image: ByteImage, layout: OverlayLayout, title: str) -> ByteImage:
    """Draw a layout on its picture (which is changed) and set a strip with the title and the colours below it."""
    _fill(image, layout.outlines)
    for outline in layout.outlines:
        _stroke(image, outline, max(2, round(layout.text_px / (12 if outline.dashed else 7))))
    if layout.disc is not None:
        _draw_disc(image, layout.disc, layout.text_px)
    for label in layout.labels:
        _draw_leader(image, label)
    for label in layout.labels:
        _draw_label(image, label, layout.text_px)
    return np.vstack([image, _legend(layout, title)])


def decode_picture(data: bytes, what: str) -> ByteImage:
    """Decode a picture to BGR, at most `MAX_WIDTH_PX` wide.

    Raises:
        OutputError: it can't be decoded.
    """
    image = (
        cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION) if data else None
    )
    if image is None:
        raise OutputError(f"{what}: its picture can't be decoded; run the visit again")
    return narrowed(np.asarray(image, dtype=np.uint8), MAX_WIDTH_PX)


def narrowed(image: ByteImage, width_px: int) -> ByteImage:
    """Return the picture at most `width_px` wide."""
    if image.shape[1] <= width_px:
        return image
    height = round(image.shape[0] * width_px / image.shape[1])
    return np.asarray(cv2.resize(image, (width_px, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def encode_picture(image: ByteImage, quality: int) -> bytes:
    """Encode a picture as JPEG without any metadata.

    Raises:
        OutputError: OpenCV can't.
    """
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise OutputError(f"a picture of {image.shape[1]} x {image.shape[0]} px can't be encoded as JPEG")
    return data.tobytes()


def _fill(image: ByteImage, outlines: tuple[Outline, ...]) -> None:
    """Tint the matched faces."""
    tinted = image.copy()
    for outline in outlines:
        if not outline.dashed:
            cv2.fillPoly(tinted, [_fixed(ring) for ring in outline.rings], bgr(outline.colour), cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(tinted, 0.26, image, 0.74, 0.0, dst=image)


def _stroke(image: ByteImage, outline: Outline, thick: int) -> None:
    """Draw a face's rings with a dark edge; dashed where it is unmatched."""
    for ring in outline.rings:
        lines = _dashes(ring, 5.0 * thick) if outline.dashed else [ring]
        pieces = [_fixed(line) for line in lines]
        closed = not outline.dashed
        cv2.polylines(image, pieces, closed, bgr(_PAPER), thick + 2, cv2.LINE_AA, _SHIFT)
        cv2.polylines(image, pieces, closed, bgr(outline.colour), thick, cv2.LINE_AA, _SHIFT)


def _dashes(ring: FloatArray, dash_px: float) -> list[FloatArray]:
    """Cut a closed ring into dashes, as many as fit, each two points."""
    points = np.vstack([ring, ring[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(int(along[-1] / (2.0 * dash_px)), 1)
    starts = np.arange(count) * (along[-1] / count)
    stops = starts + along[-1] / count / 2.0
    at = np.stack([starts, stops], axis=1)
    both = np.stack([np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])], axis=-1)
    return list(both)


def _draw_disc(image: ByteImage, disc: tuple[float, float, float], text_px: float) -> None:
    """Ring the target, with a cross at its centre."""
    x, y, r = disc
    centre = (round(x * 2**_SHIFT), round(y * 2**_SHIFT))
    thick = max(2, round(text_px / 7))
    for colour, width in ((_PAPER, thick + 2), (TARGET_COLOUR, thick)):
        cv2.circle(image, centre, round((r + 2 * thick) * 2**_SHIFT), bgr(colour), width, cv2.LINE_AA, _SHIFT)
    for dx, dy in ((0.35 * r, 0.0), (0.0, 0.35 * r)):
        start, stop = _fixed(np.array([[x - dx, y - dy], [x + dx, y + dy]]))
        cv2.line(image, start, stop, bgr(_INK), 1, cv2.LINE_AA, _SHIFT)


def _draw_leader(image: ByteImage, label: Label) -> None:
    """Draw the line from a face to a label that lies off it."""
    if label.leader is None:
        return
    start, stop = _fixed(np.array(label.leader).reshape(2, 2))
    for colour, thick in ((_PAPER, 3), (_INK, 1)):
        cv2.line(image, start, stop, bgr(colour), thick, cv2.LINE_AA, _SHIFT)
    cv2.circle(image, start, 3 * 2**_SHIFT, bgr(_INK), -1, cv2.LINE_AA, _SHIFT)


def _draw_label(image: ByteImage, label: Label, text_px: float) -> None:
    """Write a label on its darkened box, centred."""
    shade(image, label.left, label.top, label.width, label.height)
    for index, line in enumerate(label.lines):
        size = text_px * min(1.0, (label.width - 4.0) / max(text_width(line, text_px), 1.0))
        left = label.left + (label.width - text_width(line, size)) / 2.0
        draw_text(image, line, left, label.top + (1.15 + 1.3 * index) * text_px, size, _INK)


def _legend(layout: OverlayLayout, title: str) -> ByteImage:
    """Draw the strip below the picture: its title and what the colours say."""
    size = layout.text_px
    strip = np.full((round(2.4 * size), layout.width, 3), bgr(_PAPER), np.uint8)
    baseline, x = 1.5 * size, 0.8 * size
    draw_text(strip, title, x, baseline, size, _INK)
    x += text_width(title, size) + 2.0 * size
    meanings = dict.fromkeys((outline.meaning, outline.colour) for outline in layout.outlines if outline.meaning)
    entries = [*meanings, *([("target", TARGET_COLOUR)] if layout.disc is not None else [])]
    for meaning, colour in entries:
        if x + 1.5 * size + text_width(meaning, size) > layout.width:
            break
        cv2.rectangle(strip, (round(x), round(0.75 * size)), (round(x + size), round(1.6 * size)), bgr(colour), -1)
        draw_text(strip, meaning, x + 1.4 * size, baseline, size, _INK)
        x += text_width(meaning, size) + 3.0 * size
    return strip


def _fixed(points: FloatArray) -> IntArray:
    """Return points in OpenCV's fixed-point pixels."""
    scaled: FloatArray = np.round(np.asarray(points, dtype=np.float64) * 2**_SHIFT)
    return scaled.astype(np.int32)
