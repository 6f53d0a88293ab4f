"""Stations that hang together by prints, brought to where the survey has some of these prints."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply, laid_over
from asbuilt_bim.register.growth import Places, Viewpoint, grown
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.tags import SQUARE

NEAR_M = 0.3
"""Where a surveyed print may lie at first: what a chain of stations drifts by, and less than two prints are apart."""
SPREAD_M = 0.05
"""Points this near to one line leave the turn about it open."""
MAX_TRIALS = 80

Points = dict[int, FloatArray]
"""Points (n, 3) of prints by id: four corners, or the centre alone."""


def anchored(
    viewpoints: Sequence[Viewpoint],
    starts: Mapping[str, FloatArray],
    known_m: Mapping[int, FloatArray],
    sizes_m: Mapping[int, float],
    links: Sequence[PointLink] = (),
) -> Places:
    """Return all stations and prints that hang together with something known, in the world.

    `known_m` are surveyed corners (4, 3) of prints, or centres (1, 3).
    """
    corners = {tag: points for tag, points in known_m.items() if len(points) == 4}
    found = grown(viewpoints, starts, corners, sizes_m, links) if starts else Places()
    left = [one for one in viewpoints if one.name not in found.stations]
    while left:
        first = max(left, key=lambda one: (sum(len(one.seen.keys() & other.seen.keys()) for other in left), one.name))
        block = grown(left, {first.name: np.eye(4)}, {}, sizes_m, links)
        known = {tag: _corners(*place) for tag, place in found.tags.items()} | dict(known_m)
        local = {tag: _corners(*block.tags[tag]) for tag in block.tags if tag in known}
        local = {tag: own if len(known[tag]) == 4 else own.mean(axis=0)[None] for tag, own in local.items()}
        world_from_block = _fit(local, known)
        if world_from_block is not None:
            _join(found, block, world_from_block)
        left = [one for one in left if one.name not in block.stations]
    return found


def _join(found: Places, block: Places, world_from_block: FloatArray) -> None:
    found.stations.update({name: world_from_block @ pose for name, pose in block.stations.items()})
    for tag, (pose, size) in block.tags.items():
        found.tags.setdefault(tag, (world_from_block @ pose, size))


def _corners(pose: FloatArray, size_m: float) -> FloatArray:
    return apply(pose, SQUARE * size_m)


def _fit(local: Points, known: Mapping[int, FloatArray]) -> FloatArray | None:
    """Return the move (4, 4) that most prints agree on; None where they leave it open."""
    best: tuple[int, float] | None = None
    moved: FloatArray | None = None
    for chosen in _subsets(local):
        trial = _between(local, known, chosen)
        for _ in range(2):
            if trial is None:
                break
            off = {
                tag: float(np.linalg.norm(apply(trial, own) - known[tag], axis=1).max()) for tag, own in local.items()
            }
            near = tuple(tag for tag, away in off.items() if away < NEAR_M)
            rank = (len(near), -sum(off[tag] for tag in near))
            if best is None or rank > best:
                best, moved = rank, trial
            trial = _between(local, known, near)
    return moved if best is not None and best[0] else None


def _subsets(local: Points) -> Iterator[tuple[int, ...]]:
    tags = sorted(local)
    yield tuple(tags)
    trials: list[tuple[int, ...]] = [(tag,) for tag in tags if len(local[tag]) == 4]
    trials += [*combinations(tags, 3)]
    stride = max(len(trials) / MAX_TRIALS, 1.0)
    for number in range(min(len(trials), MAX_TRIALS)):
        yield trials[int(number * stride)]


def _between(local: Points, known: Mapping[int, FloatArray], tags: Sequence[int]) -> FloatArray | None:
    """Return the rigid move nearest to carrying local points to known ones."""
    if not tags:
        return None
    a, b = np.concatenate([local[tag] for tag in tags]), np.concatenate([known[tag] for tag in tags])
    spread = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)), compute_uv=False)
    return None if np.sqrt(spread[1]) < SPREAD_M else laid_over(a, b)
