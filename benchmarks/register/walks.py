"""Short walks on generated sites: from each station of a visit a step to the side, a turn, and another step.

The photos are ray-cast as the sites are, and kept in ASBUILT_BIM_BENCH. Nothing but the camera moves.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.project.model import Project, Station
from asbuilt_bim.project.read import read_project
from benchmarks.sites import benchmark_folder, generated_site

STEPS = ((0.9, 0.2, 8.0), (2.0, 0.4, -5.0))
"""Metres to the right and ahead, and degrees to the left, against the first station of a walk."""
BASES = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walk:
    """A site's project, the stations of its walks, and the true poses (4, 4) by station; those of `bases` keep tags."""

    project: Project
    stations: tuple[Station, ...]
    true: dict[str, FloatArray]
    bases: tuple[str, ...]


def walk(seed: int) -> Walk:
    """Return the walks of a site's first visit, rendered where they aren't there yet; needs the generator."""
    site = generated_site(seed)
    project = read_project(site / "project.yaml")
    folder = benchmark_folder() / f"walk-{seed}"
    index = folder / "poses.json"
    if not index.exists():
        _render(seed, folder)
    poses = {name: np.array(pose) for name, pose in json.loads(index.read_text(encoding="utf-8")).items()}
    first = project.visits[0].stations[:BASES]
    truth = json.loads((site / "truth.json").read_text(encoding="utf-8"))["visits"][0]["stations"]
    true = {one["name"]: np.array(one["world_from_left"]) for one in truth} | poses
    made = [Station(name=name, left=folder / f"{name}_left.jpg", right=folder / f"{name}_right.jpg") for name in poses]
    stations = (*first, *made)
    return Walk(project=project, stations=stations, true={one.name: true[one.name] for one in stations},
                bases=tuple(one.name for one in first))  # fmt: skip


def _render(seed: int, folder: Path) -> None:
    from asbuilt_synthetic.photo_file import write_photo
    from asbuilt_synthetic.raycast import render
    from asbuilt_synthetic.sample import _tags
    from asbuilt_synthetic.scene import scene

    folder.mkdir(parents=True, exist_ok=True)
    whole = scene(seed)
    poses = {}
    for base in whole.stations[:BASES]:
        for number, (right_m, ahead_m, turn_deg) in enumerate(STEPS, 1):
            turn = rotation_from_vector(np.array([0.0, 0.0, np.radians(turn_deg)]))
            pose = base.world_from_left
            level = pose[:3, 2] * np.array([1.0, 1.0, 0.0])
            place = pose[:3, 3] + right_m * pose[:3, 0] * np.array([1.0, 1.0, 0.0]) + ahead_m * level
            there = replace(base, name=f"{base.name}-{number}", world_from_left=rigid(turn @ pose[:3, :3], place))
            poses[there.name] = there.world_from_left.tolist()
            for side in ("left", "right"):
                path = folder / f"{there.name}_{side}.jpg"
                if not path.exists():
                    write_photo(path, render(whole, there, side), _tags(whole, side, datetime(2026, 3, 2, 12)))
    (folder / "poses.json").write_text(json.dumps(poses), encoding="utf-8")


if __name__ == "__main__":
    for text in sys.argv[1:]:
        walk(int(text))
