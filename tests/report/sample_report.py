"""A believable result of a small site, for the tests of its views: two storeys, eight elements, hostile names."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date, datetime

import cv2
import numpy as np

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.polygon import Region, area, box, difference
from asbuilt_bim.progress.completion.earned_value import earned
from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    DesignFaceRecord,
    ElementProgress,
    FaceRecord,
    GroupProgress,
    ProgressReport,
    Provenance,
    State,
    StationRecord,
    TaskProgress,
)
from asbuilt_bim.progress.surface import SurfaceState
from tests.notes import unstated

VISIT = date(2026, 3, 16)
EARLIER = date(2026, 3, 2)
ORIGIN = np.array([2_600_412.25, 1_200_731.5, 431.0])
TURN = math.radians(27.0)
GROUND, FIRST = "0GroundStoreyGlobalId1", "0FirstStoreyGlobalId22"
HOSTILE_FORMULA = '=HYPERLINK("http://x","pay")'
HOSTILE_MARKUP = "<script>alert(1)</script>"
UMLAUTS = "Stütze Süd-West, ß, 墙"

# name, kind, storey, length, thickness, height, x, y, built share of the height seen, seen share of the length
LAYOUT = (
    ("C-01", "column", GROUND, 0.4, 0.4, 2.9, 0.0, 0.0, 1.0, 1.0),
    (UMLAUTS, "column", GROUND, 0.4, 0.4, 2.9, 6.0, 0.0, 0.55, 1.0),
    (HOSTILE_FORMULA, "column", GROUND, 0.5, 0.5, 2.9, 12.0, 0.0, 0.0, 1.0),
    ("W-01 east", "wall", GROUND, 5.6, 0.25, 2.9, 0.4, 0.0, 1.0, 0.8),
    (HOSTILE_MARKUP, "wall", GROUND, 5.6, 0.25, 2.9, 6.4, 0.0, 0.5, 0.6),
    ("C-11", "column", FIRST, 0.4, 0.4, 2.9, 0.0, 0.0, 0.0, 0.0),
    ("C-12", "column", FIRST, 0.4, 0.4, 2.9, 6.0, 0.0, 0.0, 0.0),
    ("W-11", "wall", FIRST, 5.6, 0.25, 2.9, 0.4, 0.0, 0.3, 0.07),
)


def global_id(index: int) -> str:
    """Return a GlobalId-like text."""
    return f"1Element{index:02d}GlobalId0000"[:22]


def sample_report() -> ProgressReport:
    """Build the whole report."""
    faces = tuple(face for index in range(len(LAYOUT)) for face in _design_faces(index))
    elements = tuple(_element(i, [f for f in faces if f.element == global_id(i)]) for i in range(len(LAYOUT)))
    storeys = tuple(
        _group(key, name, [e for e in elements if e.storey == key])
        for key, name in ((GROUND, "Ground floor"), (FIRST, "First floor"))
    )
    return ProgressReport(
        project_name="Sample site, Überlingen",
        visit_date=VISIT,
        earlier_visits=(EARLIER,),
        elements=elements,
        storeys=storeys,
        whole=_group("", "Whole building", list(elements)),
        tasks=_tasks(elements),
        cost_lines=_cost_lines(elements),
        faces=faces,
        stations=tuple(_station(index) for index in range(3)),
        rejections=(
            Rejection(
                code=Reason.SCALE_UNCHECKED,
                subject=Subject(kind=SubjectKind.STATION, name="B2"),
                values={"found": 0, "needed": 2},
            ),
            Rejection(
                code=Reason.MARKERS_TOO_FEW,
                subject=Subject(kind=SubjectKind.STATION, name="Süd 3"),
                values={"found": 1, "needed": 2, "any_read": True},
            ),
            Rejection(
                code=Reason.MARKER_CONTRADICTS,
                subject=Subject(kind=SubjectKind.MARKER, name="17", station="A1"),
                values={"off_sigmas": 14.2, "limit_sigmas": 3.0},
            ),
        ),
        unmatched=(
            Rejection(
                code=Reason.FACE_BEFORE,
                subject=Subject(kind=SubjectKind.FACE, name="A2/2", station="A2"),
                values={"nearest": "Wall 2", "offset_m": 0.42, "limit_m": 0.1},
            ),
        ),
        unobserved=tuple(f.face_id for f in faces if f.surface.unknown_area_m2 >= f.exposed_area_m2 - 1e-9),
        notes=(unstated("The IFC file has 2 walls without a body; they are left out."),),
        provenance=Provenance(
            program_version="0.1.0",
            created="2026-03-17T08:30:00+00:00",
            project_name="Sample site, Überlingen",
            ifc_name="design.ifc",
            ifc_digest="sha256:" + "3f" * 32,
            rig_digest="sha256:" + "a1" * 32,
            survey_digest="sha256:" + "5b" * 32,
            options_digest="sha256:" + "c7" * 32,
            networks={},
            libraries={"numpy": "2.4.0", "opencv": "5.0.0"},
        ),
    )


def _element(index: int, faces: list[DesignFaceRecord]) -> ElementProgress:
    """Sum an element's faces."""
    name, kind, storey, length, thickness, height, *_ = LAYOUT[index]
    built = sum(f.surface.built_area_m2 for f in faces)
    open_ = sum(f.surface.open_area_m2 for f in faces)
    design = sum(f.exposed_area_m2 for f in faces)
    decided = built + open_
    coverage = decided / design
    best = built / decided if coverage >= 0.1 else None
    measured = [f.surface.as_built_area_m2 for f in faces if f.surface.as_built_area_m2 is not None]
    known: State = "complete" if (best or 0) > 0.97 else "not started" if (best or 0) < 0.02 else "part"
    state: State = "unknown" if best is None else known
    seen = decided > 0
    return ElementProgress(
        global_id=global_id(index),
        ifc_class="IfcWall" if kind == "wall" else "IfcColumn",
        kind=kind,
        name=name,
        storey=storey,
        state=state,
        completion=Completion(best=best, lower=built / design, upper=1.0 - open_ / design, coverage=coverage),
        cells_built=round(40 * built / design, 2),
        cells_open=round(40 * open_ / design, 2),
        cells_unknown=round(40 * (1 - coverage), 2),
        cells_conflict=1.0 if index == 4 else 0.0,
        surface_coverage=coverage,
        design_area_m2=design,
        design_volume_m3=length * thickness * height,
        built_area_m2=built,
        as_built_area_m2=sum(measured) if measured else None,
        as_built_sigma_m2=0.012 * sum(measured) if measured else None,
        offset_m=0.013 if measured else None,
        offset_sigma_m=0.004 if measured else None,
        tilt_rad=0.002 if measured else None,
        stations=("A1", "A2") if seen else (),
        last_seen=(EARLIER if index == 3 else VISIT) if seen else None,
        notes=(unstated("one side seen built and open: look at it"),) if index == 4 else (),
    )


