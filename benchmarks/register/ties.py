"""Stations without a tag, linked to their neighbours by points that both show: short walks on generated sites.

python benchmarks/register/ties.py --check --json figures.json   five sites, 30 stations without a tag: rendering takes
                                                                  minutes a site, the rest two minutes
python benchmarks/register/ties.py --quick                        one site
python benchmarks/register/ties.py --seeds 20 100 101             these sites

Of each walk the first station keeps its tags, and is placed by the survey; the tags of the other two are taken away.
`walks.py` says how they are walked. All stations of a walk share its first one's errors.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.flow.measure_visit import options_of, read_pair
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import inverse, vector_from_rotation
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement, measure_station
from asbuilt_bim.project.tables.places import known_places
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import register
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.point_look import look_for_links
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.codec import plain_digest
from asbuilt_bim.scale.fingerprint import measuring_code_digest
from asbuilt_bim.scale.share import in_turn
from benchmarks.register.walks import Walk, walk
from benchmarks.sites import benchmark_folder
from benchmarks.table import Line, line, options, report, told, unjudged

SEEDS = (20, 100, 101, 31, 102)
"""All of them developed on: links by points were made on these sites."""
WORST_SIGMAS, SHARES = 5.0, (0.6827, 0.9545)
MEDIAN_M, MEDIAN_DEG = 0.015, 0.15
_SIGNIFICANT = 1.96


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tried:
    """One site: errors (N, 6) and sigmas of stations placed without a tag, how many were there, links and seconds."""

    errors: FloatArray
    sigmas: FloatArray
    count: int
    pairs: int  # of stations of one walk
    links: tuple[PointLink, ...]
    links_off: FloatArray  # (L,) the furthest off of each link's six numbers, in sigmas
    seconds: float
    measuring: float


def measured(walked: Walk) -> tuple[list[StationMeasurement], float]:
    """Measure all stations of a site, or find them measured; returns them, and the seconds that one takes."""
    cache = Cache(folder=benchmark_folder() / "cache")
    rig = rig_of(walked.project, cache, _silent).rig
    chosen = options_of(walked.project)
    found: list[StationMeasurement] = []
    for station in walked.stations:
        photos = read_pair(station, walked.project)
        assert not isinstance(photos, RejectedStation)
        rig_digest = plain_digest(rig, type(rig))
        parts = ["walk", photos.name, photos.left.digest, photos.right.digest, rig_digest, repr(chosen)]
        key = digest_of([*parts, measuring_code_digest()])
        one = cache.get(key, StationMeasurement)
        if one is None:
            made = measure_station(photos, rig, chosen)
            if isinstance(made, RejectedStation):
                continue
            one = made
            cache.put(key, one, StationMeasurement)
        found.append(one)
    return found, float(np.median([sum(one.seconds.values()) for one in found]))


def _silent(step: str, done: int, total: int, what: str = "") -> None:
    """Tell nobody."""


def tried(seed: int) -> Tried:
    """Place a site's walks by the survey of their first stations alone."""
    walked = walk(seed)
    stations, measuring = measured(walked)
    bare = [one if one.station in walked.bases else replace(one, markers=()) for one in stations]
    survey = known_places(walked.project, lambda: None).survey
    start = time.process_time()
    placement = register(bare, survey, RegisterOptions())
    seconds = time.process_time() - start
    off, sigmas = [], []
    for placed in placement.stations:
        pose = placed.pose
        if pose.station not in walked.bases:
            off.append(_apart(pose.world_from_left, walked.true[pose.station]))
            sigmas.append(np.sqrt(np.diag(pose.covariance)))
    unplaced = {one.station for one in bare if one.station not in walked.bases}
    links = look_for_links(bare, unplaced, in_turn)
    links_off = [
        float(np.abs(_apart(link.first_from_second, inverse(walked.true[link.first]) @ walked.true[link.second])
                     / np.sqrt(np.diag(link.covariance))).max()) for link in links
    ]  # fmt: skip
    walks = [[one for one in walked.true if one.split("-")[0] == base] for base in walked.bases]
    return Tried(
        errors=np.array(off).reshape(-1, 6), sigmas=np.array(sigmas).reshape(-1, 6), count=len(unplaced),
        pairs=sum(len(list(combinations(one, 2))) for one in walks), links=links, links_off=np.array(links_off),
        seconds=seconds, measuring=measuring * len(bare),
    )  # fmt: skip


