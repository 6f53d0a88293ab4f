"""The sheets beside the bill: variations, certificates, observations; and what to do where there are no costs."""

from collections.abc import Mapping, Sequence

from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, VariationLine
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS
from asbuilt_bim.progress.valuation.observed import observed_elements
from asbuilt_bim.report.cost_rows import NO_CURRENCY
from asbuilt_bim.report.tables import NO_STOREY
from asbuilt_bim.report.wording.of_workbook.valuation_columns import (
    CERTIFICATES,
    NOTHING_TO_PRICE,
    OBSERVATIONS,
    VARIATIONS,
    WHY_NOTHING,
)
from asbuilt_bim.report.wording.values import cut_down, cut_up, percent_to_a_tenth
from asbuilt_bim.report.workbook.layout import HEAD, SPARE_VARIATIONS, letter
from asbuilt_bim.report.workbook.sheet import (
    Cell,
    Formula,
    Styles,
    print_page,
    titled,
    write_cell,
    write_head,
    write_paragraph,
    write_row,
    write_table,
)

_INPUTS = ("No.", "Text", "Order", "Unit", "Quantity", "Rate", "Done", "Previous amount", "By")


def write_variations(sheet: Worksheet, made: Sequence[Bill], title: str, styles: Styles) -> None:
    """Write the variations and empty rows for more; a row that is added to the table gets its formulas, too."""
    titled(sheet, title, "Variations: work that was ordered beside the contract", styles)
    write_head(sheet, HEAD, VARIATIONS, styles)
    lines = [(bill.number, one) for bill in made for one in bill.variations]
    rows = [*lines, *[(1, None)] * SPARE_VARIATIONS]
    last = HEAD + len(rows)
    own = _amounts({column.heading: f"Variations[[#This Row],[{column.heading}]]" for column in VARIATIONS})
    write_table(sheet, "Variations", HEAD, last, VARIATIONS, styles, own)
    amounts = [letter(VARIATIONS, heading) for heading in own]
    sheet.ignore_errors({"calculated_column": " ".join(f"{one}{HEAD + 2}:{one}{last + 1}" for one in amounts)})
    for index, (bill, one) in enumerate(rows):
        _variation(sheet, HEAD + 1 + index, bill, one, styles)
    sheet.freeze_panes(HEAD + 1, 0)
    print_page(sheet, HEAD, last_row=last, last_column=len(VARIATIONS) - 1)


def _amounts(c: Mapping[str, str]) -> dict[str, str]:
    """Return the formulas of a row's amounts by heading; `c` says by heading what refers to its cells.

    The rows themselves refer by A1: so they may be copied below the table, where no program calls it a row of it.
    """
    numbers = f"AND(ISNUMBER({c['Quantity']}),ISNUMBER({c['Rate']}))"
    done = f"IF(ISNUMBER({c['Done']}),MIN(1,MAX(0,{c['Done']})),0)"
    return {
        "Bill": "=1",
        "Amount": f"=IF({numbers},ROUND({c['Quantity']}*{c['Rate']},2),0)",
        "This period amount": f"=ROUND({c['Certified amount']}-{c['Previous amount']},2)",
        "Certified amount": f"=ROUND({c['Amount']}*{done},2)",
    }


def _variation(sheet: Worksheet, row: int, bill: int, line: VariationLine | None, styles: Styles) -> None:
    amounts = _amounts({column.heading: f"{letter(VARIATIONS, column.heading)}{row + 1}" for column in VARIATIONS})
    one = line.variation if line else None
    certified = line.certified if line else 0.0
    previous = line.previous if line else 0.0
    cells: dict[str, Cell] = {
        "Bill": bill,
        "No.": one.number if one else "",
        "Text": one.text if one else "",
        "Order": one.order if one else "",
        "Unit": one.unit if one else "",
        "Quantity": one.quantity if one else "",
        "Rate": one.rate if one else "",
        "Amount": Formula(amounts["Amount"], line.amount if line else 0.0),
        "Done": one.share if one else "",
        "Previous amount": previous,
        "This period amount": Formula(amounts["This period amount"], cents(certified - previous)),
        "Certified amount": Formula(amounts["Certified amount"], certified),
        "By": one.by if one else "",
    }
    write_row(sheet, row, [cells[column.heading] for column in VARIATIONS], VARIATIONS, styles)
    for index, column in enumerate(VARIATIONS):
        if column.heading in _INPUTS:
            write_cell(sheet, row, index, cells[column.heading], column.kind, styles, "person" if one else "input")


