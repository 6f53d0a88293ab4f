"""Dense depth against a laser and structured light, beside OpenCV's own SGBM: coverage, errors, sigma, bias of planes.

python benchmarks/real/depth.py --check --json figures.json     both sets with truth, half a minute
python benchmarks/real/depth.py --fit                           the matcher's three numbers, on each set and on both

Developed on one set and reported on the other, then exchanged: `--fit` says what each set alone would have chosen, and
what the other set makes of that. SGBM looks through as many disparities as the program does.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.photo.read import decode
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, frozen
from asbuilt_bim.vision.stereo import matching
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, disparity_steps
from benchmarks.real.laser_truth import plain_sgbm
from benchmarks.real.scenes import SCENES
from benchmarks.real.shots import Shot
from benchmarks.real.truth_planes import upright_regions
from benchmarks.table import Line, line, options, report, told

NEAREST_M = 1.0
"""The playground's nearest things; the program's own 1.5 m would lose them."""
FILTER_CAP = 63
WITHIN_ONE, WITHIN_TWO = (0.60, 0.76), 0.90
MOST_BIAS_PX = 0.1
BAD_PX = 1.0
PRIORS, SHARES, WINDOWS = (0.15, 0.2, 0.25, 0.3, 0.35), (1.0, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0), (5, 7, 9)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A rectified pair with its true disparity (H, W), NaN where unknown."""

    name: str
    pair: RectifiedPair
    truth_px: Float32Array
    shot: Shot


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What a disparity map is worth: shares of the truth's pixels answered, and of those answered the rest."""

    coverage: float
    bad: float
    within_one: float = float("nan")
    within_two: float = float("nan")
    answered: int = 0


def cases() -> list[Case]:
    """Return the pairs with truth that are here; they come rectified, and are matched as they came."""
    return [
        Case(name=scene.name, pair=_as_it_is(shot), truth_px=shot.truth_px, shot=shot)
        for scene in SCENES
        if scene.truth and scene.here
        for shot in scene.shots()
        if shot.truth_px is not None
    ]


def _as_it_is(shot: Shot) -> RectifiedPair:
    """Move the right photo by the principal points' distance, so that disparity is distance's alone."""
    left, right = shot.rig.left, shot.rig.right
    height, width = left.height_px, left.width_px
    apart = float(right.K[0, 2] - left.K[0, 2])
    moved = np.array([[1.0, 0.0, -apart], [0.0, 1.0, 0.0]])
    inside = np.broadcast_to(np.arange(width) < width - apart, (height, width))
    every = np.ones((height, width), dtype=bool)
    camera = RectifiedCamera(
        f_px=float(left.K[0, 0]), cx_px=float(left.K[0, 2]), cy_px=float(left.K[1, 2]), width_px=width,
        height_px=height, baseline_m=shot.rig.baseline_m, rectified_from_left=frozen(np.eye(3)),
    )  # fmt: skip
    return RectifiedPair(
        name=shot.photos.name,
        left=decode(shot.photos.left),
        right=np.asarray(cv2.warpAffine(decode(shot.photos.right), moved, (width, height), flags=cv2.INTER_CUBIC)),
        valid_left=every,
        valid_right=np.ascontiguousarray(inside),
        camera=camera,
    )


def plain(pair: RectifiedPair) -> Float32Array:
    """Match as OpenCV does by itself, with as many disparities as the program looks through."""
    steps = disparity_steps(pair.camera.f_px * pair.camera.baseline_m / NEAREST_M, pair.camera.width_px)
    return plain_sgbm(pair, steps, FILTER_CAP)


def figures(found: Float32Array, truth: Float32Array, sigma: Float32Array | None = None) -> Figures:
    """Compare a disparity map, and its sigma, with the truth."""
    known = np.isfinite(truth)
    given = known & np.isfinite(found)
    off = np.abs(found[given] - truth[given])
    z = off / sigma[given] if sigma is not None else np.full_like(off, np.nan)
    return Figures(
        coverage=float(given.sum() / known.sum()),
        bad=float(np.mean(off > BAD_PX)),
        within_one=float(np.mean(z < 1.0)),
        within_two=float(np.mean(z < 2.0)),
        answered=int(given.sum()),
    )


