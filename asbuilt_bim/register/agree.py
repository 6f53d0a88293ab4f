"""Which of the sighted things agree on one pose, and which one is wrong: found by trying small subsets."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.register.solve import Sighted, Solution, disagreement, solve_pose, whitened

MAX_TRIALS = 66
"""Twelve markers make 66 pairs; of more, as many subsets are tried, spread evenly."""

LOOSER = (1.0, 2.0)
"""Sigmas are tried as claimed, then doubled: a rig a little off makes all markers disagree a little."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Agreement:
    """The largest set that agrees, its pose, what disagrees (name -> sigmas), and whether a rival set is as large."""

    solution: Solution
    used: tuple[Sighted, ...]
    wrong: dict[str, float]
    ambiguous: bool


def largest_agreement(camera: RectifiedCamera, seen: Sequence[Sighted], subset: int) -> Agreement | None:
    """Find the largest set of groups that one pose explains, starting from subsets of `subset` groups.

    A majority is wanted, under looser sigmas if need be, before a minority under the claimed ones is taken. None where
    not even one subset gives a pose that explains itself.
    """
    first: Agreement | None = None
    trials = _Trials(camera=camera, seen=seen)
    for looser in LOOSER:
        found = _largest(trials, subset, looser)
        if found is not None and 2 * len(found.used) > len(seen) and not found.ambiguous:
            return found
        first = first or found
    return first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trials:
    """The groups seen, and what was solved of them: subsets grow to the same sets again and again."""

    camera: RectifiedCamera
    seen: Sequence[Sighted]
    solved: dict[frozenset[int], Solution | None] = field(default_factory=dict)

    def of(self, chosen: frozenset[int]) -> Solution | None:
        """Return the pose of some groups, by their places."""
        if chosen not in self.solved:
            self.solved[chosen] = solve_pose(self.camera, [self.seen[index] for index in sorted(chosen)])
        return self.solved[chosen]


def _largest(trials: _Trials, subset: int, looser: float) -> Agreement | None:
    camera, seen = trials.camera, trials.seen
    best: tuple[frozenset[int], Solution] | None = None
    rivals: list[frozenset[int]] = []
    for chosen in (tuple(range(len(seen))), *_subsets(len(seen), subset)):
        trial = _grow(trials, frozenset(chosen), looser)
        if trial is None:
            continue
        rivals.append(trial[0])
        if best is None or _rank(trial) > _rank(best):
            best = trial
        if len(trial[0]) == len(seen):
            break
    if best is None:
        return None
    used, solution = best
    wrong = {
        group.name: disagreement(camera, solution, group) ** 0.5
        for index, group in enumerate(seen)
        if index not in used
    }
    # Two sets of one size that share less than a pose needs can't both be right, and nothing says which one is.
    ambiguous = any(len(rival) == len(used) and len(rival & used) < subset for rival in rivals)
    return Agreement(
        solution=solution, used=tuple(seen[index] for index in sorted(used)), wrong=wrong, ambiguous=ambiguous
    )


def _rank(trial: tuple[frozenset[int], Solution]) -> tuple[int, float]:
    return len(trial[0]), -trial[1].variance_factor


def _limit(count: int, looser: float) -> float:
    """Return the largest mean square that noise gives `count` residuals in sigmas: 3 deviations of chi-squared."""
    return float(looser**2 * (1.0 + 3.0 * np.sqrt(2.0 / count)))


def _grow(trials: _Trials, chosen: frozenset[int], looser: float) -> tuple[frozenset[int], Solution] | None:
    """Solve on the chosen groups, then take in what agrees, until nothing changes."""
    camera, seen = trials.camera, trials.seen
    solution = trials.of(chosen)
    for _ in range(5):
        if solution is None or not _explains(camera, solution, [seen[index] for index in chosen], looser):
            return None
        inside = chosen | {
            index
            for index in range(len(seen))
            if index not in chosen
            and disagreement(camera, solution, seen[index]) <= _limit(_count(seen[index]), looser)
        }
        if inside == chosen:
            return chosen, solution
        grown = trials.of(inside)
        if grown is None or not _explains(camera, grown, [seen[index] for index in inside], looser):
            return chosen, solution
        chosen, solution = inside, grown
    return (chosen, solution) if solution is not None else None


def _explains(camera: RectifiedCamera, solution: Solution, used: Sequence[Sighted], looser: float) -> bool:
    """Say whether a solution leaves no group of its own over the limit: one wrong among many hides in their mean."""
    return all(
        float(np.mean(whitened(camera, solution.world_from_left, group)[:, 0] ** 2)) <= _limit(_count(group), looser)
        for group in used
    )


def _count(group: Sighted) -> int:
    return group.left_px.size * (1 if group.right_px is None else 2)


def _subsets(count: int, size: int) -> list[tuple[int, ...]]:
    every = list(combinations(range(count), min(size, count)))
    if len(every) <= MAX_TRIALS:
        return every
    stride = len(every) / MAX_TRIALS
    return [every[int(index * stride)] for index in range(MAX_TRIALS)]
