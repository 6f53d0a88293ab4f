"""Which outlines of measured faces may count as built concrete: not formwork, starter bars or a neighbour's side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.evidence import Evidence, Verdict
from asbuilt_bim.progress.states.sample_grid import Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Speaking:
    """A station's matches that may count as built concrete, each with the samples in its outline.

    `tinted` are those that don't, for their colour alone, by face id: the share that hasn't the colour of concrete.
    """

    matches: list[tuple[FaceMatch, Indices]]
    tinted: dict[str, float]


def speaking(
    element: BimElement,
    samples: CellSamples,
    station: str,
    evidence: Evidence,
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> Speaking:
    """Return a station's matches that may count as built concrete.

    An outline doesn't count where `may_be_concrete` says so, where depth finds gaps in its surface, as starter bars
    have, or where most of it hasn't the colour of concrete.
    """
    found = Speaking(matches=[], tinted={})
    for index, face in enumerate(element.faces):
        own = np.flatnonzero(samples.face == index)
        for match in by_face.get(face.face_id, ()) if len(own) else ():
            if match.station != station or not may_be_concrete(match, options):
                continue
            covered = own[polygon.contains(match.outline_uv_m, samples.uv_m[own])]
            if len(covered) == 0 or np.mean(evidence.own[covered] == Verdict.NEAR) < options.solid_share:
                continue
            tinted = float(np.mean(evidence.tinted[covered]))
            if tinted <= options.tinted_share:
                found.matches.append((match, covered))
            else:
                found.tinted[match.face_id] = tinted
    return found


def standing_off(
    element: BimElement,
    samples: CellSamples,
    station: str,
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> BoolArray:
    """Say which samples (N,) lie in outlines of a station's faces that were measured to stand off their design face.

    A plane through thousands of pixels knows better than one of them whether it is that surface. (A cylinder's offset
    is how far off its middle is.)
    """
    off = np.zeros(len(samples.uv_m), dtype=bool)
    for index, face in enumerate(element.faces):
        own = np.flatnonzero(samples.face == index)
        for match in by_face.get(face.face_id, ()) if len(own) else ():
            if match.station == station and isinstance(face.frame, PlaneFrame) and stands_off(match, options):
                off[own] |= polygon.contains(match.outline_uv_m, samples.uv_m[own])
    return off


def outlined_samples(
    samples: CellSamples, speak: Sequence[tuple[FaceMatch, Indices]], evidence: Evidence, options: ProgressOptions
) -> tuple[BoolArray, FloatArray]:
    """Say which samples lie in outlines that count, and the planes' sigma (m)."""
    inside, sigma = np.zeros(len(samples.uv_m), dtype=bool), np.full(len(samples.uv_m), np.inf)
    for match, covered in speak:
        inside[covered] = True
        sigma[covered] = np.minimum(sigma[covered], match.offset_sigma_m)
    return inside, sigma


def stands_off(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face stands further off its design face than concrete may: formwork, a neighbour's side."""
    return abs(match.offset_m) > options.building_tolerance_m + 2.0 * match.offset_sigma_m


def looks_like_bars(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face may be starter bars: too small to be anything, or small and as deep as steel may be.

    Steel has its cover of concrete before it, so a face known to lie nearer the design face is no steel.
    """
    small = match.area_m2 < options.min_patch_m2
    return match.area_m2 < options.min_face_m2 or (small and match.offset_m < -options.cover_m + match.offset_sigma_m)


def may_be_concrete(match: FaceMatch, options: ProgressOptions) -> bool:
    """Say whether a matched face may count as built concrete."""
    return not stands_off(match, options) and not looks_like_bars(match, options)
