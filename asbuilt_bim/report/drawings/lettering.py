"""Text on pictures: OpenCV 5's own font where there is one, the plain Hershey letters of OpenCV 4 otherwise."""

import unicodedata
from typing import Any

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.report.drawings.colours import bgr

_PLAIN = str.maketrans({"±": "+-", "²": "2", "³": "3", "…": "..", "–": "-", "·": "-", "ß": "ss", "\u202f": " "})
_HERSHEY_HEIGHT = 30.0  # pixels from descender to ascender at scale 1


def draw_text(image: ByteImage, text: str, left: float, baseline: float, size_px: float, colour: str) -> None:
    """Draw one line of text on `image` from `left`, standing on `baseline`."""
    at = (round(left), round(baseline))
    if hasattr(cv2, "FontFace"):
        call: Any = cv2.putText  # OpenCV 5's second form
        call(image, text, at, bgr(colour), cv2.FontFace("sans"), round(size_px), 500)
        return
    scale = size_px / _HERSHEY_HEIGHT
    cv2.putText(
        image, ascii_text(text), at, cv2.FONT_HERSHEY_SIMPLEX, scale, bgr(colour), _stroke(size_px), cv2.LINE_AA
    )


def text_width(text: str, size_px: float) -> float:
    """Return the width of one line of text in pixels."""
    if hasattr(cv2, "FontFace"):
        call: Any = cv2.getTextSize
        _, _, width, _ = call((10_000, 1000), text, (0, 500), cv2.FontFace("sans"), round(size_px), 500)
        return float(width)
    scale = size_px / _HERSHEY_HEIGHT
    (width, _), _ = cv2.getTextSize(ascii_text(text), cv2.FONT_HERSHEY_SIMPLEX, scale, _stroke(size_px))
    return float(width)


def ascii_text(text: str) -> str:
    """Write text in the letters that Hershey fonts have: umlauts lose their dots, ± becomes +-."""
    bare = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    letters = (c for c in bare if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else "?" for c in letters)


def shade(image: ByteImage, left: float, top: float, width: float, height: float, strength: float = 0.62) -> None:
    """Darken a box of `image`, so that light text on it can be read on any photo."""
    rows = slice(max(round(top), 0), max(round(top + height), 0))
    columns = slice(max(round(left), 0), max(round(left + width), 0))
    part = image[rows, columns]
    part[:] = np.round(part * (1.0 - strength) + 24.0 * strength).astype(np.uint8)


def _stroke(size_px: float) -> int:
    """Return the stroke width of Hershey letters."""
    return max(1, round(size_px / 14.0))
