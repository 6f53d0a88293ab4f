"""The sheet `Valuation`: what is due of each bill, with retention, tax and the place to sign."""

from collections.abc import Sequence
from datetime import date

from xlsxwriter.workbook import Workbook
from xlsxwriter.worksheet import Worksheet

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, Sums
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS
from asbuilt_bim.progress.valuation.notes import CODES, of_money
from asbuilt_bim.report.by_persons import by_persons
from asbuilt_bim.report.cost_rows import NO_CURRENCY
from asbuilt_bim.report.tables import faults_before, still_in_doubt
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.alike import doubts_alike
from asbuilt_bim.report.wording.of_page.fault_words import NOT_CLEAR, WRONG_BEFORE, before_words
from asbuilt_bim.report.wording.of_page.money_words import FIRST, NOT_SET, rests_words
from asbuilt_bim.report.wording.of_workbook.valuation_columns import BILL as BILL_COLUMNS
from asbuilt_bim.report.wording.of_workbook.valuation_columns import (
    CHANGED_SINCE,
    SIGNING_RULES,
    in_doubt_words,
    persons_words,
)
from asbuilt_bim.report.wording.of_workbook.valuation_columns import VARIATIONS as VARIATION_COLUMNS
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.values import UNKNOWN, plain
from asbuilt_bim.report.workbook.layout import (
    BILL,
    COLUMNS,
    FORMAT,
    FORMAT_NAME,
    VALUATION,
    VARIATIONS,
    letter,
    sum_name,
)
from asbuilt_bim.report.workbook.sheet import Cell, Formula, Styles, print_page, write_cell, write_paragraph

_LABELS = {
    "work": "Work, certified",
    "variations": "Variations, certified",
    "gross": "Gross",
    "retention": "Less retention",
    "net": "Net",
    "tax": "Tax",
    "payable": "Payable",
}
_WIDTHS = (30.0, 16.0, 16.0, 16.0, 16.0)
_LAST = len(_WIDTHS) - 1


def write_valuation(
    book: Workbook,
    sheet: Worksheet,
    report: ProgressReport,
    made: Sequence[Bill],
    first_sum: int,
    styles: Styles,
    earlier: Sequence[ProgressReport] = (),
) -> None:
    """Write the certificate; `first_sum` is the row of the first sum in Bill.

    What is wrong with `earlier` visits stands at the top, and what their photos left in doubt where one signs.
    """
    inputs = report.valuation or NO_INPUTS
    for index, width in enumerate(_WIDTHS):
        sheet.set_column(index, index, width)
    sheet.set_row(0, 24)
    write_cell(sheet, 0, 0, f"Valuation {inputs.number}", "text", styles, "title")
    last = inputs.certificates[-1] if inputs.certificates else None
    before = f"Valuation {last.number}, signed {last.signed_on} by {last.signed_by}" if last else _none_before(made)
    head: tuple[tuple[str, str, Cell, str], ...] = (
        ("Project", "", report.project_name, "text"),
        ("Valuation", "valuation_number", inputs.number, "count"),
        ("Visit of", "visit_date", report.visit_date, "date"),
        ("Before it", "", before, "text"),
    )
    row = 1
    for label, name, value, kind in head:
        write_cell(sheet, row, 0, label, "text", styles, "plain")
        write_cell(sheet, row, 1, value, "left" if kind == "count" else kind, styles, "plain")
        _name(book, name, row, 1)
        row += 1
    row = _doubts(sheet, row + 1, NOT_CLEAR, [str(words_of(fault)) for fault in report.faults], styles)
    row = _doubts(sheet, row, WRONG_BEFORE, before_words(faults_before(earlier, report)), styles)
    for label, name, share in (
        ("Retention", "retention_rate", inputs.terms.retention),
        ("Tax", "tax_rate", inputs.terms.tax),
    ):
        write_cell(sheet, row, 0, f"{label} (blue: may be overwritten)", "text", styles)
        write_cell(sheet, row, 1, share, "percent2", styles, "input")
        unset = Formula(f'=IF({name}=0,"{NOT_SET}","")', "" if share else NOT_SET)
        write_cell(sheet, row, 2, unset, "text", styles, "plain")
        _name(book, name, row, 1)
        row += 1
    for bill in made:
        row = _summary(book, sheet, row + 1, bill, first_sum, styles)
    row = _signatures(book, sheet, row + 1, styles)
    notes = [note_words(note) for note in report.notes if note.code in CODES or of_money(note)]
    rests = [rests_words(by_persons(bill), bill.cumulative.variations, bill.currency) for bill in made]
    persons = persons_words(
        [one for one in rests if one], len(inputs.overrides), len(inputs.rates), len(inputs.variations)
    )
    said: list[str | Formula] = [*map(_changed_since, made), *_in_doubt(made, report, earlier), *persons, *notes]
    row = _paragraphs(sheet, row + 1, "Before you sign", said, styles)
    row = _paragraphs(sheet, row + 1, "How it is worked out", SIGNING_RULES, styles)
    write_cell(sheet, row + 1, 0, "Format of this workbook", "text", styles, "unknown")
    write_cell(sheet, row + 1, 1, FORMAT, "left", styles, "unknown")
    _name(book, FORMAT_NAME, row + 1, 1)
    print_page(sheet, None, last_row=row + 1, last_column=_LAST, landscape=False)


