"""What has to be said where contract, terms or design don't fit each other, or the last certificate."""

import math
from collections.abc import Iterator, Mapping

from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, Values, about, noted
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.valuation.bill import Bill, BillLine
from asbuilt_bim.progress.valuation.held import without_contract
from asbuilt_bim.progress.valuation.inputs import ValuationInputs

OFF = 0.1
"""A contract quantity this far off the design's is told: a tenth is what contracts add for waste and round.

It is for a number or a unit that was typed wrong, and for a line that covers other elements than it should. Nothing
is held back for it.
"""
MOST_NAMED = 5


def contract_notes(bill: Bill) -> Iterator[Note]:
    """Yield what of a bill's lines is far off the design, was lost or added with it, or is otherwise than signed."""
    for line in bill.lines:
        if line.gone:
            continue
        if line.line.lost:
            yield _lost(line, bill.currency)
        added = without_contract(line.line, line.paid)
        if added:
            yield _added(line, added, bill.currency)
        if not added and (design := design_off(line)) is not None:
            given = line.line
            yield noted(
                Reason.CONTRACT_NOT_DESIGN,
                line_subject(line),
                item=line_label(line),
                contract=given.planned_quantity,
                design=design,
                unit=given.unit,
            )
        if changed := _changed(line):
            yield noted(Reason.CERTIFIED_LINE_CHANGED, line_subject(line), item=line_label(line), **changed)


def design_off(line: BillLine) -> float | None:
    """Return the design's quantity of a line where the contract's is far off it; None where it isn't, or can't be told.

    Where a line pays for more than is measured here, it may well hold more. What the design lost is told by itself.
    """
    given = line.line
    if given.measure == "other" or given.design_quantity <= 0.0:
        return None
    contract = abs(given.planned_quantity) * (1.0 - given.lost)
    least, most = given.design_quantity * (1.0 - OFF), given.design_quantity * (1.0 + OFF)
    return given.design_quantity if contract < least or (contract > most and not given.others) else None


def _lost(line: BillLine, currency: str) -> Note:
    """Return the note on the part of a line that stood for what the design has no longer."""
    given, paid = line.line, line.paid
    gone = [paid.elements[key] or key for key in line.left] if paid else []
    quantity = given.planned_quantity * given.lost
    return noted(
        Reason.DESIGN_LOST_WORK,
        line_subject(line),
        item=line_label(line),
        elements=tuple(gone[:MOST_NAMED]),
        count=len(gone),
        uncovered=sum(line.left.values()),
        quantity=quantity,
        unit=given.unit,
        amount=cents(quantity * line.rate),
        currency=currency,
    )


def _added(line: BillLine, added: Mapping[str, float], currency: str) -> Note:
    """Return the note on what the design has since it was signed, and the contract quantity has no room for."""
    quantity = math.fsum(added.values())
    return noted(
        Reason.DESIGN_ADDED_WORK,
        line_subject(line),
        item=line_label(line),
        elements=tuple(line.elements[key].name or key for key in added if key in line.elements)[:MOST_NAMED],
        count=len(added),
        quantity=quantity,
        unit=line.line.unit,
        amount=cents(quantity * line.rate),
        currency=currency,
    )


def _changed(line: BillLine) -> dict[str, str | float]:
    """Return what of a line is otherwise than when it was certified, as values of a note; nothing where all is as then.

    A rate that a person set in the workbook is told by itself.
    """
    paid, given = line.paid, line.line
    if paid is None or not paid.amount:
        return {}
    found: dict[str, str | float] = {}
    if paid.text.split() != given.name.split():
        found |= {"text_was": paid.text, "text": given.name}
    if line.rate_change is None and paid.rate != line.rate:
        found |= {"rate_was": paid.rate, "rate": line.rate}
    if paid.contract and not math.isclose(paid.contract, given.planned_quantity, rel_tol=1e-9):
        found |= {"contract_was": paid.contract, "contract": given.planned_quantity, "unit": given.unit}
    return found


def terms_notes(bill: Bill, inputs: ValuationInputs) -> Iterator[Note]:
    """Yield where a bill's retention or tax is another than what was certified of it was signed with."""
    subject, gross = about(SubjectKind.COST_LINE, f"bill {bill.number}"), bill.previous.gross
    signed, terms = inputs.signed_terms, inputs.terms
    more = cents(cents(gross * terms.retention) - bill.previous.retention)
    if gross and more and (signed is None or signed.retention != terms.retention):
        was = signed.retention if signed else bill.previous.retention / gross
        values: Values = {"was": was, "now": terms.retention, "amount": more, "currency": bill.currency}
        yield noted(Reason.RETENTION_CHANGED, subject, **values)
    if gross and signed is not None and signed.tax != terms.tax:
        yield noted(Reason.TAX_CHANGED, subject, was=signed.tax, now=terms.tax)


def line_subject(line: BillLine) -> Subject:
    """Return what a note on a line is about."""
    return about(SubjectKind.COST_LINE, line.line.global_id)


def line_label(line: BillLine) -> str:
    """Return what people call a line."""
    return f"{line.line.identification} {line.line.name}".strip() or line.line.global_id
