"""Prints that were moved between two visits: what all the others moved by is no move."""

from collections.abc import Collection, Mapping

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.register.tags import TagPlace

LEAST_PRINTS = 5
"""Of fewer nobody can say which of them were moved."""
MOVED_SIGMAS, MOVED_M = 5.0, 0.05
"""Of what both visits know of it; and what no hand moves a print by without meaning to."""
LEAST_SHARE = 0.5
"""Of its sigma at least: a print's sigma is mostly what it has in common with the others, and that was taken off."""


def moved_since(
    found: Mapping[int, TagPlace], remembered: Mapping[int, TagPlace], already: Collection[int]
) -> dict[int, FloatArray]:
    """Return how far (3,) prints were moved since they were remembered, those that are known `already` left out.

    What all prints err by in common is taken off first. How much they differ is taken from themselves.
    """
    both = sorted(found.keys() & remembered.keys())
    if len(both) < LEAST_PRINTS:
        return {}
    off = np.array([found[tag].centre_m - remembered[tag].centre_m for tag in both])
    off -= np.median(off, axis=0)
    own = np.array([np.hypot(found[tag].sigma_m, remembered[tag].sigma_m) for tag in both])
    away = np.linalg.norm(off, axis=1)
    share = np.clip(robust_sigma((off / own[:, None]).ravel()), LEAST_SHARE, 1.0)
    limit = np.maximum(MOVED_SIGMAS * share * own, MOVED_M)
    return {tag: step for tag, step, far in zip(both, off, away > limit, strict=True) if far and tag not in already}
