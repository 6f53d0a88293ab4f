"""A rig knocked after its calibration: found by its own photos, refined, and an untouched one left in peace.

python benchmarks/rigs/knocked.py --check --json figures.json  three sites, twelve turns, 100 visits: ten minutes
python benchmarks/rigs/knocked.py --quick                      one site, yaw only, 10 visits

The right camera is turned about its own centre by 0.1 to 1 degree about each axis, by warping the right photos through
the true lens. FOUND: the visit is refused or warned of. Areas: 1 m2 at 5 m, triangulated with the refined rig.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.stereo.rig_fit import worst_area_effect
from asbuilt_bim.vision.stereo.rig_health import AREA_LIMIT, RigVerdict, judge, judge_visit, refined_rig
from benchmarks.rigs.photos import DEVELOPING_SITES, Visit, area_error, healths, turned_rig, visits
from benchmarks.rigs.visits import rigs, visit
from benchmarks.table import LEAST_N, Line, line, options, report, told, unjudged

AXES = ("pitch", "yaw", "roll")
DEGREES = (0.1, 0.2, 0.5, 1.0)
POOLED, SINGLE = 0.015, 0.03
VISITS_A_RIG = 4
DRAWS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """One turn of one site's rig: what it does to areas unrefined, what became of it, the bias after refining."""

    name: str
    degrees: float
    unrefined: float
    state: str
    rows_px: float  # what the mean vertical residual would have shown
    pooled: float
    singles: tuple[float, ...]


def turn_of(one: Visit, axis: int, degrees: float) -> Turn:
    """Turn a visit's right camera, judge it, and refine."""
    true = turned_rig(one.true, axis, degrees)
    found = healths(one, one.calibrated, (axis, degrees))
    verdict = judge(found, one.calibrated)
    camera = found[0].camera
    singles = [judge([health], one.calibrated) for health in found]
    return Turn(
        name=f"{one.name} {AXES[axis]} {degrees:+.1f}",
        degrees=degrees,
        unrefined=area_error(true, one.calibrated),
        state=verdict.state,
        rows_px=verdict.rows_px,
        pooled=area_error(true, refined_rig(one.calibrated, verdict, camera)),
        singles=tuple(area_error(true, refined_rig(one.calibrated, single, camera)) for single in singles),
    )