def write_certificates(sheet: Worksheet, report: ProgressReport, title: str, styles: Styles) -> None:
    """Write what was signed before, a row for each bill of each valuation."""
    titled(sheet, title, "Certificates: valuations that were signed", styles)
    write_head(sheet, HEAD, CERTIFICATES, styles)
    row, paid = HEAD, dict[int, float]()
    for one in (report.valuation or NO_INPUTS).certificates:
        for sums in one.totals:
            row += 1
            payable = cents(sums.net + sums.tax)
            cells: list[Cell] = [one.number, one.visit, one.signed_on, one.signed_by, sums.bill]
            cells += [sums.currency or NO_CURRENCY, sums.work, sums.variations, sums.retention, sums.tax]
            cells += [cents(sums.net), payable, cents(payable - paid.get(sums.bill, 0.0))]
            cells += [one.run, one.digests.get("workbook", "")]
            paid[sums.bill] = payable
            write_row(sheet, row, cells, CERTIFICATES, styles)
    if row == HEAD:
        write_cell(sheet, row + 1, 0, "None yet. A valuation is signed on the sheet Valuation.", "text", styles)
    write_table(sheet, "Certificates", HEAD, row, CERTIFICATES, styles)
    money = next(index for index, column in enumerate(CERTIFICATES) if column.heading == "Paid by this one")
    print_page(sheet, HEAD, last_row=max(row, HEAD + 1), last_column=money)  # digests are for the screen


def write_observations(
    sheet: Worksheet, report: ProgressReport, title: str, storeys: dict[str, str], styles: Styles
) -> None:
    """Write what persons saw beside what photos say."""
    titled(sheet, title, "Observations: what persons saw, beside what photos say", styles)
    write_head(sheet, HEAD, OBSERVATIONS, styles)
    elements = {element.global_id: element for element in report.elements}
    counted = observed_elements(report.observations, elements, report.visit_date)
    counts = (report.valuation or NO_INPUTS).count_observations
    row = HEAD
    for one in sorted(report.observations, key=lambda one: (one.element, one.day)):
        element = elements.get(one.element)
        if element is None:
            continue
        row += 1
        done, last = element.completion, counted.get(one.element)
        what = "not yet: after this visit" if one.day > report.visit_date else "an earlier one"
        if last is not None and last.observation is one:
            what = (
                f"{percent_to_a_tenth(last.share)}{', contradicted' if last.contradicts else ''}"
                if counts
                else "shown only"
            )
        cells: list[Cell] = [element.name or one.element, storeys.get(element.storey, NO_STOREY), one.day, one.share]
        cells += [one.by, one.why, cut_down(done.lower), done.best_shown, cut_up(done.upper)]
        cells += [element.last_seen or "", what, one.element]
        write_row(sheet, row, cells, OBSERVATIONS, styles)
        for index in (2, 3, 4, 5):
            write_cell(sheet, row, index, cells[index], OBSERVATIONS[index].kind, styles, "person")
    if row == HEAD:
        text = "None. Write `observations: observations.csv` into the project file to add what persons saw."
        write_cell(sheet, row + 1, 0, text, "text", styles)
    write_table(sheet, "Observations", HEAD, row, OBSERVATIONS, styles)
    sheet.freeze_panes(HEAD + 1, 1)
    print_page(sheet, HEAD, last_row=max(row, HEAD + 1), last_column=len(OBSERVATIONS) - 2)


def write_nothing_to_price(sheet: Worksheet, report: ProgressReport, title: str, styles: Styles) -> None:
    """Say why there is no bill, and what to do."""
    titled(sheet, title, "", styles)
    sheet.set_column(0, 0, 110)
    old = any(note.code is Reason.COST_NOT_IN_IFC2X3 for note in report.notes)
    why = WHY_NOTHING["ifc2x3" if old else "none"]
    for index, text in enumerate(NOTHING_TO_PRICE):
        write_paragraph(sheet, HEAD + index, 0, text.replace("{why}", why), 110, styles)
    print_page(sheet, None, last_row=HEAD + len(NOTHING_TO_PRICE), last_column=0)
