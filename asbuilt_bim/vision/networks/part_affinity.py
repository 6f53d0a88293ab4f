"""Which parts of walls and columns are one instance: for each two of them the odds, and the parts joined by these.

The pair that most surely belongs together is joined first, and the odds of what was joined are summed. So many small
doubts outweigh one sure link, and an instance isn't strung together along its chain of neighbours.

Reference: Keuper et al. 2015, Efficient decomposition of image and mesh graphs by lifted multicuts (greedy additive
edge contraction).
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.networks.parts import Part

FEATURES = (
    "one",
    "convex edge",
    "off the plane",
    "votes apart",
    "classes apart",
    "width",
    "columns' gap",
    "unmeasured",
)
ODDS = np.array([5.85, 0.24, -0.54, -2.49, -3.84, -0.44, -0.64, -2.11])
"""Log-odds of each feature, by logistic regression on parts of generated pairs of the seeds 20, 21, 22, 24 and 25.

Both the shipped network's maps of classes and the true ones were used (benchmarks/networks/odds.py).
"""
MOST_WIDE_M = 6.0
TOUCHING_PX = 1.5
CLEAR = 0.02
"""A plane passes before or behind another part clearly when it misses it by this share of 1/Z."""


def features(one: Part, other: Part, gap_px: float, f_px: float) -> FloatArray:
    """Return the features of whether two parts are one instance (8,), in the order of `FEATURES`."""
    convex, off, width = 0.0, 0.0, 1.0
    measured = one.measured and other.measured
    if measured:
        small, large = (one, other) if one.size < other.size else (other, one)
        misses = small.misses(large), large.misses(small)
        convex = float(gap_px <= TOUCHING_PX and max(misses) < -CLEAR)
        off = float(np.log(np.clip(abs(misses[0]), 0.005, 1.0) / 0.005))
        span = max(one.box[2], other.box[2]) - min(one.box[0], other.box[0]) + 1.0
        nearness = 0.5 * float(np.median(one.inverse) + np.median(other.inverse))
        width = min(span / (f_px * nearness), MOST_WIDE_M)
    apart = float(np.hypot(*(one.vote - other.vote))) / (2.0 + one.spread + other.spread)
    columns = one.column * other.column
    return np.array(
        [
            1.0,
            convex,
            off,
            np.log1p(apart),
            abs(one.column - other.column),
            width,
            columns * np.log1p(gap_px),
            float(not measured),
        ]
    )


def joined(parts: list[Part], gaps_px: FloatArray, f_px: float) -> NDArray[np.intp]:
    """Return the number of the thing that each part belongs to (N,)."""
    count = len(parts)
    links = np.full((count, count), -np.inf)
    for one, other in combinations(range(count), 2):
        odds = float(ODDS @ features(parts[one], parts[other], float(gaps_px[one, other]), f_px))
        links[one, other] = links[other, one] = odds * np.sqrt(min(parts[one].size, parts[other].size))
    return contracted(links)


def contracted(links: FloatArray) -> NDArray[np.intp]:
    """Return the group of each node (N,) by greedy additive contraction of `links` (N, N), -inf on the diagonal."""
    links, group = links.copy(), np.arange(len(links))
    while len(links) > 1:
        one, other = divmod(int(links.argmax()), len(links))
        if links[one, other] <= 0.0:
            break
        links[one] += links[other]
        links[:, one] = links[one]
        links[one, one] = links[other, :] = links[:, other] = -np.inf
        group[group == group[other]] = group[one]
    return np.asarray(np.unique(group, return_inverse=True)[1])
