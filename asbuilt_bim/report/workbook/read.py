"""Reads the last workbook back: what a surveyor wrote into it, and what was certified. Nothing is guessed.

What formulas gave when the workbook was last saved is held against its own rates and quantities first.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.progress.money import cents, certified_quantity, total
from asbuilt_bim.progress.valuation.bill import LOST, whole_share
from asbuilt_bim.progress.valuation.inputs import (
    NO_INPUTS,
    BillTotals,
    Certificate,
    Override,
    Paid,
    RateChange,
    Terms,
    ValuationInputs,
    Variation,
)
from asbuilt_bim.report.cost_rows import NO_CURRENCY
from asbuilt_bim.report.workbook.layout import (
    BILL,
    CERTIFICATES,
    FORMAT,
    FORMAT_NAME,
    PARTS,
    PER_DESIGN,
    VALUATION,
    VARIATIONS,
    sum_name,
)
from asbuilt_bim.storage.table_file import written_day
from asbuilt_bim.storage.xlsx_file import XlsxCell, XlsxFile, XlsxSheet, read_xlsx

MAX_TEXT = 500
_AGAIN = "open it, let it calculate (Ctrl+Shift+F9) and save it"
_NO_FORMULA = f"{_AGAIN}; where its row has no formulas, copy a row of the table over it and type it again"
_LOST = "what was written into it would be lost"
_DAMAGED = (
    "put your signed copy of it in its place (quantities.signed-<time>.xlsx lie beside it), or the last one from a "
    "folder of runs/"
)
Row = Mapping[str, XlsxCell]


@dataclass(frozen=True, slots=True, kw_only=True)
class LastWorkbook:
    """What the last workbook holds of persons, notes on what of it can't be used, and the amounts that it says."""

    inputs: ValuationInputs
    notes: tuple[Note, ...]
    certified: Mapping[int, float | None] = field(default_factory=dict)  # by line's number in its bill
    certain: Mapping[tuple[str, str], float] = field(default_factory=dict)  # shares, by line and GlobalId


def read_last_workbook(path: Path, *, as_it_stands: bool = False) -> LastWorkbook:
    """Read a workbook of this program, as a surveyor saved it; one without a valuation holds nothing.

    Where it is signed, what it certified is what came before the next valuation; else what stood as previous still is.
    `as_it_stands` takes it as not signed yet: then it begins no next valuation, and its period is its own.

    Raises:
        WorkbookError: it can't be read, its sheets were taken apart, its formulas have no values, or what it certified
            doesn't follow from its own quantities and rates.
    """
    book = read_xlsx(path, WorkbookError, (VALUATION, BILL, PARTS, VARIATIONS, CERTIFICATES), _DAMAGED)
    if FORMAT_NAME not in book.names:
        if BILL in book.all_sheets and any(_cells(book, BILL)):
            raise WorkbookError(f"{path}: the named cell {FORMAT_NAME} is gone, so {_LOST}; take an earlier copy of it")
        return LastWorkbook(inputs=NO_INPUTS, notes=())
    if book.at(FORMAT_NAME) != FORMAT:
        raise WorkbookError(f"{path}: is of another version of this program ({book.at(FORMAT_NAME)}); update it")
    lines = _rows(book, BILL, "Key", path)
    parts = _rows(book, PARTS, "Override", path)
    more = [row for row in _rows(book, VARIATIONS, "Done", path) if _text(row, "No.") or _text(row, "Text")]
    signed = None if as_it_stands else _signature(book, path)
    notes: list[Note] = []
    variations = _variations(more, notes)
    earlier = _certificates(book, path)
    bill = _Bill(path=path, lines=lines, parts=parts if signed or earlier else (), signed=signed is not None)
    own = _certificate(book, signed, path) if signed else None
    if own is not None:
        _check_days(own, earlier[-1] if earlier else None, path)
    terms = Terms(retention=_rate_of(book, "retention_rate", path), tax=_rate_of(book, "tax_rate", path))
    inputs = ValuationInputs(
        terms=terms,
        signed_terms=terms if signed else None,
        overrides=tuple(_overrides(parts, bill, notes)),
        rates=tuple(_rates(lines, notes)),
        variations=variations,
        certificates=(*earlier, *([own] if own else [])),
        before=own.totals if own else _totals(book, "previous", path),
        paid=tuple(bill.paid()),
        paid_variations=_paid_variations(more, path, signed=signed is not None),
    )
    if signed:
        _check_parts(lines, parts, path)
    _check_sums(inputs, path, signed=signed is not None)
    certified = {int(_number(row, "No.", path, "line")): _plain(row.get("Certified amount")) for row in lines}
    keys = {row["No."]: _text(row, "Key") for row in lines}
    shares = {(keys.get(row["No."], ""), _text(row, "GlobalId")): _plain(row.get("Certain")) for row in parts}
    certain = {key: share for key, share in shares.items() if share is not None}
    return LastWorkbook(inputs=inputs, notes=tuple(notes), certified=certified, certain=certain)


