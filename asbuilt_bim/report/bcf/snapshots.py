"""A topic's picture: the photo cut to what the topic is about, with its outline; never a whole photo."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.progress.report import ProgressReport, StationRecord
from asbuilt_bim.report.bcf.topics import Topic
from asbuilt_bim.report.drawings.colours import bgr
from asbuilt_bim.report.drawings.overlay import decode_picture, narrowed
from asbuilt_bim.report.drawings.private import shower_of
from asbuilt_bim.report.page.cuts import Cut, Photo, box_round, cuts_by_element

WIDTH_PX, MOST = 640, 100
"""A picture has a quarter of a megabyte: further topics have none, so that the file can be mailed."""
_BESIDE_DESIGN = "#ff3b5c"
_DARK = "#181d22"


def snapshots_of(report: ProgressReport, topics: Sequence[Topic], pictures: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return PNG bytes by the topics' GUIDs; a topic that nothing in its photo shows has none.

    Raises:
        OutputError: a picture can't be decoded.
    """
    stations = {station.name: station for station in report.stations}
    of_station: dict[str, list[Topic]] = {}
    for topic in topics[:MOST]:
        if topic.station in stations and pictures.get(topic.station):
            of_station.setdefault(topic.station, []).append(topic)
    found: dict[str, bytes] = {}
    shower = shower_of(report, whole=report.pictures == "whole")
    for name, own in of_station.items():
        image = shower.shown(decode_picture(pictures[name], f"station {name}"), stations[name])
        photo = Photo(key=name, station=stations[name], jpeg="", width=image.shape[1], height=image.shape[0])
        cuts = cuts_by_element(report, [photo])
        for topic in own:
            cut = next(iter(cuts.get(topic.elements[0], ())), None) if topic.elements else None
            piece = _of_cut(image, cut) if cut else None if topic.elements else _beside_design(image, photo, report)
            if piece is not None:
                found[topic.guid] = cv2.imencode(".png", piece, [cv2.IMWRITE_PNG_COMPRESSION, 7])[1].tobytes()
    return found


def _of_cut(image: ByteImage, cut: Cut) -> ByteImage:
    return _drawn(image, cut.rings, cut.box, cut.colour)


def _beside_design(image: ByteImage, photo: Photo, report: ProgressReport) -> ByteImage | None:
    """Cut a photo to the measured faces that belong to nothing in the design."""
    station = photo.station
    assert station is not None
    names = {one.subject.name for one in report.unmatched if one.subject.at_station == station.name}
    rings = _outlines(station, names, photo.width / station.width_px)
    if not rings:
        return None
    return _drawn(image, rings, box_round(rings, photo.width, photo.height), _BESIDE_DESIGN)


def _outlines(station: StationRecord, names: set[str], scale: float) -> tuple[FloatArray, ...]:
    """Return the outer rings (N, 2) of a station's faces of these names, in the picture's pixels."""
    faces = [face for face in station.faces if face.face_id in names and face.outline_px]
    return tuple((np.asarray(face.outline_px[0]) + 0.5) * scale for face in faces if len(face.outline_px[0]) >= 3)


def _drawn(
    image: ByteImage, rings: Sequence[FloatArray], box: tuple[float, float, float, float], colour: str
) -> ByteImage:
    """Return the piece of a picture in a box (left, top, width, height) with rings drawn on it."""
    left, top, width, height = (round(value) for value in box)
    piece = image[top : top + height, left : left + width].copy()
    lines = [np.round(np.asarray(ring) - [left, top]).astype(np.int32) for ring in rings]
    thick = max(2, round(piece.shape[1] / 120))
    for shade, extra in ((_DARK, 2), (colour, 0)):
        cv2.polylines(piece, lines, True, bgr(shade), thick + extra, cv2.LINE_AA)
    return narrowed(piece, WIDTH_PX)
