"""Rigs that rest before real things: do points that their photos show say that they moved?

python benchmarks/register/real.py --check --json figures.json   a minute; skipped without ASBUILT_BIM_DATA
python benchmarks/register/real.py --quick                       three pairs of each rig

A ZED that rests in a corridor takes six pairs, EuRoC's rig many before a board in a room. Each pair is linked to the
first one by points, as stations are; what comes out should be no motion, within its sigma.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import vector_from_rotation
from asbuilt_bim.measure.options import MeasureOptions
from asbuilt_bim.measure.station import StationMeasurement, measure_station
from asbuilt_bim.register.point_links import Shown, link_by_points
from asbuilt_bim.register.point_look import landmarks_of
from benchmarks.real.scenes import SCENES, Scene
from benchmarks.sites import absent
from benchmarks.table import Line, line, options, report, told, unjudged

RESTING = "corridor, all six", "room, first half"
MOVED_M, WORST_SIGMAS = 0.002, 5.0


def shown(scene: Scene, most: int) -> list[Shown]:
    """Measure some pairs of a scene, spread over it, and return what they show of points."""
    shots = scene.shots()
    plain = MeasureOptions()
    free = replace(plain, target=replace(plain.target, required=False), least_markers_without_target=0)
    found = []
    for shot in shots[:: max(1, len(shots) // most)][:most]:
        one = measure_station(shot.photos, shot.rig, free)
        if isinstance(one, StationMeasurement):
            found.append(Shown(name=one.station, camera=one.camera, landmarks=landmarks_of(one)))
    return found


def rest_lines(scene: Scene, most: int) -> list[Line]:
    """Judge how far a rig at rest seems to move from its first pair to each other."""
    pairs = shown(scene, most)
    links = [link_by_points(pairs[0], other) for other in pairs[1:]]
    found = [one for one in links if one is not None]
    lines = [told(f"{scene.name}: pairs linked to the first", f"{len(found)} of {len(links)}", len(links))]
    if not found:
        return lines
    moved = np.array([np.linalg.norm(one.first_from_second[:3, 3]) for one in found])
    pulls = np.array([np.abs(_motion(one.first_from_second)) / np.sqrt(np.diag(one.covariance)) for one in found])
    worst = float(pulls.max())
    return [
        *lines,
        line("  the rig moves by, at most", f"{moved.max() * 1e3:.2f} mm", "2 mm", len(found),
             bool(moved.max() <= MOVED_M), least_n=2),
        told("  points that agree, median", f"{np.median([one.points for one in found]):.0f}", len(found)),
        line("  furthest off", f"{worst:.1f} sigma", "5 sigma", len(found), worst <= WORST_SIGMAS, least_n=2),
    ]  # fmt: skip


def _motion(pose: FloatArray) -> FloatArray:
    return np.append(vector_from_rotation(pose[:3, :3]), pose[:3, 3])


def main() -> int:
    """Judge all that is here."""
    given = options(__doc__ or "").parse_args()
    lines: list[Line] = []
    for scene in SCENES:
        if scene.name in RESTING and not absent(scene.folder):
            lines += rest_lines(scene, 3 if given.quick else 6)
    if not lines:
        return 0
    return report("rigs at rest, by points", unjudged(lines) if given.quick else lines, given)


if __name__ == "__main__":
    raise SystemExit(main())