def signed_number(path: Path) -> int | None:
    """Return the number of the valuation that a workbook is, signed; None where it is none, or can't be read."""
    try:
        book = read_xlsx(path, WorkbookError, (VALUATION,))
        number = book.at("valuation_number")
        return int(number) if _signature(book, path) and isinstance(number, int | float) else None
    except WorkbookError:
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bill:
    """The rows of the sheet Bill; those of Cost by element where something was signed."""

    path: Path
    lines: Sequence[Row]
    parts: Sequence[Row]
    signed: bool

    def paid(self) -> Iterator[Paid]:
        """Yield what was certified of each line.

        Raises:
            WorkbookError: a number is missing, or an amount isn't quantity x rate.
        """
        which = "Certified" if self.signed else "Previous"
        for row in self.lines:
            item = _text(row, "Item") or _text(row, "Key")
            quantity = _number(row, f"{which} quantity", self.path, item)
            amount = _number(row, f"{which} amount", self.path, item)
            rate = _number(row, "Rate", self.path, item)
            if self.signed and cents(quantity * rate) != cents(amount):
                raise WorkbookError(
                    f"{self.path}: item {item}: the certified amount {amount:,.2f} isn't {quantity:g} x {rate:g}; "
                    f"{_AGAIN}. To certify another value, write an override on '{PARTS}'"
                )
            own = [part for part in self.parts if part["No."] == row["No."] and part.get("Quantity") is not None]
            shares = {key: part for part in own if (key := _text(part, "GlobalId")) not in ("", LOST)}
            if quantity or amount or shares:
                yield Paid(
                    line=_text(row, "Key"),
                    identification=_text(row, "Item"),
                    text=_text(row, "Text"),
                    unit=_text(row, "Unit"),
                    rate=rate,
                    quantity=quantity,
                    amount=cents(amount),
                    bill=int(_number(row, "Bill", self.path, item)),
                    contract=_number(row, "Contract quantity", self.path, item) if self.parts else 0.0,
                    per_design=(_plain(row.get(PER_DESIGN)) or 0.0) if self.parts else 0.0,
                    elements={key: _text(part, "Element") for key, part in shares.items()},
                    quantities={key: _number(part, "Quantity", self.path, item) for key, part in shares.items()},
                )


def _rows(book: XlsxFile, name: str, needed: str, path: Path) -> list[Row]:
    """Return the rows of a sheet's table by heading, up to the first without any number or text in its first cells."""
    sheet = book.sheets.get(name, XlsxSheet(rows=(), formulas=False))
    for index, cells in enumerate(sheet.rows[:20]):
        if "No." in cells and needed in cells:
            heads = [str(cell) if cell is not None else "" for cell in cells]
            if len({head for head in heads if head}) != sum(1 for head in heads if head):
                raise WorkbookError(f"{path}: sheet '{name}' has two columns of one heading; take one out")
            rows = [dict(zip(heads, row, strict=False)) for row in sheet.rows[index + 1 :]]
            return [row for row in rows if isinstance(row.get("No."), int | float) or name == VARIATIONS]
    raise WorkbookError(f"{path}: sheet '{name}' lacks its headings, so {_LOST}; take an earlier copy of it")


