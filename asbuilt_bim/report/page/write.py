"""`report.html`: one file that holds everything, without scripts and without requests."""

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from asbuilt_bim.codes import SubjectKind
from asbuilt_bim.progress.report import ElementProgress, ProgressReport, StationRecord
from asbuilt_bim.report.cost_rows import cost_groups
from asbuilt_bim.report.drawings.colours import ORDER, TARGET_COLOUR
from asbuilt_bim.report.drawings.overlay import decode_picture, encode_picture, narrowed
from asbuilt_bim.report.drawings.overlay_layout import OverlayLayout, overlay_layout
from asbuilt_bim.report.page.cards import Photo, element_cards
from asbuilt_bim.report.page.plan import MOST_VIEWS, storey_plans
from asbuilt_bim.report.page.rows import next_rows, since_rows
from asbuilt_bim.report.page.trend import trend_of
from asbuilt_bim.report.tables import (
    NO_STOREY,
    OF_FACES,
    StationRow,
    group_rows,
    lost_stations,
    measured_words,
    photographed_areas,
    station_of,
    station_rows,
    storey_names,
)
from asbuilt_bim.report.task_rows import late_rows, late_words, plan_words, task_rows
from asbuilt_bim.report.wording import completion
from asbuilt_bim.report.wording import values as wording
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.surface_notes import photos_disagree
from asbuilt_bim.storage.atomic_write import writing

TEMPLATES = Path(__file__).parent / "templates"
FULL_WIDTH_PX, SMALL_WIDTH_PX = 1280, 720
MANY_STATIONS = 40  # from here on smaller pictures, so that the page can still be mailed (about 6 MB)
_QUALITY = 80


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationCard:
    """A station on the page: its row, its record where it was measured, its picture with what is drawn over it."""

    row: StationRow
    record: StationRecord | None
    photo: Photo | None  # None where there is no picture
    layout: OverlayLayout | None


def page_html(
    report: ProgressReport,
    pictures: Mapping[str, bytes],
    earlier: Sequence[ProgressReport] = (),
    pictures_before: Mapping[str, bytes] | None = None,
) -> str:
    """Return the page; `pictures` maps a station's name to its rectified left photo as JPEG.

    `earlier` are the reports of the visits before, in the order of days; `pictures_before` are those of the last one.

    Raises:
        OutputError: a picture can't be decoded.
    """
    names = storey_names(report)
    before = earlier[-1] if earlier else None
    cards, steps = _cards(report, pictures), next_rows(report)
    photos = [card.photo for card in cards if card.photo is not None]
    photos_before = _photos_before(before, pictures_before or {})
    shown = element_cards(report, photos, before, photos_before)
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            report=report,
            storeys=group_rows(report),
            elements=_by_storey(report, names),
            storey_names=names,
            no_storey=NO_STOREY,
            plans=storey_plans(report),
            cards=shown,
            photos=[*photos, *photos_before],
            photo_sizes={photo.key: (photo.width, photo.height) for photo in (*photos, *photos_before)},
            photographed=photographed_areas(report),
            trend=trend_of(report, earlier),
            stations=cards,
            lost=lost_stations(report),
            other_rejections=_others(report),
            unmatched=[words_of(rejection) for rejection in report.unmatched],
            faults=[words_of(fault) for fault in report.faults],
            doubted=[element for element in report.elements if element.doubts],
            conflicts=[photos_disagree(e.kind, e.name, e.stations) for e in report.elements if e.cells_conflict > 0],
            tasks=task_rows(report),
            late=late_rows(report),
            plan_words=plan_words(report),
            late_words=late_words(report),
            cost_groups=cost_groups(report),
            before=before,
            since=since_rows(before, report) if before else (),
            next_rows=steps,
            step_of={row.element.global_id: row for row in steps[:MOST_VIEWS]},
            most_shown=MOST_VIEWS,
            order=ORDER,
            target_colour=TARGET_COLOUR,
        )
    )


