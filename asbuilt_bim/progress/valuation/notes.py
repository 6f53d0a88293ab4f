"""What has to be said of a valuation: what falls, what persons changed, what they wrote that can't be used."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, bills
from asbuilt_bim.progress.valuation.contract_notes import contract_notes, line_label, line_subject, terms_notes
from asbuilt_bim.progress.valuation.held import held_line
from asbuilt_bim.progress.valuation.inputs import ValuationInputs
from asbuilt_bim.progress.valuation.known_again import paid_lines
from asbuilt_bim.progress.valuation.observed import observation_notes, observed_elements

_OF_LINES = {
    *(Reason.CERTIFIED_FALLS, Reason.CERTIFIED_LINE_GONE, Reason.CERTIFIED_LINE_CHANGED, Reason.TAX_CHANGED),
    *(Reason.CONTRACT_NOT_DESIGN, Reason.DESIGN_LOST_WORK, Reason.DESIGN_ADDED_WORK, Reason.RETENTION_CHANGED),
    Reason.OVERRIDE_NOT_WHOLE,
}
OF_MONEY = _OF_LINES | {
    *(Reason.COST_UNIT_UNKNOWN, Reason.COST_PAID_TWICE, Reason.COST_COVER_UNKNOWN, Reason.CERTIFIED_PHOTOS_CHANGED),
    *(Reason.CERTIFIED_OTHERWISE, Reason.CERTIFIED_FILES_CHANGED),
}
"""Codes of notes on lines for which too much or too little may be paid: they stand beside what is due."""
CODES = _OF_LINES | {
    *(Reason.OBSERVATION_CONTRADICTS, Reason.OBSERVATION_SHOWN, Reason.OBSERVATION_LATER, Reason.CERTIFICATE_LATER),
    *(Reason.OVERRIDE_UNUSED, Reason.OVERRIDE_UNSIGNED, Reason.OVERRIDE_UNREADABLE, Reason.RATE_CHANGED),
    *(Reason.RATE_UNREADABLE, Reason.RATE_UNUSED, Reason.VARIATION_UNREADABLE, Reason.TERMS_KEPT),
}
"""Codes of notes that are made anew whenever a workbook is."""
MOST = 20


def of_money(note: Note) -> bool:
    """Say whether a note stands beside what is due: so does a line's that names what isn't there, say a storey."""
    return note.code in OF_MONEY or (note.code is Reason.COST_COVERS_NOTHING and bool(note.values["said"]))


def with_valuation(report: ProgressReport, inputs: ValuationInputs | None, read: Sequence[Note] = ()) -> ProgressReport:
    """Return a report with what persons brought to its valuation, and notes on it; `read`: from reading the workbook.

    A report without cost lines, observations and certificates stays as it is.
    """
    report = replace(report, valuation=inputs, notes=tuple(note for note in report.notes if note.code not in CODES))
    report = replace(report, cost_lines=_held(report, inputs)) if inputs else report
    notes = [*read, *valuation_notes(report)]
    return replace(report, notes=(*report.notes, *notes)) if notes else report


def _held(report: ProgressReport, inputs: ValuationInputs) -> tuple[CostProgress, ...]:
    """Return the cost lines, none with more of its contract on what was built than when it was signed."""
    paid = paid_lines(report.cost_lines, inputs.paid)
    elements = {element.global_id: element for element in report.elements}
    return tuple(held_line(line, paid.get(line.global_id), elements) for line in report.cost_lines)


def valuation_notes(report: ProgressReport) -> list[Note]:
    """Return the notes on a report's bills, the first few of each sort."""
    elements = {element.global_id: element for element in report.elements}
    seen = observed_elements(report.observations, elements, report.visit_date)
    inputs = report.valuation or ValuationInputs()
    made = bills(report)
    notes = [*observation_notes(seen, elements, inputs.count_observations)]
    if inputs.count_observations:
        notes += _later(report, elements)
    for bill in made:
        notes += list(contract_notes(bill))[:MOST]
        notes += [*list(_falls(bill))[:MOST], *terms_notes(bill, inputs)]
    notes += list(_of_persons(made, inputs))[:MOST]
    subject = about(SubjectKind.VISIT, report.visit_date.isoformat())
    later = [one for one in inputs.certificates if one.visit > report.visit_date][-1:]
    notes += [noted(Reason.CERTIFICATE_LATER, subject, number=one.number, visit=one.visit.isoformat()) for one in later]
    return notes


def _later(report: ProgressReport, elements: Mapping[str, ElementProgress]) -> list[Note]:
    """Return the note on what persons saw after the visit's day: it counts at none but a later visit."""
    later = [one for one in report.observations if one.element in elements and one.day > report.visit_date]
    named = [f"{one.by}, {elements[one.element].name or one.element} on {one.day.isoformat()}" for one in later]
    subject = about(SubjectKind.VISIT, report.visit_date.isoformat())
    return [noted(Reason.OBSERVATION_LATER, subject, elements=tuple(named[:MOST]), count=len(named))] if later else []


def _falls(bill: Bill) -> Iterator[Note]:
    for line in bill.lines:
        if line.falls:
            values: Values = {"was": line.previous, "now": line.amount, "currency": bill.currency}
            if line.gone:
                values = {**values, "unit": line.line.unit, "replaced_by": line.replaced_by}
            code = Reason.CERTIFIED_LINE_GONE if line.gone else Reason.CERTIFIED_FALLS
            yield noted(code, line_subject(line), item=line_label(line), **values)
    for one in bill.variations:
        if one.certified < one.previous and one.amount >= 0.0:
            number = one.variation.number
            yield noted(
                Reason.CERTIFIED_FALLS,
                about(SubjectKind.COST_LINE, number),
                item=f"variation {number}",
                was=one.previous,
                now=one.certified,
                currency=bill.currency,
            )


def _of_persons(made: Sequence[Bill], inputs: ValuationInputs) -> Iterator[Note]:
    used = set[int]()
    for bill in made:
        for line in bill.lines:
            if line.rate_change is not None:
                change = line.rate_change
                used.add(id(change))
                values: Values = {"was": line.line.rate, "now": change.rate}
                values = {**values, "why": change.why, "currency": bill.currency}
                yield noted(Reason.RATE_CHANGED, line_subject(line), item=line_label(line), **values)
            for row in line.rows:
                if (given := row.override) is None:
                    continue
                used.add(id(given))
                values = {"item": line_label(line), "element": row.element.name if row.element else ""}
                if not (given.reason and given.by and given.day):
                    yield noted(Reason.OVERRIDE_UNSIGNED, line_subject(line), **values)
                if row.share != given.share:
                    values = {**values, "share": given.share, "counted": row.share}
                    yield noted(Reason.OVERRIDE_NOT_WHOLE, line_subject(line), **values)
    for one in inputs.overrides:
        if id(one) not in used:
            subject = about(SubjectKind.COST_LINE, one.line)
            yield noted(Reason.OVERRIDE_UNUSED, subject, element=one.element, share=one.share, by=one.by)
    for change in inputs.rates:
        if id(change) not in used:
            yield noted(Reason.RATE_UNUSED, about(SubjectKind.COST_LINE, change.line), now=change.rate, why=change.why)
