"""How high an element's concrete reaches: how likely each level is, by all that its sides show, seen or not.

Concrete rises from below, so each upright line of cells has one level, under which all is built and over which nothing
is. Along a wall the level stays, or is any other one where a joint lies. What sides show of a level adds up, but the
rows of one side err alike: each counts by a small share of its log-odds. What earlier visits showed counts as one side
more: it reaches as high as then or, as likely, any higher. Where sides contradict one another as a whole the element
isn't what or where the design says, or something of it is gone. The numbers are fitted on rendered sites
(benchmarks/site/fit_pour.py writes pour.json, with what each buys).
Reference: Rabiner 1989, forward and backward along a hidden Markov chain: exact.
"""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray

DATA = Path(__file__).with_name("pour.json")
JOINT_M = 6.0
"""Walls are poured in lengths of some 6 m: so far apart are the joints that they are planned with."""
APART = 0.01
"""How often an element stands beside its design, or is something else, so that each side shows a level of its own. On
rendered sites none does: it can't be fitted there, and costs a point of the bounds' width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Fitted: what a row's samples are worth, which err alike, and how likely levels are that nobody sees.

    `built_weight`, `face_weight` and `open_weight` are the shares of their mean log-odds that count, where they look
    built by depth alone, where a face was measured as well, and where they look open.
    `not_begun` is how likely nothing is built, and as likely is all. `doubt` is how likely a row that counts as known
    may be otherwise, `limit` how likely a state has to be.
    """

    built_weight: float
    face_weight: float
    open_weight: float
    not_begun: float
    doubt: float
    limit: float


@lru_cache(maxsize=1)
def model() -> Model:
    """Read the fitted model that lies in the package."""
    return Model(**json.loads(DATA.read_text(encoding="utf-8"))["model"])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """What each row of each side of an element shows, (sides, nx, rows).

    How many samples are built, open, and built and measured as a face; and the mean log-odds of all of them.
    """

    built: FloatArray
    open: FloatArray
    measured: FloatArray
    log_odds: FloatArray

    @property
    def decided(self) -> FloatArray:
        """Return how many are built or open."""
        return self.built + self.open


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Levels:
    """How likely each level is in each upright line, (nx, rows + 1): of 0 to all rows built.

    `if_risen` is the same where it may well have risen since it was last seen: how likely that is nobody knows.
    `torn` is how likely the sides contradict one another as a whole; `seen` (nx,) are lines that something shows of.
    `evidence` (nx, rows + 1) is the log-likelihood of all that was ever shown of a line; None where nothing was.
    """

    chance: FloatArray
    if_risen: FloatArray
    torn: float
    seen: BoolArray
    evidence: FloatArray | None

    @property
    def rows(self) -> int:
        """Return how many rows there are."""
        return int(self.chance.shape[1]) - 1

    def built(self) -> FloatArray:
        """Return how likely each row (nx, rows) is built."""
        under: FloatArray = 1.0 - np.cumsum(self.chance, axis=1)[:, :-1]
        return under

    def between(self, low: int, high: int) -> float:
        """Return how likely the level of what was seen lies from one row's number to another's, both in.

        So likely it is at least, whether or not it may have risen since.
        """
        ways = (one[self.seen, low : high + 1].sum(axis=1).mean() for one in (self.chance, self.if_risen))
        return min(float(one) for one in ways) if self.seen.any() else 0.0


def levels(shown: Shown, size_m: tuple[float, float], fitted: Model, before: FloatArray | None = None) -> Levels:
    """Return how likely each level is by what shows of an element so long and high.

    `before` (nx, rows + 1) is the evidence of earlier visits. Of an element that shows nothing each level is as likely
    as it is anywhere.
    """
    lines, rows = shown.decided.shape[1:]
    prior = np.full(rows + 1, (1.0 - 2.0 * fitted.not_begun) / max(rows - 1, 1))
    prior[[0, -1]] = fitted.not_begun
    prior /= prior.sum()
    seen = np.asarray((shown.decided > 0.0).any(axis=(0, 2)))
    if before is not None:
        seen |= np.ptp(before, axis=1) > 0.0
    if not seen.any():
        anywhere = np.tile(prior, (lines, 1))
        return Levels(chance=anywhere, if_risen=anywhere, torn=0.0, seen=seen, evidence=None)
    joint = min(size_m[0] / lines / JOINT_M, 0.5)
    of_sides = _of_sides(shown, fitted)[(shown.log_odds != 0.0).any(axis=(1, 2))]
    each, now = _along(of_sides, prior, joint)[0], of_sides.sum(axis=0)
    ways, so_likely = now[None], np.zeros(1)
    if before is not None:
        since, so_likely, then = _since(before, prior, joint)
        each, ways = np.append(each, then), now + since
    of_ways, chance = _along(ways, prior, joint)
    so_likely = so_likely + of_ways
    together = np.logaddexp.reduce(so_likely)
    apart = each.sum() + np.log(APART) if len(each) > 1 else -np.inf
    torn = float(np.exp(apart - np.logaddexp(apart, together)))
    share = np.exp(so_likely - together)[:, None, None]
    told = np.exp(ways - np.logaddexp.reduce(ways + np.log(prior), axis=2, keepdims=True))
    evidence = (1.0 - torn) * (share * told).sum(axis=0) + torn
    return Levels(
        chance=_a_sample_off((1.0 - torn) * (share * chance).sum(axis=0) + torn * prior),
        if_risen=_a_sample_off((1.0 - torn) * chance[-1] + torn * prior),
        torn=torn, seen=seen, evidence=np.log(np.maximum(evidence, np.finfo(np.float64).tiny)),
    )  # fmt: skip


