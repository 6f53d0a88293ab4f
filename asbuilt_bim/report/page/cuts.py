"""Pieces of photos cut to an element with its outline: what was measured of it, or where its design says it stands."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import rings_area
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, ProgressReport, StationRecord
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.drawings.not_counted import Verdicts, verdicts_of
from asbuilt_bim.report.page.plan import closed_path
from asbuilt_bim.report.wording.of_page.card_words import cut_title

MOST_PHOTOS = 2
_ROUND = 0.25  # of the element's size in the picture, left round it
_LEAST_PX = 180.0
_LEAST_ASPECT = 0.5  # of a column: so much of what stands beside it is left
_NEAREST_M = 0.3  # before the camera: nearer points of a design have no place in a picture


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
    for photo in photos:
        for key, ring in _should_stand(photo, report, found.keys()):
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


def _should_stand(photo: Photo, report: ProgressReport, shown: Iterable[str]) -> Iterator[tuple[str, FloatArray]]:
    """Yield elements that this photo decided something of, and that no outline shows, with where the design has them.

    The ring (N, 2) is the hull of their sides that the photo decided, in the picture's pixels, within its borders.
    """
    if photo.station is None or photo.station.world_from_left is None:
        return
    without = {e.global_id for e in report.elements if photo.station.name in e.stations} - set(shown)
    points: dict[str, list[FloatArray]] = {}
    for face in report.faces if without else ():
        if face.element in without and photo.station.name in face.surface.stations:
            points.setdefault(face.element, []).append(_projected(face, photo.station))
    scale = photo.width / photo.station.width_px
    for key, found in points.items():
        seen = (np.vstack(found) + 0.5) * scale
        if len(seen) >= 3:
            ring = cv2.convexHull(seen.astype(np.float32)).reshape(-1, 2)
            inside = np.clip(ring.astype(np.float64), 0.0, [photo.width, photo.height])
            if np.ptp(inside, axis=0).min() > 1.0:
                yield key, inside


def _projected(face: DesignFaceRecord, station: StationRecord) -> FloatArray:
    """Return the corners (N, 2) of a face in a station's rectified pixels; none of a face that reaches past it."""
    assert station.world_from_left is not None
    world = _corners_m(face)
    left_from_world = np.linalg.inv(station.world_from_left)
    left = world @ left_from_world[:3, :3].T + left_from_world[:3, 3]
    x, y, z = (left @ station.rectified_from_left.T).T
    if not len(world) or z.min() < _NEAREST_M:
        return np.zeros((0, 2))
    return np.stack([station.f_px * x / z + station.cx_px, station.f_px * y / z + station.cy_px], axis=1)


def _corners_m(face: DesignFaceRecord) -> FloatArray:
    """Return world points (N, 3) round a face's exposed surface; of a lateral surface two whole circles."""
    rings = [polygon[0] for polygon in face.exposed_uv_m if polygon and len(polygon[0])]
    if not rings:
        return np.zeros((0, 3))
    uv, (origin, first, second) = np.vstack(rings), face.frame_m
    if face.kind == "plane":
        flat: FloatArray = origin + uv[:, :1] * first + uv[:, 1:2] * second
        return flat
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)[:, None]
    circle = face.radius_m * (np.cos(angles) * second + np.sin(angles) * np.cross(first, second))
    levels = [origin + level * first + circle for level in (uv[:, 1].min(), uv[:, 1].max())]
    return np.vstack(levels)


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