def write_page(
    report: ProgressReport,
    pictures: Mapping[str, bytes],
    path: Path,
    earlier: Sequence[ProgressReport] = (),
    pictures_before: Mapping[str, bytes] | None = None,
) -> None:
    """Write the page.

    Raises:
        OutputError: it can't be written, or a picture can't be decoded.
    """
    with writing(path):
        path.write_bytes(page_html(report, pictures, earlier, pictures_before).encode("utf-8", "replace"))


def _environment() -> Environment:
    """Make the template environment: everything escaped, nothing undefined."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=wording.shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters: dict[str, Callable[..., str]] = {
        "percent": wording.percent,
        "percent_certain": wording.percent_certain,
        "number": wording.number,
        "rate": wording.rate,
        "area": wording.area,
        "metres": wording.length,
        "millimetres": wording.millimetres,
        "plumb": wording.millimetres_per_metre,
        "day": wording.day,
        "unit": wording.unit_sign,
        "plain": wording.plain,
        "words": note_words,
        "at_least": completion.at_least,
        "possibly": completion.possibly,
        "at_most": completion.at_most,
        "best": completion.best_words,
        "seen": completion.seen_words,
        "in_words": completion.in_words,
        "counts": completion.count_words,
        "area_of": wording.area_of,
    }
    environment.filters.update(filters)
    environment.globals.update(best_shown=completion.best_shown, measured_words=measured_words)
    return environment


def _by_storey(report: ProgressReport, names: dict[str, str]) -> list[tuple[str, list[ElementProgress]]]:
    """Return the elements by storey from below, within it by class and name."""
    groups: dict[str, list[ElementProgress]] = {key: [] for key in names}
    for element in sorted(report.elements, key=lambda e: (e.ifc_class, e.name, e.global_id)):
        groups.setdefault(element.storey, []).append(element)
    return [(names.get(key, NO_STOREY), elements) for key, elements in groups.items() if elements]


def _cards(report: ProgressReport, pictures: Mapping[str, bytes]) -> list[StationCard]:
    """Make the stations' cards with their pictures inside."""
    width = SMALL_WIDTH_PX if len(report.stations) > MANY_STATIONS else FULL_WIDTH_PX
    records = {station.name: station for station in report.stations}
    cards = []
    for number, row in enumerate(station_rows(report)):
        record, layout, photo = records.get(row.name), None, None
        if data := pictures.get(row.name):
            photo = _photo(f"now{number}", row.name, record, data, width)
            layout = overlay_layout(record, report, photo.width, photo.height) if record else None
        cards.append(StationCard(row=row, record=record, photo=photo, layout=layout))
    return cards


def _photo(key: str, name: str, record: StationRecord | None, data: bytes, width: int) -> Photo:
    """Make a picture that stands in the page once."""
    image = narrowed(decode_picture(data, f"station {name}"), width)
    address = f"data:image/jpeg;base64,{base64.b64encode(encode_picture(image, _QUALITY)).decode('ascii')}"
    return Photo(key=key, station=record, address=address, width=image.shape[1], height=image.shape[0])


def _photos_before(before: ProgressReport | None, pictures: Mapping[str, bytes]) -> list[Photo]:
    """Make the small pictures of the visit before, which elements are cut out of; none on a large site."""
    if before is None or len(before.stations) > MANY_STATIONS:
        return []
    return [
        _photo(f"then{number}", station.name, station, pictures[station.name], SMALL_WIDTH_PX)
        for number, station in enumerate(before.stations)
        if station.name in pictures
    ]


def _others(report: ProgressReport) -> list[str]:
    """Return what was left out besides stations and faults; faces and other discs stand with their stations."""
    lost = {row.name for row in lost_stations(report)}
    kept = [r for r in report.rejections if r.subject.kind not in {*OF_FACES, SubjectKind.DISC}]
    rest = [r for r in kept if r not in report.faults and station_of(r) not in lost]
    return [str(words_of(rejection)) for rejection in rest]