def _since(before: FloatArray, prior: FloatArray, joint: float) -> tuple[FloatArray, FloatArray, float]:
    """Return what earlier visits' evidence (nx, levels) says of the levels now, in two ways (2, nx, levels).

    It reaches as high as then; or any higher, each as likely as anywhere. Beside them the log-likelihood of each way,
    and that of the evidence for itself.
    """
    higher = np.maximum.accumulate(before, axis=1) - before.max(axis=1, keepdims=True)
    (then, anyway), _ = _along(np.array([before, higher]), prior, joint)
    return np.array([before, higher]), np.log(0.5) + np.array([0.0, then - anyway]), float(then)


def _a_sample_off(chance: FloatArray) -> FloatArray:
    """Return how likely levels (nx, rows + 1) are if each may lie a row lower or higher: where a line cuts a sample."""
    inner = np.pad(chance[:, 1:-1], ((0, 0), (1, 1)), mode="edge" if chance.shape[1] > 2 else "constant")
    beside = 0.5 * (inner[:, :-2] + inner[:, 2:])
    return np.column_stack([chance[:, 0], 0.5 * (inner[:, 1:-1] + beside), chance[:, -1]])


def _of_sides(shown: Shown, fitted: Model) -> FloatArray:
    """Return the log-likelihood (sides, nx, rows + 1) of each level by what each side shows in each line."""
    of_face = shown.measured / np.maximum(shown.built, 1.0)
    weight = fitted.built_weight + (fitted.face_weight - fitted.built_weight) * of_face
    odds = np.where(shown.log_odds > 0.0, weight, fitted.open_weight) * shown.log_odds
    shows = odds != 0.0
    if_built, if_open = (np.where(shows, -np.log1p(np.exp(sign * odds)), 0.0) for sign in (-1.0, 1.0))
    none = np.zeros((*odds.shape[:2], 1))
    under = np.concatenate([none, np.cumsum(if_built, axis=2)], axis=2)
    over = np.concatenate([np.cumsum(if_open[:, :, ::-1], axis=2)[:, :, ::-1], none], axis=2)
    return np.where(shows.any(axis=2, keepdims=True), under + over, 0.0)


def _along(evidence: FloatArray, prior: FloatArray, joint: float) -> tuple[FloatArray, FloatArray]:
    """Return the log-likelihood (...,) of chains (..., nx, levels), and how likely each level is in each line.

    From one line to the next the level stays, or, at a joint, is as likely as it is anywhere.
    """
    lines = evidence.shape[-2]
    stays, moves = np.log1p(-joint), np.log(joint) + np.log(prior)
    so_far, to_come = np.empty_like(evidence), np.zeros_like(evidence)
    so_far[..., 0, :] = np.log(prior) + evidence[..., 0, :]
    for line in range(1, lines):
        last = so_far[..., line - 1, :]
        moved = moves + np.logaddexp.reduce(last, axis=-1, keepdims=True)
        so_far[..., line, :] = np.logaddexp(stays + last, moved) + evidence[..., line, :]
    for line in range(lines - 2, -1, -1):
        after = to_come[..., line + 1, :] + evidence[..., line + 1, :]
        moved = np.logaddexp.reduce(moves + after, axis=-1, keepdims=True)
        to_come[..., line, :] = np.logaddexp(stays + after, moved)
    total = np.logaddexp.reduce(so_far[..., -1, :], axis=-1)
    return total, np.exp(so_far + to_come - total[..., None, None])