def _cells(book: XlsxFile, name: str) -> Iterator[XlsxCell]:
    """Yield the keys of a sheet's lines, where it has the column."""
    for cells in book.sheets[name].rows if name in book.sheets else ():
        if "Key" in cells:
            yield True


def _signature(book: XlsxFile, path: Path) -> tuple[str, date] | None:
    """Return who signed the workbook, and when; None where nobody did.

    Raises:
        WorkbookError: there is a name without a day, or a day without a name.
    """
    who, when = book.at("signed_by"), book.at("signed_on")
    name = "" if who is None else str(who).strip()
    day = _day(when)
    if isinstance(when, str) and when.strip() and day is None:
        raise WorkbookError(f"{path}: signed on '{when!s:.40}', which is no day; write 2026-03-20")
    if bool(name) != (day is not None):
        lacks = "the date" if name else "the name"
        raise WorkbookError(f"{path}: {lacks} of who certified it is missing on '{VALUATION}'; write both, or neither")
    return (name[:MAX_TEXT], day) if name and day else None


def _rate_of(book: XlsxFile, name: str, path: Path) -> float:
    value = book.at(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0:
        text = "empty" if value is None else f"the text '{value!s:.40}'"
        shown = f"{100.0 * value:g} %" if isinstance(value, int | float) else text
        of = f"{name.replace('_', ' ')} on '{VALUATION}'"
        raise WorkbookError(f"{path}: {of} is {shown}, and no percentage from 0 % to 100 %; type it as 5 %")
    return float(value)


def _overrides(parts: Sequence[Row], bill: _Bill, notes: list[Note]) -> Iterator[Override]:
    keys = {row["No."]: _text(row, "Key") for row in bill.lines}
    for row in parts:
        written = row.get("Override")
        if written is None or written == "":
            continue
        item = f"{_text(row, 'Item')} {_text(row, 'Element')}".strip()
        if isinstance(written, bool) or not isinstance(written, int | float) or not 0.0 <= written <= 1.0:
            subject = about(SubjectKind.COST_LINE, item)
            notes.append(noted(Reason.OVERRIDE_UNREADABLE, subject, written=str(written)[:40]))
            continue
        yield Override(
            line=keys.get(row["No."], ""),
            element=_text(row, "GlobalId"),
            share=float(written),
            reason=_text(row, "Reason"),
            by=_text(row, "By"),
            day=_day(row.get("Date")),
        )


def _day(cell: XlsxCell) -> date | None:
    return cell if isinstance(cell, date) else written_day(str(cell).strip())


def _rates(lines: Sequence[Row], notes: list[Note]) -> Iterator[RateChange]:
    for row in lines:
        rate, contract = row.get("Rate"), row.get("Contract rate")
        if isinstance(rate, bool) or not isinstance(rate, int | float) or not math.isfinite(rate):
            subject = about(SubjectKind.COST_LINE, _text(row, "Item"))
            notes.append(noted(Reason.RATE_UNREADABLE, subject, written=str(rate)[:40]))
        elif rate != contract:
            yield RateChange(line=_text(row, "Key"), rate=float(rate), why=_text(row, "Rate: why, by whom"))


def _variations(rows: Sequence[Row], notes: list[Note]) -> tuple[Variation, ...]:
    """Return the variations; one whose numbers can't be read is worth nothing, and named."""
    found: list[Variation] = []
    for index, row in enumerate(rows, 1):
        number = _text(row, "No.") or f"without number {index}"
        bill, quantity, rate, share = (_plain(row.get(key)) for key in ("Bill", "Quantity", "Rate", "Done"))
        typed = any(isinstance(row.get(key), str) and _text(row, key) for key in ("Bill", "Done"))
        known = quantity is not None and rate is not None and not typed and 0.0 <= (share or 0.0) <= 1.0
        doubled = any(one.number == number for one in found)
        if not known or doubled:
            notes.append(noted(Reason.VARIATION_UNREADABLE, about(SubjectKind.COST_LINE, number)))
        found.append(
            Variation(
                number=f"{number} ({index})" if doubled else number,
                text=_text(row, "Text"),
                order=_text(row, "Order"),
                unit=_text(row, "Unit"),
                quantity=quantity or 0.0,
                rate=rate or 0.0,
                share=(share or 0.0) if known and not doubled else 0.0,
                by=_text(row, "By"),
                bill=max(int(bill or 1), 1),
            )
        )
    return tuple(found)


def _paid_variations(rows: Sequence[Row], path: Path, *, signed: bool) -> dict[str, float]:
    heading = "Certified amount" if signed else "Previous amount"
    found: dict[str, float] = {}
    for index, row in enumerate(rows, 1):
        number = _text(row, "No.") or f"without number {index}"
        if not signed and row.get(heading) is None:  # typed below the table: it was never certified
            continue
        amount = _number(row, heading, path, f"variation {number}", _NO_FORMULA)
        if amount and signed:
            _number(row, "Bill", path, f"variation {number}", "write the number of its bill, such as 1, and save it")
        if amount:
            found[number] = cents(found.get(number, 0.0) + amount)
    return found


def _certificates(book: XlsxFile, path: Path) -> tuple[Certificate, ...]:
    """Return what was signed before this workbook, as its sheet holds it."""
    rows = _rows(book, CERTIFICATES, "Signed on", path)
    made: dict[int, Certificate] = {}
    for row in rows:
        number = int(_number(row, "No.", path, "certificate"))
        visit, signed_on = row.get("Visit"), row.get("Signed on")
        if not isinstance(visit, date) or not isinstance(signed_on, date):
            raise WorkbookError(f"{path}: sheet '{CERTIFICATES}': valuation {number} has no visit or no day of signing")
        currency = _text(row, "Currency")
        values = [cents(_number(row, key, path, f"valuation {number}")) for key in ("Work", "Variations")]
        kept = [cents(_number(row, key, path, f"valuation {number}")) for key in ("Retention", "Tax")]
        sums = BillTotals(
            bill=int(_number(row, "Bill", path, f"valuation {number}")),
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
                number=number, visit=visit, signed_by=_text(row, "Signed by"), signed_on=signed_on, totals=(sums,)
            )
        )
    return tuple(made[number] for number in sorted(made))


