"""What persons wrote into the last workbook, and what was certified before: carried on into the next one."""

import filecmp
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from asbuilt_bim.bim.cost_units import currency_of
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import CostError, WorkbookError
from asbuilt_bim.flow.output.certified_on import with_what_they_rest_on
from asbuilt_bim.flow.output.folder import OutputFolder
from asbuilt_bim.flow.output.kept import SIGNED_WORKBOOKS, WORKBOOK, age_of
from asbuilt_bim.flow.output.places import CURRENT
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.report import CostProgress, ProgressReport
from asbuilt_bim.progress.valuation.bill import BEFORE, bills
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, Certificate, Paid, Terms, ValuationInputs
from asbuilt_bim.progress.valuation.known_again import paid_lines
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.project.file import ValuationFile
from asbuilt_bim.report.workbook.layout import CERTIFICATES
from asbuilt_bim.report.workbook.read import LastWorkbook, read_last_workbook, signed_number


def last_workbook(
    out: OutputFolder, before: ProgressReport | None, named: Path | None = None, *, as_it_stands: bool = False
) -> LastWorkbook | None:
    """Return what the workbook in an output folder holds of persons; None where there is none, or nobody changed it.

    `before` is the current run's report, `named` the workbook that the project names: it counts in a folder without
    one. One that nobody changed holds what its run's result holds; of a run after the current one it is read, since
    that knows more: the pointer to the current run was put back. `as_it_stands`: see `read_last_workbook`.

    Raises:
        WorkbookError: it can't be read; see `read_last_workbook`. Or a signed one beside it was never carried on.
    """
    found = _last_workbook(out, before, named, as_it_stands)
    known = (before.valuation if before else None) or NO_INPUTS
    if found is not None:
        _check_certificates(found.inputs.certificates, known.certificates, out.path / WORKBOOK)
        known = found.inputs
    for signed in sorted(out.path.glob(SIGNED_WORKBOOKS)):
        number = signed_number(signed)
        if number is not None and number >= known.number and not as_it_stands:
            raise WorkbookError(
                f"{signed}: is valuation {number}, signed, and the run that is current here doesn't know it: all of it "
                f"would be due again. Was {out.path / CURRENT} put back from a backup? Put that file back as "
                f"{WORKBOOK}, or move it out of this folder if it doesn't count"
            )
    return found


def _check_certificates(read: Sequence[Certificate], known: Sequence[Certificate], path: Path) -> None:
    """Hold the certificates that a workbook lists against those that were read when they were signed.

    Raises:
        WorkbookError: one was written over since.
    """
    was = {one.number: one for one in known}
    for one in read:
        then = was.get(one.number, one)
        if one != then:
            raise WorkbookError(
                f"{path}: says that valuation {one.number} was {_certified(one)}. It was {_certified(then)}. What was "
                f"certified isn't rewritten: put back {path.stem}.signed-<time>.xlsx, or the sheet '{CERTIFICATES}' as "
                "it was, and write what was wrong into the next valuation (an override, with its reason)"
            )


def _certified(one: Certificate) -> str:
    """Write who signed a valuation, when, for which visit, and what it comes to."""
    sums = ", ".join(f"{total.net:,.2f} {total.currency}".strip() for total in one.totals)
    return f"signed by {one.signed_by} on {one.signed_on.isoformat()}, visit of {one.visit.isoformat()}, net {sums}"


def _last_workbook(
    out: OutputFolder, before: ProgressReport | None, named: Path | None, as_it_stands: bool
) -> LastWorkbook | None:
    copy, current = out.path / WORKBOOK, out.current()
    if copy.is_file():
        written = [run for run in (out.path / "runs").iterdir() if (run / WORKBOOK).is_file()]
        same = [run for run in written if filecmp.cmp(copy, run / WORKBOOK, shallow=False)]
        known = current is None or any(age_of(run) <= age_of(current.folder) for run in same)
        if same and known and before is not None:
            return None
        last = read_last_workbook(copy, as_it_stands=as_it_stands)
        return replace(last, digests={**last.digests, "result": current.digest}) if current and last.digests else last
    return read_last_workbook(named) if named is not None and before is None else None


def with_last(report: ProgressReport, last: LastWorkbook) -> ProgressReport:
    """Return a result with what persons wrote into its workbook since."""
    counts = report.valuation is not None and report.valuation.count_observations
    inputs, notes = inputs_of(ValuationFile(observations="count" if counts else "shown"), last, report)
    return with_valuation(report, inputs, notes)


