"""How discs and other red things answer what `vision/target/odds.py` asks, counted on generated pairs.

python benchmarks/target/odds.py --json figures.json    60 pairs with a disc, 30 without, of development seeds
python benchmarks/target/odds.py --quick                8 and 4, not judged

Every place with outlines of the given size is counted by its likeliest, also where the finder has no need of it. Those
at the disc's true distance (to 2 %) count as the disc, all others as other things. The weights that part them best are
counted too (Cox 1958, a little ridge keeps them finite). Those in `vision/target/odds.py` were counted so over some 400
things of the seeds 60, 61, 62, 1200 and 1201. Whoever changes a number there runs this before and after; no reporting
seed is used.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.target.disc import find_discs
from asbuilt_bim.vision.target.odds import ANSWERS, BASE, LEAST_ODDS, WEIGHTS, answers, log_odds
from asbuilt_bim.vision.target.pairing import Pairing, TargetOptions, pairings, size_fits
from asbuilt_bim.vision.target.search import sought
from benchmarks.table import Line, line, options, report, told, unjudged
from benchmarks.target.pictures import RADIUS_M, Case, backgrounds, case

SEED = 70
TOLD_M = 2.0 * RADIUS_M
AT_THE_DISC = 0.02
RIDGE = 1.0  # of standardised answers
SHOWN = (*ANSWERS, "odds, ln")


def counted(one: Case) -> list[tuple[bool, list[float]]]:
    """Return of each pairing of the given size in a case whether it is the disc, and its answers."""
    pair = one.pair
    lefts, rights = find_discs(pair.left), find_discs(pair.right)
    found = pairings(lefts, rights, pair.camera, TOLD_M) + sought(pair, lefts, rights, TOLD_M)
    asked = [p for p in found if size_fits(p.circle, TargetOptions(diameter_m=TOLD_M))]
    kept: list[Pairing] = []
    for p in sorted(asked, key=lambda p: -log_odds(p, TOLD_M)):
        if all(np.hypot(*(p.circle.centre_px - k.circle.centre_px)) > k.left.ellipse.major_px for k in kept):
            kept.append(p)
    if "reflection" in one.traits:  # a disc of the given size, and separated from the disc by the answers of both
        kept = [p for p in kept if _is_disc(p, one)]
    return [(_is_disc(p, one), [*answers(p, TOLD_M), log_odds(p, TOLD_M)]) for p in kept]


def _is_disc(found: Pairing, one: Case) -> bool:
    camera, circle = one.pair.camera, found.circle
    depth = camera.f_px * camera.baseline_m / circle.disparity_px
    ray = np.array([*(circle.centre_px - [camera.cx_px, camera.cy_px]) / camera.f_px, 1.0])
    return one.range_m is not None and abs(depth * float(np.linalg.norm(ray)) / one.range_m - 1.0) < AT_THE_DISC


def counted_weights(rows: FloatArray, is_disc: FloatArray) -> FloatArray:
    """Return the weight of each answer (N, K) and the base (K + 1,) that part discs (1) from others (0) best."""
    middle, spread = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-6)
    scaled = np.c_[(rows - middle) / spread, np.ones(len(rows))]
    ridge = np.diag([*[RIDGE] * rows.shape[1], 1e-9])
    weights = np.zeros(scaled.shape[1])
    for _ in range(50):
        likely = 1.0 / (1.0 + np.exp(-np.clip(scaled @ weights, -30.0, 30.0)))
        gradient = scaled.T @ (likely - is_disc) + ridge @ weights
        curvature = (scaled * (likely * (1.0 - likely))[:, None]).T @ scaled + ridge
        weights = weights - np.linalg.solve(curvature, gradient)
    each = weights[:-1] / spread
    return np.array([*each, weights[-1] - middle @ each])


def lines(discs: FloatArray, others: FloatArray) -> list[Line]:
    """Tell how both answer, and judge how many the limit of the odds puts on the wrong side."""
    table = [
        told(
            f"{name}: {whose}, 5 / 50 / 95 %",
            " / ".join(f"{q:.2f}" for q in np.quantile(rows[:, k], _SHARES)),
            len(rows),
        )
        for k, name in enumerate(SHOWN)
        for whose, rows in (("discs", discs), ("others", others))
        if len(rows)
    ]
    lost, taken = int(np.sum(discs[:, -1] <= LEAST_ODDS)), int(np.sum(others[:, -1] > LEAST_ODDS))
    table.append(
        line("discs' outlines under the limit of odds", str(lost), "<= 5 %", len(discs), lost <= 0.05 * len(discs))
    )
    table.append(line("others' over it", str(taken), "<= 5 %", len(others), taken <= 0.05 * len(others)))
    both = np.concatenate([discs, others])[:, :-1]
    weights = counted_weights(both, np.repeat([1.0, 0.0], [len(discs), len(others)]))
    for name, weight, used in zip((*ANSWERS, "base"), weights, (*WEIGHTS, BASE), strict=True):
        table.append(told(f"weight of {name}: counted / used", f"{weight:.2f} / {used:.2f}", len(both)))
    return table


_SHARES = (0.05, 0.5, 0.95)


def main() -> int:
    """Count the answers over development pairs and print them."""
    parser = options(__doc__ or "")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--with-disc", type=int, default=60)
    parser.add_argument("--without", type=int, default=30)
    args = parser.parse_args()
    with_disc, without = (8, 4) if args.quick else (args.with_disc, args.without)
    rows: list[tuple[bool, list[float]]] = []
    for i, background in zip(range(with_disc + without), backgrounds(), strict=False):
        has_disc = i < with_disc
        rows += counted(case(i, args.seed + (not has_disc), background, has_disc))
    is_disc = np.array([disc for disc, _ in rows], dtype=bool)
    values = np.array([each for _, each in rows]).reshape(-1, len(SHOWN))
    table = lines(values[is_disc], values[~is_disc])
    return report("What discs and other red things answer", unjudged(table) if args.quick else table, args)


if __name__ == "__main__":
    sys.exit(main())
