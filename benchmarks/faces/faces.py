"""Areas of faces against the truth: twins of the paper's two experiments, by the width of the narrow side.

python benchmarks/faces/faces.py --check --json figures.json     64 pairs, 8 of them path-traced
python benchmarks/faces/faces.py --networks --json figures.json  the same pairs, the shipped networks' masks and depth
python benchmarks/faces/faces.py --quick                         one pair, not judged
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.measure.faces import MeasuredFace
from benchmarks.faces.network_ways import NETWORK_WAYS, Way
from benchmarks.faces.paper_ways import PAPER_WAYS
from benchmarks.faces.twins import (
    RAYCAST_SEEDS,
    Read,
    by_truth,
    cycles_seeds,
    load_twin,
    measured,
    read_twin,
    twin_folder,
)
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

CLASSES = ("60 px and more", "30 to 60 px", "under 30 px")
LEAST_FACES = 40
LEAST_ROUND = 0.8  # of the round columns: an outline that is doubted may be refused, but not most of them
Row = dict[str, Any]


def class_of(narrow_px: float) -> str:
    """Name a face's class by its narrow side."""
    return CLASSES[0] if narrow_px >= 60.0 else CLASSES[1] if narrow_px >= 30.0 else CLASSES[2]


def face_rows(read: Read, way: str, measure: Way) -> list[Row]:
    """Compare every face in view of both cameras with what one way of measuring says of it."""
    found = measure(read)
    rows: list[Row] = []
    for truth in read.twin.truth["faces"]:
        if truth["kind"] == "plane" and not truth["whole"]:
            continue
        row: Row = {
            "twin": read.twin.name, "way": way, "face": truth["face"], "kind": truth["kind"],
            "object": read.twin.truth["objects"][truth["object"]]["kind"], "narrow_px": truth["narrow_px"],
            "class": class_of(truth["narrow_px"]), "true_m2": truth["area_m2"], "in_view": truth["whole"],
            "distance_m": truth["distance_m"], "incidence_deg": truth["incidence_deg"], "found": False,
        }  # fmt: skip
        face = found.get(truth["face"])
        if face is not None:
            row |= _compared(face, truth)
        rows.append(row)
    return rows


def _compared(face: MeasuredFace, truth: dict[str, Any]) -> Row:
    sigma = face.area_sigma_m2
    found_as: Row = {"found": True, "whole": face.whole, "name": face.face_id, "sigma_m2": sigma}
    true_m2 = truth["area_m2"]
    if truth["kind"] == "cylinder":
        # what is claimed is the visible arc: of the true circle, from where it stands, as much as the tangents hold
        if not isinstance(face.frame, CylinderFrame):
            return {"found": False}
        distance = truth["level_distance_m"]
        true_m2 = 2.0 * truth["radius_m"] * np.arccos(truth["radius_m"] / distance) * truth["height_m"]
        found_as["radius_error"] = face.frame.radius_m / truth["radius_m"] - 1.0
    elif isinstance(face.frame, CylinderFrame):
        return {"found": False}
    found_as["true_m2"] = true_m2
    found_as["error"] = face.area_m2 / true_m2 - 1.0
    found_as["pull"] = (face.area_m2 - true_m2) / sigma if sigma > 0 else float("inf")
    return found_as


def ours(true_masks: bool) -> Way:
    """Return the program's own way, on true masks or on its own."""
    return lambda read: by_truth(read.twin, measured(read, true_masks).faces)


WAYS: dict[str, Way] = {
    "true masks": ours(True),
    "own masks": ours(False),
    **PAPER_WAYS,
}


def collect(seeds: list[tuple[int, str]], ways: dict[str, Way]) -> tuple[list[Row], list[Row]]:
    """Measure every pair in every way; return rows of faces and of targets."""
    rows: list[Row] = []
    targets: list[Row] = []
    for seed, renderer in seeds:
        read = read_twin(load_twin(twin_folder(seed, renderer)))
        true_depth = read.twin.truth["target"]["depth_m"]
        targets.append({
            "twin": read.twin.name,
            "error": None if read.target is None else _depth_m(read) / true_depth - 1.0,
        })  # fmt: skip
        for way, measure in ways.items():
            rows += face_rows(read, way, measure)
        print(f"{read.twin.name} ...", file=sys.stderr, flush=True)
    return rows, targets


def _depth_m(read: Read) -> float:
    """Return the target's depth along the LEFT camera's own axis, as the truth has it."""
    assert read.target is not None
    camera = read.twin.pair.camera
    point = camera.points(np.array(read.target.left_px), np.array(read.target.disparity_px))
    return float(point[2])


def planar_lines(rows: list[Row], way: str) -> list[Line]:
    """Judge planar faces wholly in view, by class."""
    lines: list[Line] = []
    limits = {"true masks": (0.003, 0.015), "own masks": (0.007, 0.025)}
    for name in CLASSES:
        own = [r for r in rows if r["way"] == way and r["class"] == name and r["kind"] == "plane"]
        got = [r for r in own if r["found"]]
        errors = np.abs([r["error"] for r in got]) if got else np.ones(1)
        median, high, n = float(np.median(errors)), float(np.percentile(errors, 95)), len(own)
        what = f"{way}, {name}"
        if name == CLASSES[0] and way in limits:
            most, most_high = limits[way]
            lines.append(line(f"{what}: median", f"{median:.2%}", f"<= {most:.1%}", n, median <= most, LEAST_FACES))
            lines.append(
                line("  95th percentile", f"{high:.2%}", f"<= {most_high:.1%}", n, high <= most_high, LEAST_FACES)
            )
            lines.append(told("  found", f"{len(got)}", n))
        elif name == CLASSES[1] and way in limits:
            lines.append(line(f"{what}: found", f"{len(got)} of {n}", "all", n, len(got) == n, LEAST_FACES))
            lines.append(line("  median", f"{median:.2%}", "<= 3 %", n, median <= 0.03, LEAST_FACES))
            lines.append(told("  95th percentile", f"{high:.2%}", n))
        elif way in limits:
            wrong = [r for r in got if r["whole"] and abs(r["pull"]) > 3.0]
            lines.append(told(f"{what}: measured", f"{len(got)} of {n}", n))
            lines.append(told("  median / 95th percentile", f"{median:.2%} / {high:.2%}", n))
            lines.append(line("  wrong by over 3 sigma, unsaid", f"{len(wrong)}", "0", n, not wrong, LEAST_FACES))
        else:
            lines.append(told(f"{what}: median / 95th percentile, found", f"{median:.1%} / {high:.1%}, {len(got)}", n))
        lines.append(told("  called partial though whole", f"{sum(not r['whole'] for r in got)}", len(got)))
    return lines


