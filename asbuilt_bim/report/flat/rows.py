"""The rows of the flat tables: one of each thing and visit, in the columns' order."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date, datetime

from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    ElementProgress,
    FaceRecord,
    GroupProgress,
    ProgressReport,
)
from asbuilt_bim.progress.valuation.bill import BillLine, bills
from asbuilt_bim.report.flat.columns import TABLES, Table
from asbuilt_bim.report.tables import StationRow, photographed_areas, station_rows
from asbuilt_bim.report.task_rows import TaskRow, task_rows

Cell = str | float | int | bool | date | datetime | None
Row = dict[str, Cell]
OF_THE_NEWEST: Row = {"certified_quantity": None, "certified_amount": None, "previous_amount": None}
"""What earlier visits' rows don't hold: what was certified then, somebody may have changed since."""


def flat_tables(reports: Sequence[ProgressReport]) -> dict[Table, list[tuple[Cell, ...]]]:
    """Return every table's rows, the visits in their order."""
    ordered = sorted(reports, key=lambda report: report.visit_date)
    made: dict[Table, list[tuple[Cell, ...]]] = {name: [] for name in TABLES}
    for report in ordered:
        visit: Row = {
            "project": report.project_name,
            "visit_date": report.visit_date,
            "newest": report is ordered[-1],
        }
        for name, columns in TABLES.items():
            for row in _ROWS[name](report):
                whole = visit | row | ({} if visit["newest"] else OF_THE_NEWEST)
                made[name].append(tuple(whole[column.name] for column in columns))
    return made


def _elements(report: ProgressReport) -> Iterator[Row]:
    storeys = {storey.key: storey.name for storey in report.storeys}
    sides = photographed_areas(report)
    for element in report.elements:
        more: Row = {"storey": storeys.get(element.storey) or None}
        yield _element(element) | more | {"photographed_design_area_m2": sides.get(element.global_id)}


def _element(element: ElementProgress) -> Row:
    return {
        "global_id": element.global_id,
        "ifc_class": element.ifc_class,
        "type_name": element.type_name or None,
        "name": element.name or None,
        "storey_id": element.storey or None,
        "state": element.shown_state,
        **_completion(element.completion),
        "design_area_m2": element.design_area_m2,
        "as_built_area_m2": element.as_built_area_m2,
        "as_built_sigma_m2": element.as_built_sigma_m2,
        "design_volume_m3": element.design_volume_m3,
        "offset_m": element.offset_m,
        "offset_sigma_m": element.offset_sigma_m,
        "tilt_rad": element.tilt_rad,
        "tilt_sigma_rad": element.tilt_sigma_rad,
        "tolerance": element.tolerance.verdict if element.tolerance is not None else None,
        "zones": "; ".join(element.zones) or None,
        "first_built_date": element.first_built,
        "complete_date": element.complete_on,
        "last_seen_date": element.last_seen,
        "doubtful": bool(element.doubts),
    }


def _completion(completion: Completion) -> Row:
    return {
        "completion_best": completion.best_shown,
        "completion_lower": completion.lower,
        "completion_upper": completion.upper,
        "coverage": completion.coverage,
    }


def _faces(report: ProgressReport) -> Iterator[Row]:
    for station in report.stations:
        for face in station.faces:
            yield _face(face) | {"station": station.name}


def _face(face: FaceRecord) -> Row:
    return {
        "face_id": face.face_id,
        "label": face.label,
        "kind": face.kind,
        "global_ids": " ".join(face.elements) or None,
        "area_m2": face.area_m2,
        "area_sigma_calibration_m2": face.area_sigma_calibration_m2,
        "area_sigma_image_m2": face.area_sigma_image_m2,
        "width_m": face.width_m,
        "height_m": face.height_m,
        "whole": face.whole,
    }


def _storeys(report: ProgressReport) -> Iterator[Row]:
    measured = {element.global_id for element in report.elements if element.as_built_area_m2 is not None}
    for storey in report.storeys:
        known = bool(measured & set(storey.elements))
        yield {
            "storey_id": storey.key or None,
            "storey": storey.name,
            **_completion(storey.completion),
            "design_area_m2": storey.design_area_m2,
            "as_built_area_m2": storey.as_built_area_m2 if known else None,
            "as_built_sigma_m2": storey.as_built_sigma_m2 if known else None,
            **_group_counts(storey),
        }


def _group_counts(group: GroupProgress) -> Row:
    return {
        "elements": len(group.elements),
        "elements_complete": group.surely_complete,
        "elements_part": group.part,
        "elements_not_started": group.not_started,
        "elements_displaced": group.displaced,
        "elements_unknown": group.unknown,
        "elements_as_far_as_seen": group.as_far_as_seen,
    }


def _tasks(report: ProgressReport) -> Iterator[Row]:
    yield from map(_task, task_rows(report))


def _task(task: TaskRow) -> Row:
    return {
        "task_id": task.global_id,
        "identification": task.identification or None,
        "name": task.name or None,
        "outline": task.outline or None,
        "planned_start": task.planned_start,
        "planned_finish": task.planned_finish,
        "seen_begun_date": task.seen_begun,
        "seen_complete_date": task.seen_complete,
        "forecast_finish": task.forecast_finish,
        "forecast_earliest": task.forecast_earliest,
        "known": task.knowledge,
        **_completion(task.completion),
        "scheduled_share": task.certain,
        "planned_share": task.planned,
        "late": task.late,
        "late_days": task.late_days,
        "behind_days": task.behind_days,
        "behind_least_days": task.behind_least_days,
        "behind_most_days": task.behind_most_days,
        "elements": task.elements,
        "elements_complete": task.complete,
        "elements_part": task.part,
        "elements_not_started": task.not_started,
        "elements_displaced": task.displaced,
        "elements_unknown": task.unknown,
        "elements_as_far_as_seen": task.as_far_as_seen,
    }


def _cost_lines(report: ProgressReport) -> Iterator[Row]:
    in_bill = {one.line.global_id: one for bill in bills(report) for one in bill.lines if not one.gone}
    for line in report.cost_lines:
        yield _cost_line(line, in_bill[line.global_id])


def _cost_line(line: CostProgress, billed: BillLine) -> Row:
    return {
        "line_id": line.global_id,
        "identification": line.identification or None,
        "name": line.name or None,
        "schedule": line.schedule or None,
        "measure": line.measure,
        "unit": line.unit,
        "currency": line.currency or None,
        "rate": line.rate,
        "planned_quantity": line.planned_quantity,
        "as_built_best": line.best_quantity_shown,
        "as_built_lower": line.as_built_lower,
        "planned_value": line.planned_value,
        "earned_best": line.earned_best_shown,
        "earned_lower": line.earned_lower,
        **_completion(line.completion),
        "certified_quantity": billed.quantity,
        "certified_amount": billed.amount,
        "previous_amount": billed.previous,
    }


def _stations(report: ProgressReport) -> Iterator[Row]:
    yield from map(_station, station_rows(report))


def _station(station: StationRow) -> Row:
    return {
        "station": station.name,
        "status": station.status,
        "residual_px": station.residual_px,
        "target_range_m": station.target_range_m,
        "target_depth_m": station.target_depth_m,
        "target_depth_sigma_m": station.target_depth_sigma_m,
        "faces": station.faces or 0,
        "faces_matched": station.matched or 0,
    }


_ROWS: Mapping[Table, Callable[[ProgressReport], Iterator[Row]]] = {
    "elements": _elements,
    "faces": _faces,
    "storeys": _storeys,
    "tasks": _tasks,
    "cost_lines": _cost_lines,
    "stations": _stations,
}