def _check_days(own: Certificate, last: Certificate | None, path: Path) -> None:
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


def _certificate(book: XlsxFile, signed: tuple[str, date], path: Path) -> Certificate:
    """Return the certificate that a signed workbook is."""
    number, visit = book.at("valuation_number"), book.at("visit_date")
    if not isinstance(number, int | float) or not isinstance(visit, date):
        raise WorkbookError(f"{path}: the number or the visit of the valuation is gone from '{VALUATION}'")
    totals = _totals(book, "cumulative", path)
    return Certificate(number=int(number), visit=visit, signed_by=signed[0], signed_on=signed[1], totals=totals)


def _totals(book: XlsxFile, column: str, path: Path) -> tuple[BillTotals, ...]:
    """Return a column of each bill's summary.

    Raises:
        WorkbookError: a sum has no value.
    """
    currencies = {row.get("Bill"): _text(row, "Currency") for row in _rows(book, BILL, "Key", path)}
    totals: list[BillTotals] = []
    while sum_name("work", column, bill := len(totals) + 1) in book.names:
        values = {}
        for what in ("work", "variations", "retention", "tax"):
            value = _plain(book.at(sum_name(what, column, bill)))
            if value is None:
                raise WorkbookError(f"{path}: '{VALUATION}': {what} of bill {bill} has no value; {_AGAIN}")
            values[what] = cents(value)
        currency = currencies.get(bill, "")
        totals.append(BillTotals(bill=bill, currency="" if currency == NO_CURRENCY else currency, **values))
    return tuple(totals)


