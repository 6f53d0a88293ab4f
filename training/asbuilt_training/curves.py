"""A training run's record: one row a look, as CSV and as a small picture of curves."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np

WIDTH_PX, HEIGHT_PX, MARGIN_PX = 760, 190, 34
SHOWN = (
    "loss",
    "class_loss",
    "offset_loss",
    "depth_loss",
    "wall_iou",
    "column_iou",
    "concrete_iou",
    "concrete_iou_without",
    "abs_rel",
    "delta",
)
COLOURS = ((180, 90, 20), (40, 120, 220), (60, 150, 60), (150, 60, 150))

Row = dict[str, float]


def write_csv(path: Path, rows: list[Row]) -> None:
    """Write the rows; a look that didn't measure something leaves its field empty."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names, restval="")
        writer.writeheader()
        writer.writerows({k: f"{v:.6g}" for k, v in row.items()} for row in rows)


def plot(path: Path, rows: list[Row]) -> None:
    """Draw each curve over minutes, one panel a figure."""
    panels = [_panel(name, rows) for name in SHOWN if sum(name in row for row in rows) >= 2]
    if panels:
        cv2.imwrite(str(path), np.vstack(panels))


def _panel(name: str, rows: list[Row]) -> np.ndarray:
    points = np.array([(row["minutes"], row[name]) for row in rows if np.isfinite(row.get(name, np.nan))])
    canvas = np.full((HEIGHT_PX, WIDTH_PX, 3), 255, dtype=np.uint8)
    if len(points) < 2:
        return canvas
    low, high = points.min(axis=0), points.max(axis=0)
    span = np.maximum(high - low, 1e-9)
    size = (WIDTH_PX - 2 * MARGIN_PX, HEIGHT_PX - 2 * MARGIN_PX)
    at = MARGIN_PX + (points - low) / span * size
    at[:, 1] = HEIGHT_PX - at[:, 1]
    cv2.rectangle(canvas, (MARGIN_PX, MARGIN_PX), (WIDTH_PX - MARGIN_PX, HEIGHT_PX - MARGIN_PX), (200, 200, 200))
    cv2.polylines(canvas, [np.round(at).astype(np.int32)], False, COLOURS[SHOWN.index(name) % 4], 2, cv2.LINE_AA)
    for text, y in ((f"{high[1]:.3g}", MARGIN_PX), (f"{low[1]:.3g}", HEIGHT_PX - MARGIN_PX)):
        cv2.putText(canvas, text, (2, y), cv2.FONT_HERSHEY_SIMPLEX, 0.33, (90, 90, 90), 1, cv2.LINE_AA)
    title = f"{name}: {points[-1, 1]:.4g} after {high[0]:.0f} min"
    cv2.putText(canvas, title, (MARGIN_PX, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (30, 30, 30), 1, cv2.LINE_AA)
    return canvas
