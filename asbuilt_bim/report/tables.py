"""The rows of every table, worked out once: csv, workbook and page only write them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date

from asbuilt_bim.codes import GIVEN_CONTRADICTED, PHOTO_FAULTS, Reason, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import (
    ElementProgress,
    GroupProgress,
    ProgressReport,
    Provenance,
    ShownState,
    StationRecord,
)
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of, words_of_faces
from asbuilt_bim.report.wording.values import area_of
from asbuilt_bim.report.wording.words import Words
from asbuilt_bim.version import __version__

NO_STOREY = "(no storey)"
OF_STATION = frozenset(
    {
        *(SubjectKind.STATION, SubjectKind.PHOTO, SubjectKind.TARGET, SubjectKind.DISC),
        *(SubjectKind.MARKER, SubjectKind.CONTROL_POINT),
    }
)
"""What counts against a station: itself, its photos, its target and its markers."""
OF_FACES = frozenset({SubjectKind.FACE, SubjectKind.INSTANCE})


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementRow:
    """One wall or column; None is unknown, and is never written as 0."""

    storey: str
    global_id: str
    ifc_class: str
    name: str
    state: ShownState
    design_area_m2: float
    photographed_m2: float | None  # design area of the sides that the as-built area was measured on
    as_built_area_m2: float | None
    sigma_m2: float | None
    best: float | None
    lower: float
    upper: float
    coverage: float
    surface_coverage: float
    offset_mm: float | None
    offset_sigma_mm: float | None
    tolerance: str  # in, out or undecided; "" where the project names no tolerance
    visit: date
    last_seen: date | None
    stations: str
    notes: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StationRow:
    """One station that was measured, or `rejected` with its reasons."""

    name: str
    status: str  # "placed", "not placed", "rejected"
    reasons: tuple[Words, ...]  # of the station itself, its photos, its target and its markers
    left_out: tuple[Words, ...]  # of its faces, and of walls and columns that gave none; those alike together
    faces_left_out: int = 0
    markers: str = ""
    residual_px: float | None = None
    target_range_m: float | None = None
    target_depth_m: float | None = None
    target_depth_sigma_m: float | None = None
    faces: int = 0
    matched: int = 0


def element_rows(report: ProgressReport) -> tuple[ElementRow, ...]:
    """Return the elements by storey from below, within it by name."""
    names = storey_names(report)
    order = {key: index for index, key in enumerate(names)}
    elements = sorted(
        report.elements, key=lambda e: (order.get(e.storey, len(order)), e.ifc_class, e.name, e.global_id)
    )
    sides = photographed_areas(report)
    return tuple(
        _element_row(element, names.get(element.storey, NO_STOREY), report.visit_date, sides.get(element.global_id))
        for element in elements
    )


def _element_row(element: ElementProgress, storey: str, visit: date, photographed_m2: float | None) -> ElementRow:
    """Lay out one element."""
    return ElementRow(
        storey=storey,
        global_id=element.global_id,
        ifc_class=element.ifc_class,
        name=element.name,
        state=element.shown_state,
        design_area_m2=element.design_area_m2,
        photographed_m2=photographed_m2,
        as_built_area_m2=element.as_built_area_m2,
        sigma_m2=element.as_built_sigma_m2,
        best=element.completion.best_shown,
        lower=element.completion.lower,
        upper=element.completion.upper,
        coverage=element.completion.coverage,
        surface_coverage=element.surface_coverage,
        offset_mm=None if element.offset_m is None else element.offset_m * 1000.0,
        offset_sigma_mm=None if element.offset_sigma_m is None else element.offset_sigma_m * 1000.0,
        tolerance=element.tolerance.verdict if element.tolerance is not None else "",
        visit=visit,
        last_seen=element.last_seen,
        stations=", ".join(element.stations),
        notes="; ".join(map(note_words, element.notes)),
    )


def storey_names(report: ProgressReport) -> dict[str, str]:
    """Return GlobalId -> name of the storeys; two of the same name get a number."""
    names: dict[str, str] = {}
    for storey in report.storeys:
        name = storey.name or NO_STOREY
        same = sum(1 for other in names.values() if other == name or other.startswith(f"{name} ("))
        names[storey.key] = f"{name} ({same + 1})" if same else name
    return names


def group_rows(report: ProgressReport) -> tuple[tuple[str, GroupProgress], ...]:
    """Return (name, progress) of each storey from below, then of the whole."""
    names = storey_names(report)
    return (*((names[storey.key], storey) for storey in report.storeys), ("Whole", report.whole))


def photographed_areas(report: ProgressReport) -> dict[str, float]:
    """Return by GlobalId the design area (m2) of the sides that as-built areas were measured on."""
    found: dict[str, float] = {}
    for face in report.faces:
        if face.surface.as_built_area_m2 is not None:
            found[face.element] = found.get(face.element, 0.0) + face.exposed_area_m2
    return found


def program_words(made: Provenance) -> str:
    """Write which program measured and when, and which wrote this where `report` of another version made it again."""
    measured = f"asbuilt_bim {made.program_version}, {made.created}"
    return measured if made.program_version == __version__ else f"{measured}; written again by {__version__}"


def measured_words(group: GroupProgress, report: ProgressReport) -> str:
    """Write a group's measured area beside the design's of the same sides: `86.78 ± 0.44 of 112.40 m²`; "none"."""
    design_m2 = photographed_of(group, report)
    if design_m2 is None:
        return "none"
    return area_of(group.as_built_area_m2, group.as_built_sigma_m2, design_m2)


def photographed_of(group: GroupProgress, report: ProgressReport) -> float | None:
    """Return the design area (m2) of the sides of a group that were measured; None where none was."""
    sides = photographed_areas(report)
    found = [sides[key] for key in group.elements if key in sides]
    return sum(found) if found else None


def station_rows(report: ProgressReport) -> tuple[StationRow, ...]:
    """Return the stations that were measured, then those rejected before that."""
    reasons: dict[str, list[Words]] = {}
    left_out: dict[str, list[Rejection]] = {}
    for rejection in report.rejections:
        subject = rejection.subject
        if station := station_of(rejection):
            reasons.setdefault(station, []).append(words_of(rejection))
        elif subject.kind in OF_FACES and subject.at_station:
            left_out.setdefault(subject.at_station, []).append(rejection)
    measured = [
        _station_row(station, tuple(reasons.pop(station.name, ())), left_out.get(station.name, ()))
        for station in report.stations
    ]
    lost = [
        StationRow(
            name=name,
            status="rejected",
            reasons=tuple(found),
            left_out=words_of_faces(name, left_out.get(name, ())),
            faces_left_out=len(left_out.get(name, ())),
        )
        for name, found in sorted(reasons.items())
    ]
    return (*measured, *lost)


def station_of(rejection: Rejection) -> str:
    """Return the station that a rejection counts against, "" where it is about a face or something else."""
    return rejection.subject.at_station if rejection.subject.kind in OF_STATION else ""


def of_whole_visit(rejection: Rejection) -> bool:
    """Say whether a rejection is about no station and no face: about the rig, the survey, or the visit."""
    return not station_of(rejection) and rejection.subject.kind not in OF_FACES


def station_doubts(report: ProgressReport) -> tuple[Rejection, ...]:
    """Return what is wrong with photos, given places and networks of stations that count: numbers rest on these."""
    codes = PHOTO_FAULTS | GIVEN_CONTRADICTED | {Reason.PHOTOS_GREY, Reason.NETWORK_SAW_NOTHING}
    return tuple(one for one in report.rejections if one.code in codes and station_of(one) in report.placed)


def _station_row(station: StationRecord, reasons: tuple[Words, ...], left_out: Sequence[Rejection]) -> StationRow:
    """Lay out one measured station."""
    return StationRow(
        name=station.name,
        status="placed" if station.world_from_left is not None else "not placed",
        markers=", ".join([*map(str, station.markers_used), *(f"{name} (points)" for name in station.linked_to)]),
        residual_px=station.pose_residual_px,
        target_range_m=station.target_range_m,
        target_depth_m=station.target_depth_m,
        target_depth_sigma_m=station.target_depth_sigma_m,
        faces=len(station.faces),
        matched=sum(1 for face in station.faces if face.design_faces),
        reasons=reasons,
        left_out=words_of_faces(station.name, left_out),
        faces_left_out=len(left_out),
    )


def lost_stations(report: ProgressReport) -> tuple[StationRow, ...]:
    """Return the stations that count for nothing: rejected, or not placed."""
    return tuple(row for row in station_rows(report) if row.status != "placed")


def faults_before(earlier: Sequence[ProgressReport], report: ProgressReport) -> tuple[tuple[date, Words], ...]:
    """Return what is known to be wrong with earlier visits, by day, but for what is wrong with this one just so."""
    own = {str(words_of(fault)) for fault in report.faults}
    told = [(one.visit_date, words_of(fault)) for one in earlier for fault in one.faults]
    return tuple((day, words) for day, words in told if str(words) not in own)


def lost_before(earlier: Sequence[ProgressReport]) -> tuple[tuple[date, StationRow], ...]:
    """Return the stations of earlier visits that count for nothing, by day."""
    return tuple((one.visit_date, row) for one in earlier for row in lost_stations(one))


def still_in_doubt(report: ProgressReport, earlier: Sequence[ProgressReport]) -> list[ElementProgress]:
    """Return the elements with what is in doubt of each: of one that this visit didn't show, by the last that did.

    What photos disagreed about then is still paid for now. Its stations are named with their visit's day.
    """
    before = sorted((one for one in earlier if one.visit_date < report.visit_date), key=lambda one: one.visit_date)
    seen: dict[str, tuple[ElementProgress, date]] = {}
    for one in before:
        seen |= {e.global_id: (e, one.visit_date) for e in one.elements if e.stations}
    return [
        _as_seen(element, *seen[element.global_id]) if not element.stations and element.global_id in seen else element
        for element in report.elements
    ]


def _as_seen(now: ElementProgress, then: ElementProgress, day: date) -> ElementProgress:
    """Return an element with what photos of an earlier day disagreed about."""
    if not then.cells_conflict > 0.0:
        return now
    torn = tuple(note for note in then.notes if note.code is Reason.PHOTOS_DISAGREE)
    stations = tuple(f"{name} of {day.isoformat()}" for name in then.stations)
    return replace(now, cells_conflict=then.cells_conflict, notes=(*now.notes, *torn), stations=stations)
