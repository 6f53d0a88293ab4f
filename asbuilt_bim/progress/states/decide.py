"""Decides an element's surface by its stations' votes and its history: each sample is built, open or unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import CellSamples, cell_samples
from asbuilt_bim.bim.model import BimElement, DesignFace
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.as_built import as_built
from asbuilt_bim.progress.states.doubts import GONE_M2, past_design
from asbuilt_bim.progress.states.outlines import looks_like_bars, stands_off
from asbuilt_bim.progress.states.rows import row_log_odds, sides_of
from asbuilt_bim.progress.states.sample_grid import Indices, patches, strips
from asbuilt_bim.progress.states.votes import Votes
from asbuilt_bim.progress.surface import SurfaceState, knows_anything, unseen
from asbuilt_bim.register.scale import ScaleDoubt

OVERLAP_M = 1e-6
"""Sample boxes are grown by this, so that neighbours join without a crack."""
OF_AREA = 0.05
"""Share of a face that may lie past its outline by the grid of samples alone: half a sample all round 2 m2."""


def decide_element(
    element: BimElement,
    votes: Votes,
    by_face: Mapping[str, Sequence[FaceMatch]],
    earlier: Sequence[SurfaceState | None],
    options: ProgressOptions,
    doubt: ScaleDoubt | None = None,
) -> list[SurfaceState]:
    """Return the state of each face of an element by its stations' votes, and by what `earlier` visits made of them.

    What was built stays so, but in cells of which this visit sees a good piece open: there it is unknown which is right
    until a visit says so again.
    """
    samples = cell_samples(element, options.spacing_m)
    sides = list(sides_of(element, options.spacing_m))
    past = _past(element, samples, votes, earlier)
    elsewhere_m = 0.0 if doubt is None else float(doubt.reach_m(element.vertices_m).max(initial=0.0))
    faces = []
    for index, (face, was) in enumerate(zip(element.faces, earlier, strict=True)):
        own, matches = samples.face == index, by_face.get(face.face_id, ())
        state = _face_state(face, samples, own, votes, matches, was, past, options, elsewhere_m)
        rows = row_log_odds([side for side in sides if side.face == index], votes.log_odds)
        says = knows_anything(state) or bool((own & (votes.built | votes.open)).any())
        faces.append(replace(state, row_log_odds=rows if says else None))
    return faces


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Past:
    """What earlier visits saw built (N,), what of it looks open now, and what of it is still held to stand."""

    built: BoolArray
    undone: BoolArray
    stands: BoolArray


def _past(element: BimElement, samples: CellSamples, votes: Votes, earlier: Sequence[SurfaceState | None]) -> _Past:
    built = np.zeros(len(samples.face), dtype=bool)
    if not any(earlier):
        return _Past(built=built, undone=built, stands=built)
    known = [was or unseen(face) for was, face in zip(earlier, element.faces, strict=True)]
    for index, was in enumerate(known):
        own = samples.face == index
        if was.built_uv_m and own.any():
            built[own] = polygon.contains(was.built_uv_m, samples.uv_m[own])
    undone = built & votes.open
    gone_m2 = np.bincount(samples.face, weights=samples.area_m2 * undone, minlength=len(known))
    lost = samples.cell[undone & (gone_m2 >= GONE_M2)[samples.face]]
    return _Past(built=built, undone=undone, stands=built & ~np.isin(samples.cell, lost))


def _face_state(
    face: DesignFace,
    samples: CellSamples,
    own: BoolArray,
    votes: Votes,
    matches: Sequence[FaceMatch],
    earlier: SurfaceState | None,
    past: _Past,
    options: ProgressOptions,
    elsewhere_m: float,
) -> SurfaceState:
    now_built, now_open = own & votes.built, own & votes.open
    built = now_built | (past.stands & own)
    opened = now_open & ~past.built
    conflict = own & (votes.contradicted | past.undone)
    gone_m2 = float(samples.area_m2[own & past.undone].sum())
    regions = [_region(samples, one, face) for one in (built, opened)]
    checked = _checked(face, samples, own, votes, matches, built, options)
    taken_down = bool((past.built & own).any()) and not built.any()
    measured = as_built(checked.matches, None if taken_down else earlier, face)
    areas = {name: float(samples.area_m2[own & by].sum()) for name, by in votes.decided_by.items()}
    built_area, open_area = float(samples.area_m2[built].sum()), float(samples.area_m2[opened].sum())
    doubts = tuple(past_design(checked.matches, options))
    border_m = elsewhere_m if (now_built | now_open).any() else 0.0
    if earlier is not None and (built & ~now_built).any():
        border_m = max(border_m, earlier.border_m)
    return SurfaceState(
        face_id=face.face_id,
        element=face.element,
        built_uv_m=regions[0],
        open_uv_m=regions[1],
        unknown_uv_m=polygon.difference(face.exposed_uv_m, polygon.union(regions)),
        outline_uv_m=measured.outline_uv_m,
        built_area_m2=built_area,
        open_area_m2=open_area,
        unknown_area_m2=max(face.exposed_area_m2 - built_area - open_area, 0.0),
        as_built_area_m2=measured.area_m2,
        as_built_sigma_calibration_m2=measured.sigma_calibration_m2,
        as_built_sigma_image_m2=measured.sigma_image_m2,
        offset_m=measured.offset_m,
        offset_sigma_m=measured.offset_sigma_m,
        tilt_rad=measured.tilt_rad,
        tilt_sigma_rad=measured.tilt_sigma_rad,
        stations={name: value for name, value in areas.items() if value > 0.0},
        conflict_area_m2=float(samples.area_m2[conflict].sum()),
        notes=(
            *doubts,
            *checked.notes,
            *measured.notes,
            *_notes(face, samples, own, votes, built | opened, gone_m2, matches, options),
        ),
        parts=checked.parts,
        doubts=doubts,
        gone_area_m2=gone_m2,
        whole=measured.whole,
        border_m=border_m,
    )


def _checked(
    face: DesignFace,
    samples: CellSamples,
    own: BoolArray,
    votes: Votes,
    matches: Sequence[FaceMatch],
    built: BoolArray,
    options: ProgressOptions,
) -> Checked:
    """Return a face's matches that count as concrete; of a round column, whole is what one station can see of it."""
    standing = tuple(match for match in matches if match in votes.spoken)
    if isinstance(face.frame, CylinderFrame):
        return Checked(matches=standing, parts=(), notes=())
    return check_whole(standing, samples, np.flatnonzero(own), built, options)


