"""What a surveyor wrote into the workbook of an output folder goes into the next run's workbook and result."""

from __future__ import annotations

from dataclasses import make_dataclass, replace
from datetime import date
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import openpyxl
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CostError, WorkbookError
from asbuilt_bim.flow.output import publish
from asbuilt_bim.flow.output.carried_on import inputs_of, last_workbook
from asbuilt_bim.flow.output.certified_on import certified_runs
from asbuilt_bim.flow.output.folder import OutputFolder
from asbuilt_bim.flow.output.kept import keep_edited
from asbuilt_bim.flow.output.publish import with_persons
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import Terms, ValuationInputs
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.project.file import ValuationFile
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.report.wording.changes import changes
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.workbook.read import LastWorkbook
from asbuilt_bim.report.workbook.write import write_workbook
from benchmarks.valuation.sequences import signed
from tests.progress.valuation.test_contract import exchanged
from tests.report.sample_report import sample_report
from tests.report.workbook.saved import at, run_folder, typed

PROJECT = ValuationFile(retention_percent=5.0, tax_percent=19.0, observations="count")


def folder(path: Path, report: ProgressReport) -> OutputFolder:
    """Make an output folder with one run in it, and the copy of its workbook."""
    run_folder(path, report)
    return OutputFolder(path=path)


def test_a_first_workbook_begins_with_the_projects_terms(tmp_path: Path) -> None:
    inputs, notes = inputs_of(PROJECT, None, None)
    terms = Terms(retention=0.05, tax=0.19)
    assert inputs == ValuationInputs(terms=terms, count_observations=True, project_terms=terms) and notes == ()


def test_terms_written_into_the_project_file_after_a_first_run_count_from_then_on(tmp_path: Path) -> None:
    first, _ = inputs_of(ValuationFile(), None, None)
    before = with_valuation(sample_report(), first)
    inputs, notes = inputs_of(PROJECT, last_workbook(folder(tmp_path, before), before), before)
    assert inputs.terms == Terms(retention=0.05, tax=0.19) and notes == ()


def test_terms_that_a_surveyor_typed_outlast_those_of_a_project_file_that_stays_as_it_is(tmp_path: Path) -> None:
    first, _ = inputs_of(PROJECT, None, None)
    out = folder(tmp_path, before := with_valuation(sample_report(), first))
    typed(tmp_path / "quantities.xlsx", {("", "retention_rate"): 0.0, ("", "tax_rate"): 0.0})
    second, told = inputs_of(PROJECT, last_workbook(out, before), before)
    third, again = inputs_of(PROJECT, None, with_valuation(sample_report(), second))
    assert second.terms == third.terms == Terms() and len(told) == len(again) == 1
    changed = ValuationFile(retention_percent=3.0)
    assert inputs_of(changed, None, with_valuation(sample_report(), third))[0].terms == Terms(retention=0.03, tax=0.0)


def certified(report: ProgressReport) -> ProgressReport:
    return with_valuation(report, signed(with_valuation(report, ValuationInputs())))


def test_a_certificate_outlasts_a_pointer_that_was_put_back_from_before_it(tmp_path: Path) -> None:
    before = with_valuation(sample_report(), ValuationInputs())
    out = folder(tmp_path, before)
    later = tmp_path / "runs" / "20260318T120000Z-00000000"
    later.mkdir()
    write_workbook(certified(sample_report()), later / "quantities.xlsx")
    (tmp_path / "quantities.xlsx").write_bytes((later / "quantities.xlsx").read_bytes())
    last = last_workbook(out, before)
    assert last is not None and [one.number for one in last.inputs.certificates] == [1]


def test_an_older_runs_workbook_takes_no_certificate_from_the_current_run(tmp_path: Path) -> None:
    now = certified(sample_report())
    out = folder(tmp_path, now)
    older = tmp_path / "runs" / "20260301T120000Z-00000000"
    older.mkdir()
    write_workbook(with_valuation(sample_report(), ValuationInputs()), older / "quantities.xlsx")
    (tmp_path / "quantities.xlsx").write_bytes((older / "quantities.xlsx").read_bytes())
    assert last_workbook(out, now) is None  # a run that was cut off before its copies: the result counts


