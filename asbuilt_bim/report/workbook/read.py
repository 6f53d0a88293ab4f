"""Reads the last workbook back: what a surveyor wrote into it, and what was certified. Nothing is guessed.

What formulas gave when the workbook was last saved is held against its own rates and quantities first.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.valuation.bill import LOST
from asbuilt_bim.progress.valuation.inputs import (
    NO_INPUTS,
    Override,
    Paid,
    RateChange,
    Terms,
    ValuationInputs,
    Variation,
)
from asbuilt_bim.report.workbook.layout import (
    BILL,
    CERTIFICATES,
    FORMAT,
    FORMAT_NAME,
    PARTS,
    PER_DESIGN,
    VALUATION,
    VARIATIONS,
)
from asbuilt_bim.report.workbook.read_cells import AGAIN, LOST_INPUT, Row, day_of, number_of, plain_of, rows_of, text_of
from asbuilt_bim.report.workbook.read_certificates import (
    certificate_of,
    check_days,
    earlier_certificates,
    signature_of,
    totals_of,
)
from asbuilt_bim.report.workbook.read_checks import check_parts, check_sums
from asbuilt_bim.storage.regular_file import file_digest
from asbuilt_bim.storage.xlsx_file import XlsxCell, XlsxFile, read_xlsx

_NO_FORMULA = f"{AGAIN}; where its row has no formulas, copy a row of the table over it and type it again"
_DAMAGED = (
    "put your signed copy of it in its place (quantities.signed-<time>.xlsx lie beside it), or the last one from a "
    "folder of runs/"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LastWorkbook:
    """What the last workbook holds of persons, notes on what of it can't be used, and the amounts that it says."""

    inputs: ValuationInputs
    notes: tuple[Note, ...]
    certified: Mapping[int, float | None] = field(default_factory=dict)  # by line's number in its bill
    certain: Mapping[tuple[str, str], float] = field(default_factory=dict)  # shares, by line and GlobalId
    digests: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of the "workbook", where it is signed, and of its run's "result"."""


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
            raise WorkbookError(
                f"{path}: the named cell {FORMAT_NAME} is gone, so {LOST_INPUT}; take an earlier copy of it"
            )
        return LastWorkbook(inputs=NO_INPUTS, notes=())
    if book.at(FORMAT_NAME) != FORMAT:
        raise WorkbookError(f"{path}: is of another version of this program ({book.at(FORMAT_NAME)}); update it")
    lines = rows_of(book, BILL, "Key", path)
    parts = rows_of(book, PARTS, "Override", path)
    more = [row for row in rows_of(book, VARIATIONS, "Done", path) if text_of(row, "No.") or text_of(row, "Text")]
    signed = None if as_it_stands else signature_of(book, path)
    notes: list[Note] = []
    variations = _variations(more, notes)
    earlier = earlier_certificates(book, path)
    bill = _Bill(path=path, lines=lines, parts=parts if signed or earlier else (), signed=signed is not None)
    own = certificate_of(book, signed, path) if signed else None
    if own is not None:
        check_days(own, earlier[-1] if earlier else None, path)
    terms = Terms(retention=_rate_of(book, "retention_rate", path), tax=_rate_of(book, "tax_rate", path))
    inputs = ValuationInputs(
        terms=terms,
        signed_terms=terms if signed else None,
        overrides=tuple(_overrides(parts, bill, notes)),
        rates=tuple(_rates(lines, notes)),
        variations=variations,
        certificates=(*earlier, *([own] if own else [])),
        before=own.totals if own else totals_of(book, "previous", path),
        paid=tuple(bill.paid()),
        paid_variations=_paid_variations(more, path, signed=signed is not None),
    )
    if signed:
        check_parts(lines, parts, path)
    check_sums(inputs, path, signed=signed is not None)
    certified = {int(number_of(row, "No.", path, "line")): plain_of(row.get("Certified amount")) for row in lines}
    keys = {row["No."]: text_of(row, "Key") for row in lines}
    shares = {(keys.get(row["No."], ""), text_of(row, "GlobalId")): plain_of(row.get("Certain")) for row in parts}
    certain = {key: share for key, share in shares.items() if share is not None}
    return LastWorkbook(
        inputs=inputs,
        notes=tuple(notes),
        certified=certified,
        certain=certain,
        digests={"workbook": file_digest(path)} if signed else {},
    )


