"""Where did stations stand, linked by prints that nobody surveyed? Simulated visits, their faults, and real photos.

python benchmarks/register/place.py --check --json figures.json   26 visits, 120 faults, 200 stations: ten minutes
python benchmarks/register/place.py --quick                       two visits and five faults

`visits.py` says what is simulated: two storeys, 12 to 40 stations, three surveyed prints. All stations of a visit share
errors, so a visit counts once where shares are judged. `tags_room.py` has the real photos.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import vector_from_rotation
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import given_pose, register
from asbuilt_bim.register.pose import Placement
from benchmarks.register.faults import FAULTS, named, told_alike
from benchmarks.register.tags_room import room_lines
from benchmarks.register.visits import Visit, simulated
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

REPORTING_SEEDS, DEVELOPING_SEEDS = range(1000, 1026), range(1, 3)
SIZES = (12, 16, 20, 28, 40)
SHARES = (0.6827, 0.9545)
MEDIAN_M, MEDIAN_DEG, WORST_SIGMAS, DRIFT, NAMED = 0.015, 0.15, 5.0, 0.005, 0.95
LARGE = 200
_SIGNIFICANT = 1.96


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """One visit: errors (N, 6) [rad, m] of the stations that were placed, their sigmas, how many there are, seconds."""

    errors: FloatArray
    sigmas: FloatArray
    count: int
    seconds: float


def errors(placement: Placement, visit: Visit) -> tuple[FloatArray, FloatArray]:
    """Return the errors (N, 6) of the placed stations, and their sigmas."""
    found, sigmas = [], []
    for placed in placement.stations:
        here, true = placed.pose.world_from_left, visit.true[placed.pose.station]
        found.append(np.append(vector_from_rotation(here[:3, :3] @ true[:3, :3].T), here[:3, 3] - true[:3, 3]))
        sigmas.append(np.sqrt(np.diag(placed.pose.covariance)))
    return np.array(found).reshape(-1, 6), np.array(sigmas).reshape(-1, 6)


def placed(visit: Visit) -> Placed:
    """Place a visit by its three surveyed prints."""
    start = time.perf_counter()
    placement = register(visit.measured, visit.survey, RegisterOptions())
    seconds = time.perf_counter() - start
    found, sigmas = errors(placement, visit)
    return Placed(errors=found, sigmas=sigmas, count=len(visit.measured), seconds=seconds)


def visit_lines(rows: list[Placed]) -> list[Line]:
    """Judge errors against the truth, and against their sigmas."""
    every = np.concatenate([row.errors for row in rows])
    off_m, off_deg = np.linalg.norm(every[:, 3:], axis=1), np.degrees(np.linalg.norm(every[:, :3], axis=1))
    n, total = len(every), sum(row.count for row in rows)
    pulls = [np.abs(row.errors / row.sigmas) for row in rows if len(row.errors)]
    lines = [
        told("stations placed of all", f"{n / total:.0%}", total),
        line("position, median", f"{np.median(off_m) * 100:.1f} cm", "1.5 cm", n, bool(np.median(off_m) <= MEDIAN_M)),
        line("direction, median", f"{np.median(off_deg):.2f}°", "0.15°", n, bool(np.median(off_deg) <= MEDIAN_DEG)),
        told("position, 95th percentile", f"{np.quantile(off_m, 0.95) * 100:.1f} cm", n),
    ]
    for k, share in enumerate(SHARES, 1):
        own = np.array([(pull <= k).mean() for pull in pulls])
        mean, sigma = float(own.mean()), float(own.std(ddof=1) / np.sqrt(len(own))) if len(own) > 1 else np.inf
        lines.append(
            line(f"within {k} sigma, by visit", f"{mean:.1%} ± {sigma:.1%}", f"{share:.0%} not rejected", len(own),
                 abs(mean - share) <= _SIGNIFICANT * sigma)
        )  # fmt: skip
    worst = max(float(pull.max()) for pull in pulls)
    lines.append(line("furthest off", f"{worst:.1f} sigma", "5 sigma", n, worst <= WORST_SIGMAS))
    return lines


def drift_lines(visits: list[Visit]) -> list[Line]:
    """Judge how far stations drift from one anchor: the first station's pose is given, and nothing is surveyed."""
    shares, pulls = [], []
    for visit in visits:
        first = visit.measured[0].station
        given = {first: given_pose(first, visit.true[first], 1e-4, 0.001)}
        placement = register(visit.measured, (), RegisterOptions(), given=given)
        found, sigmas = errors(placement, visit)
        names = [one.pose.station for one in placement.stations]
        far = _along(visit, first)
        shares += [
            float(np.linalg.norm(e[3:])) / far[name] for e, name in zip(found, names, strict=True) if far[name] > 3
        ]
        pulls += [np.abs(e / s).max() for e, s, name in zip(found, sigmas, names, strict=True) if name != first]
    if not shares:
        return []
    worst = float(np.quantile(shares, 0.95))
    return [
        line("drift from one anchor, median of the path", f"{np.median(shares):.2%}", "0.5 %", len(shares),
             bool(np.median(shares) <= DRIFT)),
        told("drift from one anchor, 95th percentile", f"{worst:.2%}", len(shares)),
        line("furthest off there", f"{max(pulls):.1f} sigma", "5 sigma", len(pulls), bool(max(pulls) <= WORST_SIGMAS)),
    ]  # fmt: skip


