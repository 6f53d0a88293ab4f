"""A project folder with empty files: enough to read a project file, not to run it."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any

import yaml

PLAIN: dict[str, Any] = {
    "format": "asbuilt-bim/project",
    "version": 1,
    "name": "Site",
    "ifc": "design.ifc",
    "rig": {
        "boards": {
            "kind": "charuco",
            "columns": 9,
            "rows": 7,
            "square_m": 0.08,
            "marker_m": 0.06,
            "dictionary": "DICT_5X5_100",
            "left": "calibration/left_*.jpg",
            "right": "calibration/right_*.jpg",
        }
    },
    "target": {"diameter_m": 0.3},
    "markers": {"survey": "markers.csv", "family": "apriltag_36h11", "size_m": 0.28, "sigma_m": 0.002},
    "visits": [
        {"date": "2026-03-16", "stations": [{"name": "B1", "left": "v/B1_left.jpg", "right": "v/B1_right.jpg"}]},
        {
            "date": "2026-03-02",
            "stations": [
                {"name": "A1", "left": "v/A1_left.jpg", "right": "v/A1_right.jpg"},
                {"name": "A2", "left": "v/A2_left.jpg", "right": "v/A2_right.jpg"},
            ],
        },
    ],
}


def plain() -> dict[str, Any]:
    """The contents of a good project file."""
    return copy.deepcopy(PLAIN)


def write_project(folder: Path, contents: dict[str, Any] | None = None, boards: int = 3) -> Path:
    """Write a project folder; dates are written bare, as people write them."""
    (folder / "calibration").mkdir(parents=True, exist_ok=True)
    for number in range(1, boards + 1):
        for side in ("left", "right"):
            (folder / f"calibration/{side}_{number:02}.jpg").write_bytes(b"")
    text = yaml.safe_dump(contents or plain(), allow_unicode=True, sort_keys=False)
    path = folder / "project.yaml"
    path.write_text(re.sub(r"date: '([^'\n]*)'\n", r"date: \1\n", text), encoding="utf-8")
    return path