def test_a_signed_workbook_that_nothing_knows_any_more_is_never_due_again(tmp_path: Path) -> None:
    before = with_valuation(sample_report(), ValuationInputs())
    out = folder(tmp_path, before)
    kept = tmp_path / "quantities.signed-20260320T120000Z.xlsx"
    kept.write_bytes((tmp_path / "quantities.xlsx").read_bytes())
    typed(kept, {("", "signed_by"): "A", ("", "signed_on"): date(2026, 3, 20)})
    with pytest.raises(WorkbookError, match="is valuation 1, signed, and the run that is current here doesn't know it"):
        last_workbook(out, before)
    now = certified(sample_report())
    assert last_workbook(folder(tmp_path / "other", now), now) is None
    (tmp_path / "other" / kept.name).write_bytes(kept.read_bytes())
    assert last_workbook(OutputFolder(path=tmp_path / "other"), now) is None  # known: nothing to say


def test_a_workbook_that_nobody_changed_is_what_its_result_says(tmp_path: Path) -> None:
    before = with_valuation(sample_report(), ValuationInputs(terms=Terms(retention=0.1, tax=0.0)))
    assert last_workbook(folder(tmp_path, before), before) is None
    inputs, notes = inputs_of(PROJECT, None, before)
    assert inputs.terms == Terms(retention=0.1, tax=0.0)  # the project's were the first workbook's
    assert [note_words(note) for note in notes] == [
        "retention and tax are the last workbook's, 10 % and 0 %. The project file says 5 % and 19 %: change them on "
        "the sheet Valuation"
    ]
    assert inputs_of(ValuationFile(), None, before)[1] == ()  # a project that says nothing of terms


def test_what_a_surveyor_typed_goes_before_the_result(tmp_path: Path) -> None:
    before = with_valuation(sample_report(), ValuationInputs(terms=Terms(retention=0.1, tax=0.0)))
    out = folder(tmp_path, before)
    copy = tmp_path / "quantities.xlsx"
    typed(copy, {("", "tax_rate"): 0.07, at(copy, "Cost by element", "Override", 5): 0.3})
    last = last_workbook(out, before)
    inputs, _ = inputs_of(PROJECT, last, before)
    assert inputs.terms == Terms(retention=0.1, tax=0.07) and [one.share for one in inputs.overrides] == [0.3]


def test_a_changed_workbook_that_cannot_be_read_stops_the_run(tmp_path: Path) -> None:
    before = with_valuation(sample_report(), ValuationInputs())
    out = folder(tmp_path, before)
    (tmp_path / "quantities.xlsx").write_bytes(b"PK\x03\x04 cut short")
    with pytest.raises(WorkbookError, match="damaged"):
        last_workbook(out, before)


def test_in_another_folder_the_named_workbook_counts_and_else_the_projects_history(tmp_path: Path) -> None:
    done = with_valuation(sample_report(), ValuationInputs())
    write_workbook(done, tmp_path / "last.xlsx")
    typed(tmp_path / "last.xlsx", {("", "signed_by"): "Ann", ("", "signed_on"): date(2026, 3, 20)})
    (tmp_path / "new" / "runs").mkdir(parents=True)
    last = last_workbook(OutputFolder(path=tmp_path / "new"), None, tmp_path / "last.xlsx")
    assert last is not None and last.inputs.number == 2
    past = with_valuation(sample_report(), signed(done))
    inputs, _ = inputs_of(PROJECT, None, None, (past,))
    assert inputs.paid == last.inputs.paid and inputs.number == 2


def test_a_result_keeps_all_that_persons_brought(tmp_path: Path) -> None:
    report = with_valuation(sample_report(), signed(with_valuation(sample_report(), ValuationInputs())))
    write_result(report, tmp_path / "result.json")
    assert read_result(tmp_path / "result.json").valuation == report.valuation


def test_a_workbook_before_there_were_costs_loses_nothing_that_the_result_holds(tmp_path: Path) -> None:
    kept = with_valuation(sample_report(), ValuationInputs(terms=Terms(retention=0.2, tax=0.0)))
    out = folder(tmp_path, replace(kept, cost_lines=()))
    book = openpyxl.load_workbook(tmp_path / "quantities.xlsx")
    book.save(tmp_path / "quantities.xlsx")
    inputs, _ = inputs_of(PROJECT, last_workbook(out, kept), kept)
    assert inputs.terms.retention == 0.2


