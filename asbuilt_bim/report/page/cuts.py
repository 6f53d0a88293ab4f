"""Pieces of photos cut to an element with its outline: what was measured of it, or where its design says it stands."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import rings_area
from asbuilt_bim.progress.report import ElementProgress, ProgressReport, StationRecord
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.drawings.not_counted import Verdicts, verdicts_of
from asbuilt_bim.report.drawings.projected import Decided, decided_faces, hull_in_picture
from asbuilt_bim.report.page.plan import closed_path
from asbuilt_bim.report.wording.of_page.card_words import cut_title

MOST_PHOTOS = 2
_ROUND = 0.25  # of the element's size in the picture, left round it
_LEAST_PX = 180.0
_LEAST_ASPECT = 0.5  # of a column: so much of what stands beside it is left


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Photo:
    """A picture that stands in the page once, under its `key`, and is shown whole and cut."""

    key: str
    station: StationRecord | None  # None of a rejected one
    jpeg: str  # in base64
    width: int
    height: int

    @property
    def address(self) -> str:
        """Return the picture as an address."""
        return f"data:image/jpeg;base64,{self.jpeg}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cut:
    """A piece of a photo with the element's outline, all in the photo's pixels."""

    photo: str
    title: str
    box: tuple[float, float, float, float]  # left, top, width, height
    rings: tuple[FloatArray, ...]  # of the outline, each (N, 2)
    colour: str
    should_stand: bool = False  # nothing of it was measured there: the outline is the design's

    @property
    def outline(self) -> str:
        """Return the outline as SVG path data."""
        return "".join(closed_path(ring) for ring in self.rings)


def cuts_by_element(report: ProgressReport, photos: Sequence[Photo]) -> dict[str, list[Cut]]:
    """Return each element's pieces of photos, the one that shows most of it first."""
    elements = {element.global_id: element for element in report.elements}
    verdicts = verdicts_of(report)
    found: dict[str, list[tuple[float, Cut]]] = {}
    for photo in photos:
        for key, rings in _rings_by_element(photo, verdicts).items():
            if key in elements:
                area = sum(rings_area((ring,)) for ring in rings) / photo.width**2
                found.setdefault(key, []).append((area, _cut(photo, rings, elements[key])))
    decided = decided_faces(report)
    for photo in photos:
        for key, ring in _should_stand(photo, elements, decided, found.keys()):
            area = rings_area((ring,)) / photo.width**2
            found.setdefault(key, []).append((area, _cut(photo, [ring], elements[key], should_stand=True)))
    return {
        key: [cut for _, cut in sorted(cuts, key=lambda one: (-one[0], one[1].photo))[:MOST_PHOTOS]]
        for key, cuts in found.items()
    }


def _rings_by_element(photo: Photo, verdicts: Verdicts) -> Mapping[str, list[FloatArray]]:
    """Return the outer rings (N, 2) of an element's measured faces, in the picture's pixels."""
    if photo.station is None:
        return {}
    scale = photo.width / photo.station.width_px
    found: dict[str, list[FloatArray]] = {}
    for face in photo.station.faces:
        for key in verdicts.elements_of(face):
            if face.outline_px and len(face.outline_px[0]) >= 3:
                found.setdefault(key, []).append((np.asarray(face.outline_px[0]) + 0.5) * scale)
    return found


def _should_stand(
    photo: Photo, elements: Mapping[str, ElementProgress], decided: Decided, shown: Iterable[str]
) -> Iterator[tuple[str, FloatArray]]:
    """Yield elements that this photo decided something of, and that no outline shows, with where the design has them.

    The ring (N, 2) is the hull of their sides that the photo decided, in the picture's pixels, within its borders.
    """
    if photo.station is None:
        return
    name, outlined = photo.station.name, set(shown)
    for key, faces in decided.get(name, {}).items():
        if key in outlined or key not in elements or name not in elements[key].stations:
            continue
        if (ring := hull_in_picture(faces, photo.station, photo.width, photo.height)) is not None:
            yield key, ring


def _cut(photo: Photo, rings: Sequence[FloatArray], element: ElementProgress, *, should_stand: bool = False) -> Cut:
    return Cut(
        photo=photo.key,
        title=cut_title(element, photo.station, should_stand=should_stand),
        box=box_round(rings, photo.width, photo.height),
        rings=tuple(rings),
        colour=STATE_COLOURS[element.shown_state],
        should_stand=should_stand,
    )


def box_round(rings: Sequence[FloatArray], width: int, height: int) -> tuple[float, float, float, float]:
    """Return the box (left, top, width, height) round rings, with something round them, never past the picture."""
    most = np.array([width, height], dtype=np.float64)
    points = np.clip(np.vstack(rings), 0.0, most)
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum((high - low) * (1.0 + 2.0 * _ROUND), _LEAST_PX)
    size = np.minimum(np.maximum(size, _LEAST_ASPECT * size[::-1]), most)
    corner = np.clip((low + high - size) / 2.0, 0.0, most - size)
    return float(corner[0]), float(corner[1]), float(size[0]), float(size[1])
