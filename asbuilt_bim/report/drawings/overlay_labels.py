"""The labels of an overlay: what they say, what they point at, and where they find room."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.report import FaceRecord
from asbuilt_bim.report.drawings.label_placing import Box, free_box
from asbuilt_bim.report.drawings.not_counted import Verdicts
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.of_faces import UNCOUNTED, source_text
from asbuilt_bim.vision.masks.segment import InstanceSource

GLYPH_WIDTH = 0.58  # mean advance of a sans serif per text height, for placing before anything is drawn
MAX_NAME = 22  # longer names are cut on pictures; the tables hold them whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """Lines of text in a box: left, top, width, height in pixels of the picture.

    `leader` (x0, y0, x1, y1) runs from the face to a box that had to move off it; None where it lies on it.
    """

    lines: tuple[str, ...]
    left: float
    top: float
    width: float
    height: float
    leader: tuple[float, float, float, float] | None


def face_text(face: FaceRecord, names: Mapping[str, str], verdicts: Verdicts) -> tuple[str, ...]:
    """Write a face's label: its element and area; an unmatched face goes by its own id, on one line.

    What doesn't count as concrete has neither name nor area.
    """
    if (reason := verdicts.reason_of(face)) is not None:
        return (UNCOUNTED[reason],)
    known = [names[element] for element in verdicts.elements_of(face) if element in names]
    sigma = float(np.hypot(face.area_sigma_calibration_m2, face.area_sigma_image_m2))
    area = wording.area(face.area_m2, sigma) + ("" if face.whole else " (part)")
    alone = face.source is InstanceSource.GEOMETRY  # a word only where there were two opinions
    who = () if alone else (_cut(source_text(face.source, face.segmenter)),)
    if not known:
        return (f"{face.face_id.rpartition('/')[2]}: {area}", *who)
    more = f" +{len(known) - 1}" if len(known) > 1 else ""
    return (_cut(known[0]) + more, area, *who)


def _cut(name: str) -> str:
    """Shorten a name and take line ends out of it."""
    flat = " ".join(wording.plain(name).split())
    return flat if len(flat) <= MAX_NAME else f"{flat[: MAX_NAME - 1]}…"


def anchor_of(rings: tuple[FloatArray, ...], width: int, height: int) -> tuple[tuple[float, float] | None, float]:
    """Return the point of a face that is furthest from its border, and its share of the picture.

    The point is None where the face isn't in the picture.
    """
    reduce = max(width / 320.0, 1.0)
    mask = np.zeros((int(height / reduce) + 3, int(width / reduce) + 3), np.uint8)
    cv2.fillPoly(mask, [np.round(ring / reduce + 1).astype(np.int32) for ring in rings if len(ring) >= 3], (1,))
    mask[[0, -1], :] = 0
    mask[:, [0, -1]] = 0
    if not mask.any():
        return None, 0.0
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return (float((column - 1) * reduce), float((row - 1) * reduce)), float(mask.mean())


def place_label(
    anchor: tuple[float, float],
    lines: tuple[str, ...],
    text_px: float,
    bounds: tuple[float, float],
    taken: list[Box],
    *,
    leader: bool = True,
) -> Label:
    """Put a label at its anchor, or as near to it as other labels let it; enters it in `taken`."""
    wide = min((max(map(len, lines)) * GLYPH_WIDTH + 1.0) * text_px, bounds[0] - 2.0)
    high = (1.3 * len(lines) + 0.4) * text_px
    left, top, _, _ = free_box(anchor, wide, high, bounds, taken)
    x, y = min(max(anchor[0], left), left + wide), min(max(anchor[1], top), top + high)
    off = leader and (x, y) != anchor
    return Label(
        lines=lines,
        left=left,
        top=top,
        width=wide,
        height=high,
        leader=(anchor[0], anchor[1], x, y) if off else None,
    )
