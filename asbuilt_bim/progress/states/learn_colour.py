"""What colour concrete has at a visit: learned from its matched faces, in the light that was there."""

from collections.abc import Mapping, Sequence

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.colour import SCATTER, ConcreteColour, Palette, TintedPicture
from asbuilt_bim.progress.states.outlines import may_be_concrete

MOST_TINT = 0.12
"""What the light of a day can make of grey. A visit that shows more has concrete of that colour, or grey as well."""

RAYLEIGH_MEDIAN = 1.177
"""Median distance from the middle of a round scatter in the plane, in sigmas."""


def visit_colours(matched: MatchResult, options: ProgressOptions) -> dict[str, ConcreteColour]:
    """Learn by station what concrete looks like; a station without a picture, or with a grey one, isn't among them.

    With `tinted_share` 1 nothing is judged by its colour.
    """
    if options.tinted_share >= 1.0:
        return {}
    credible = [match for match in matched.matches if may_be_concrete(match, options)]
    pictures = {placed.pose.station: TintedPicture.of(placed.measurement) for placed in matched.stations}
    known = {name: picture for name, picture in pictures.items() if picture is not None}
    faces = {
        placed.pose.station: known[placed.pose.station].face_tints(placed.measurement.faces)
        for placed in matched.stations
        if placed.pose.station in known
    }
    visit = _visit_tint(credible, faces)
    own = {name: _own_tint(name, picture, matched, credible) for name, picture in known.items()}
    tints = {name: _tints(one, visit) for name, one in own.items()}
    sigma = _sigma(credible, faces, tints)
    return {
        name: ConcreteColour(
            tint=picture.tint, palette=Palette(tints=tints[name], sigma=sigma), faces=faces[name], scale=picture.scale
        )
        for name, picture in known.items()
    }


def _visit_tint(matches: Sequence[FaceMatch], faces: Mapping[str, Mapping[str, FloatArray]]) -> FloatArray:
    """Return the visit's tint (2,): the median of its elements, with grey as one more that says nothing."""
    by_element: dict[str, list[FloatArray]] = {}
    for match in matches:
        tint = faces.get(match.station, {}).get(match.face_id)
        if tint is not None:
            by_element.setdefault(match.element, []).append(tint)
    if not by_element:
        return np.zeros(2)
    medians = np.array([np.median(tints, axis=0) for tints in by_element.values()])
    return np.asarray(np.median(medians, axis=0) * len(medians) / (len(medians) + 1.0))


def _own_tint(
    station: str, picture: TintedPicture, matched: MatchResult, credible: Sequence[FaceMatch]
) -> FloatArray | None:
    """Return the median (2,) over all of a station's credible faces, None where it has none."""
    wanted = {match.face_id for match in credible if match.station == station}
    (measured,) = (placed.measurement for placed in matched.stations if placed.pose.station == station)
    return picture.median([face for face in measured.faces if face.face_id in wanted])


def _tints(own: FloatArray | None, visit: FloatArray) -> FloatArray:
    """Return the tints (k, 2) of concrete at a station: its own faces', or the visit's where its own can't be.

    Where that is no grey in any daylight, grey is concrete as well.
    """
    if own is None or (np.linalg.norm(own) > MOST_TINT and np.linalg.norm(own - visit) > MOST_TINT):
        own = visit
    return own[None, :] if np.linalg.norm(own) <= MOST_TINT else np.stack([np.zeros(2), own])


def _sigma(
    matches: Sequence[FaceMatch], faces: Mapping[str, Mapping[str, FloatArray]], tints: Mapping[str, FloatArray]
) -> float:
    """Return how faces scatter round their stations' tints: at least `SCATTER`, at most as daylight does."""
    away = [
        float(np.linalg.norm(tints[match.station] - tint, axis=1).min())
        for match in matches
        if match.station in tints and (tint := faces[match.station].get(match.face_id)) is not None
    ]
    return float(np.clip(np.median(away) / RAYLEIGH_MEDIAN, SCATTER, MOST_TINT)) if away else SCATTER
