"""`quantities.xlsx`: the workbook for cost control."""

import io
from collections.abc import Sequence
from pathlib import Path

from xlsxwriter.workbook import Workbook
from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.report import GroupProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.tables import (
    ElementRow,
    StationRow,
    element_rows,
    faults_before,
    group_rows,
    lost_before,
    lost_stations,
    photographed_of,
    program_words,
    station_rows,
    storey_names,
)
from asbuilt_bim.report.task_rows import LateRow, TaskRow, late_rows, late_words, plan_words, task_rows, unclear_rows
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.fault_words import NOT_CLEAR, WRONG_BEFORE, before_words
from asbuilt_bim.report.wording.of_workbook.columns import (
    ELEMENTS,
    LATE,
    NOTES,
    STATIONS,
    STOREYS,
    TASKS,
    UNCLEAR,
    Column,
)
from asbuilt_bim.report.wording.of_workbook.valuation_columns import BILL as BILL_COLUMNS
from asbuilt_bim.report.wording.of_workbook.valuation_columns import CERTIFICATES, COST_PARTS, OBSERVATIONS, VARIATIONS
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.values import cut_down, cut_up, plain
from asbuilt_bim.report.workbook.bill import write_bill
from asbuilt_bim.report.workbook.layout import BILL, PARTS, VALUATION
from asbuilt_bim.report.workbook.layout import CERTIFICATES as CERTIFICATES_SHEET
from asbuilt_bim.report.workbook.layout import OBSERVATIONS as OBSERVATIONS_SHEET
from asbuilt_bim.report.workbook.layout import VARIATIONS as VARIATIONS_SHEET
from asbuilt_bim.report.workbook.parts import rows_of, write_parts
from asbuilt_bim.report.workbook.records import (
    write_certificates,
    write_nothing_to_price,
    write_observations,
    write_variations,
)
from asbuilt_bim.report.workbook.sheet import (
    Cell,
    Styles,
    finish_table,
    page_setup,
    write_cell,
    write_head,
    write_row,
)
from asbuilt_bim.report.workbook.valuation import title_of, write_valuation
from asbuilt_bim.storage.atomic_write import writing


def write_workbook(report: ProgressReport, path: Path, earlier: Sequence[ProgressReport] = ()) -> None:
    """Write the workbook; it holds no macros, links or hidden columns, and its cost sheet calculates.

    It says what is wrong with `earlier` visits, too.

    Raises:
        OutputError: the file can't be written, for instance because it is open in another program.
    """
    with writing(path):
        path.write_bytes(workbook_bytes(report, earlier))


def workbook_bytes(report: ProgressReport, earlier: Sequence[ProgressReport] = ()) -> bytes:
    """Return the workbook's bytes; the same reports give the same cells."""
    out = io.BytesIO()
    book = Workbook(
        out, {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "remove_timezone": True}
    )
    book.set_properties({"title": plain(f"{report.project_name}: as-built quantities {report.visit_date}")})
    styles = Styles(book)
    _summary(book.add_worksheet("Summary"), report, earlier, styles)
    _write_money(book, report, earlier, styles)
    elements = [_element(row) for row in element_rows(report)]
    _table(book.add_worksheet("Elements"), ELEMENTS, elements, styles, keep=2, name="Elements", printed=15)
    _table(book.add_worksheet("Tasks"), TASKS, [_task(row) for row in task_rows(report)], styles, keep=1)
    late = [_late(row) for row in (*late_rows(report), *unclear_rows(report))]
    _table(book.add_worksheet("Late"), LATE, late, styles, keep=2)
    _table(book.add_worksheet("Stations"), STATIONS, [_station(row) for row in station_rows(report)], styles, keep=1)
    _notes(book.add_worksheet("Notes"), report, styles)
    book.close()
    return out.getvalue()