def _along(visit: Visit, first: str) -> dict[str, float]:
    """Return how long the walk is from a station to each other, by name."""
    names = [one.station for one in visit.measured]
    places = np.array([visit.true[name][:3, 3] for name in names])
    walked = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
    return {name: abs(float(at - walked[names.index(first)])) for name, at in zip(names, walked, strict=True)}


def order_line(visit: Visit) -> Line:
    """Judge whether the order of stations and of the survey changes any pose."""
    rng = np.random.default_rng(7)
    one = register(visit.measured, visit.survey, RegisterOptions())
    mixed = [visit.measured[k] for k in rng.permutation(len(visit.measured))]
    other = register(mixed, visit.survey[::-1], RegisterOptions())
    poses = {placed.pose.station: placed.pose.world_from_left for placed in other.stations}
    same = [np.array_equal(placed.pose.world_from_left, poses.get(placed.pose.station)) for placed in one.stations]
    what = "stations in any order give the same poses"
    return line(what, f"{sum(same)} of {len(same)}", "all", len(same), all(same) and bool(same), least_n=5)


def fault_lines(seeds: range) -> list[Line]:
    """Judge whether each kind of fault is named, and whether what is placed all the same is right."""
    lines = []
    for kind in FAULTS:
        told_right, wrong, alike = 0, 0, 0
        for seed in seeds:
            fault = kind(seed)
            placement = register(fault.visit.measured, fault.visit.survey, RegisterOptions(), given=fault.given,
                                 remembered=fault.remembered)  # fmt: skip
            told_right += (right := named(fault, placement))
            alike += not right and told_alike(fault, placement)
            found, sigmas = errors(placement, fault.visit)
            wrong += bool(len(found) and np.any(np.abs(found / sigmas) > WORST_SIGMAS))
        n = len(seeds)
        lines.append(line(f"{kind.__name__.replace('_', ' ')}: named", f"{told_right} of {n}", "19 of 20", n,
                          told_right >= NAMED * n, least_n=20))  # fmt: skip
        if alike:
            lines.append(told("  of the others, nothing tells them from no fault", f"{alike}", n - told_right))
        lines.append(line("  visits with a station over 5 sigma off", f"{wrong}", "0", n, not wrong, least_n=20))
    return lines


def large_lines(count: int) -> list[Line]:
    """Tell what placing many stations costs."""
    made = placed(simulated(LARGE, count))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return [
        told(f"{count} stations placed together", f"{made.seconds:.0f} s", len(made.errors)),
        line("memory of the whole benchmark", f"{memory:.0f} MB", "2,000 MB", 1, memory < 2000.0, least_n=1),
    ]


def main() -> int:
    """Print the table."""
    args = options(__doc__ or "").parse_args()
    seeds = DEVELOPING_SEEDS if args.quick else REPORTING_SEEDS
    visits = [simulated(seed, SIZES[k % len(SIZES)]) for k, seed in enumerate(seeds)]
    rows = [placed(visit) for visit in visits]
    lines = visit_lines(rows) + drift_lines(visits) + [order_line(visits[0])]
    lines += fault_lines(range(500, 501) if args.quick else range(2000, 2020))
    lines += large_lines(30 if args.quick else LARGE)
    lines += room_lines()
    every = np.concatenate([row.errors for row in rows])
    summary: dict[str, object] = {
        "position_m": quantiles(np.linalg.norm(every[:, 3:], axis=1)),
        "direction_rad": quantiles(np.linalg.norm(every[:, :3], axis=1)),
        "pulls": quantiles(np.concatenate([(row.errors / row.sigmas).ravel() for row in rows])),
    }
    return report("where stations stood", unjudged(lines) if args.quick else lines, args, summary)


if __name__ == "__main__":
    raise SystemExit(main())
