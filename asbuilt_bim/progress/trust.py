"""What may be taken for built concrete and what for open: formwork, starter bars and stray depth are told apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray
from asbuilt_bim.match.matches import FaceMatch
from asbuilt_bim.progress.evidence import Evidence, Verdict
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.sample_grid import (
    Indices,
    above,
    at_border,
    beside,
    bridged,
    patches,
    share_along,
    share_around,
    wide,
)

EDGE_REACH = 2
"""Samples that the ring of one reaches over at most: 6 px of the photo are 12 cm of a wall 20 m off."""

SPECKLE = 0.04
"""One of the 25 samples round one may be a mismatch."""

WIDER_THAN_A_BAR = 3
"""Samples: depth smears a bar over two of them."""

SEEN_THROUGH = 0.1
"""Of what depth finds round a sample behind the surface: two mismatches of 25; a pour line and bars show more."""

FEWEST_FOR_SLOPE = 12
"""Samples from which a patch's slope is worth a test."""


def large_enough(
    samples: CellSamples, chosen: BoolArray, sure: BoolArray, least_m2: float, between: BoolArray
) -> BoolArray:
    """Keep the chosen samples in patches with so much of them sure: a speckle of mismatched stereo proves nothing.

    What a narrow strip of samples `between` divides, such as a bar, is one patch; the strip adds nothing to its size.
    """
    label = patches(samples, chosen | bridged(samples, chosen, between, EDGE_REACH))
    sizes = np.bincount(label, weights=samples.area_m2 * (chosen & sure))
    kept: BoolArray = chosen & (sizes[label] >= least_m2)
    return kept


def trusted(
    samples: CellSamples, evidence: Evidence, height_m: FloatArray, backed: bool, options: ProgressOptions
) -> tuple[BoolArray, BoolArray]:
    """Return which samples depth alone says are built, and which stand before the design after all.

    `height_m` (N,) is each sample's height over the element's foot, where the ground looks like the element.

    The mean of a patch is far better known than one sample: formwork shows. Unless a measured face of the element backs
    them, patches count from a size on, and together from a larger one; what a blurred strip divides is one patch.
    """
    near = _to_its_edges(samples, evidence, options) & (height_m > evidence.drop_m)
    near = wide(samples, near & ~_with_gaps(samples, evidence, options), WIDER_THAN_A_BAR)
    elsewhere = np.isin(evidence.own, (Verdict.BEHIND, Verdict.BEFORE))
    label = patches(samples, near | bridged(samples, near, ~elsewhere, EDGE_REACH))
    count = int(label.max(initial=0)) + 1
    hits = near & (evidence.own == Verdict.NEAR)
    number = np.maximum(np.bincount(label[hits], minlength=count), 1)
    offset = np.bincount(label[hits], weights=evidence.offset_m[hits], minlength=count) / number
    common = np.bincount(label[hits], weights=evidence.common_m[hits], minlength=count) / number
    stands_off = (offset > options.building_tolerance_m + 2.0 * common)[label]
    kept = near & ~stands_off & ~_leaning(samples, evidence, hits, label, options)[label]
    sizes = np.bincount(label[near], weights=samples.area_m2[near], minlength=count)
    kept &= (sizes >= options.min_face_m2)[label]
    if not backed:
        kept &= float(samples.area_m2[kept].sum()) >= options.min_patch_m2
    return kept, near & stands_off


def _with_gaps(samples: CellSamples, evidence: Evidence, options: ProgressOptions) -> BoolArray:
    """Say round which samples depth sees through the surface, and finds too little of it for solid concrete.

    Starter bars are like that: their depth lies on the design, with gaps between.
    """
    everywhere = np.ones(len(evidence.own), dtype=bool)
    known = np.isin(evidence.own, (Verdict.NEAR, Verdict.BEHIND, Verdict.BEFORE))
    through = share_around(samples, evidence.own == Verdict.BEHIND, known) > SEEN_THROUGH
    solid = share_around(samples, evidence.own == Verdict.NEAR, everywhere) >= options.solid_share
    gaps: BoolArray = through & ~solid
    return gaps


def _to_its_edges(samples: CellSamples, evidence: Evidence, options: ProgressOptions) -> BoolArray:
    """Return the samples where the surface is, out to its upright edges.

    The ring of a sample close by an edge reaches past it and sees what lies behind or before. Where its own pixel shows
    the surface, and the surface is sure at its height no further off than the ring is wide, the sample is on it too;
    not so by a border of built and open, where starter bars stand.
    """
    sure = evidence.verdict == Verdict.NEAR
    at_edge = (evidence.verdict == Verdict.MIXED) & (evidence.own == Verdict.NEAR) & ~evidence.tinted
    at_edge &= options.sigmas * evidence.sigma_m <= options.max_blur_m
    open_around = share_around(samples, evidence.own == Verdict.BEHIND, np.ones(len(sure), dtype=bool))
    at_edge &= open_around <= SPECKLE
    there: BoolArray = sure | (at_edge & beside(samples, sure, EDGE_REACH))
    return there