def _apart(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.append(vector_from_rotation(one[:3, :3] @ other[:3, :3].T), one[:3, 3] - other[:3, 3])


def lines_of(rows: list[Tried]) -> list[Line]:
    """Judge poses against the truth and against their sigmas, and links against the truth."""
    every, total = np.concatenate([row.errors for row in rows]), sum(row.count for row in rows)
    n = len(every)
    if not n:
        return [line("stations without a tag that are placed", "none", "", total, False)]
    off_m, off_deg = np.linalg.norm(every[:, 3:], axis=1), np.degrees(np.linalg.norm(every[:, :3], axis=1))
    pulls = [np.abs(row.errors / row.sigmas) for row in rows if len(row.errors)]
    links_off = np.concatenate([row.links_off for row in rows])
    lines = [
        told("stations without a tag that are placed", f"{n / total:.0%}", total),
        line("position, median", f"{np.median(off_m) * 1e3:.1f} mm", "15 mm", n, bool(np.median(off_m) <= MEDIAN_M)),
        line("direction, median", f"{np.median(off_deg):.3f}°", "0.15°", n, bool(np.median(off_deg) <= MEDIAN_DEG)),
        told("position, the worst", f"{off_m.max() * 1e3:.1f} mm", n),
    ]
    for k, share in enumerate(SHARES, 1):
        own = np.array([(pull <= k).mean() for pull in pulls])
        sigma = float(own.std(ddof=1) / np.sqrt(len(own))) if len(own) > 1 else np.inf
        holds = abs(float(own.mean()) - share) <= _SIGNIFICANT * sigma
        text = f"{own.mean():.1%} ± {sigma:.1%}" if len(own) > 1 else f"{own.mean():.1%}"
        lines.append(line(f"within {k} sigma, by site", text, f"{share:.0%} not rejected", n, holds))
    worst = max(float(pull.max()) for pull in pulls)
    wrong = int(np.sum(links_off > WORST_SIGMAS))
    count = sum(len(row.links) for row in rows)
    seconds, measuring = sum(row.seconds for row in rows), sum(row.measuring for row in rows)
    return [
        *lines,
        line("furthest off", f"{worst:.1f} sigma", "5 sigma", n, worst <= WORST_SIGMAS),
        told("links found, of pairs in one walk", f"{count} of {sum(row.pairs for row in rows)}", count),
        line("links over 5 sigma off, or of two walks", f"{wrong}", "0", count, wrong == 0),
        told("placing, of the time to measure", f"{seconds / measuring:.0%}", total),
    ]


def main() -> int:
    """Place the walks, judge, and report."""
    asked = options(__doc__ or "")
    asked.add_argument("--seeds", type=int, nargs="+", default=SEEDS, help="the sites")
    given = asked.parse_args()
    seeds = SEEDS[:1] if given.quick else given.seeds
    rows = [tried(seed) for seed in seeds]
    lines = lines_of(rows)
    figures: dict[str, object] = {
        "position_m": [float(x) for row in rows for x in np.linalg.norm(row.errors[:, 3:], axis=1)],
        "sigmas_off": [float(x) for row in rows for x in np.abs(row.errors / row.sigmas).max(axis=1)],
        "points": [link.points for row in rows for link in row.links],
    }
    return report("stations linked by points", unjudged(lines) if given.quick else lines, given, figures)


if __name__ == "__main__":
    raise SystemExit(main())
