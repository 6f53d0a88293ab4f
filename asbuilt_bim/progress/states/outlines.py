"""Which outlines of measured faces may count as built concrete: not formwork, starter bars or a neighbour's side."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import apply
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.match.score import WorldFace, widest_rad
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


def before_ends(element: BimElement, samples: CellSamples, asked: Indices, unmatched: Sequence[WorldFace]) -> BoolArray:
    """Say which samples (N,) of those `asked` a station sees before a measured face that lies within the element.

    It fits no design face, looks the way that one of the element's does, and stands where the design has concrete: the
    end of a wall that is shorter than its design. Aslant, what lies close before it looks like the samples' surface.
    """
    before = np.zeros(len(samples.face), dtype=bool)
    normals = [face.frame.normal for face in element.faces if isinstance(face.frame, PlaneFrame)]
    body = apply(element.axis_from_world, element.vertices_m)
    low, high = body.min(axis=0), body.max(axis=0)
    for end in unmatched:
        frame, at = end.frame, apply(element.axis_from_world, end.centroid_m)
        if not isinstance(frame, PlaneFrame) or not np.all((at > low) & (at < high)):
            continue
        turned = np.cos(widest_rad(end.angle_sigma_rad, MatchOptions()))
        if any(frame.normal @ normal >= turned for normal in normals):
            other = asked[samples.normals[asked] @ frame.normal < turned]
            eye = end.pose.world_from_left[:-1, -1]
            hits = apply(element.axis_from_world, frame.plane.intersect(eye, samples.points_m[other] - eye))
            rise = apply(element.axis_from_world, frame.from_uv(end.face.outline_uv_m[0]))[:, 2]
            inside = np.all((hits >= [*low[:2], rise.min()]) & (hits <= [*high[:2], rise.max()]), axis=1)
            before[other] |= inside
    return before


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
