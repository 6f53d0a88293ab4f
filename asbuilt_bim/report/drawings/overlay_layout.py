"""What a station's overlay shows and where: worked out once, drawn by OpenCV (jpg) and as SVG (page)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.progress.report import FaceRecord, ProgressReport, ShownState, StationRecord
from asbuilt_bim.report.drawings.colours import (
    NOT_COUNTED_COLOUR,
    STATE_COLOURS,
    UNMATCHED,
    UNMATCHED_COLOUR,
    element_names,
    element_states,
    joint_state,
)
from asbuilt_bim.report.drawings.label_placing import Box
from asbuilt_bim.report.drawings.not_counted import Verdicts, verdicts_of
from asbuilt_bim.report.drawings.overlay_labels import Label, anchor_of, face_text, place_label
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.of_faces import NOT_COUNTED_LABEL

TEXT_SHARE = 1 / 70  # text height per picture width: 18 px at 1280, readable when the page shows it at half size
UNMATCHED_SHARE = 0.006  # of the picture: smaller unmatched faces get no label, which would hide the rest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outline:
    """A face's rings (N, 2) in pixels of the picture, its colour and what the colour says."""

    rings: tuple[FloatArray, ...]
    colour: str
    meaning: str
    dashed: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OverlayLayout:
    """All that is drawn over one picture; `disc` is the target's x, y, radius."""

    width: int
    height: int
    text_px: float
    outlines: tuple[Outline, ...]
    labels: tuple[Label, ...]
    disc: tuple[float, float, float] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What the pictures of a report show of its elements: worked out once for all stations."""

    names: Mapping[str, str]  # by GlobalId
    states: Mapping[str, ShownState]
    verdicts: Verdicts


def known_of(report: ProgressReport) -> Known:
    """Return what pictures of a report show of its elements."""
    return Known(names=element_names(report), states=element_states(report), verdicts=verdicts_of(report))


def overlay_layout(station: StationRecord, known: Known, width: int, height: int) -> OverlayLayout:
    """Lay out a station's faces and target on its picture of `width` x `height` pixels."""
    text_px = max(width * TEXT_SHARE, 11.0)
    faces = sorted(station.faces, key=lambda face: (not face.elements, -face.area_m2))  # matched first, large first
    outlines = tuple(_outline(face, known, width / station.width_px) for face in faces)
    disc = _disc(station, width / station.width_px)
    taken: list[Box] = []
    labels: list[Label] = []
    bounds = (float(width), float(height))
    if disc is not None:
        x, y, r = disc
        taken.append((x - r, y - r, 2 * r, 2 * r))
        lines = (f"target {wording.length(station.target_range_m)}",)
        labels.append(place_label((x, y + r + 1.3 * text_px), lines, text_px, bounds, taken, leader=False))
    for face, outline in zip(faces, outlines, strict=True):
        anchor, share = anchor_of(outline.rings, width, height)
        if anchor is not None and (not outline.dashed or share > UNMATCHED_SHARE):
            text = face_text(face, known.names, known.verdicts)
            labels.append(place_label(anchor, text, text_px, bounds, taken))
    return OverlayLayout(
        width=width, height=height, text_px=text_px, outlines=outlines, labels=tuple(labels), disc=disc
    )


def _outline(face: FaceRecord, known: Known, scale: float) -> Outline:
    """Scale a face's rings and choose its colour."""
    rings = tuple(frozen((np.asarray(ring) + 0.5) * scale - 0.5) for ring in face.outline_px)
    if known.verdicts.reason_of(face) is not None:
        return Outline(rings=rings, colour=NOT_COUNTED_COLOUR, meaning=NOT_COUNTED_LABEL, dashed=True)
    found = [known.states[element] for element in known.verdicts.elements_of(face) if element in known.states]
    if not found:
        return Outline(rings=rings, colour=UNMATCHED_COLOUR, meaning=UNMATCHED, dashed=True)
    state = joint_state(found)
    return Outline(rings=rings, colour=STATE_COLOURS[state], meaning=state, dashed=False)


def _disc(station: StationRecord, scale: float) -> tuple[float, float, float] | None:
    """Return the target's circle on the picture."""
    if station.target_left_px is None or station.target_radius_px is None:
        return None
    x, y = (np.asarray(station.target_left_px) + 0.5) * scale - 0.5
    return float(x), float(y), float(station.target_radius_px * scale)
