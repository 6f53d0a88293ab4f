"""Where a face ends, judged: which faces are called whole, and what part areas hold, on crowded and on bare twins.

python benchmarks/faces/ends.py --check --json figures.json   16 crowded scenes and 8 bare ones, not fitted on
python benchmarks/faces/ends.py --quick                       one scene, not judged

A face is false whole where its outline lacks over 3 % of it and its area falls short by over 3 sigma. A part area is no
lower bound where it is over what is seen by more than 3 sigma.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.faces import MeasuredFace
from benchmarks.faces.border_truth import LACKS, TrueFace, crowded_twin, is_whole, judged, true_depth_m, true_faces
from benchmarks.faces.twins import TwinPair, measured, read_twin
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

# 2001 to 2066 judged earlier models, and changed what came next
SEEDS = (*range(2101, 2117), *range(2151, 2159))
SIGMAS = 3.0
Row = dict[str, Any]


def rows_of(seed: int) -> list[Row]:
    """Measure a scene and hold every face of it against the truth."""
    twin = crowded_twin(seed)
    faces = measured(read_twin(twin), true_masks=False).faces
    return judged_rows(twin, true_faces(twin), true_depth_m(twin, seed), seed, faces)


def judged_rows(
    twin: TwinPair, truth: dict[int, TrueFace], depth_m: FloatArray, seed: int, faces: Sequence[MeasuredFace]
) -> list[Row]:
    """Hold measured faces against the truth; what lies behind the scene isn't judged."""
    rows: list[Row] = []
    for face in faces:
        one = judged(twin, truth, face, depth_m)
        if not one.is_background:
            rows.append({
                "seed": seed, "name": face.face_id, "whole": face.whole, "probability": face.whole_probability,
                "area_m2": face.area_m2, "sigma_m2": face.area_sigma_m2, "body": one.number, "share": one.share,
                "true_m2": one.true_m2, "seen_m2": one.seen_m2, "held_m2": one.held_m2, "narrow_px": one.narrow_px,
            })  # fmt: skip
    return rows


def holds_all(row: Row) -> bool:
    """Say whether the outline holds all of its true face, within what its borders may err."""
    return is_whole(row["held_m2"], row["true_m2"], row["narrow_px"])


def is_short(row: Row) -> bool:
    """Say whether its area falls short of the true face by more than sigma tells."""
    lacking = row["true_m2"] - row["area_m2"]
    return bool(lacking > max(LACKS * row["true_m2"], SIGMAS * row["sigma_m2"]))


def lines_of(rows: list[Row]) -> list[Line]:
    """Judge what was called whole, the part areas, outlines of no concrete, and the probabilities themselves."""
    bodies = [r for r in rows if r["body"] >= 0]
    called, parts = [r for r in bodies if r["whole"]], [r for r in bodies if not r["whole"]]
    false = [r for r in called if not holds_all(r) and is_short(r)]
    over = [r for r in parts if r["area_m2"] - r["seen_m2"] > SIGMAS * r["sigma_m2"]]
    beyond = [r for r in parts if r["area_m2"] - r["held_m2"] > max(LACKS * r["held_m2"], SIGMAS * r["sigma_m2"])]
    none = [r for r in rows if r["body"] < 0 and r["share"] < 0.5]
    whole = [r for r in bodies if holds_all(r)]
    errors = np.abs([r["area_m2"] / r["true_m2"] - 1.0 for r in called if holds_all(r)] or [1.0])
    gaps, counts = _gaps(bodies)
    gap = float(np.average(gaps, weights=counts))
    return [
        told("faces of bodies", f"{len(bodies)}", len(rows)),
        _share("cut or hidden, called whole", false, called, 0.01),
        told("whole, called whole", f"{sum(r['whole'] for r in whole)} of {len(whole)}", len(whole)),
        told("  error of their area: median", f"{np.median(errors):.2%}", len(errors)),
        told("  95th percentile", f"{np.percentile(errors, 95):.2%}", len(errors)),
        _share("part areas over what is seen by 3 sigma", over, parts, 0.02),
        told("  over what there is by 3 % and 3 sigma: another's", f"{len(beyond)}", len(parts)),
        _share("outlines of no concrete", none, rows, 0.03),
        told("  called whole", f"{sum(r['whole'] for r in none)}", len(none)),
        line("probability of whole against the share: mean gap", f"{gap:.1%}", "<= 3 points", len(bodies), gap <= 0.03),
    ]  # fmt: skip


def _share(what: str, some: list[Row], of: list[Row], most: float) -> Line:
    share = len(some) / max(len(of), 1)
    return line(what, f"{len(some)} ({share:.1%})", f"<= {most:.0%}", len(of), share <= most)


def _gaps(rows: list[Row]) -> tuple[list[float], list[int]]:
    """Return by how much probability and share differ in each tenth of the probabilities, and how many faces it has."""
    chance, whole = np.array([r["probability"] for r in rows]), np.array([holds_all(r) for r in rows])
    gaps, counts = [], []
    for some in np.array_split(np.argsort(chance), 10):
        if len(some):
            gaps.append(abs(float(chance[some].mean() - whole[some].mean())))
            counts.append(len(some))
    return gaps, counts


def main() -> int:
    """Measure the scenes and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", help="other seeds than the reporting ones")
    args = parser.parse_args()
    rows: list[Row] = []
    for seed in SEEDS[:1] if args.quick else args.seeds or SEEDS:
        rows += rows_of(seed)
        print(f"scene {seed}: {len(rows)} faces so far", file=sys.stderr, flush=True)
    lines = lines_of(rows)
    summary: dict[str, object] = {"probability": quantiles(r["probability"] for r in rows)}
    return report("Where faces end", unjudged(lines) if args.quick else lines, args, summary, {"faces": rows})


if __name__ == "__main__":
    sys.exit(main())