def on_the_way(one: Visit, axis: int, degrees: float) -> bool:
    """Knock the rig after the second station and ask whether the visit is parted there."""
    before, after = healths(one, one.calibrated), healths(one, one.calibrated, (axis, degrees))
    parted = judge_visit([*before[:2], *after[2:]], one.calibrated)
    return [len(verdict.stations) for verdict in parted] == [2, len(before) - 2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Untouched:
    """Visits of one untouched rig: alarms (a refusal, a warning or a parting), and area effects over their sigma.

    `expected` are the shares within one sigma and two that exact sigmas would give. The effect is told where it is
    worst of five places, and so it lies further out than one told at a fixed place.
    """

    alarms: int
    pulls: tuple[float, ...]
    expected: tuple[float, float]


def untouched(count: int, seed: int) -> list[Untouched]:
    """Return what becomes of visits of rigs that nobody touched, by rig."""
    found = []
    for true, used, rng in rigs(max(1, count // VISITS_A_RIG), seed):
        alarms, pulls = 0, []
        for _ in range(min(VISITS_A_RIG, count)):
            healths_seen = visit(true, used, rng)
            verdicts = judge_visit(healths_seen, used)
            alarms += any(verdict.state != "sound" for verdict in verdicts) or len(verdicts) > 1
            pulls.append(verdicts[0].area_effect / verdicts[0].area_sigma)
        drawn = _drawn(verdicts[0], healths_seen[0].camera, rng)
        found.append(Untouched(alarms=alarms, pulls=tuple(pulls), expected=(np.mean(drawn < 1), np.mean(drawn < 2))))
    return found


def _drawn(verdict: RigVerdict, camera: RectifiedCamera, rng: np.random.Generator) -> FloatArray:
    """Return by how many sigmas the told effect would lie off for corrections that err as their covariance says."""
    root = np.linalg.cholesky(verdict.covariance)
    told_effects = [worst_area_effect(root @ rng.normal(size=5), verdict.covariance, camera) for _ in range(DRAWS)]
    return np.array([abs(effect) / sigma for effect, sigma in told_effects])


def pull_lines(found: list[Untouched]) -> list[Line]:
    """Hold the told effects' sigmas against what exact ones would give; visits of one rig share its calibration."""
    total, lines = sum(len(one.pulls) for one in found), []
    for k, words in enumerate(("one sigma", "two")):
        off = np.array([np.mean(np.abs(one.pulls) < k + 1) - one.expected[k] for one in found])
        error = float(off.std(ddof=1) / np.sqrt(len(off))) if len(off) > 1 else 1.0
        within = float(np.mean([np.mean(np.abs(one.pulls) < k + 1) for one in found]))
        exact = float(np.mean([one.expected[k] for one in found]))
        lines.append(
            line(f"  their area effect within {words}, by rig", f"{within:.0%}", f">= {exact:.0%} at 5 %", total,
                 bool(off.mean() > -1.645 * error), least_n=80)
        )  # fmt: skip
    return lines


def turn_lines(turns: list[Turn]) -> list[Line]:
    """Judge detection and refinement."""
    matter = [turn for turn in turns if abs(turn.unrefined) > AREA_LIMIT]
    found = sum(turn.state in ("knocked", "doubtful") for turn in matter)
    pooled = max(abs(turn.pooled) for turn in turns)
    singles = np.array([abs(error) for turn in turns for error in turn.singles])
    return [
        line("turns that move an area by over 2 %, found", f"{found} of {len(matter)}", "all", len(matter),
             found == len(matter), least_n=12),
        told("  refused outright", str(sum(turn.state == "knocked" for turn in matter)), len(matter)),
        told("  refused or warned of, of all turns", str(sum(turn.state != "sound" for turn in turns)), len(turns)),
        line("area bias after --refine-rig, pooled, worst", f"{pooled:.2%}", "< 1.5 %", len(turns), pooled < POOLED,
             least_n=12),
        told("  pooled, median", f"{np.median([abs(turn.pooled) for turn in turns]):.2%}", len(turns)),
        line("  single stations, worst", f"{singles.max():.2%}", "< 3 %", len(singles), bool(singles.max() < SINGLE)),
        told("  single stations, median", f"{np.median(singles):.2%}", len(singles)),
    ]  # fmt: skip


def main() -> int:
    """Turn the rigs of the sites, then leave a hundred alone."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", default=list(DEVELOPING_SITES))
    parser.add_argument("--visits", type=int, default=100)
    parser.add_argument("--seed", type=int, default=500, help="of the untouched visits")
    args = parser.parse_args()
    seeds, count = (tuple(args.seeds[:1]), 10) if args.quick else (tuple(args.seeds), args.visits)
    turns, parted, alarms_on_site, sites = [], [], 0, 0
    for one in visits(seeds):
        for axis in (1,) if args.quick else (0, 1, 2):
            for number, degrees in enumerate(DEGREES):
                turns.append(turn_of(one, axis, degrees if (number + axis) % 2 else -degrees))
        parted.append(on_the_way(one, 1, 0.2))
        alarms_on_site += any(v.state != "sound" for v in judge_visit(healths(one, one.calibrated), one.calibrated))
        sites += 1
    alone = untouched(count, args.seed)
    total, alarms = sum(len(one.pulls) for one in alone), sum(one.alarms for one in alone)
    table = turn_lines(turns)
    table += [
        line("untouched visits that alarm, in 100", f"{alarms}", "<= 2", total, alarms <= 0.02 * total),
        *pull_lines(alone),
        told("  untouched sites that alarm", str(alarms_on_site), sites),
        told("a knock of 0.2 degrees on the way, its moment found", f"{sum(parted)} of {sites}", sites),
    ]  # fmt: skip
    if args.quick:
        table = unjudged(table, LEAST_N)
    for turn in turns:
        print(f"  {turn.name}: unrefined {turn.unrefined:+.1%}, {turn.state}, rows {turn.rows_px:.2f} px, refined "
              f"{turn.pooled:+.2%}, single stations {min(turn.singles):+.2%} to {max(turn.singles):+.2%}")  # fmt: skip
    return report("A knocked rig", table, args)


if __name__ == "__main__":
    sys.exit(main())
