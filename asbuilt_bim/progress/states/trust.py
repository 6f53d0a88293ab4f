"""What depth alone proves, built or open: formwork, bars and stray depth are kept apart from concrete."""

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.evidence import Evidence, Verdict
from asbuilt_bim.progress.states.sample_grid import (
    above,
    at_border,
    bridged,
    next_to,
    patches,
    share_along,
    share_around,
    wide,
)

EDGE_REACH = 2
"""Samples that the ring of one reaches over at most: 6 px of the photo are 12 cm of a wall 20 m off."""

RAIL_REACH = 4
"""Samples: a board of 0.2 m before the surface, and what the rings of the samples beside it reach over."""

SPECKLE = 0.04
"""One of the 25 samples round one may be a mismatch."""

WIDER_THAN_A_BAR = 3
"""Samples: depth smears a bar over two of them."""

WIDER_THAN_A_COLUMN = 10
"""Samples, half a metre: a narrower strip of a wall's surface is a column at its end, or what depth smears it to."""

ALIKE = 9
"""Samples that err alike: stereo smooths over a dozen pixels, three samples along and up at thirteen metres."""


def large_enough(
    samples: CellSamples,
    chosen: BoolArray,
    sure: BoolArray,
    least_m2: float,
    bars: BoolArray,
    before: BoolArray | None = None,
) -> BoolArray:
    """Keep the chosen samples in patches with so much of them sure: a speckle of mismatched stereo proves nothing.

    What a narrow strip of `bars` divides is one patch, and so is what a rail or a board `before` them (N,) does; the
    strip adds nothing to its size.
    """
    joined = chosen | bridged(samples, chosen, bars, EDGE_REACH)
    if before is not None:
        joined |= bridged(samples, chosen, before, RAIL_REACH)
    label = patches(samples, joined)
    sizes = np.bincount(label, weights=samples.area_m2 * (chosen & sure))
    kept: BoolArray = chosen & (sizes[label] >= least_m2)
    return kept


def trusted(
    samples: CellSamples,
    evidence: Evidence,
    height_m: FloatArray,
    backed: bool,
    options: ProgressOptions,
    least_wide: int = WIDER_THAN_A_BAR,
) -> tuple[BoolArray, BoolArray]:
    """Return which samples depth alone says are built, and which stand before the design after all.

    `height_m` (N,) is each sample's height over the element's foot, where the ground looks like the element. No strip
    of fewer samples than `least_wide` counts, with what stands before it, but the whole width of a narrow face does.

    The mean of a patch is far better known than one sample: formwork shows. Unless a measured face of the element backs
    them, patches count from a size on, and together from a larger one; what a blurred strip divides is one patch.
    """
    near = _to_its_edges(samples, evidence, options) & (height_m > evidence.drop_m)
    near = wide(samples, near, WIDER_THAN_A_BAR)
    near &= wide(samples, near | (evidence.own == Verdict.BEFORE), least_wide)
    elsewhere = np.isin(evidence.own, (Verdict.BEHIND, Verdict.BEFORE))
    label = patches(samples, near | bridged(samples, near, ~elsewhere, EDGE_REACH))
    count = int(label.max(initial=0)) + 1
    hits = near & (evidence.own == Verdict.NEAR)
    number = np.maximum(np.bincount(label[hits], minlength=count), 1)
    offset = np.bincount(label[hits], weights=evidence.offset_m[hits], minlength=count) / number
    common = np.bincount(label[hits], weights=evidence.common_m[hits], minlength=count) / number
    stands_off = (offset > options.building_tolerance_m + 2.0 * common)[label]
    kept = near & ~stands_off
    noise = np.maximum(evidence.sigma_m[hits] ** 2 - evidence.common_m[hits] ** 2, 0.0)
    spread = np.bincount(label[hits], weights=noise, minlength=count) / number / np.maximum(number / ALIKE, 1.0)
    kept &= (options.sigmas * np.sqrt(common**2 + spread) <= options.max_blur_m)[label]
    sizes = np.bincount(label[near], weights=samples.area_m2[near], minlength=count)
    kept &= (sizes >= options.min_face_m2)[label]
    if not backed:
        kept &= float(samples.area_m2[kept].sum()) >= options.min_patch_m2
    return kept, near & stands_off


def _to_its_edges(samples: CellSamples, evidence: Evidence, options: ProgressOptions) -> BoolArray:
    """Return the samples where the surface is, out to its upright edges.

    The ring of a sample close by an edge reaches past it and sees what lies behind or before. Where its own pixel shows
    the surface, and the surface is sure at its height no further off than the ring is wide, the sample is on it too. By
    a border of built and open it isn't: starter bars stand there.
    """
    sure = evidence.verdict == Verdict.NEAR
    reached_past = np.isin(evidence.verdict, (Verdict.MIXED, Verdict.NOT_MEASURED))
    at_edge = reached_past & (evidence.own == Verdict.NEAR) & ~evidence.tinted
    open_around = share_around(samples, evidence.own == Verdict.BEHIND, np.ones(len(sure), dtype=bool))
    at_edge &= open_around <= SPECKLE
    there: BoolArray = sure | (at_edge & next_to(samples, sure, EDGE_REACH))
    return there


def seen_through(samples: CellSamples, evidence: Evidence, built: BoolArray, options: ProgressOptions) -> BoolArray:
    """Say which undecided samples are seen through all the same: between starter bars, over a pour line, in a cage.

    Most of what depth finds round them lies behind, and higher up, where the bars end, nothing but what lies behind. Or
    at their height, well inside the face's edges, depth passes it again and again: concrete is solid.
    """
    known = np.isin(evidence.own, (Verdict.NEAR, Verdict.BEHIND, Verdict.BEFORE))
    undecided = np.isin(evidence.verdict, (Verdict.MIXED, Verdict.NOT_MEASURED)) & ~built
    through = share_around(samples, evidence.own == Verdict.BEHIND, known)
    found = share_around(samples, known, np.ones(len(known), dtype=bool))
    standing = built | np.isin(evidence.verdict, (Verdict.NEAR, Verdict.OTHER))
    free_above = above(samples, evidence.verdict == Verdict.BEHIND) & ~above(samples, standing)
    enough = (through >= options.through_share) & (found >= options.found_share)
    open_around: BoolArray = undecided & ((enough & free_above) | _in_a_cage(samples, evidence, built, options))
    return open_around


def _in_a_cage(samples: CellSamples, evidence: Evidence, built: BoolArray, options: ProgressOptions) -> BoolArray:
    """Say at which heights a face is seen through between bars, with nothing solid over them."""
    faced = ~np.isin(evidence.own, (Verdict.NOT_FACED, Verdict.BEFORE))
    inside = faced & ~next_to(samples, ~faced, EDGE_REACH) & ~at_border(samples, EDGE_REACH)
    passed = share_along(samples, evidence.own == Verdict.BEHIND, inside & (evidence.own != Verdict.NOT_MEASURED))
    found = share_along(samples, evidence.own != Verdict.NOT_MEASURED, inside)
    solid = built | (evidence.verdict == Verdict.OTHER)
    low = np.zeros(len(solid), dtype=bool)
    for index in np.unique(samples.face[solid]):
        own = samples.face == index
        low[own] = samples.uv_m[own, 1] <= samples.uv_m[own & solid, 1].max()
    caged: BoolArray = (passed >= options.found_share) & (found >= options.found_share) & ~low
    return caged