def _write_money(book: Workbook, report: ProgressReport, earlier: Sequence[ProgressReport], styles: Styles) -> None:
    """Write the valuation and what it stands on; without cost lines, why there is none and what to do."""
    names = (VALUATION, BILL, PARTS, VARIATIONS_SHEET, CERTIFICATES_SHEET, OBSERVATIONS_SHEET)
    sheets = {name: book.add_worksheet(name) for name in names}
    made, title, storeys = bills(report), title_of(report), storey_names(report)
    write_observations(sheets[OBSERVATIONS_SHEET], report, title, storeys, styles)
    if not made:
        for name in names[:-1]:
            write_nothing_to_price(sheets[name], report, title, styles)
        return
    counts = report.valuation is not None and report.valuation.count_observations
    first_sum = write_bill(sheets[BILL], made, title, len(rows_of(made)), styles)
    write_parts(sheets[PARTS], made, title, storeys, counts, styles)
    write_variations(sheets[VARIATIONS_SHEET], made, title, styles)
    write_certificates(sheets[CERTIFICATES_SHEET], report, title, styles)
    write_valuation(book, sheets[VALUATION], report, made, first_sum, styles, earlier)


def _table(
    sheet: Worksheet,
    columns: Sequence[Column],
    rows: Sequence[Sequence[Cell]],
    styles: Styles,
    *,
    keep: int,
    name: str = "",
    printed: int = 0,
) -> None:
    """Write a sheet that is one table."""
    write_head(sheet, 0, columns, styles)
    for index, cells in enumerate(rows):
        rejected = "rejected" in cells or "not placed" in cells
        write_row(sheet, index + 1, cells, columns, styles, "loud" if rejected else "body")
    finish_table(sheet, 0, len(rows), columns, styles=styles, keep=keep, name=name, printed=printed)


def _summary(sheet: Worksheet, report: ProgressReport, earlier: Sequence[ProgressReport], styles: Styles) -> None:
    """Write the title, what was lost, and the storeys."""
    write_cell(sheet, 0, 0, report.project_name, "text", styles, "title")
    sheet.set_row(0, 22)
    write_cell(sheet, 1, 0, f"As-built quantities, visit of {report.visit_date.isoformat()}", "text", styles)
    row = _doubts(sheet, 3, NOT_CLEAR, [str(words_of(fault)) for fault in report.faults], styles)
    row = _doubts(sheet, row, WRONG_BEFORE, before_words(faults_before(earlier, report)), styles)
    lost = [(row.name, row) for row in lost_stations(report)]
    lost += [(f"{row.name} of the visit of {day.isoformat()}", row) for day, row in lost_before(earlier)]
    if lost:
        heading = f"{len(lost)} station(s) count for nothing in these numbers"
        row = _lost(sheet, row, heading, lost, styles)
    write_head(sheet, row, STOREYS, styles)
    groups = group_rows(report)
    for index, (name, group) in enumerate(groups):
        role = "total" if index == len(groups) - 1 else "body"
        write_row(sheet, row + 1 + index, _group(name, group, photographed_of(group, report)), STOREYS, styles, role)
    row += len(groups) + 2
    for note in report.notes:
        write_cell(sheet, row, 0, note_words(note), "text", styles)
        row += 1
    page_setup(sheet)


def _doubts(sheet: Worksheet, row: int, heading: str, doubts: Sequence[str], styles: Styles) -> int:
    """Write what puts a whole visit in doubt, if anything, in a loud colour; return the next free row."""
    if not doubts:
        return row
    for column in range(len(STOREYS)):
        write_cell(sheet, row, column, heading if column == 0 else "", "text", styles, "loud")
    for doubt in doubts:
        row += 1
        write_cell(sheet, row, 0, doubt, "text", styles)
    return row + 2


def _lost(sheet: Worksheet, row: int, heading: str, lost: Sequence[tuple[str, StationRow]], styles: Styles) -> int:
    """Write the rejected stations, each by what it is called, in a loud colour; return the next free row."""
    for column in range(len(STOREYS)):
        write_cell(sheet, row, column, heading if column == 0 else "", "text", styles, "loud")
    for name, station in lost:
        row += 1
        write_cell(sheet, row, 0, f"{name}: {station.status}", "text", styles, "heading")
        for reason in station.reasons:
            row += 1
            write_cell(sheet, row, 0, str(reason), "text", styles)
    return row + 2


