"""Writes a whole project folder: IFC, project file, marker survey, board pairs, photos of the visits, truth."""

from __future__ import annotations

import csv
import json
import sys
import time
from collections.abc import Callable
from datetime import datetime, timedelta
from datetime import time as clock_time
from importlib import import_module
from pathlib import Path

import numpy as np

from asbuilt_synthetic.boards import BOARD_PAIRS, Board, board_scenes
from asbuilt_synthetic.ifc_file import write_ifc
from asbuilt_synthetic.model import Marker, Scene, Station
from asbuilt_synthetic.photo_file import ExifTags, write_photo
from asbuilt_synthetic.rig import rig_truth
from asbuilt_synthetic.scene import STATIONS, scene, site
from asbuilt_synthetic.truth_file import truth_document

_CORNERS = ("top-left", "top-right", "bottom-right", "bottom-left")
_PIXEL_MM = 0.0045


def write_site(
    seed: int,
    out: Path,
    renderer: str = "raycast",
    visits: int = 2,
    stations: int = STATIONS,
    board_renderer: str | None = None,
    board_count: int = BOARD_PAIRS,
    truth: bool = True,
    *,
    shuttered: bool = False,
) -> None:
    """Write the project folder of a seed; photos that are there already are kept (resumable).

    `renderer` and `board_renderer` are "raycast" or "cycles"; boards follow the renderer where not given.
    On a `shuttered` site formwork of thick panels stands round all that is absent.
    """
    out.mkdir(parents=True, exist_ok=True)
    here = site(seed)
    write_ifc(here.building, out / "design.ifc")
    scenes = [scene(seed, v, stations, shuttered=shuttered) for v in range(visits)]
    _write_markers(out / "markers.csv", here.tags.markers(here.building))
    (out / "project.yaml").write_text(_project_text(here.building.name, here.tags.size_m, scenes), encoding="utf-8")
    if truth:
        text = json.dumps(truth_document(seed, scenes), indent=1)
        (out / "truth.json").write_text(text + "\n", encoding="utf-8")
    for s in scenes:
        _photos(s, out, renderer)
    _boards(seed, out, board_renderer or renderer, board_count)


def photo_path(scene_: Scene, station: Station, side: str) -> Path:
    """Return where a photo lies in the project folder."""
    return Path("visits") / scene_.day.isoformat() / f"{station.name}_{side}.jpg"


def _renderer(name: str) -> Callable[[Scene, Station, str], np.ndarray]:
    """Load a renderer by its name; Cycles only where it is asked for."""
    found: Callable[[Scene, Station, str], np.ndarray] = import_module(f"asbuilt_synthetic.{name}").render
    return found


def _photos(s: Scene, out: Path, renderer: str) -> None:
    render = _renderer(renderer)
    for k, station in enumerate(s.stations):
        taken = datetime.combine(s.day, clock_time(9, 12)) + timedelta(minutes=7 * k)
        for side in ("left", "right"):
            path = out / photo_path(s, station, side)
            if not path.exists():
                start = time.perf_counter()
                write_photo(path, render(s, station, side), _tags(s, side, taken))
                sys.stderr.write(f"{path} {time.perf_counter() - start:.1f} s\n")


def _boards(seed: int, out: Path, renderer: str, count: int) -> None:
    render = _renderer(renderer)
    for k, s in enumerate(board_scenes(rig_truth(seed), seed, count)):
        taken = datetime.combine(s.day, clock_time(7, 30)) + timedelta(seconds=20 * k)
        for side in ("left", "right"):
            path = out / "calibration" / f"{side}_{k + 1:02d}.jpg"
            if not path.exists():
                write_photo(path, render(s, s.stations[0], side), _tags(s, side, taken))


def _tags(s: Scene, side: str, taken: datetime) -> ExifTags:
    camera = s.rig.left if side == "left" else s.rig.right
    nominal = round(1050 * _PIXEL_MM, 1)
    return ExifTags(
        make="Synthetic",
        model="Stereo 250",
        serial=f"S250-{s.seed:04d}-{side[0].upper()}",
        focal_mm=nominal,
        taken=taken,
        width_px=camera.width_px,
        height_px=camera.height_px,
    )


def _write_markers(path: Path, markers: tuple[Marker, ...]) -> None:
    with path.open("w", newline="", encoding="utf-8") as f:
        rows = csv.writer(f)
        rows.writerow(["id", "corner", "x_m", "y_m", "z_m"])
        for m in markers:
            for name, p in zip(_CORNERS, m.surveyed_corners_m, strict=True):
                rows.writerow([m.tag_id, name, *(f"{v:.4f}" for v in p)])


def _project_text(name: str, tag_size_m: float, scenes: list[Scene]) -> str:
    b = Board()
    lines = [
        "# yaml-language-server: $schema=https://asbuilt-bim.org/schemas/project-1.json",
        "format: asbuilt-bim/project",
        "version: 1",
        f"name: {name}",
        "ifc: design.ifc",
        "rig:",
        f"  boards: {{kind: charuco, columns: {b.columns}, rows: {b.rows}, square_m: {b.square_m}, "
        f"marker_m: {b.marker_m}, "
        f'dictionary: {b.dictionary}, left: "calibration/left_*.jpg", right: "calibration/right_*.jpg"}}',
        "target: {diameter_m: 0.30}",
        f"markers: {{survey: markers.csv, family: apriltag_36h11, size_m: {tag_size_m}, sigma_m: 0.002}}",
        "visits:",
    ]
    for s in scenes:
        lines += [f"  - date: {s.day.isoformat()}", "    stations:"]
        for t in s.stations:
            left, right = (photo_path(s, t, side).as_posix() for side in ("left", "right"))
            lines.append(f"      - {{name: {t.name}, left: {left}, right: {right}}}")
    return "\n".join(lines) + "\n"
