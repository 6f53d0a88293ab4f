"""The report folder: each photo, what we labelled, what the network answered, and where they differ."""

from __future__ import annotations

from html import escape
from pathlib import Path

import cv2
import numpy as np
from asbuilt_bim.geometry.arrays import ByteImage
from numpy.typing import NDArray

from asbuilt_training.real.figures import DepthFigure, Figures
from asbuilt_training.real.labels import COLUMN, STONE, UNCLEAR, WALL
from asbuilt_training.real.score import Mask, Scored, by_view, mean_iou

RIGHT, WRONG, MISSED, UNJUDGED = (60, 180, 60), (40, 40, 230), (240, 140, 20), (160, 160, 160)
LABEL_COLOURS = {WALL: (60, 180, 60), COLUMN: (220, 180, 40), STONE: (220, 180, 40), UNCLEAR: UNJUDGED}
WIDTH_PX = 800
STYLE = (
    "body{font:15px sans-serif;margin:2em}img{max-width:49%;margin:2px}"
    "table{border-collapse:collapse}td,th{padding:2px 10px;text-align:left}"
)
KEY = "Green: concrete, found. Red: called concrete and is none. Blue: concrete, missed. Grey: nobody could tell."


def write_page(figures: Figures, folder: Path) -> Path:
    """Write `real.html` and its pictures; the pictures are others' photographs: keep the folder out of the project."""
    folder.mkdir(parents=True, exist_ok=True)
    worst_first = sorted(figures.scored, key=lambda one: one.counts.iou if np.isfinite(one.counts.iou) else 2.0)
    parts = [f"<!doctype html><meta charset=utf-8><title>Real photographs</title><style>{STYLE}</style>"]
    parts += [f"<h1>Real photographs, by {escape(figures.network)}</h1>", _table(figures)]
    parts.append(f"<p>{KEY}</p>")
    for number, one in enumerate(worst_first):
        labelled, judged = f"{number:02d}_labels.jpg", f"{number:02d}_answer.jpg"
        _save(folder / labelled, _labelled(one))
        _save(folder / judged, _judged(one))
        parts.append(
            f"<h3>{escape(one.photo.view)} ({one.photo.distance}): {escape(one.photo.file)}</h3><p>{_said(one)}</p>"
        )
        parts.append(f'<img src="{labelled}" alt="labels"><img src="{judged}" alt="answer">')
    for number, depth in enumerate(figures.depth):
        name = f"depth_{number}.jpg"
        _save(folder / name, _depth_picture(depth))
        e = depth.errors
        parts.append(f"<h3>depth, {escape(depth.name)}</h3><p>AbsRel {e.abs_rel:.3f}, within 1.25 {e.within:.1%}</p>")
        parts.append(f'<img src="{name}" alt="photo, truth and answer" style="max-width:98%">')
    path = folder / "real.html"
    path.write_text("\n".join(parts), encoding="utf-8")
    return path


def _said(one: Scored) -> str:
    c = one.counts
    return (
        f"IoU {c.iou:.2f}; found {c.recall:.0%} of the concrete; {c.precision:.0%} of what was called concrete is; "
        f"{c.alarms:.1%} of the photo called wrongly"
    )


def _table(figures: Figures) -> str:
    rows = ["<tr><th>view</th><th>photos</th><th>IoU</th></tr>"]
    for distance in ("far", "ground"):
        views = by_view(figures.scored, distance)
        for view, counts in views.items():
            values = ", ".join(f"{one.iou:.2f}" for one in counts)
            rows.append(f"<tr><td>{escape(view)} ({distance})</td><td>{len(counts)}</td><td>{values}</td></tr>")
        mean, n = mean_iou(views)
        rows.append(f"<tr><th>mean, {distance}</th><th>{n} views</th><th>{mean:.3f}</th></tr>")
    return f"<table>{''.join(rows)}</table>"


def _labelled(one: Scored) -> ByteImage:
    return _painted(one.image, [(one.kinds == kind, colour) for kind, colour in LABEL_COLOURS.items()])


def _judged(one: Scored) -> ByteImage:
    concrete = np.isin(one.kinds, (WALL, COLUMN, STONE))
    clear = one.kinds != UNCLEAR
    return _painted(one.image, [
        (~clear & one.answer, UNJUDGED), (concrete & one.answer, RIGHT), (concrete & ~one.answer, MISSED),
        (clear & ~concrete & one.answer, WRONG),
    ])  # fmt: skip


def _painted(image: ByteImage, layers: list[tuple[Mask, tuple[int, int, int]]]) -> ByteImage:
    painted = image.astype(np.float32)
    for mask, colour in layers:
        painted[mask] = 0.55 * painted[mask] + 0.45 * np.asarray(colour, dtype=np.float32)
    return painted.astype(np.uint8)


def _depth_picture(depth: DepthFigure) -> ByteImage:
    with np.errstate(divide="ignore", invalid="ignore"):
        truth = np.nan_to_num(1.0 / depth.truth_m, nan=0.0)
    return np.hstack([depth.image, _coloured(truth), _coloured(depth.relative)])


def _coloured(values: NDArray[np.float64]) -> ByteImage:
    """Return a map in colours, near ones bright, between the 2nd and the 98th of a hundred values."""
    low, high = np.percentile(values, [2.0, 98.0])
    level = np.clip((values - low) / max(high - low, 1e-9), 0.0, 1.0)
    return np.asarray(cv2.applyColorMap((255 * level).astype(np.uint8), cv2.COLORMAP_INFERNO), dtype=np.uint8)


def _save(path: Path, image: ByteImage) -> None:
    scale = min(1.0, 2 * WIDTH_PX / image.shape[1])
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    path.write_bytes(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes())
