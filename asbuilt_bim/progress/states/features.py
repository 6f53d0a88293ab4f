"""What a station shows round each sample of an element's surface: all that its evidence is weighed by.

A new kind of evidence is one more entry in `FEATURES`, of a file of its own if you like. It weighs nothing until
`benchmarks/site/fit_evidence.py` has fitted it, which says what it buys; docs/measurement-model.md shows how.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.evidence import Evidence, Verdict
from asbuilt_bim.progress.states.sample_grid import above, patches, share_along, share_around

LARGE_M2 = 1.0
"""A patch that is larger says no more."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """What a station shows of an element's N samples, each by its own pixel.

    What lies past bars is behind the design, and what is known to stand off it is before it, whatever one pixel says.
    `faced` are those that the station looks at, from `eye_m` (3,) in world, `outlined` those in outlines of its faces.
    """

    station: str
    eye_m: FloatArray
    samples: CellSamples
    verdict: NDArray[np.uint8]
    past_bars: BoolArray
    tinted: BoolArray
    faced: BoolArray
    outlined: BoolArray

    def around(self, flags: BoolArray) -> FloatArray:
        """Return the share (N,) of flagged samples round each one, among those that nothing stands before."""
        free = self.faced & (self.verdict != Verdict.BEFORE)
        return share_around(self.samples, flags & free, free)

    def along(self, verdict: Verdict) -> FloatArray:
        """Return the share (N,) whose own pixels say so at each one's height, among those nothing stands before."""
        free = self.faced & (self.verdict != Verdict.BEFORE)
        return share_along(self.samples, self.verdict == verdict, free)

    def over(self, verdict: Verdict) -> FloatArray:
        """Return 1 for each sample (N,) that has one above it whose own pixel says so."""
        return above(self.samples, self.verdict == verdict).astype(np.float64)

    def size(self) -> FloatArray:
        """Return the root of the area (m2) of the patch that each sample of the surface lies in, 1 at most."""
        label = patches(self.samples, self.verdict == Verdict.NEAR)
        areas = np.bincount(label, weights=self.samples.area_m2)
        areas[0] = 0.0
        return np.sqrt(np.minimum(areas, LARGE_M2))[label]


def shown(
    station: str,
    eye_m: FloatArray,
    samples: CellSamples,
    evidence: Evidence,
    faced: BoolArray,
    outlined: BoolArray,
    stands_off: BoolArray,
    height_m: FloatArray,
    options: ProgressOptions,
) -> Shown:
    """Put together what a station shows; `stands_off` (N,) are samples in outlines that stand off their design face.

    `height_m` (N,) is each sample's height over the element's foot, where the ground looks like the element.
    """
    before, ground = stands_off | _before(samples, evidence, options), height_m <= evidence.drop_m
    verdict = np.select(
        [evidence.through, evidence.verdict != Verdict.NEAR, before, ground],
        [Verdict.BEHIND, evidence.verdict.astype(np.int64), Verdict.BEFORE, Verdict.NOT_MEASURED],
        Verdict.NEAR,
    )
    return Shown(
        station=station, eye_m=eye_m, samples=samples, verdict=verdict.astype(np.uint8), faced=faced,
        tinted=evidence.tinted, past_bars=evidence.through, outlined=outlined & ~evidence.through,
    )  # fmt: skip


def _before(samples: CellSamples, evidence: Evidence, options: ProgressOptions) -> BoolArray:
    """Say which samples (N,) lie in a patch of surface whose mean stands before the design: formwork.

    The mean is far better known than one sample, but for what all of them err by.
    """
    near = evidence.verdict == Verdict.NEAR
    label = patches(samples, near)
    number = np.maximum(np.bincount(label[near]), 1)
    offset, common = (
        np.bincount(label[near], weights=one[near]) / number for one in (evidence.offset_m, evidence.common_m)
    )
    before: BoolArray = near & np.append(offset > options.building_tolerance_m + 2.0 * common, False)[label]
    return before


FEATURES: dict[str, Callable[[Shown], FloatArray]] = {
    "near": lambda one: one.around(one.verdict == Verdict.NEAR),
    "behind": lambda one: one.around(one.verdict == Verdict.BEHIND),
    "before": lambda one: share_around(one.samples, one.faced & (one.verdict == Verdict.BEFORE), one.faced),
    "near and tinted": lambda one: one.around(one.tinted & (one.verdict == Verdict.NEAR)),
    "itself near": lambda one: (one.verdict == Verdict.NEAR).astype(np.float64),
    "itself behind": lambda one: (one.verdict == Verdict.BEHIND).astype(np.float64),
    "itself before": lambda one: (one.verdict == Verdict.BEFORE).astype(np.float64),
    "past bars": lambda one: one.around(one.past_bars),
    "outlined": lambda one: one.around(one.outlined),
    "itself outlined": lambda one: one.outlined.astype(np.float64),
    "near at its height": lambda one: one.along(Verdict.NEAR),
    "behind at its height": lambda one: one.along(Verdict.BEHIND),
    "behind above": lambda one: one.over(Verdict.BEHIND),
    "near above": lambda one: one.over(Verdict.NEAR),
    "size": lambda one: one.size(),
}
"""Each a share or a flag from 0 to 1; "itself" is of the sample, the others of those round it, by it or over it."""


def features_of(seen: Shown, names: Collection[str] = FEATURES) -> FloatArray:
    """Return the features (N, K) of every sample, of these names."""
    return np.stack([FEATURES[name](seen) for name in names], axis=1)