def _design_faces(index: int) -> list[DesignFaceRecord]:
    """Make the two long sides (and for columns all four) with their states; the back is never seen."""
    _, kind, storey, length, thickness, height, x, y, built, seen = LAYOUT[index]
    level = 0.0 if storey == GROUND else 3.1
    sides = [((x, y), (1.0, 0.0), length), ((x + length, y + thickness), (-1.0, 0.0), length)]
    if kind == "column":
        sides += [((x + length, y), (0.0, 1.0), thickness), ((x, y + thickness), (0.0, -1.0), thickness)]
    turn = np.array([[math.cos(TURN), -math.sin(TURN)], [math.sin(TURN), math.cos(TURN)]])
    found = []
    for side, (corner, along, width) in enumerate(sides):
        start = np.append(turn @ np.array(corner), level) + ORIGIN
        frame = np.stack([start, np.append(turn @ np.array(along), 0.0), [0.0, 0.0, 1.0]])
        visible = seen if side in (0, 2) else 0.0
        found.append(_face_record(index, side, frame, width, height, built, visible))
    return found


def _face_record(
    index: int, side: int, frame: FloatArray, width: float, height: float, built: float, seen: float
) -> DesignFaceRecord:
    """Make one design face: built from below to `built`, seen from its left to `seen`."""
    whole = box(0, 0, width, height)
    built_region: Region = box(0, 0, width * seen, height * built) if built * seen > 0 else ()
    open_region: Region = box(0, height * built, width * seen, height) if (1 - built) * seen > 0 else ()
    unknown = difference(difference(whole, built_region), open_region)
    face_id = f"{global_id(index)}-{side:08x}"
    surface = SurfaceState(
        face_id=face_id,
        element=global_id(index),
        built_uv_m=built_region,
        open_uv_m=open_region,
        unknown_uv_m=unknown,
        outline_uv_m=built_region,
        built_area_m2=area(built_region),
        open_area_m2=area(open_region),
        unknown_area_m2=area(unknown),
        as_built_area_m2=area(built_region) * 1.004 if built_region else None,
        as_built_sigma_calibration_m2=0.008 * area(built_region),
        as_built_sigma_image_m2=0.009 * area(built_region),
        offset_m=0.013 if built_region else None,
        offset_sigma_m=0.004 if built_region else None,
        tilt_rad=0.002 if built_region else None,
        stations={"A1": area(built_region)} if seen else {},
        conflict_area_m2=0.0,
        notes=(),
    )
    return DesignFaceRecord(
        face_id=face_id,
        element=global_id(index),
        kind="plane",
        role="side",
        frame_m=frozen(frame),
        radius_m=0.0,
        area_m2=width * height,
        exposed_area_m2=width * height,
        exposed_uv_m=whole,
        surface=surface,
    )


