"""The pages' pictures: each stands in a page once, as small as the number of stations asks for."""

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass

from asbuilt_bim.progress.report import ProgressReport, StationRecord
from asbuilt_bim.report.drawings.overlay import decode_picture, encode_picture, narrowed
from asbuilt_bim.report.drawings.overlay_layout import OverlayLayout, known_of, overlay_layout
from asbuilt_bim.report.drawings.private import Shower, shower_of
from asbuilt_bim.report.page.cuts import Photo
from asbuilt_bim.report.tables import StationRow, station_rows

FULL_WIDTH_PX, SMALL_WIDTH_PX = 1280, 720
MANY_STATIONS = 40  # from here on smaller pictures, so that the page can still be mailed
MOST_SMALL = 300
"""So many small pictures fit a page of 40 MB; of more stations all pictures together have as many pixels as these."""
_QUALITY = 80


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationCard:
    """A station on the page: its row, its record where it was measured, its picture with what is drawn over it."""

    row: StationRow
    record: StationRecord | None
    photo: Photo | None  # None where there is no picture
    layout: OverlayLayout | None
    hidden: bool = False  # there is a picture, and no element is known in it


def picture_width(stations: int) -> int:
    """Return how wide (px) the pictures of so many stations are."""
    if stations <= MANY_STATIONS:
        return FULL_WIDTH_PX
    return int(SMALL_WIDTH_PX * math.sqrt(min(1.0, MOST_SMALL / stations)))


def station_cards(report: ProgressReport, pictures: Mapping[str, bytes]) -> list[StationCard]:
    """Make the stations' cards with their pictures inside.

    Raises:
        OutputError: a picture can't be decoded.
    """
    width, known = picture_width(len(report.stations)), known_of(report)
    shower = shower_of(report, whole=report.pictures == "whole")
    records = {station.name: station for station in report.stations}
    cards = []
    for number, row in enumerate(station_rows(report)):
        record, layout, photo = records.get(row.name), None, None
        if (data := pictures.get(row.name)) and (record is not None or shower.whole):
            photo = _photo(f"now{number}", row.name, record, data, width, shower)
            layout = overlay_layout(record, known, photo.width, photo.height) if record else None
        hidden = photo is None and row.name in pictures
        cards.append(StationCard(row=row, record=record, photo=photo, layout=layout, hidden=hidden))
    return cards


def photos_before(before: ProgressReport | None, pictures: Mapping[str, bytes], *, whole: bool) -> list[Photo]:
    """Make the small pictures of the visit before, which elements are cut out of; none on a large site.

    Raises:
        OutputError: a picture can't be decoded.
    """
    if before is None or len(before.stations) > MANY_STATIONS:
        return []
    shower = shower_of(before, whole=whole)
    return [
        _photo(f"then{number}", station.name, station, pictures[station.name], SMALL_WIDTH_PX, shower)
        for number, station in enumerate(before.stations)
        if station.name in pictures
    ]


def _photo(key: str, name: str, record: StationRecord | None, data: bytes, width: int, shower: Shower) -> Photo:
    """Make a picture that stands in the page once, with what may be shown."""
    image = narrowed(decode_picture(data, f"station {name}"), width)
    if record is not None:
        image = shower.shown(image, record)
    jpeg = base64.b64encode(encode_picture(image, _QUALITY)).decode("ascii")
    return Photo(key=key, station=record, jpeg=jpeg, width=image.shape[1], height=image.shape[0])
