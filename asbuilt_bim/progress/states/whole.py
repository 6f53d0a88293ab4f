"""Whether a face that its station took for whole is: the concrete of its design face may go on past its outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.sample_grid import Indices, patches

OF_AREA = 0.05
"""Share of a face that may lie past its outline by the grid of samples alone: half a sample all round 2 m2."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """A design face's matches, and which measured faces (ids) are a part though their stations took them for whole."""

    matches: tuple[FaceMatch, ...]
    parts: tuple[str, ...]
    notes: tuple[Note, ...]


def check_whole(
    matches: Sequence[FaceMatch], samples: CellSamples, own: Indices, built: BoolArray, options: ProgressOptions
) -> Checked:
    """Take "whole" from matches of a plane design face that leave out what hangs together with them and is built.

    `own` are the design face's samples, `built` (N,) all that is known to be built, by any station. A mask may end at a
    shadow, a pole or a strip of formwork, and look whole where it was taken.
    """
    kept: list[FaceMatch] = []
    parts: list[str] = []
    notes: list[Note] = []
    for match in matches:
        more_m2 = _past_outline(match, samples, own, built) if match.whole and len(own) else 0.0
        allowed_m2 = OF_AREA * match.area_m2 + options.sigmas * match.area_sigma_image_m2
        if more_m2 <= max(options.min_face_m2, allowed_m2):
            kept.append(match)
            continue
        kept.append(replace(match, whole=False))
        parts.append(match.face_id)
        subject = about(SubjectKind.FACE, match.face_id, match.station)
        values: Values = {"more_m2": more_m2, "area_m2": match.area_m2}
        notes.append(Note(code=Reason.PAST_OUTLINE, subject=subject, values=values))
    return Checked(matches=tuple(kept), parts=tuple(parts), notes=tuple(notes))


def _past_outline(match: FaceMatch, samples: CellSamples, own: Indices, built: BoolArray) -> float:
    """Return how much (m2) of what is built lies past a match's outline and hangs together with it."""
    inside = np.zeros(len(built), dtype=bool)
    inside[own] = polygon.contains(match.outline_uv_m, samples.uv_m[own])
    past = np.zeros(len(built), dtype=bool)
    past[own] = built[own] & ~inside[own]
    label = patches(samples, inside | past)
    past &= np.isin(label, np.unique(label[inside]))
    return float(samples.area_m2[past].sum())