def _group(key: str, name: str, elements: list[ElementProgress]) -> GroupProgress:
    """Weigh the elements by their design area."""
    design = sum(e.design_area_m2 for e in elements)
    built = sum(e.completion.lower * e.design_area_m2 for e in elements)
    upper = sum(e.completion.upper * e.design_area_m2 for e in elements)
    coverage = sum(e.completion.coverage * e.design_area_m2 for e in elements) / design
    best = built / (coverage * design) if coverage >= 0.1 else None
    states = [e.state for e in elements]
    return GroupProgress(
        key=key,
        name=name,
        elements=tuple(e.global_id for e in elements),
        completion=Completion(best=best, lower=built / design, upper=upper / design, coverage=coverage),
        complete=states.count("complete"),
        part=states.count("part"),
        not_started=states.count("not started"),
        unknown=states.count("unknown"),
        design_area_m2=design,
        as_built_area_m2=sum(e.as_built_area_m2 or 0.0 for e in elements),
        as_built_sigma_m2=0.011 * sum(e.as_built_area_m2 or 0.0 for e in elements),
    )


def _tasks(elements: tuple[ElementProgress, ...]) -> tuple[TaskProgress, ...]:
    """Make three tasks: one begun, one late, one unknown."""
    columns = [e for e in elements if e.kind == "column" and e.storey == GROUND]
    walls = [e for e in elements if e.kind == "wall" and e.storey == GROUND]
    upper = [e for e in elements if e.storey == FIRST]
    return (
        TaskProgress(
            progress=_group("2TaskA", "Columns, ground floor", columns),
            schedule_start=datetime(2026, 2, 23, 8),
            schedule_finish=datetime(2026, 3, 13, 17),
            actual_start=EARLIER,
            actual_finish=None,
            late=True,
        ),
        TaskProgress(
            progress=_group("2TaskB", "Walls, ground floor", walls),
            schedule_start=datetime(2026, 3, 2, 8),
            schedule_finish=datetime(2026, 3, 27, 17),
            actual_start=VISIT,
            actual_finish=None,
            late=False,
        ),
        TaskProgress(
            progress=_group("2TaskC", "First floor", upper),
            schedule_start=None,
            schedule_finish=None,
            actual_start=None,
            actual_finish=None,
            late=None,
        ),
    )


def _cost_lines(elements: tuple[ElementProgress, ...]) -> tuple[CostProgress, ...]:
    """Make lines of volume, area and pieces, one of them unknown, in two currencies."""
    ground = [e for e in elements if e.storey == GROUND]
    first = [e for e in elements if e.storey == FIRST]
    columns = [e for e in elements if e.kind == "column"]
    rows = (
        ("01.1", "Concrete C30/37, ground floor", ground, "m3", "volume", 12.5, 185.0, "EUR"),
        ("01.2", "Formwork, ground floor", ground, "m2", "area", 84.0, 62.5, "EUR"),
        ("02.1", "@SUM(A1) Concrete, first floor", first, "m3", "volume", 8.25, 190.0, "EUR"),
        ("09", "Cast-in anchors", columns, "pcs", "count", 5.0, 40.0, "CHF"),
    )
    return tuple(
        _cost_line(f"3Cost{index}", *row)
        for index, row in enumerate(rows)  # type: ignore[arg-type]
    )


def _cost_line(
    key: str,
    identification: str,
    name: str,
    of: list[ElementProgress],
    unit: str,
    measure: str,
    quantity: float,
    rate: float,
    currency: str,
) -> CostProgress:
    """Work out one line."""
    line = CostLine(
        global_id=key,
        name=name,
        identification=identification,
        elements=tuple(e.global_id for e in of),
        unit=unit,
        measure=measure,  # type: ignore[arg-type]
        planned_quantity=quantity,
        rate=rate,
        currency=currency,
    )
    parts = {e.global_id: 1.0 / len(of) for e in of}
    return earned(line, _group("", "", of).completion, parts, {e.global_id: e for e in of})


