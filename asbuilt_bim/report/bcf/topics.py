"""What a person has to look at, as topics with GlobalIds that stay the same from run to run."""

import math
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date

from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.geometry.polygon import rings_area
from asbuilt_bim.progress.report import ElementProgress, ProgressReport, StationRecord
from asbuilt_bim.report.bcf.camera import Camera, station_camera, wanted_camera
from asbuilt_bim.report.drawings.not_counted import verdicts_of
from asbuilt_bim.report.page.plan import MOST_VIEWS
from asbuilt_bim.report.page.rows import next_rows
from asbuilt_bim.report.task_rows import late_rows
from asbuilt_bim.report.wording.issue_words import (
    IssueKind,
    again_text,
    closed_text,
    late_text,
    not_seen_since,
    notes_text,
    state_text,
    title_of,
    unmatched_text,
)
from asbuilt_bim.report.wording.reasons import words_of

SAME_VIEW_M, SAME_VIEW_COS = 2.0, math.cos(math.radians(30.0))
"""How far apart two stations are, and their directions, at most, that show the same."""
OPEN, CLOSED = "Open", "Closed"
_SPACE = uuid.uuid5(uuid.NAMESPACE_URL, "https://asbuilt-bim.org/bcf")
_OFF_DESIGN = frozenset({Reason.DISPLACED, Reason.DISPLACED_WITH_OTHERS, Reason.OTHER_SIZE, Reason.PAST_DESIGN})
_CONTRADICTS = frozenset({Reason.PHOTOS_DISAGREE, Reason.GONE})


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """One thing to look at; `station` is the one whose picture shows it, "" for none."""

    guid: str
    kind: IssueKind
    status: str
    title: str
    text: str
    elements: tuple[str, ...]  # GlobalIds
    camera: Camera | None
    station: str
    due: date | None
    created: date
    visit: date


def all_topics(report: ProgressReport, earlier: Sequence[ProgressReport] = ()) -> tuple[Topic, ...]:
    """Return the visit's topics with the day since which each has been so, then those of earlier visits.

    One of these is closed where this visit shows that it is no longer so. What nobody has looked at since stays open.
    """
    first: dict[str, Topic] = {}
    for past in sorted(earlier, key=lambda one: one.visit_date):
        for topic in _topics(past):
            first.setdefault(topic.guid, topic)
    now = {topic.guid: topic for topic in _topics(report)}
    still = [replace(topic, created=first.get(guid, topic).created) for guid, topic in now.items()]
    past_ones = (_as_now(topic, report) for guid, topic in first.items() if guid not in now)
    return (*still, *past_ones)


def _as_now(topic: Topic, report: ProgressReport) -> Topic:
    """Return a topic that this visit doesn't give, as it stands now."""
    elements = {element.global_id: element for element in report.elements}
    own = [elements[key] for key in topic.elements if key in elements]
    if topic.kind in (IssueKind.NEXT_VIEW, IssueKind.SURVEY):
        is_over = not report.nothing_seen
    elif topic.elements:
        is_over = all(element.last_seen == report.visit_date for element in own)
    else:
        is_over = any(_same_view(topic.camera, station_camera(station)) for station in report.stations)
    closed = again_text if topic.kind is IssueKind.NOT_IN_MODEL else closed_text
    text = closed(report.visit_date) if is_over else f"{topic.text} {not_seen_since(topic.visit)}"
    status = CLOSED if is_over else OPEN
    return replace(topic, status=status, text=text, visit=report.visit_date, station="")


def _same_view(one: Camera | None, other: Camera | None) -> bool:
    """Say whether two photos show the same, about: what one of them showed beside the model the other has, or lacks."""
    if one is None or other is None:
        return False
    along = sum(a * b for a, b in zip(one.direction, other.direction, strict=True))
    return math.dist(one.place_m, other.place_m) < SAME_VIEW_M and along > SAME_VIEW_COS


def guid_of(*parts: str) -> str:
    """Return the GUID of what the parts name: the same parts give the same one, on every machine."""
    return str(uuid.uuid5(_SPACE, "\x1f".join(parts)))


