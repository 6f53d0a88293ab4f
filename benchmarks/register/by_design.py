"""Is a station right that the design alone placed from a rough place, and is it refused where it isn't?

python benchmarks/register/by_design.py --check --json figures.json   60 rendered stations; an hour
python benchmarks/register/by_design.py --quick                       simulated stations alone

Rough places are off by up to 1.5 m and 20 degrees, evenly. The stations of a visit are judged together, without their
markers and with them as if nobody had surveyed one; each alone is told beside it. The sample and two rendered sites
were there while this was made; three others were not, and are judged by themselves. `design_seen.py` simulates what
can't be told apart: columns in a grid, halves of a hall, storeys alike, a bare wall; and what must not be found:
mirrored, of another site. `design_visits.py` simulates visits of a hall.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.flow.design_source import design_of as read_design
from asbuilt_bim.flow.measure_visit import Workplace, measure_visit
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import vector_from_rotation
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.project.read import read_project
from asbuilt_bim.register.by_design.rough import RoughPlace, RoughPlaces
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import register
from asbuilt_bim.register.pose import StationPose
from asbuilt_bim.scale.cache import Cache
from benchmarks.register.design_seen import Box, column, design_of, measured, standing, wall
from benchmarks.register.design_visits import SeenVisit, hall, hall_visit
from benchmarks.sites import SAMPLE, benchmark_folder, generated_site
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

DEVELOPING, REPORTING = (20, 31), (151, 152, 153)
"""Rendered sites by seed. Placing was made with the first in view, the sample beside them; the others it never saw."""
WITHIN_M, WITHIN_DEG = 1.5, 20.0
WRONG_M, WRONG_DEG, WRONG_SIGMAS = 0.10, 1.0, 5.0
"""A place is wrong from here on: half a thin wall."""
RIGHT, REFUSED = 0.90, 0.95
SHARES = (0.6827, 0.9545)
EYE_M = 1.5
SIMULATED, VISITS = 200, 40
_SIGNIFICANT = 1.96


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A station, the design it is looked for in, and its true pose, None where it stands nowhere there."""

    station: StationMeasurement
    design: BimModel
    true: FloatArray | None
    storeys: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Whether a station was placed, rightly, how far off (6,) [rad, m], and its sigmas (6,)."""

    placed: bool
    right: bool
    error: FloatArray
    sigma: FloatArray


def rendered(sites: Iterable[Path]) -> Iterator[list[Case]]:
    """Measure the stations of all visits of rendered sites, or find them in the cache."""
    cache = Cache(folder=benchmark_folder() / "cache")
    for site in sites:
        project = read_project(site / "project.yaml")
        design = read_design(project, cache)
        truth = json.loads((site / "truth.json").read_text(encoding="utf-8"))
        rig = rig_of(project, cache, _quiet).rig
        for visit, true in zip(project.visits, truth["visits"], strict=True):
            poses = {one["name"]: np.array(one["world_from_left"]) for one in true["stations"]}
            measured_all = measure_visit(visit, project, rig, Workplace(workers=1, cache=cache), _quiet).measured
            yield [_case(station, poses[station.station], design) for station in measured_all]
        print(f"{site.name} measured", file=sys.stderr, flush=True)


def _case(station: StationMeasurement, pose: FloatArray, design: BimModel) -> Case:
    floor = min(design.storeys, key=lambda one: abs(pose[2, 3] - one.elevation_m - EYE_M))
    return Case(station=station, design=design, true=pose, storeys=(floor.global_id,))


def _quiet(*_: object, **__: object) -> None:
    pass


def tried(case: Case, rng: np.random.Generator, near: FloatArray | None) -> Outcome:
    """Place a station from `near` (4, 4), off by up to what a rough place may be; None: from its storey alone."""
    return tried_together([case], rng, [near], marked=False)[0]


def tried_together(
    cases: list[Case], rng: np.random.Generator, near: list[FloatArray | None], *, marked: bool
) -> list[Outcome]:
    """Place the stations of a visit together; `marked`: by the markers that they share, too, which nobody surveyed."""
    places = {one.station.station: _rough(one, rng, there) for one, there in zip(cases, near, strict=True)}
    stations = [one.station if marked else replace(one.station, markers=()) for one in cases]
    rough = RoughPlaces(places=places, design=cases[0].design)
    found = {one.pose.station: one.pose for one in register(stations, (), RegisterOptions(), rough=rough).stations}
    return [_outcome(case, found.get(case.station.station)) for case in cases]


def _rough(case: Case, rng: np.random.Generator, near: FloatArray | None) -> RoughPlace:
    place, bearing = None, None
    if near is not None:
        far, way = WITHIN_M * np.sqrt(rng.random()), rng.uniform(0.0, 2.0 * np.pi)
        place = near[:2, 3] + far * np.array([np.cos(way), np.sin(way)])
        off = np.radians(WITHIN_DEG) * rng.uniform(-1.0, 1.0)
        bearing = float(np.arctan2(near[0, 2], near[1, 2]) + off)
    return RoughPlace(
        storeys=case.storeys, level_m=place, bearing_rad=bearing, within_m=WITHIN_M,
        within_rad=float(np.radians(WITHIN_DEG)),
    )  # fmt: skip


def _outcome(case: Case, pose: StationPose | None) -> Outcome:
    if pose is None or case.true is None:
        return Outcome(placed=pose is not None, right=False, error=np.zeros(6), sigma=np.ones(6))
    here, true = pose.world_from_left, case.true
    error = np.append(vector_from_rotation(here[:3, :3] @ true[:3, :3].T), here[:3, 3] - true[:3, 3])
    right = np.linalg.norm(error[3:]) < WRONG_M and np.linalg.norm(error[:3]) < np.radians(WRONG_DEG)
    return Outcome(placed=True, right=bool(right), error=error, sigma=np.sqrt(np.diag(pose.covariance)))


def rendered_lines(which: str, visits: list[list[Case]]) -> list[Line]:
    """Judge rendered visits from rough places, with markers and without; tell of each station alone, and of storeys."""
    rng = np.random.default_rng(0)
    cases = [case for visit in visits for case in visit]
    near = [one for visit in visits for one in tried_together(visit, rng, _true(visit), marked=False)]
    lines = _shares(f"{which}: from a rough place, a visit together", near, judged=True)
    marked = [one for visit in visits for one in tried_together(visit, rng, _true(visit), marked=True)]
    lines += _shares(f"{which}: the same with markers that nobody surveyed", marked, judged=True)
    lines += _shares(f"{which}: each station alone", [tried(case, rng, case.true) for case in cases], judged=False)
    right = [one for one in near if one.right]
    errors = np.array([one.error for one in right])
    pulls = np.abs(errors / np.array([one.sigma for one in right]))
    off_m, off_deg = np.linalg.norm(errors[:, 3:], axis=1), np.degrees(np.linalg.norm(errors[:, :3], axis=1))
    count = len(right)
    lines += [
        line(
            f"{which}: position, median",
            f"{np.median(off_m) * 100:.1f} cm",
            "1.5 cm",
            count,
            bool(np.median(off_m) <= 0.015),
        ),
        line(
            f"{which}: direction, median",
            f"{np.median(off_deg):.2f}°",
            "0.15°",
            count,
            bool(np.median(off_deg) <= 0.15),
        ),
        told(f"{which}: position, 95th percentile", f"{np.quantile(off_m, 0.95) * 100:.1f} cm", count),
    ]
    for k, share in enumerate(SHARES, 1):
        own = (pulls <= k).mean(axis=1)
        sigma = float(own.std(ddof=1) / np.sqrt(count))
        wanted = f"{share:.0%}, no less"
        holds = own.mean() >= share - _SIGNIFICANT * sigma
        lines.append(line(f"{which}: within {k} sigma", f"{own.mean():.1%} ± {sigma:.1%}", wanted, count, bool(holds)))
    worst = float(pulls.max())
    lines.append(line(f"{which}: furthest off", f"{worst:.1f} sigma", "5 sigma", count, worst <= WRONG_SIGMAS))
    storey = [one for visit in visits for one in tried_together(visit, rng, [None] * len(visit), marked=False)]
    lines += _shares(f"{which}: from the storey alone, a visit together", storey, judged=False)
    return [*lines, _none_placed(f"{which}: stations of another site", list(_strange(visits, rng)))]


def _true(visit: list[Case]) -> list[FloatArray | None]:
    return [case.true for case in visit]


def _strange(visits: list[list[Case]], rng: np.random.Generator) -> Iterator[Outcome]:
    """Look for each visit in the design of another site."""
    for number, visit in enumerate(visits):
        other = visits[(number + 7) % len(visits)]
        if other[0].design is visit[0].design:
            continue
        there = [
            Case(station=one.station, design=place.design, true=None, storeys=place.storeys)
            for one, place in zip(visit, other, strict=False)
        ]
        yield from tried_together(there, rng, _true(other)[: len(there)], marked=False)


def _shares(what: str, found: list[Outcome], judged: bool) -> list[Line]:
    right, wrong = sum(one.right for one in found), sum(one.placed and not one.right for one in found)
    count, left = len(found), len(found) - right
    share, refused = right / count, 1.0 - wrong / left if left else 1.0
    lines = [
        line(f"{what}: right", f"{share:.0%} ({right} of {count})", "90 %", count, share >= RIGHT),
        line(f"{what}: of the others refused", f"{refused:.0%} ({left - wrong} of {left})", "95 %", count,
             refused >= REFUSED),
    ]  # fmt: skip
    return lines if judged else unjudged(lines)


def _none_placed(what: str, found: list[Outcome]) -> Line:
    """Judge what stands nowhere in the design: none of it may be placed."""
    placed = sum(one.placed for one in found)
    return line(f"{what}: placed", f"{placed} of {len(found)}", "0", len(found), placed == 0)


def simulated_lines(count: int) -> list[Line]:
    """Judge simulated stations: what a rough place tells apart, and what must be refused."""
    rng = np.random.default_rng(1)
    halls = [_hall(rng) for _ in range(count)]
    near = [tried(case, rng, case.true) for case in halls]
    lines = _shares("simulated halls", near, judged=False)
    lines += _wrong("simulated halls", near)
    mirrored = []
    for case in halls:
        assert case.true is not None
        mirror = design_of([box.mirrored() for box in _boxes(case)])
        seen = measured(mirror, _mirrored(case.true), seed=int(rng.integers(1 << 30)))
        there = Case(station=seen, design=case.design, true=None, storeys=case.storeys)
        mirrored.append(tried(there, rng, case.true))
    lines.append(_none_placed("mirrored halls", mirrored))
    grids = [_grid(rng) for _ in range(count)]
    lines += _wrong("grids of equal columns, storey alone", [tried(case, rng, None) for case in grids])
    lines += _wrong("grids of equal columns, rough place", [tried(case, rng, case.true) for case in grids])
    alike = [_hall(rng, storeys=2) for _ in range(count)]
    lines += _wrong("storeys alike, none named", [tried(case, rng, case.true) for case in alike])
    bare = [_bare(rng) for _ in range(count)]
    lines += _wrong("a bare wall", [tried(case, rng, case.true) for case in bare])
    return [*lines, *_visit_lines(max(2, count * VISITS // SIMULATED))]


def _visit_lines(count: int) -> list[Line]:
    """Judge visits of several stations together: halls and their mirror images, without prints and with them."""
    rng = np.random.default_rng(2)
    lines: list[Line] = []
    for prints in (False, True):
        told_of = "with prints nobody surveyed" if prints else "without prints"
        halls = [hall_visit(rng, prints=prints) for _ in range(count)]
        alone = [one for visit in halls for case in _cases(visit) for one in tried_together([case], rng, [case.true],
                 marked=prints)]  # fmt: skip
        together = [one for visit in halls for one in tried_together(_cases(visit), rng, [*visit.true], marked=prints)]
        lines += _shares(f"visits of a hall, {told_of}, each station alone", alone, judged=False)
        lines += _shares(f"visits of a hall, {told_of}, together", together, judged=False)
        mirrored = [hall_visit(rng, prints=prints, mirrored=True) for _ in range(count)]
        found = [one for visit in mirrored for one in tried_together(_cases(visit), rng, [*visit.true], marked=prints)]
        lines.append(_none_placed(f"visits of mirrored halls, {told_of}", found))
    return lines


def _cases(visit: SeenVisit) -> list[Case]:
    return [
        Case(station=one, design=visit.design, true=pose, storeys=("S0",))
        for one, pose in zip(visit.stations, visit.true, strict=True)
    ]


def _wrong(what: str, found: list[Outcome]) -> list[Line]:
    wrong = sum(one.placed and not one.right for one in found)
    right = sum(one.right for one in found)
    figure = f"{wrong} of {len(found)} wrong; {right} right"
    return [line(f"{what}: placed wrongly", figure, "0", len(found), wrong == 0)]


def _boxes(case: Case) -> list[Box]:
    boxes = []
    for element in case.design.elements:
        foot = element.vertices_m[:4]
        sides = np.linalg.norm(foot[1] - foot[0]), np.linalg.norm(foot[2] - foot[1])
        along = foot[1] - foot[0]
        middle = foot.mean(axis=0)
        boxes.append(
            Box(middle_m=(float(middle[0]), float(middle[1])), sides_m=(float(sides[0]), float(sides[1])),
                turn_rad=float(np.arctan2(along[1], along[0])))
        )  # fmt: skip
    return boxes


def _mirrored(pose: FloatArray) -> FloatArray:
    bearing = float(np.degrees(np.arctan2(pose[0, 2], pose[1, 2])))
    return standing(-pose[0, 3], pose[1, 3], -bearing)


def _hall(rng: np.random.Generator, storeys: int = 1) -> Case:
    """Return a station in a hall, part of it not built."""
    boxes = hall(rng)
    true = standing(rng.uniform(-1.5, 1.5), rng.uniform(-2.0, 0.5), rng.uniform(-30.0, 30.0))
    built = [box for box in boxes if rng.random() < 0.8]
    all_of_it = [Box(middle_m=b.middle_m, sides_m=b.sides_m, turn_rad=b.turn_rad, foot_m=3.0 * k, head_m=3.0 * k + 3.0)
                 for k in range(storeys) for b in boxes]  # fmt: skip
    return Case(
        station=measured(design_of(built), true, seed=int(rng.integers(1 << 30))),
        design=design_of(all_of_it, storeys=[3.0 * k for k in range(storeys)]), true=true,
        storeys=("S0",) if storeys == 1 else (),
    )  # fmt: skip


def _grid(rng: np.random.Generator) -> Case:
    """Return a station among equal columns, of which some aren't built."""
    bay, side = rng.uniform(3.0, 7.0), float(rng.choice([0.3, 0.4, 0.5]))
    boxes = [column((bay * x, bay * y), side) for x in range(-5, 6) for y in range(-5, 6)]
    true = standing(rng.uniform(0.6, bay - 0.6), rng.uniform(0.6, bay - 0.6), rng.uniform(0.0, 360.0))
    built = [box for box in boxes if rng.random() < 0.85]
    seen = measured(design_of(built), true, seed=int(rng.integers(1 << 30)))
    return Case(station=seen, design=design_of(boxes), true=true, storeys=("S0",))