def _doubts(sheet: Worksheet, row: int, heading: str, doubts: Sequence[str], styles: Styles) -> int:
    """Write what puts a whole visit in doubt, if anything, in a loud colour; return the next free row."""
    if not doubts:
        return row
    for column in range(_LAST + 1):
        write_cell(sheet, row, column, heading if column == 0 else "", "text", styles, "loud")
    for doubt in doubts:
        row += 1
        write_paragraph(sheet, row, _LAST, doubt, sum(_WIDTHS), styles)
    return row + 2


def _none_before(made: Sequence[Bill]) -> str:
    return "none" if any(bill.previous.gross for bill in made) else FIRST


def _in_doubt(made: Sequence[Bill], report: ProgressReport, earlier: Sequence[ProgressReport]) -> list[str]:
    """Return what the page asks to look at of the elements that something is certified of."""
    rows = [row for bill in made for line in bill.lines for row in line.rows if row.certified]
    paid = {row.global_id for row in rows if row.element is not None}
    asked = [one for one in still_in_doubt(report, earlier) if one.global_id in paid]
    return [in_doubt_words(one) for one in doubts_alike(asked)]


def _summary(book: Workbook, sheet: Worksheet, row: int, bill: Bill, first_sum: int, styles: Styles) -> int:
    """Write a bill's sums by formulas; return the next free row."""
    name = f"Bill {bill.number}, {plain(bill.currency) or NO_CURRENCY}"
    head = (
        f"{name}: {plain(bill.schedule)}" if bill.schedule else name,
        "Previous",
        "This period",
        "In all",
        _best_heading(bill),
    )
    sheet.set_row(row, 30)
    for column, text in enumerate(head):
        sheet.write_string(row, column, text, styles.get("text" if column == 0 else "money", "head"))
    at = {what: row + 2 + index for index, what in enumerate(_LABELS)}  # as formulas count rows
    contract = Formula(f"={BILL}!{letter(BILL_COLUMNS, 'Contract amount')}{first_sum + bill.number}", bill.contract)
    values = {"previous": bill.previous, "this_period": bill.period, "cumulative": bill.cumulative}
    for what, label in _LABELS.items():
        line = at[what] - 1
        role = "total" if what in ("gross", "net", "payable") else "body"
        write_cell(sheet, line, 0, label, "text", styles, role)
        for column, sums in enumerate(COLUMNS, 1):
            value = _value(values[sums], what)
            formula = _formula(what, sums, at, bill, first_sum)
            cell: Cell = value if formula is None else Formula(formula, value)
            write_cell(sheet, line, column, cell, "money", styles, "input" if formula is None else role)
            _name(book, sum_name(what, sums, bill.number), line, column)
        best: Cell = ""
        if what == "work":
            place = f"{BILL}!{letter(BILL_COLUMNS, 'Best amount')}{first_sum + bill.number}"
            best = Formula(f"={place}", UNKNOWN if bill.best is None else bill.best)
        write_cell(sheet, line, _LAST, best, "money", styles, role)
    end = at["payable"]
    write_cell(sheet, end, 0, "Contract, in all", "text", styles)
    write_cell(sheet, end, 3, contract, "money", styles)
    _name(book, f"contract_{bill.number}", end, 3)
    return end + 1