def _region(samples: CellSamples, chosen: BoolArray, face: DesignFace) -> Region:
    """Return what the chosen samples (N,) of one face stand for, as polygons within its exposed surface."""
    if not chosen.any():
        return polygon.EMPTY
    step = samples.step_m[np.argmax(chosen)]
    past = samples.past_uv_m[chosen[samples.owner]]
    low, high = strips(samples, np.flatnonzero(chosen))
    low, high = np.concatenate([low, past - 0.5 * step]), np.concatenate([high, past + 0.5 * step])
    low, high = np.round(low - OVERLAP_M, 6), np.round(high + OVERLAP_M, 6)
    joined = polygon.boxes(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    return polygon.intersection(joined, face.exposed_uv_m)


def _notes(
    face: DesignFace,
    samples: CellSamples,
    own: BoolArray,
    votes: Votes,
    decided: BoolArray,
    gone_m2: float,
    matches: Sequence[FaceMatch],
    options: ProgressOptions,
) -> list[Note]:
    notes: list[Note] = []
    element = about(SubjectKind.ELEMENT, face.element)
    hidden = float(samples.area_m2[own & votes.before & ~decided].sum())
    if hidden >= 0.1:
        notes.append(noted(Reason.PARTLY_HIDDEN, element))
    if 0.1 <= gone_m2 < GONE_M2:
        notes.append(noted(Reason.GONE_LITTLE, element, area_m2=gone_m2))
    tinted = [match for match in matches if match.face_id in votes.other_colour]
    unclear = [match for match in matches if match not in votes.spoken and match not in tinted]
    notes += [_of_another_colour(match, votes) for match in tinted]
    return [*notes, *(_not_counted(match, options) for match in unclear)]


def _of_another_colour(match: FaceMatch, votes: Votes) -> Note:
    """Say of a measured face that it has another colour than the visit's concrete, and whether it was counted."""
    seen = votes.other_colour[match.face_id]
    return noted(
        Reason.OTHER_COLOUR,
        about(SubjectKind.FACE, match.face_id, match.station),
        area_m2=match.area_m2,
        share=seen.other_share,
        tint=(float(seen.tint[0]), float(seen.tint[1])),
        counted=match in votes.spoken,
    )


def _not_counted(match: FaceMatch, options: ProgressOptions) -> Note:
    """Say why a measured face was not counted as built."""
    subject = about(SubjectKind.FACE, match.face_id, match.station)
    if stands_off(match, options):
        return noted(Reason.STANDS_OFF, subject, offset_m=match.offset_m)
    code = Reason.STARTER_BARS if looks_like_bars(match, options) else Reason.SURFACE_UNCLEAR
    return noted(code, subject, area_m2=match.area_m2)


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
        notes.append(noted(Reason.PAST_OUTLINE, subject, more_m2=more_m2, area_m2=match.area_m2))
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