def test_a_signed_valuation_is_kept_by_that_name_and_a_changed_one_as_edited(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    report = with_valuation(sample_report(), ValuationInputs())
    for who, called in (("Ann", "quantities.signed-"), (None, "quantities.edited-")):
        write_workbook(report, tmp_path / "quantities.xlsx")
        typed(tmp_path / "quantities.xlsx", {("", "signed_by"): who, ("", "retention_rate"): 0.05})
        kept = keep_edited(tmp_path, Path("quantities.xlsx"))
        assert kept is not None and kept.name.startswith(called)


def test_a_project_file_that_no_longer_names_terms_releases_no_retention() -> None:
    first, _ = inputs_of(PROJECT, None, None)
    later, _ = inputs_of(ValuationFile(), None, with_valuation(sample_report(), first))
    assert later.terms == first.terms != Terms()


def in_currency(report: ProgressReport, currency: str, *items: int) -> ProgressReport:
    """Return a report whose cost lines, all or those of some places, are in a currency."""
    lines = enumerate(report.cost_lines)
    return replace(
        report, cost_lines=tuple(replace(x, currency=currency) if i in items or not items else x for i, x in lines)
    )


def test_costs_in_another_currency_than_was_signed_are_refused_by_file_and_both_currencies() -> None:
    first, _ = inputs_of(PROJECT, None, None)
    plain = in_currency(sample_report(), "EUR")
    before = replace(plain, valuation=signed(with_valuation(plain, first)))
    project: Any = SimpleNamespace(valuation=PROJECT, costs=Path("boq.csv"), ifc=())

    def run(report: ProgressReport) -> object:
        return with_persons(SimpleNamespace(reports=(report,), past=(before,)), project, None, None, {})  # type: ignore[arg-type]

    with pytest.raises(CostError, match=r"boq.csv: item .* is in CHF, and valuation 1 has it in EUR\. Nothing was wri"):
        run(in_currency(plain, "CHF"))
    with pytest.raises(CostError, match="is in no currency, and valuation 1 has it in EUR"):
        run(in_currency(plain, ""))
    others = replace(
        plain, cost_lines=(replace(plain.cost_lines[0], global_id="x", identification="x", currency="USD"),)
    )
    with pytest.raises(CostError, match="no item is in EUR any more, and valuation 1 has amounts in it"):
        run(others)


def on_photos(report: ProgressReport, **digests: str) -> ProgressReport:
    """Return a report of stations with these digests of their left photos, and no others."""
    station = report.stations[0]
    return replace(
        report, stations=tuple(replace(station, name=name, left_digest=one) for name, one in digests.items())
    )


def test_a_visit_that_was_certified_and_rests_on_other_photos_now_is_named_until_they_are_put_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(publish, "remapped_ids", lambda before, design: {})
    project: Any = SimpleNamespace(valuation=PROJECT, costs=Path("boq.csv"), ifc=())

    def run(report: ProgressReport, before: ProgressReport | None, last: LastWorkbook | None = None) -> ProgressReport:
        result: Any = make_dataclass("Run", ["reports", "past", "design"])((report,), (), None)
        return with_persons(result, project, before, last, {}).reports[-1]

    def told(report: ProgressReport) -> list[str]:
        return [note_words(note) for note in report.notes if note.code is Reason.CERTIFIED_PHOTOS_CHANGED]

    plain = in_currency(sample_report(), "EUR")
    first = run(on_photos(plain, A="a", B="b", C="c"), None)
    workbook = LastWorkbook(inputs=replace(signed(first), photos={}), notes=(), certified={})
    same = run(on_photos(plain, A="a", B="b", C="c"), first, workbook)
    assert told(same) == []
    changed = run(on_photos(plain, A="a", B="other", D="d"), same)
    (words,) = told(changed)
    day = plain.visit_date.isoformat()
    assert f"Stations no longer used: {day} C; new: {day} D; with other photos: {day} B." in words
    assert told(run(on_photos(plain, A="a", B="other", D="d"), changed)) == [words]
    assert told(run(on_photos(plain, A="a", B="b", C="c"), changed)) == []
    again = LastWorkbook(inputs=replace(signed(changed), photos={}), notes=(), certified={})
    assert told(run(on_photos(plain, A="a", B="other", D="d"), changed, again)) == []


def test_shares_that_a_signed_workbook_calls_certain_and_its_run_does_not_are_named_until_the_next_is_signed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(publish, "remapped_ids", lambda before, design: {})
    project: Any = SimpleNamespace(valuation=PROJECT, costs=Path("boq.csv"), ifc=())

    def run(before: ProgressReport | None, last: LastWorkbook | None = None) -> ProgressReport:
        result: Any = make_dataclass("Run", ["reports", "past", "design"])((plain,), (), None)
        return with_persons(result, project, before, last, {}).reports[-1]

    def told(report: ProgressReport) -> list[str]:
        return [note_words(note) for note in report.notes if note.code is Reason.CERTIFIED_OTHERWISE]

    plain = in_currency(sample_report(), "EUR")
    out = folder(tmp_path, first := run(None))
    book = typed(tmp_path / "quantities.xlsx", {("", "signed_by"): "A", ("", "signed_on"): date(2026, 3, 20)})
    last = last_workbook(out, first)
    assert last is not None and last.certain and told(run(first, last)) == []
    (key, was), *_ = last.certain.items()
    other = replace(last, certain={**last.certain, key: was + 0.25})
    second = run(first, other)
    (words,) = told(second)
    assert "Valuation 1 was signed on other shares than those of the run" in words and book.is_file()
    assert told(run(second)) == [words]
    assert told(run(second, LastWorkbook(inputs=signed(second), notes=(), certified={}))) == []


def test_a_certificate_knows_its_run_from_when_it_is_signed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(publish, "remapped_ids", lambda before, design: {})
    project: Any = SimpleNamespace(valuation=PROJECT, costs=Path("boq.csv"), ifc=())

    def run(before: ProgressReport | None, day: int, last: LastWorkbook | None = None) -> ProgressReport:
        result: Any = make_dataclass("Run", ["reports", "past", "design"])((plain,), (), None)
        found = with_persons(result, project, before, last, {}).reports[-1]
        assert found.provenance is not None
        return replace(found, provenance=replace(found.provenance, created=f"2026-03-{day}T12:00:00+00:00"))

    plain = in_currency(sample_report(), "EUR")
    first = run(None, 10)
    kept, other = Path("runs/20260310T120000Z-abcdef01"), Path("runs/20260320T120000Z-abcdef01")
    assert not certified_runs(first)(kept)
    second = run(first, 20, LastWorkbook(inputs=signed(first), notes=(), certified={}))
    third = run(second, 30)
    assert all(certified_runs(one)(kept) and not certified_runs(one)(other) for one in (second, third))
    torn = [replace(one, run="soon") for one in (third.valuation or ValuationInputs()).certificates]
    assert not certified_runs(replace(third, valuation=ValuationInputs(certificates=tuple(torn))))(kept)


@pytest.mark.parametrize("spelt", ["€", "eur", "Euro"])
def test_retention_and_tax_go_on_however_a_currency_is_spelt_and_whichever_bill_stands_before(spelt: str) -> None:
    first, _ = inputs_of(PROJECT, None, None)
    plain = in_currency(sample_report(), spelt)
    known = signed(with_valuation(plain, first))
    again = in_currency(sample_report(), "EUR")
    franc = replace(again.cost_lines[0], global_id="new", identification="new", currency="CHF")
    again = replace(again, cost_lines=(franc, *again.cost_lines))
    francs, euros = bills(with_valuation(again, known))
    (was,) = bills(with_valuation(plain, first))
    assert (francs.currency, francs.previous.gross, francs.previous.retention) == ("CHF", 0.0, 0.0)
    assert euros.previous == was.cumulative and euros.period.payable == 0.0


def test_a_retention_that_the_project_file_raises_after_a_signature_is_among_the_changes(tmp_path: Path) -> None:
    first, _ = inputs_of(PROJECT, None, None)
    before = with_valuation(sample_report(), first)
    typed(run_folder(tmp_path, before), {("", "signed_by"): "Ann", ("", "signed_on"): date(2026, 3, 20)})
    more = ValuationFile(retention_percent=10.0, tax_percent=19.0, observations="count")
    inputs, _ = inputs_of(more, last_workbook(OutputFolder(path=tmp_path), before), before)
    after = with_valuation(sample_report(), inputs)
    (told,) = [line for line in changes(before, after) if line.startswith("retention")]
    assert told.startswith("retention 5 % -> 10 %: ") and "more is kept back of what was earned before" in told
    (out := tmp_path / "next").mkdir()
    typed(copy := run_folder(out, after), {at(copy, "Cost by element", "Override", 5): 0.3})
    again, _ = inputs_of(more, last_workbook(OutputFolder(path=out), after), after)
    assert again.signed_terms == Terms(retention=0.05, tax=0.19) and again.terms.retention == 0.1


def test_an_unsigned_workbook_gives_exchanged_numbers_nothing_of_the_other_works_contract(tmp_path: Path) -> None:
    report, _ = exchanged()
    typed(copy := run_folder(tmp_path, report), {at(copy, "Cost by element", "Override", 0): 0.3})
    inputs, _ = inputs_of(PROJECT, last_workbook(OutputFolder(path=tmp_path), report), report)
    assert {one.line: (one.text, one.contract, set(one.elements)) for one in inputs.paid} == {
        "costs:1.1": ("Walls", 8.0, {"c", "d"}),
        "costs:1.2": ("Columns", 4.0, {"a", "b"}),
        "costs:1.1 (before)": ("Columns", 0.0, set()),
        "costs:1.2 (before)": ("Walls", 0.0, set()),
    }


def test_files_other_than_those_that_a_valuation_was_signed_on_are_named_until_the_next_is_signed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(publish, "remapped_ids", lambda before, design: {})
    project: Any = SimpleNamespace(valuation=PROJECT, costs=Path("boq.csv"), ifc=())

    def run(before: ProgressReport | None, last: LastWorkbook | None = None, **other: str) -> ProgressReport:
        result: Any = make_dataclass("Run", ["reports", "past", "design"])((plain,), (), None)
        files = {"ifc": "a", "rig": "b", "survey": "c", "options": "d"} | other
        made = with_persons(result, project, before, last, files).reports[-1]
        assert made.provenance is not None
        digests = {f"{name}_digest": one for name, one in files.items()}
        return replace(made, provenance=replace(made.provenance, **digests))

    def told(report: ProgressReport) -> list[str]:
        return [note_words(note) for note in report.notes if note.code is Reason.CERTIFIED_FILES_CHANGED]

    plain = in_currency(sample_report(), "EUR")
    first = run(None)
    same = run(first, LastWorkbook(inputs=signed(first), notes=(), digests={"workbook": "5"}))
    (certificate,) = (same.valuation or ValuationInputs()).certificates
    assert certificate.digests == {"workbook": "5", "ifc": "a", "rig": "b", "survey": "c", "options": "d"}
    assert told(same) == told(run(same)) == []
    other = run(same, survey="x", ifc="y")
    (words,) = told(other)
    assert "Valuation 1 was signed on a run with another IFC file, another survey." in words
    assert told(run(other, survey="x", ifc="y")) == [words]
    assert told(run(other)) == []
    again = LastWorkbook(inputs=signed(other), notes=())
    assert told(run(other, again, survey="x", ifc="y")) == []


def test_a_certificate_that_was_rewritten_in_a_later_workbook_is_refused_with_both(tmp_path: Path) -> None:
    plain = in_currency(sample_report(), "EUR")
    begun = with_valuation(plain, ValuationInputs())
    later = with_valuation(plain, replace(signed(begun), photos={}))
    out = folder(tmp_path, later)
    assert last_workbook(out, later) is None
    (own,) = (later.valuation or ValuationInputs()).certificates
    typed(tmp_path / "quantities.xlsx", {("Certificates", "D5"): own.signed_by})
    last = last_workbook(out, later)
    assert last is not None and last.inputs.certificates == (own,)
    typed(tmp_path / "quantities.xlsx", {("Certificates", "D5"): "Somebody else"})
    with pytest.raises(WorkbookError, match=f"1 was signed by Somebody else on .* It was signed by {own.signed_by} on"):
        last_workbook(out, later)
