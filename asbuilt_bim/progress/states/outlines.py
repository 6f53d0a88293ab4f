"""Which outlines of measured faces may count as built concrete: not formwork, starter bars or a neighbour's side."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.sample_grid import Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Covered:
    """A station's match, the samples in its outline, and whether its design face is a plane."""

    match: FaceMatch
    samples: Indices
    flat: bool


def covered(
    element: BimElement,
    samples: CellSamples,
    station: str,
    by_face: Mapping[str, Sequence[FaceMatch]],
) -> list[Covered]:
    """Return a station's matches, each with the samples in its outline."""
    found: list[Covered] = []
    for index, face in enumerate(element.faces):
        own = np.flatnonzero(samples.face == index)
        for match in by_face.get(face.face_id, ()) if len(own) else ():
            if match.station == station:
                inside = own[polygon.contains(match.outline_uv_m, samples.uv_m[own])]
                found.append(Covered(match=match, samples=inside, flat=isinstance(face.frame, PlaneFrame)))
    return found


def marked(chosen: Iterable[Covered], count: int) -> BoolArray:
    """Say which of so many samples lie in one of the chosen outlines."""
    inside = np.zeros(count, dtype=bool)
    for one in chosen:
        inside[one.samples] = True
    return inside


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