def _topics(report: ProgressReport) -> Iterator[Topic]:
    """Yield what one visit gives, in the order in which a person would look at it."""
    yield from _survey(report)
    elements = {element.global_id: element for element in report.elements}
    for row in late_rows(report):
        text = f"{late_text(row.task, row.due, row.late_days)} {state_text(elements[row.global_id])}"
        yield _of_element(IssueKind.LATE, elements[row.global_id], text, report, row.due)
    for element in report.elements:
        off = tuple(note for note in element.doubts if note.code in _OFF_DESIGN)
        against = tuple(note for note in element.notes if note.code in _CONTRADICTS)
        if off:
            yield _of_element(IssueKind.DEVIATION, element, notes_text(off), report)
        if against and element.stations:  # else an earlier visit's topic says it, with its photo
            yield _of_element(IssueKind.CONTRADICTION, element, notes_text(against), report)
    yield from _not_in_model(report)
    yield from _next_views(report, elements)


def _survey(report: ProgressReport) -> Iterator[Topic]:
    """Yield one topic of all that puts the whole visit in doubt."""
    if report.faults:
        text = " ".join(f"{words_of(fault)}." for fault in report.faults)
        yield _topic(IssueKind.SURVEY, "", "", text, (), None, report)


def _of_element(
    kind: IssueKind, element: ElementProgress, text: str, report: ProgressReport, due: date | None = None
) -> Topic:
    name, station = element.name or element.global_id, best_station(element, report)
    return _topic(kind, _key_of(element), name, text, (element.global_id,), station, report, due=due)


def _key_of(element: ElementProgress) -> str:
    """Return the first GlobalId that an element had: an export with new ones makes no new topics."""
    return element.former_ids[0] if element.former_ids else element.global_id


def best_station(element: ElementProgress, report: ProgressReport) -> StationRecord | None:
    """Return the placed station of this visit whose photo shows most of an element.

    By its measured faces; where there are none, by the design's area that the photo decided.
    """
    verdicts = verdicts_of(report)
    own = [s for s in report.stations if s.name in element.stations and s.world_from_left is not None]

    def shown_px(station: StationRecord) -> float:
        faces = [face for face in station.faces if element.global_id in verdicts.elements_of(face)]
        return sum(rings_area(face.outline_px) for face in faces)

    decided_m2: dict[str, float] = {}
    for face in report.faces if own else ():
        if face.element == element.global_id:
            for name, area_m2 in face.surface.stations.items():
                decided_m2[name] = decided_m2.get(name, 0.0) + area_m2
    return max(own, key=lambda s: (shown_px(s), decided_m2.get(s.name, 0.0), s.name), default=None)


def _not_in_model(report: ProgressReport) -> Iterator[Topic]:
    """Yield a topic for each station with measured faces that belong to nothing in the design."""
    for station in report.stations:
        own = [one for one in report.unmatched if one.subject.at_station == station.name]
        whole = [one for one in own if one.subject.kind is SubjectKind.FACE]
        if whole and station.world_from_left is not None:
            name = f"photo {station.name} of {report.visit_date.isoformat()}"
            text = unmatched_text(len(whole), station.name, report.visit_date)
            key = f"{station.name} {report.visit_date.isoformat()}"  # the next visit's photo of that name shows another
            yield _topic(IssueKind.NOT_IN_MODEL, key, name, text, (), station, report)


def _next_views(report: ProgressReport, elements: dict[str, ElementProgress]) -> Iterator[Topic]:
    words = {row.element.global_id: row.words for row in next_rows(report)}
    for view in report.wanted_views[:MOST_VIEWS]:
        if (element := elements.get(view.element)) is not None:
            name, text = (
                element.name or element.global_id,
                f"{words.get(view.element, '')} {state_text(element)}".strip(),
            )
            topic = _topic(IssueKind.NEXT_VIEW, _key_of(element), name, text, (view.element,), None, report)
            yield replace(topic, camera=wanted_camera(view))


def _topic(
    kind: IssueKind,
    key: str,
    name: str,
    text: str,
    elements: tuple[str, ...],
    station: StationRecord | None,
    report: ProgressReport,
    due: date | None = None,
) -> Topic:
    return Topic(
        guid=guid_of(report.project_name, kind.name, key),
        kind=kind,
        status=OPEN,
        title=title_of(kind, name),
        text=text,
        elements=elements,
        camera=station_camera(station) if station else None,
        station=station.name if station else "",
        due=due,
        created=report.visit_date,
        visit=report.visit_date,
    )