def case_lines(case: Case) -> list[Line]:
    """Judge the program's disparity of one set."""
    disparity, sigma = SemiGlobalMatcher(nearest_m=NEAREST_M).match(case.pair)
    ours, theirs = figures(disparity, case.truth_px, sigma), figures(plain(case.pair), case.truth_px)
    low, high = WITHIN_ONE
    n, name = ours.answered, case.name
    return [
        line(f"{name}: pixels with depth", f"{ours.coverage:.1%}", f">= {theirs.coverage:.1%}, SGBM's", n,
             ours.coverage >= theirs.coverage),
        line(f"{name}: off by over 1 px, of those given", f"{ours.bad:.2%}", f"<= {theirs.bad:.2%}, SGBM's", n,
             ours.bad <= theirs.bad),
        line(f"{name}: pixels within 1 sigma", f"{ours.within_one:.1%}", f"{low:.0%} to {high:.0%}", n,
             low <= ours.within_one <= high),
        line(f"{name}: pixels within 2 sigma", f"{ours.within_two:.1%}", f">= {WITHIN_TWO:.0%}", n,
             ours.within_two >= WITHIN_TWO),
        _bias_line(case, disparity),
    ]  # fmt: skip


def _bias_line(case: Case, disparity: Float32Array) -> Line:
    """Compare upright planes: each region's median error, and the median of those."""
    regions = upright_regions(case.truth_px, case.shot.rays(), case.shot.focal_baseline)
    off = [_median_off(disparity, case.truth_px, region.mask) for region in regions]
    off = [one for one in off if np.isfinite(one)]
    middle = float(np.median(np.abs(off))) if off else float("nan")
    each = ", ".join(f"{one:+.2f}" for one in off)
    what, figure, limit = f"{case.name}: upright planes, median |bias|", f"{middle:.2f} px ({each})", "<= 0.1 px"
    return line(what, figure, limit, len(off), middle <= MOST_BIAS_PX, least_n=1) if off else told(what, "none", 0)


def _median_off(found: Float32Array, truth: Float32Array, mask: BoolArray) -> float:
    both = mask & np.isfinite(found) & np.isfinite(truth)
    return float(np.median((found - truth)[both])) if both.any() else float("nan")


def fit_lines(all_cases: list[Case]) -> list[Line]:
    """Try the matcher's numbers on each set, and on both; say what the other set makes of each set's choice."""
    shortfalls: dict[tuple[float, ...], list[float]] = {}
    for numbers in product(PRIORS, SHARES, WINDOWS):
        matching.PRIOR_SIGMA_PX, matching.ROUGH_SHARE = numbers[:2]
        matching.ROUGH_WINDOW_PX = int(numbers[2])
        shortfalls[numbers] = [_shortfall(case) for case in all_cases]
    lines = []
    for k, case in enumerate(all_cases):
        best = min(shortfalls, key=lambda numbers: shortfalls[numbers][k])
        here, others = shortfalls[best][k], [s for j, s in enumerate(shortfalls[best]) if j != k]
        lines.append(told(f"chosen on {case.name}", f"{best}: short by {here:.3f}, elsewhere {others}", 1))
    best = min(shortfalls, key=lambda numbers: max(shortfalls[numbers]))
    lines.append(told("chosen on all: prior px, share, window px", f"{best}: {shortfalls[best]}", 1))
    return lines


def _shortfall(case: Case) -> float:
    """Return by how much the worst of the four lines is missed, in shares; below 0 where all hold."""
    disparity, sigma = SemiGlobalMatcher(nearest_m=NEAREST_M).match(case.pair)
    ours, theirs = figures(disparity, case.truth_px, sigma), figures(plain(case.pair), case.truth_px)
    low, high = WITHIN_ONE
    return max(
        theirs.coverage - ours.coverage,
        ours.bad - theirs.bad,
        low - ours.within_one,
        ours.within_one - high,
        WITHIN_TWO - ours.within_two,
    )


def main() -> int:
    """Judge the sets with truth that are here."""
    parser = options(__doc__.splitlines()[0])
    parser.add_argument("--fit", action="store_true", help="try other numbers instead, some minutes")
    args = parser.parse_args()
    found = cases()
    if not found:
        print("no pair with truth is here: name their folder by ASBUILT_BIM_DATA")
        return 0
    lines = fit_lines(found) if args.fit else [one for case in found for one in case_lines(case)]
    return report("Dense depth of real pairs with truth", lines, args)


if __name__ == "__main__":
    sys.exit(main())