def _bare(rng: np.random.Generator) -> Case:
    """Return a station before a long wall."""
    design = design_of([wall((-40.0, 6.0), (40.0, 6.0)), wall((-40.0, 9.0), (40.0, 9.0))])
    true = standing(rng.uniform(-5.0, 5.0), 0.0, rng.uniform(-20.0, 20.0))
    return Case(station=measured(design, true, int(rng.integers(1 << 30))), design=design, true=true, storeys=("S0",))


def main() -> int:
    """Print the table."""
    args = options(__doc__ or "").parse_args()
    lines = simulated_lines(20 if args.quick else SIMULATED)
    summary: dict[str, object] = {}
    if not args.quick:
        developed = list(rendered([SAMPLE, *map(generated_site, DEVELOPING)]))
        fresh = list(rendered(map(generated_site, REPORTING)))
        visits = [*developed, *fresh]
        lines = [*rendered_lines("developed on", developed), *rendered_lines("never seen", fresh), *lines]
        summary["tilt_rad"] = quantiles(np.concatenate([_tilts(case) for visit in visits for case in visit]))
    return report("placed by the design", unjudged(lines) if args.quick else lines, args, summary)


def _tilts(case: Case) -> FloatArray:
    """Return how far what a station takes for plumb is off, about two level axes: with the rig, LEVEL_SIGMA_RAD."""
    if case.station.vertical is None or case.true is None:
        return np.zeros(0)
    up = case.true[:3, :3] @ np.asarray(case.station.vertical)
    return np.asarray(up[:2] / np.linalg.norm(up), dtype=np.float64)


if __name__ == "__main__":
    raise SystemExit(main())