def _leaning(
    samples: CellSamples, evidence: Evidence, hits: BoolArray, label: IntArray, options: ProgressOptions
) -> BoolArray:
    """Say of each patch whether it runs in another direction than the design: a neighbour's side, the ground.

    A plane is fitted to how far the samples stand off; its slope must be over the limit by more than it may err.
    """
    leaning = np.zeros(int(label.max(initial=0)) + 1, dtype=bool)
    for number in np.unique(label[hits]):
        own = np.flatnonzero(hits & (label == number))
        if len(own) < FEWEST_FOR_SLOPE:
            continue
        design = np.column_stack([samples.uv_m[own] - samples.uv_m[own].mean(axis=0), np.ones(len(own))])
        normal = design.T @ design + np.eye(3) * 1e-9
        fitted = np.linalg.solve(normal, design.T @ evidence.offset_m[own])
        spread = np.sum((evidence.offset_m[own] - design @ fitted) ** 2) / (len(own) - 3)
        sigma = np.sqrt(np.diag(np.linalg.inv(normal))[:2] * spread)
        steepest = np.tan(np.radians(options.max_lean_deg)) + options.sigmas * sigma
        leaning[number] = bool(np.any(np.abs(fitted[:2]) > steepest))
    return leaning


def speaking(
    element: BimElement,
    samples: CellSamples,
    station: str,
    evidence: Evidence,
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> list[tuple[FaceMatch, Indices]]:
    """Return a station's matches that may speak for built concrete, each with the samples in its outline.

    An outline doesn't speak where `may_be_concrete` says so, where depth finds gaps in its surface, as starter bars
    have, or where most of it hasn't the colour of concrete.
    """
    found: list[tuple[FaceMatch, Indices]] = []
    for index, face in enumerate(element.faces):
        own = np.flatnonzero(samples.face == index)
        for match in by_face.get(face.face_id, ()) if len(own) else ():
            if match.station != station or not may_be_concrete(match, options):
                continue
            covered = own[polygon.contains(match.outline_uv_m, samples.uv_m[own])]
            if len(covered) == 0 or np.mean(evidence.own[covered] == Verdict.NEAR) < options.solid_share:
                continue
            if np.mean(evidence.tinted[covered]) <= options.tinted_share:
                found.append((match, covered))
    return found


def outlined_samples(
    samples: CellSamples, speak: Sequence[tuple[FaceMatch, Indices]], evidence: Evidence, options: ProgressOptions
) -> tuple[BoolArray, FloatArray]:
    """Say which samples lie in outlines that speak, with depth on the surface round them, and the planes' sigma (m).

    Concrete is solid over its whole width: an outline that runs up into starter bars has gaps at their height.
    """
    inside, sigma = np.zeros(len(samples.uv_m), dtype=bool), np.full(len(samples.uv_m), np.inf)
    for match, covered in speak:
        inside[covered] = True
        sigma[covered] = np.minimum(sigma[covered], match.offset_sigma_m)
    hit = evidence.own == Verdict.NEAR
    solid = share_along(samples, hit, inside & (evidence.own != Verdict.BEFORE)) >= options.solid_share
    return inside & solid & (hit | (share_around(samples, hit, inside) >= options.solid_share)), sigma


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
    inside = faced & ~beside(samples, ~faced, EDGE_REACH) & ~at_border(samples, EDGE_REACH)
    passed = share_along(samples, evidence.own == Verdict.BEHIND, inside & (evidence.own != Verdict.NOT_MEASURED))
    found = share_along(samples, evidence.own != Verdict.NOT_MEASURED, inside)
    solid = built | (evidence.verdict == Verdict.OTHER)
    low = np.zeros(len(solid), dtype=bool)
    for index in np.unique(samples.face[solid]):
        own = samples.face == index
        low[own] = samples.uv_m[own, 1] <= samples.uv_m[own & solid, 1].max()
    caged: BoolArray = (passed >= options.found_share) & (found >= options.found_share) & ~low
    return caged


def stands_before(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face stands further before its design face than built concrete may: formwork, a stack."""
    return match.offset_m > options.building_tolerance_m + 2.0 * match.offset_sigma_m


def looks_like_bars(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face may be starter bars: too small to be anything, or small and not known to lie nearer
    the design face than steel may, which has its cover of concrete before it.
    """
    small = match.area_m2 < options.min_patch_m2
    return match.area_m2 < options.min_face_m2 or (small and match.offset_m < -options.cover_m + match.offset_sigma_m)


def may_be_concrete(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face may speak for built concrete."""
    return not stands_before(match, options) and not looks_like_bars(match, options)