def signed_number(path: Path) -> int | None:
    """Return the number of the valuation that a workbook is, signed; None where it is none, or can't be read."""
    try:
        book = read_xlsx(path, WorkbookError, (VALUATION,))
        number = book.at("valuation_number")
        return int(number) if signature_of(book, path) and isinstance(number, int | float) else None
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
            item = text_of(row, "Item") or text_of(row, "Key")
            quantity = number_of(row, f"{which} quantity", self.path, item)
            amount = number_of(row, f"{which} amount", self.path, item)
            rate = number_of(row, "Rate", self.path, item)
            if self.signed and cents(quantity * rate) != cents(amount):
                raise WorkbookError(
                    f"{self.path}: item {item}: the certified amount {amount:,.2f} isn't {quantity:g} x {rate:g}; "
                    f"{AGAIN}. To certify another value, write an override on '{PARTS}'"
                )
            own = [part for part in self.parts if part["No."] == row["No."] and part.get("Quantity") is not None]
            shares = {key: part for part in own if (key := text_of(part, "GlobalId")) not in ("", LOST)}
            if quantity or amount or shares:
                yield Paid(
                    line=text_of(row, "Key"),
                    identification=text_of(row, "Item"),
                    text=text_of(row, "Text"),
                    unit=text_of(row, "Unit"),
                    rate=rate,
                    quantity=quantity,
                    amount=cents(amount),
                    bill=int(number_of(row, "Bill", self.path, item)),
                    contract=number_of(row, "Contract quantity", self.path, item) if self.parts else 0.0,
                    per_design=(plain_of(row.get(PER_DESIGN)) or 0.0) if self.parts else 0.0,
                    elements={key: text_of(part, "Element") for key, part in shares.items()},
                    quantities={key: number_of(part, "Quantity", self.path, item) for key, part in shares.items()},
                )


def _cells(book: XlsxFile, name: str) -> Iterator[XlsxCell]:
    """Yield the keys of a sheet's lines, where it has the column."""
    for cells in book.sheets[name].rows if name in book.sheets else ():
        if "Key" in cells:
            yield True


def _rate_of(book: XlsxFile, name: str, path: Path) -> float:
    value = book.at(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0:
        text = "empty" if value is None else f"the text '{value!s:.40}'"
        shown = f"{100.0 * value:g} %" if isinstance(value, int | float) else text
        of = f"{name.replace('_', ' ')} on '{VALUATION}'"
        raise WorkbookError(f"{path}: {of} is {shown}, and no percentage from 0 % to 100 %; type it as 5 %")
    return float(value)


def _overrides(parts: Sequence[Row], bill: _Bill, notes: list[Note]) -> Iterator[Override]:
    keys = {row["No."]: text_of(row, "Key") for row in bill.lines}
    for row in parts:
        written = row.get("Override")
        if written is None or written == "":
            continue
        item = f"{text_of(row, 'Item')} {text_of(row, 'Element')}".strip()
        if isinstance(written, bool) or not isinstance(written, int | float) or not 0.0 <= written <= 1.0:
            subject = about(SubjectKind.COST_LINE, item)
            notes.append(noted(Reason.OVERRIDE_UNREADABLE, subject, written=str(written)[:40]))
            continue
        yield Override(
            line=keys.get(row["No."], ""),
            element=text_of(row, "GlobalId"),
            share=float(written),
            reason=text_of(row, "Reason"),
            by=text_of(row, "By"),
            day=day_of(row.get("Date")),
        )


def _rates(lines: Sequence[Row], notes: list[Note]) -> Iterator[RateChange]:
    for row in lines:
        rate, contract = row.get("Rate"), row.get("Contract rate")
        if isinstance(rate, bool) or not isinstance(rate, int | float) or not math.isfinite(rate):
            subject = about(SubjectKind.COST_LINE, text_of(row, "Item"))
            notes.append(noted(Reason.RATE_UNREADABLE, subject, written=str(rate)[:40]))
        elif rate != contract:
            yield RateChange(line=text_of(row, "Key"), rate=float(rate), why=text_of(row, "Rate: why, by whom"))


def _variations(rows: Sequence[Row], notes: list[Note]) -> tuple[Variation, ...]:
    """Return the variations; one whose numbers can't be read is worth nothing, and named."""
    found: list[Variation] = []
    for index, row in enumerate(rows, 1):
        number = text_of(row, "No.") or f"without number {index}"
        bill, quantity, rate, share = (plain_of(row.get(key)) for key in ("Bill", "Quantity", "Rate", "Done"))
        typed = any(isinstance(row.get(key), str) and text_of(row, key) for key in ("Bill", "Done"))
        known = quantity is not None and rate is not None and not typed and 0.0 <= (share or 0.0) <= 1.0
        doubled = any(one.number == number for one in found)
        if not known or doubled:
            notes.append(noted(Reason.VARIATION_UNREADABLE, about(SubjectKind.COST_LINE, number)))
        found.append(
            Variation(
                number=f"{number} ({index})" if doubled else number,
                text=text_of(row, "Text"),
                order=text_of(row, "Order"),
                unit=text_of(row, "Unit"),
                quantity=quantity or 0.0,
                rate=rate or 0.0,
                share=(share or 0.0) if known and not doubled else 0.0,
                by=text_of(row, "By"),
                bill=max(int(bill or 1), 1),
            )
        )
    return tuple(found)


def _paid_variations(rows: Sequence[Row], path: Path, *, signed: bool) -> dict[str, float]:
    heading = "Certified amount" if signed else "Previous amount"
    found: dict[str, float] = {}
    for index, row in enumerate(rows, 1):
        number = text_of(row, "No.") or f"without number {index}"
        if not signed and row.get(heading) is None:  # typed below the table: it was never certified
            continue
        amount = number_of(row, heading, path, f"variation {number}", _NO_FORMULA)
        if amount and signed:
            number_of(row, "Bill", path, f"variation {number}", "write the number of its bill, such as 1, and save it")
        if amount:
            found[number] = cents(found.get(number, 0.0) + amount)
    return found