def _group(name: str, group: GroupProgress, photographed_m2: float | None) -> tuple[Cell, ...]:
    """Lay out a storey."""
    done = group.completion
    seen = group.as_built_area_m2 > 0.0 or done.coverage > 0.0
    return (
        name,
        len(group.elements),
        group.surely_complete,
        group.as_far_as_seen,
        group.part,
        group.not_started,
        group.displaced,
        group.unknown,
        group.design_area_m2,
        photographed_m2,
        group.as_built_area_m2 if seen else None,
        group.as_built_sigma_m2 if seen else None,
        *_shares(done.lower, done.upper, done.best_shown, done.coverage),
    )


def _shares(lower: float, upper: float, best: float | None, seen: float) -> tuple[Cell, ...]:
    """Lay out what is certain, possible, likely and seen: bounds cut outwards to the tenth of a percent that shows."""
    return (cut_down(lower), cut_up(upper), best, cut_down(seen))


def _element(row: ElementRow) -> tuple[Cell, ...]:
    """Lay out an element."""
    return (
        row.storey,
        row.name,
        row.state,
        row.design_area_m2,
        row.photographed_m2,
        row.as_built_area_m2,
        row.sigma_m2,
        *_shares(row.lower, row.upper, row.best, row.coverage),
        row.offset_mm,
        row.offset_sigma_mm,
        row.tolerance,
        row.last_seen or "",
        row.notes,
        row.global_id,
        row.ifc_class,
        row.visit,
        row.stations,
    )


def _task(row: TaskRow) -> tuple[Cell, ...]:
    """Lay out a task."""
    done = row.completion
    late = {None: None, True: "late", False: "no"}[row.late]
    dates = (row.planned_start, row.planned_finish, row.seen_begun, row.seen_complete)
    return (
        row.name,
        *(date or "" for date in dates),
        row.knowledge,
        *_shares(done.lower, done.upper, done.best_shown, done.coverage),
        "" if row.planned is None else row.planned,
        row.behind_days if row.has_plan else "",
        row.behind_least_days if row.has_plan else "",
        row.behind_most_days if row.has_plan else "",
        late,
        row.late_days if row.planned_finish else "",
        row.forecast_finish,
        row.forecast_earliest,
        row.elements,
        row.complete,
    )


def _late(row: LateRow) -> tuple[Cell, ...]:
    """Lay out an element that is late, or may be."""
    days = row.late_days if row.is_sure else None
    what = "late" if row.is_sure else UNCLEAR
    return (
        row.storey,
        row.name,
        row.global_id,
        row.state,
        cut_down(row.lower),
        row.best,
        row.task,
        row.due,
        days,
        what,
    )


def _station(row: StationRow) -> tuple[Cell, ...]:
    """Lay out a station."""
    return (
        row.name,
        row.status,
        row.target_range_m,
        row.target_depth_m,
        row.target_depth_sigma_m,
        row.residual_px,
        row.markers,
        row.faces,
        row.matched,
        "; ".join(reason.at_station for reason in (*row.reasons, *row.left_out)),
    )


def _notes(sheet: Worksheet, report: ProgressReport, styles: Styles) -> None:
    """Explain every column."""
    write_head(sheet, 0, NOTES, styles)
    tables = (
        ("Summary", STOREYS),
        ("Elements", ELEMENTS),
        (BILL, BILL_COLUMNS),
        (PARTS, COST_PARTS),
        (VARIATIONS_SHEET, VARIATIONS),
        (CERTIFICATES_SHEET, CERTIFICATES),
        (OBSERVATIONS_SHEET, OBSERVATIONS),
        ("Tasks", TASKS),
        ("Late", LATE),
    )
    every = (*tables, ("Stations", STATIONS))
    rows: list[tuple[Cell, ...]] = [(name, c.heading, c.meaning) for name, columns in every for c in columns]
    rows += [("Tasks", "", plan_words(report)), ("Late", "", late_words(report))] if report.tasks else []
    left_out = map(words_of, (*report.rejections, *report.unmatched))
    rows += [("", "", "")] + [("Left out", words.what, str(words)) for words in left_out]
    if report.provenance:
        made = report.provenance
        rows += [("Made", "Program", program_words(made))]
        rows += [("Made", "IFC file", f"{made.ifc_name} {made.ifc_digest}"), ("Made", "Rig", made.rig_digest)]
    for index, cells in enumerate(rows):
        write_row(sheet, index + 1, cells, NOTES, styles)
    finish_table(sheet, 0, len(rows), NOTES, styles=styles)