def _station(index: int) -> StationRecord:
    """Make a station: the third is measured but could not be placed."""
    name = ("A1", "A2", "Süd 3")[index]
    placed = index < 2
    angle = TURN + 0.3 * index
    axes = np.array([[math.cos(angle), math.sin(angle), 0], [0, 0, -1], [-math.sin(angle), math.cos(angle), 0]]).T
    pose = np.eye(4)
    pose[:3, :3] = axes
    pose[:3, 3] = ORIGIN + np.array([4.0 + 2 * index, -3.0, 1.6])
    return StationRecord(
        name=name,
        day=VISIT,
        left_photo=f"visits/2026-03-16/{name}_left.jpg",
        right_photo=f"visits/2026-03-16/{name}_right.jpg",
        left_digest="sha256:" + "1a" * 32,
        right_digest="sha256:" + "2b" * 32,
        f_px=1052.3,
        cx_px=641.2,
        cy_px=476.8,
        baseline_m=0.2503,
        width_px=1280,
        height_px=960,
        rectified_from_left=frozen(np.eye(3)),
        world_from_left=frozen(pose) if placed else None,
        pose_covariance=frozen(np.eye(6) * 1e-6) if placed else None,
        pose_residual_px=0.31 if placed else None,
        pose_method="markers" if placed else "",
        markers_used=(3, 7, 12) if placed else (),
        target_left_px=frozen([905.218, 640.772]),
        target_right_px=frozen([842.93, 640.79]),
        target_radius_px=37.5,
        target_depth_m=4.213,
        target_depth_sigma_m=0.011,
        target_range_m=4.36,
        target_diameter_m=0.299,
        faces=_measured(name, matched=placed),
        picture=f"pictures/{name}.jpg",
        seconds={"rectify": 0.2, "stereo": 3.1},
    )


def _measured(name: str, *, matched: bool) -> tuple[FaceRecord, ...]:
    """Make three measured faces; the second is never matched, the third has a hole."""
    outlines = (
        ([[130, 180], [310, 190], [310, 800], [130, 820]],),
        ([[380, 330], [520, 340], [520, 730], [380, 740]],),
        (
            [[600, 200], [1180, 260], [1180, 760], [600, 800]],
            [[760, 420], [760, 640], [900, 640], [900, 430]],
        ),
    )
    owners = ((0,), (), (3, 4))
    areas = ((1.3524, 0.018), (0.62, 0.02), (9.87, 0.11))
    return tuple(
        FaceRecord(
            face_id=f"{name}/{number + 1}",
            label="wall" if number == 2 else "column",
            kind="plane",
            outline_px=tuple(frozen(ring) for ring in rings),
            outline_world_m=tuple(frozen(np.pad(np.array(ring) / 100.0, ((0, 0), (0, 1)))) for ring in rings),
            area_m2=areas[number][0],
            area_sigma_calibration_m2=areas[number][1] * 0.6,
            area_sigma_image_m2=areas[number][1] * 0.8,
            whole=number == 0,
            cut_by_frame=number == 2,
            occluded=number == 1,
            width_m=0.4,
            height_m=2.9,
            width_px=180.0,
            design_faces=tuple(f"{global_id(i)}-00000000" for i in owners[number]) if matched else (),
            elements=tuple(global_id(i) for i in owners[number]) if matched else (),
        )
        for number, rings in enumerate(outlines)
    )


def sample_picture(width: int = 1280, height: int = 960) -> bytes:
    """Draw a plain picture of the station, as JPEG bytes."""
    image = np.full((height, width, 3), (205, 190, 170), np.uint8)
    scale = width / 1280.0
    image[int(600 * scale) :] = (120, 135, 140)
    for face in _measured("A1", matched=True):
        rings = [np.round(ring * scale).astype(np.int32) for ring in face.outline_px]
        cv2.fillPoly(image, rings, (150, 155, 158))
    cv2.circle(image, (int(905 * scale), int(641 * scale)), int(38 * scale), (40, 40, 200), -1)
    noise = np.random.default_rng(1).integers(-9, 10, image.shape)
    return cv2.imencode(".jpg", np.clip(image + noise, 0, 255).astype(np.uint8))[1].tobytes()


def renamed(report: ProgressReport, index: int, **changes: object) -> ProgressReport:
    """Return the report with one element changed."""
    elements = list(report.elements)
    elements[index] = replace(elements[index], **changes)  # type: ignore[arg-type]
    return replace(report, elements=tuple(elements))