def round_lines(rows: list[Row], way: str) -> list[Line]:
    """Judge round columns wholly in view."""
    own = [r for r in rows if r["way"] == way and r["kind"] == "cylinder" and r["in_view"]]
    got = [r for r in own if r["found"]]
    if not got:
        return []
    called = [r for r in got if r["whole"]]
    area, radius = (np.abs([r[key] for r in called] or [1.0]) for key in ("error", "radius_error"))
    others = [abs(r["error"]) for r in got if not r["whole"]]
    n, least = len(own), int(np.ceil(LEAST_ROUND * len(own)))
    return [
        line(f"{way}, round and called whole: area, worst", f"{area.max():.2%}", "<= 1.5 %", n, area.max() <= 0.015),
        line("  radius, worst", f"{radius.max():.2%}", "<= 1 %", n, radius.max() <= 0.01),
        told("  medians of area and radius", f"{np.median(area):.2%} / {np.median(radius):.2%}", len(called)),
        line("  called whole", f"{len(called)} of {n}", f">= {least}", n, len(called) >= least),
        told("  found and called partial though whole: worst area", f"{max(others, default=0.0):.2%}", len(others)),
        told("  found", f"{len(got)}", n),
    ]


def target_lines(targets: list[Row]) -> list[Line]:
    """Judge the target's depth."""
    errors = np.abs([t["error"] for t in targets if t["error"] is not None])
    n = len(targets)
    missing = n - len(errors)
    median, worst = (float(np.median(errors)), float(errors.max())) if len(errors) else (1.0, 1.0)
    return [
        line("depth of the target, median", f"{median:.3%}", "<= 0.1 %", n, median <= 0.001 and not missing),
        line("  worst", f"{worst:.3%}", "<= 0.5 %", n, worst <= 0.005 and not missing),
    ]


def summary(rows: list[Row], targets: list[Row]) -> dict[str, object]:
    """Return what is recorded: the spread of errors and pulls of every way, by kind and class."""
    found: dict[str, object] = {}
    for key in sorted(
        {(r["way"], r["kind"], r["class"]) for r in rows}, key=lambda key: (*key[:2], -CLASSES.index(key[2]))
    ):
        own = [r for r in rows if (r["way"], r["kind"], r["class"]) == key]
        got = [r for r in own if r["found"]]
        found[", ".join(key)] = {
            "faces": len(own),
            "found": len(got),
            "whole": sum(r["whole"] for r in got),
            "error": quantiles(r["error"] for r in got),
            "pull_when_whole": quantiles(r["pull"] for r in got if r["whole"]),
        }
    return {"spread": found, "target_error": quantiles(t["error"] for t in targets if t["error"] is not None)}


def paper_lines() -> list[Line]:
    """Tell what the paper itself reports of its column and its wall."""
    return [
        told("the paper: column 0.50 x 0.50 x 2.70 m, both faces", "-7.0 % (-11.9 %, -2.2 %)", 1),
        told("the paper: wall 3.64 m2, side face not found", "-8.9 % (+21 % of what it saw)", 1),
    ]


def main() -> int:
    """Measure the twins and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", help="other seeds than the reporting ones, ray cast")
    parser.add_argument("--networks", action="store_true", help="with the shipped networks' masks and depth")
    args = parser.parse_args()
    ways = {"own masks": ours(False), **NETWORK_WAYS} if args.networks else WAYS
    seeds = [(s, "raycast") for s in RAYCAST_SEEDS] + [(s, "cycles") for s in cycles_seeds()]
    if args.seeds is not None:
        seeds = [(s, "raycast") for s in args.seeds]
    rows, targets = collect(seeds[:1] if args.quick else seeds, ways)
    lines = [*paper_lines(), *target_lines(targets)]
    for way in ways:
        lines += [*planar_lines(rows, way), *round_lines(rows, way)]
    if args.quick:
        lines = unjudged(lines)
    worst = sorted((r for r in rows if r["found"]), key=lambda r: -abs(r["error"]))[:16]
    for r in worst:
        print(f"  {r['twin']:<18} {r['way']:<10} {r['name']:<22} {r['object']:<6} {r['narrow_px']:4.0f} px "
              f"{r['incidence_deg']:3.0f} deg {r['distance_m']:.1f} m: {r['error']:+.1%}, {r['pull']:+.1f} sigma, "
              f"{'whole' if r['whole'] else 'partial'}")  # fmt: skip
    all_rows: dict[str, object] = {"faces": rows, "targets": targets}
    return report("Faces against the truth", lines, args, summary(rows, targets), all_rows)


if __name__ == "__main__":
    sys.exit(main())