def _best_heading(bill: Bill) -> str:
    """Head the best estimate, and say of how many lines there is none: without them no sum is an estimate of all."""
    left, lines = bill.without_best, len(bill.lines)
    return f"Best ({left} of {lines} lines unknown)" if left else "Best"


def _value(sums: Sums, what: str) -> float:
    """Return a sum of a column by its name."""
    return float(getattr(sums, what))


def _formula(what: str, sums: str, at: dict[str, int], bill: Bill, first_sum: int) -> str | None:
    """Return the formula of a cell of the summary; None where it is typed: it was read from a signed workbook."""
    column = {"previous": "B", "this_period": "C", "cumulative": "D"}[sums]
    cell = {key: f"{column}{line}" for key, line in at.items()}
    if what in ("gross", "net", "payable"):
        one, sign, other = {
            "gross": ("work", "+", "variations"),
            "net": ("gross", "-", "retention"),
            "payable": ("net", "+", "tax"),
        }[what]
        return f"=ROUND({cell[one]}{sign}{cell[other]},2)"
    if what in ("work", "variations") and sums != "this_period":
        return _from_sheets(what, sums, bill, first_sum)
    if sums == "previous":
        return None
    if what == "tax":
        return f"=ROUND(C{at['net']}*tax_rate,2)" if sums == "this_period" else f"=ROUND(B{at['tax']}+C{at['tax']},2)"
    if sums == "cumulative":  # retention
        return f"=ROUND(D{at['gross']}*retention_rate,2)"
    return f"=ROUND(D{at[what]}-B{at[what]},2)"


def _from_sheets(what: str, sums: str, bill: Bill, first_sum: int) -> str:
    """Return the formula that adds up a bill's lines; of its variations wherever they stand in their columns."""
    heading = "Previous amount" if sums == "previous" else "Certified amount"
    if what == "work":
        return f"={BILL}!{letter(BILL_COLUMNS, heading)}{first_sum + bill.number}"
    numbers, amounts = (letter(VARIATION_COLUMNS, one) for one in ("Bill", heading))
    return f"=ROUND(SUMIF({VARIATIONS}!${numbers}:${numbers},{bill.number},{VARIATIONS}!${amounts}:${amounts}),2)"


def _signatures(book: Workbook, sheet: Worksheet, row: int, styles: Styles) -> int:
    """Write where persons sign; the certifier's name and date make it a certificate."""
    for column, text in enumerate(("", "Name", "Date", "Signature", "")):
        sheet.write_string(row, column, text, styles.get("text", "head"))
    names = {"Prepared by": ("", ""), "Checked by": ("", ""), "Certified by": ("signed_by", "signed_on")}
    for label, (who, when) in names.items():
        row += 1
        sheet.set_row(row, 28)
        write_cell(sheet, row, 0, label, "text", styles, "signed by")
        for column in range(1, _LAST + 1):
            kind = "date" if column == 2 else "text"
            sheet.write_blank(row, column, None, styles.get(kind, "sign"))
        _name(book, who, row, 1)
        _name(book, when, row, 2)
    return row + 1


def _changed_since(bill: Bill) -> Formula:
    """Say so where what is certified of a bill is no longer what it was when the workbook was made."""
    was = {sum_name(what, "cumulative", bill.number): _value(bill.cumulative, what) for what in ("work", "variations")}
    differs = ",".join(f"ROUND({name}-({value!r}),2)<>0" for name, value in was.items())
    return Formula(f'=IF(OR({differs}),"{CHANGED_SINCE.format(number=bill.number)}","")', "")


def _paragraphs(sheet: Worksheet, row: int, heading: str, texts: Sequence[str | Formula], styles: Styles) -> int:
    write_cell(sheet, row, 0, heading, "text", styles, "heading")
    for text in texts:
        row += 1
        write_paragraph(sheet, row, _LAST, text, sum(_WIDTHS), styles)
    return row + 1


def _name(book: Workbook, name: str, row: int, column: int) -> None:
    if name:
        book.define_name(name, f"={VALUATION}!${'ABCDE'[column]}${row + 1}")


def title_of(report: ProgressReport) -> str:
    """Return what the sheets of a valuation are headed by."""
    number = (report.valuation or NO_INPUTS).number
    day: date = report.visit_date
    return f"{report.project_name}: valuation {number}, visit of {day.isoformat()}"