def _check_parts(lines: Sequence[Row], parts: Sequence[Row], path: Path) -> None:
    """Hold each line's certified quantity against its rows of Cost by element, and these against their overrides.

    Raises:
        WorkbookError: they differ: it was saved before it had calculated, or a formula was written over.
    """
    sums: dict[XlsxCell, float] = {}
    kinds = {row["No."]: _kind(row, path) for row in lines}
    for row in parts:
        item = f"{_text(row, 'Item')} {_text(row, 'Element')}".strip()
        counts, given = _number(row, "Counts", path, item), _plain(row.get("Override"))
        pieces, off = kinds.get(row["No."], (False, False))
        if given is not None and counts != whole_share(given, pieces=pieces, takes_off=off):
            raise WorkbookError(f"{path}: {item}: {counts:.1%} counts, and its override is {given:.1%}; {_AGAIN}")
        sums[row["No."]] = sums.get(row["No."], 0.0) + _number(row, "Quantity", path, item) * counts
    for row in lines:
        item, own = _text(row, "Item") or _text(row, "Key"), sums.get(row["No."], 0.0)
        planned = _number(row, "Contract quantity", path, item)
        certified = _number(row, "Certified quantity", path, item)
        pieces, off = kinds[row["No."]]
        if not math.isclose(certified, certified_quantity(own, planned, pieces=pieces, up=off), rel_tol=1e-9):
            raise WorkbookError(
                f"{path}: item {item}: {certified:g} is certified, and its rows of '{PARTS}' come to {own:g}; {_AGAIN}"
                ". To certify another value, write an override there"
            )


def _kind(row: Row, path: Path) -> tuple[bool, bool]:
    """Say of a line whether only whole pieces count, and whether it takes money off."""
    item = _text(row, "Item") or _text(row, "Key")
    worth = _number(row, "Contract quantity", path, item) * _number(row, "Rate", path, item)
    return _text(row, "In pieces") == "yes", worth < 0.0


def _check_sums(inputs: ValuationInputs, path: Path, *, signed: bool) -> None:
    """Hold the sums that were certified against their lines, and what stands as previous against the certificate.

    Raises:
        WorkbookError: they differ: it was saved before it had calculated, or a row was taken out.
    """
    work = total(one.amount for one in inputs.paid)
    variations = total(inputs.paid_variations.values())
    sums = total(one.work for one in inputs.before), total(one.variations for one in inputs.before)
    for what, lines, summed in (("work", work, sums[0]), ("variations", variations, sums[1])):
        if lines != summed:
            raise WorkbookError(f"{path}: {what}: '{VALUATION}' says {summed:,.2f}, its lines {lines:,.2f}; {_AGAIN}")
    last = inputs.certificates[-1] if inputs.certificates else None
    if last is None or signed:
        _check_variations(inputs, path, signed)
        return
    for what, lines, before in (
        ("work", work, total(one.work for one in last.totals)),
        ("variations", variations, total(one.variations for one in last.totals)),
    ):
        if lines != before:
            raise WorkbookError(
                f"{path}: {what}: the previous amounts add up to {lines:,.2f}, and valuation {last.number} certified "
                f"{before:,.2f}; put back the rows that were taken out (set what isn't done to 0 %)"
            )


def _check_variations(inputs: ValuationInputs, path: Path, signed: bool) -> None:
    for one in inputs.variations if signed else ():
        amount = cents(cents(one.quantity * one.rate) * one.share)
        if amount != inputs.paid_variations.get(one.number, 0.0):
            raise WorkbookError(f"{path}: variation {one.number} isn't quantity x rate x done; {_AGAIN}")


def _number(row: Row, key: str, path: Path, what: str, remedy: str = _AGAIN) -> float:
    """Return a number that has to be there.

    Raises:
        WorkbookError: it isn't: it is text, or the workbook was changed, or saved by what calculates nothing.
    """
    cell = row.get(key)
    value = _plain(cell)
    if isinstance(cell, str) and cell.strip():
        raise WorkbookError(
            f"{path}: {what}: '{key}' is the text '{cell.strip()[:40]}' and no number. Give the cell a number format, "
            "type it with your spreadsheet's own decimal sign and without a unit, such as 310.50 or 310,50, and save"
        )
    if value is None:
        raise WorkbookError(f"{path}: {what}: '{key}' has no value, and none is guessed; {remedy}")
    return value


def _plain(cell: XlsxCell) -> float | None:
    if isinstance(cell, bool) or not isinstance(cell, int | float) or not math.isfinite(cell):
        return None
    return float(cell)


def _text(row: Row, key: str) -> str:
    cell = row.get(key)
    if cell is None:
        return ""
    text = f"{cell:g}" if isinstance(cell, float) else str(cell)
    return text.strip()[:MAX_TEXT]
