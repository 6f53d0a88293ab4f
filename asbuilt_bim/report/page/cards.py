"""An element's card: its photos cut to it with its outline, now and at the visit before, its tasks and why."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from asbuilt_bim.codes import WHY_STATE
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import rings_area
from asbuilt_bim.progress.completion.earned_value import certain_share
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport, ShownState, StationRecord
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.drawings.not_counted import Verdicts, verdicts_of
from asbuilt_bim.report.page.elevation import ElementDrawing, element_drawings
from asbuilt_bim.report.page.plan import closed_path
from asbuilt_bim.report.tables import NO_STOREY, storey_names
from asbuilt_bim.report.task_rows import LateRow, late_rows
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.card_words import worth_words

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """A piece of a photo with the element's outline, all in the photo's pixels."""

    photo: str
    title: str
    box: tuple[float, float, float, float]  # left, top, width, height
    outline: str
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """What was known of an element after a visit."""

    day: date
    state: ShownState
    completion: Completion


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementCard:
    """All that the page shows of one element besides its row."""

    element: ElementProgress
    storey: str
    drawing: ElementDrawing | None
    now: tuple[Cut, ...]
    then: tuple[Cut, ...]
    tasks: tuple[str, ...]
    late: tuple[LateRow, ...]
    past: tuple[Past, ...]  # by visit, this one last; none where there is one visit alone
    money: tuple[str, ...]
    why: str
    notes: tuple[str, ...]


def element_cards(
    report: ProgressReport, photos: Sequence[Photo], earlier: Sequence[ProgressReport], photos_before: Sequence[Photo]
) -> tuple[ElementCard, ...]:
    """Return a card an element, in the order of the table: every name on the page leads to one."""
    storeys = storey_names(report)
    drawings = {drawing.element.global_id: drawing for drawing in element_drawings(report)}
    now = _cuts_by_element(report, photos)
    then = _cuts_by_element(earlier[-1], photos_before) if earlier else {}
    tasks, late, past, money = tasks_by_element(report), _late(report), _past(report, earlier), _money(report)
    order = {key: index for index, key in enumerate(storeys)}
    elements = sorted(
        report.elements, key=lambda e: (order.get(e.storey, len(order)), e.ifc_class, e.name, e.global_id)
    )
    cards = []
    for element in elements:
        key = element.global_id
        why = next((note for note in element.notes if note.code in WHY_STATE), None)
        others = tuple(note_words(note) for note in element.notes if note is not why)
        cards.append(
            ElementCard(
                element=element,
                storey=storeys.get(element.storey, NO_STOREY),
                drawing=drawings.get(key),
                now=tuple(now.get(key, ())),
                then=tuple(then.get(key, ())[:1]),
                tasks=tuple(tasks.get(key, ())),
                late=tuple(late.get(key, ())),
                past=tuple(past.get(key, ())),
                money=tuple(money.get(key, ())),
                why=note_words(why) if why else "",
                notes=others,
            )
        )
    return tuple(cards)


def tasks_by_element(report: ProgressReport) -> dict[str, list[str]]:
    """Return the names of each element's tasks, by GlobalId."""
    found: dict[str, list[str]] = {}
    for task in report.tasks:
        for key in task.progress.elements:
            found.setdefault(key, []).append(task.progress.name or task.identification or task.progress.key)
    return found


def _late(report: ProgressReport) -> dict[str, list[LateRow]]:
    """Return the rows of late elements, by GlobalId."""
    found: dict[str, list[LateRow]] = {}
    for row in late_rows(report):
        found.setdefault(row.global_id, []).append(row)
    return found


def _past(report: ProgressReport, earlier: Sequence[ProgressReport]) -> dict[str, list[Past]]:
    """Return what each visit knew of each element, by GlobalId."""
    found: dict[str, list[Past]] = {}
    for one in (*sorted(earlier, key=lambda each: each.visit_date), report) if earlier else ():
        for element in one.elements:
            known = Past(day=one.visit_date, state=element.shown_state, completion=element.completion)
            found.setdefault(element.global_id, []).append(known)
    return found


def _money(report: ProgressReport) -> dict[str, list[str]]:
    """Return what each element is worth in the cost lines, and what of it is certain, by GlobalId."""
    elements = {element.global_id: element for element in report.elements}
    found: dict[str, list[str]] = {}
    for line in report.cost_lines:
        pieces = line.measure == "count"
        for key, part in line.parts.items():
            if key in elements:
                share = certain_share(elements[key], pieces=pieces, takes_off=line.takes_off)
                worth = part * line.planned_quantity * line.rate
                found.setdefault(key, []).append(worth_words(line, worth, share * worth))
    return found


def _cuts_by_element(report: ProgressReport, photos: Sequence[Photo]) -> dict[str, list[Cut]]:
    """Return each element's pieces of photos, the one that shows most of it first."""
    elements = {element.global_id: element for element in report.elements}
    verdicts = verdicts_of(report)
    found: dict[str, list[tuple[float, Cut]]] = {}
    for photo in photos:
        for key, rings in _rings_by_element(photo, verdicts).items():
            if key in elements:
                area = sum(rings_area((ring,)) for ring in rings) / photo.width**2
                found.setdefault(key, []).append((area, _cut(photo, rings, elements[key])))
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


def _cut(photo: Photo, rings: Sequence[FloatArray], element: ElementProgress) -> Cut:
    """Cut a photo to an element, with something round it, never past the photo's border."""
    points = np.clip(np.vstack(rings), 0.0, [photo.width, photo.height])
    low, high = points.min(axis=0), points.max(axis=0)
    most = np.array([photo.width, photo.height], dtype=np.float64)
    size = np.maximum((high - low) * (1.0 + 2.0 * _ROUND), _LEAST_PX)
    size = np.minimum(np.maximum(size, _LEAST_ASPECT * size[::-1]), most)
    corner = np.clip((low + high - size) / 2.0, 0.0, most - size)
    station = f"{photo.station.name} of {photo.station.day.isoformat()}" if photo.station else ""
    return Cut(
        photo=photo.key,
        title=f"{element.name or element.global_id} in photo {station}",
        box=(float(corner[0]), float(corner[1]), float(size[0]), float(size[1])),
        outline="".join(closed_path(ring) for ring in rings),
        colour=STATE_COLOURS[element.shown_state],
    )