def as_in_workbook(folder: Path, report: ProgressReport) -> ProgressReport:
    """Return a folder's result with the amounts of the workbook there; as it is where nobody changed the workbook.

    Raises:
        WorkbookError: it can't be read, or says another amount than its overrides and rates come to here.
    """
    last = last_workbook(OutputFolder(path=folder), report, as_it_stands=True)
    if last is None:
        return report
    made = with_last(report, last)
    lines = {line.number: line for bill in bills(made) for line in bill.lines}
    for number in sorted(lines.keys() | last.certified.keys()):
        line, says = lines.get(number), last.certified.get(number)
        if line is None or says is None or cents(says) != line.amount:
            item, comes = (line.line.identification, f"{line.amount:,.2f}") if line else (f"no. {number}", "nothing")
            raise WorkbookError(
                f"{folder / WORKBOOK}: item {item}: {'nothing' if says is None else f'{says:,.2f}'} is certified, and "
                f"this run's result with what you wrote comes to {comes}. Let it calculate (Ctrl+Shift+F9) and save "
                "it; if it is of another run, run the project again"
            )
    return made


def inputs_of(
    project: ValuationFile,
    last: LastWorkbook | None,
    before: ProgressReport | None,
    past: Sequence[ProgressReport] = (),
) -> tuple[ValuationInputs, tuple[Note, ...]]:
    """Return what persons bring to the next valuation, and notes: by the last workbook, else by the result before it.

    `past` are results of other runs' folders that the project's history names. The project's terms are the first's.
    Later on they count where they were changed in the project file since, and nobody changed them in the workbook.
    """
    counts = project.observations == "count"
    known = next((one.valuation for one in (before, *reversed(past)) if one is not None and one.valuation), None)
    inputs = known or _first(project)
    if last is not None and last.inputs is not NO_INPUTS:
        inputs = last.inputs
        if known is not None and known.certificates == inputs.certificates:  # nobody signed what stands there now
            inputs = replace(inputs, paid=_as_signed(inputs.paid, known.paid), signed_terms=known.signed_terms)
    own = _first(project).terms
    named = own != Terms()  # a project file that names none takes none back
    if named and known is not None and known.project_terms not in (None, own) and inputs.terms == known.terms:
        inputs = replace(inputs, terms=own)
    notes = (*(last.notes if last is not None else ()), *_terms_kept(project, inputs.terms))
    inputs = replace(inputs, count_observations=counts, project_terms=own)
    return with_what_they_rest_on(inputs, before, last.digests if last is not None else {}), notes


def check_currency(lines: Sequence[CostProgress], inputs: ValuationInputs, files: Sequence[Path]) -> None:
    """Check that what was certified goes on in its own currency: one can't be paid off with another.

    Raises:
        CostError: a line is in another currency than it was certified in, or no line is in one of a bill any more.
    """
    then = {one.bill: currency_of(one.currency) for one in inputs.before}
    paid, now = paid_lines(lines, inputs.paid), {currency_of(line.currency) for line in lines}
    last = f"valuation {inputs.certificates[-1].number}" if inputs.certificates else "the last workbook"
    faults = []
    for line in lines:
        was = then.get(paid[line.global_id].bill, "") if line.global_id in paid else ""
        if was not in ("", currency_of(line.currency)) and paid[line.global_id].amount:
            item, own = line.identification or line.name, line.currency or "no currency"
            faults.append((was, f"item {item} is in {own}, and {last} has it in {was}"))
    certified = [then[one.bill] for one in inputs.before if any((one.work, one.variations, one.retention, one.tax))]
    gone = [one for one in certified if one and one not in now] if lines else []
    faults += [(one, f"no item is in {one} any more, and {last} has amounts in it") for one in gone]
    for was, fault in faults[:1]:
        raise CostError(
            f"{', '.join(map(str, files))}: {fault}. Nothing was written. Write {was} again, and give work in another "
            "currency items of its own; or begin anew in another folder, with --out"
        )


def _as_signed(read: Sequence[Paid], known: Sequence[Paid]) -> tuple[Paid, ...]:
    """Return what was certified, as an unsigned workbook holds it, with the contract and elements that were signed."""
    by_line, keys = {one.line: one for one in known}, {one.line for one in read}
    return tuple(
        replace(
            one,
            contract=then.contract,
            per_design=then.per_design,
            elements=then.elements,
            quantities=then.quantities,
        )
        if (then := by_line.get(one.line)) and _same_work(one, then, f"{one.line}{BEFORE}" in keys)
        else one
        for one in read
    )


def _same_work(one: Paid, then: Paid, replaced: bool) -> bool:
    """Say whether a line's number stands for what it stood for; `replaced`: what it stood for has a row of its own."""
    return one.text == then.text or not (replaced or then.elements.keys().isdisjoint(one.elements))


def _terms_kept(project: ValuationFile, kept: Terms) -> tuple[Note, ...]:
    """Say so where the project file names other terms than the workbook's, which count."""
    own = _first(project).terms
    if own in (kept, Terms()):
        return ()
    return (
        noted(
            Reason.TERMS_KEPT,
            about(SubjectKind.FILE, "project"),
            retention=kept.retention,
            tax=kept.tax,
            project_retention=own.retention,
            project_tax=own.tax,
        ),
    )


def _first(project: ValuationFile) -> ValuationInputs:
    terms = Terms(retention=project.retention_percent / 100.0, tax=project.tax_percent / 100.0)
    return ValuationInputs(terms=terms, project_terms=terms)
