"""What colour concrete has at a visit: learned from its matched faces, in the light that was there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.colour import SCATTER, ConcreteColour, Palette, tinted_picture
from asbuilt_bim.progress.states.outlines import may_be_concrete
from asbuilt_bim.scale.share import Share, in_turn

MOST_TINT = 0.12
"""What the light of a day can make of grey. A visit that shows more has concrete of that colour, or grey as well."""

RAYLEIGH_MEDIAN = 1.177
"""Median distance from the middle of a round scatter in the plane, in sigmas."""


def visit_colours(matched: MatchResult, options: ProgressOptions, share: Share = in_turn) -> dict[str, ConcreteColour]:
    """Learn by station what concrete looks like; a station without a picture, or with a grey one, isn't among them.

    With `tinted_share` 1 nothing is judged by its colour. The stations' pictures are looked at one by one, as `share`
    has it, and let go.
    """
    if options.tinted_share >= 1.0:
        return {}
    credible = {(match.station, match.face_id) for match in matched.matches if may_be_concrete(match, options)}
    asked = [
        (placed.measurement, frozenset(face_id for station, face_id in credible if station == placed.pose.station))
        for placed in matched.stations
    ]
    shown = zip(matched.stations, share(_looked_at, asked), strict=True)
    seen = {placed.pose.station: one for placed, one in shown if one is not None}
    visit = _visit_tint([match for match in matched.matches if may_be_concrete(match, options)], seen)
    tints = {name: _tints(one.own, visit) for name, one in seen.items()}
    sigma = _sigma(credible, seen, tints)
    return {
        name: ConcreteColour(
            palette=Palette(tints=tints[name], sigma=sigma),
            faces={face_id: tint for face_id, tint in one.faces.items() if tint is not None},
        )
        for name, one in seen.items()
    }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Seen:
    """The median tint (2,) of each of a station's faces, and of all that may be concrete; None where none is shown."""

    faces: Mapping[str, FloatArray | None]
    own: FloatArray | None


def _looked_at(asked: Sequence[tuple[StationMeasurement, frozenset[str]]]) -> list[_Seen | None]:
    """Look at stations' pictures, each with the ids of its faces that may be concrete; None where one has no colour."""
    found: list[_Seen | None] = []
    for station, credible in asked:
        picture = tinted_picture(station)
        if picture is None:
            found.append(None)
            continue
        faces = {face.face_id: _median(picture.of_faces([face])) for face in station.faces}
        own = [face for face in station.faces if face.face_id in credible]
        found.append(_Seen(faces=faces, own=_median(picture.of_faces(own))))
    return found


def _median(tints: FloatArray) -> FloatArray | None:
    return np.asarray(np.median(tints, axis=0)) if len(tints) else None


def _visit_tint(credible: Sequence[FaceMatch], seen: Mapping[str, _Seen]) -> FloatArray:
    """Return the visit's tint (2,): the median of its elements, with grey as one more that says nothing."""
    by_element: dict[str, list[FloatArray]] = {}
    for match in credible:
        tint = seen[match.station].faces[match.face_id] if match.station in seen else None
        if tint is not None:
            by_element.setdefault(match.element, []).append(tint)
    if not by_element:
        return np.zeros(2)
    medians = np.array([np.median(tints, axis=0) for tints in by_element.values()])
    return np.asarray(np.median(medians, axis=0) * len(medians) / (len(medians) + 1.0))


def _tints(own: FloatArray | None, visit: FloatArray) -> FloatArray:
    """Return the tints (k, 2) of concrete at a station: its own faces', or the visit's where its own can't be.

    Where that is no grey in any daylight, grey is concrete as well.
    """
    tint = visit if own is None else own
    if np.linalg.norm(tint) > MOST_TINT and np.linalg.norm(tint - visit) > MOST_TINT:
        tint = visit
    return tint[None, :] if np.linalg.norm(tint) <= MOST_TINT else np.stack([np.zeros(2), tint])


def _sigma(credible: set[tuple[str, str]], seen: Mapping[str, _Seen], tints: Mapping[str, FloatArray]) -> float:
    """Return how faces scatter round their stations' tints: at least `SCATTER`, at most as daylight does."""
    away = [
        float(np.linalg.norm(tints[name] - own, axis=1).min())
        for name, face_id in sorted(credible)
        if name in seen and (own := seen[name].faces[face_id]) is not None
    ]
    return float(np.clip(np.median(away) / RAYLEIGH_MEDIAN, SCATTER, MOST_TINT)) if away else SCATTER
