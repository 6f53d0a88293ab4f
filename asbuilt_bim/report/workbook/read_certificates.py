"""What a workbook says was certified: its own signature, and the sheet of those before it."""

from dataclasses import replace
from datetime import date
from pathlib import Path

from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.valuation.inputs import BillTotals, Certificate
from asbuilt_bim.report.cost_rows import NO_CURRENCY
from asbuilt_bim.report.workbook.layout import BILL, CERTIFICATES, VALUATION, sum_name
from asbuilt_bim.report.workbook.read_cells import AGAIN, MAX_TEXT, day_of, number_of, plain_of, rows_of, text_of
from asbuilt_bim.storage.xlsx_file import XlsxFile


def signature_of(book: XlsxFile, path: Path) -> tuple[str, date] | None:
    """Return who signed the workbook, and when; None where nobody did.

    Raises:
        WorkbookError: there is a name without a day, or a day without a name.
    """
    who, when = book.at("signed_by"), book.at("signed_on")
    name = "" if who is None else str(who).strip()
    day = day_of(when)
    if isinstance(when, str) and when.strip() and day is None:
        raise WorkbookError(f"{path}: signed on '{when!s:.40}', which is no day; write 2026-03-20")
    if bool(name) != (day is not None):
        lacks = "the date" if name else "the name"
        raise WorkbookError(f"{path}: {lacks} of who certified it is missing on '{VALUATION}'; write both, or neither")
    return (name[:MAX_TEXT], day) if name and day else None


def earlier_certificates(book: XlsxFile, path: Path) -> tuple[Certificate, ...]:
    """Return what was signed before this workbook, as its sheet holds it."""
    rows = rows_of(book, CERTIFICATES, "Signed on", path)
    made: dict[int, Certificate] = {}
    for row in rows:
        number = int(number_of(row, "No.", path, "certificate"))
        visit, signed_on = row.get("Visit"), row.get("Signed on")
        if not isinstance(visit, date) or not isinstance(signed_on, date):
            raise WorkbookError(f"{path}: sheet '{CERTIFICATES}': valuation {number} has no visit or no day of signing")
        currency = text_of(row, "Currency")
        values = [cents(number_of(row, key, path, f"valuation {number}")) for key in ("Work", "Variations")]
        kept = [cents(number_of(row, key, path, f"valuation {number}")) for key in ("Retention", "Tax")]
        sums = BillTotals(
            bill=int(number_of(row, "Bill", path, f"valuation {number}")),
            currency="" if currency == NO_CURRENCY else currency,
            work=values[0],
            variations=values[1],
            retention=kept[0],
            tax=kept[1],
        )
        first = made.get(number)
        made[number] = (
            replace(first, totals=(*first.totals, sums))
            if first
            else Certificate(
                number=number, visit=visit, signed_by=text_of(row, "Signed by"), signed_on=signed_on, totals=(sums,)
            )
        )
    return tuple(made[number] for number in sorted(made))


def check_days(own: Certificate, last: Certificate | None, path: Path) -> None:
    """Check that a valuation was signed after its visit, and not before the one before it.

    Raises:
        WorkbookError: it wasn't: the day is mistyped.
    """
    not_before = [(own.visit, "its visit")]
    if last is not None:
        not_before.append((last.signed_on, f"valuation {last.number} was signed"))
    for day, what in not_before:
        if own.signed_on < day:
            raise WorkbookError(
                f"{path}: valuation {own.number} is signed on {own.signed_on.isoformat()}, before {what} "
                f"({day.isoformat()}); correct the day on '{VALUATION}' and save"
            )


def certificate_of(book: XlsxFile, signed: tuple[str, date], path: Path) -> Certificate:
    """Return the certificate that a signed workbook is."""
    number, visit = book.at("valuation_number"), book.at("visit_date")
    if not isinstance(number, int | float) or not isinstance(visit, date):
        raise WorkbookError(f"{path}: the number or the visit of the valuation is gone from '{VALUATION}'")
    totals = totals_of(book, "cumulative", path)
    return Certificate(number=int(number), visit=visit, signed_by=signed[0], signed_on=signed[1], totals=totals)


def totals_of(book: XlsxFile, column: str, path: Path) -> tuple[BillTotals, ...]:
    """Return a column of each bill's summary.

    Raises:
        WorkbookError: a sum has no value.
    """
    currencies = {row.get("Bill"): text_of(row, "Currency") for row in rows_of(book, BILL, "Key", path)}
    totals: list[BillTotals] = []
    while sum_name("work", column, bill := len(totals) + 1) in book.names:
        values = {}
        for what in ("work", "variations", "retention", "tax"):
            value = plain_of(book.at(sum_name(what, column, bill)))
            if value is None:
                raise WorkbookError(f"{path}: '{VALUATION}': {what} of bill {bill} has no value; {AGAIN}")
            values[what] = cents(value)
        currency = currencies.get(bill, "")
        totals.append(BillTotals(bill=bill, currency="" if currency == NO_CURRENCY else currency, **values))
    return tuple(totals)
