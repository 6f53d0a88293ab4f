"""What a payment rests on is named where it isn't as it was, and nothing else is."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from asbuilt_bim.camera.photo.read import read_photo
from asbuilt_bim.cli import app
from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.flow.output.carried_on import inputs_of, last_workbook
from asbuilt_bim.flow.output.folder import OutputFolder, open_output
from asbuilt_bim.flow.output.publish import places_digest
from asbuilt_bim.flow.output.verify import verify_folder
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.project.file import ValuationFile
from asbuilt_bim.report.result.document import write_result
from asbuilt_bim.report.workbook.write import write_workbook
from asbuilt_bim.storage.regular_file import file_digest
from tests.report.sample_report import sample_report
from tests.report.workbook.saved import typed
from tests.site_fixture import site

NOON = datetime(2026, 3, 18, 12, tzinfo=UTC)


def published(out: OutputFolder, report: ProgressReport, hour: int = 12) -> Path:
    def write(folder: Path) -> None:
        write_result(report, folder / "result.json")
        write_workbook(report, folder / "quantities.xlsx")
        (folder / "report.html").write_text("page")

    return out.publish(write, when=NOON.replace(hour=hour), digest="0" * 8, ifc=["design.ifc"]).folder


@pytest.fixture
def certified(tmp_path: Path) -> Path:
    """Make a folder of two runs: the first was signed, the second carries that on."""
    (tmp_path / "design.ifc").write_bytes(b"design")
    plain = sample_report()
    assert plain.provenance is not None
    made_from = replace(plain.provenance, ifc_digest=file_digest(tmp_path / "design.ifc"), created=NOON.isoformat())
    first = with_valuation(replace(plain, provenance=made_from), inputs_of(ValuationFile(), None, None)[0])
    with open_output(tmp_path / "out") as out:
        (out.path / "design.ifc").write_bytes(b"design")
        published(out, first)
        day = date(2026, 3, 20)
        typed(out.path / "quantities.xlsx", {("", "signed_by"): "A. Surveyor", ("", "signed_on"): day})
        last = last_workbook(out, first)
        inputs, _ = inputs_of(ValuationFile(), last, first)
        published(out, with_valuation(first, inputs), hour=14)
    return tmp_path / "out"


def states(folder: Path, project: Any = None) -> dict[str, str]:
    return {f"{one.kind}: {one.name}": one.state for one in verify_folder(folder, project)}


def test_what_nobody_touched_is_as_it_was(certified: Path) -> None:
    found = states(certified)
    assert set(found.values()) == {"same"}
    assert {"signed workbook: valuation 1", "signed run: valuation 1", "IFC: design.ifc"} < found.keys()
    assert CliRunner().invoke(app, ["verify", str(certified)]).exit_code == 0


def test_a_signed_workbook_is_known_by_its_digest_wherever_it_is_and_gone_once_a_cell_is_another(
    certified: Path,
) -> None:
    (signed,) = certified.glob("quantities.signed-*.xlsx")
    moved = signed.rename(certified / "quantities.signed-by-me.xlsx")
    assert states(certified)["signed workbook: valuation 1"] == "same"
    typed(moved, {("", "signed_by"): "Somebody else"})
    assert states(certified)["signed workbook: valuation 1"] == "gone"
    told = CliRunner().invoke(app, ["verify", str(certified)])
    assert told.exit_code == 1 and "valuation 1: isn't there (SHA-256 " in told.stderr
    assert "What to do: put the file back as it was signed" in told.stdout


def test_a_run_that_was_signed_on_is_gone_once_its_result_is_another(certified: Path) -> None:
    first = min((certified / "runs").glob("2*"))
    result = first / "result.json"
    result.write_bytes(result.read_bytes().replace(b'"sample"', b'"simple"') + b" ")
    assert states(certified)["signed run: valuation 1"] == "gone"


def test_copies_and_the_ifc_file_are_held_against_the_run(certified: Path) -> None:
    (certified / "report.html").write_text("another page")
    (certified / "design.ifc").write_bytes(b"another design")
    typed(certified / "quantities.xlsx", {("", "signed_by"): "A. Surveyor"})
    found = states(certified)
    assert found["copy: report.html"] == found["IFC: design.ifc"] == "other"
    assert found["copy: quantities.xlsx"] == "typed into"
    (certified / "report.html").unlink()
    (certified / "design.ifc").unlink()
    found = states(certified)
    assert found["copy: report.html"] == found["IFC: design.ifc"] == "gone"


def test_a_changed_result_is_no_result_and_a_folder_without_a_run_says_how_to_make_one(
    certified: Path, tmp_path: Path
) -> None:
    last = max((certified / "runs").glob("2*"))
    (last / "result.json").write_bytes(b"{}")
    with pytest.raises(OutputError, match="was changed since its run wrote it"):
        verify_folder(certified)
    with pytest.raises(ResultError, match="holds no run"):
        verify_folder(tmp_path)
    with pytest.raises(ResultError, match="no such folder; name the --out folder of a run"):
        verify_folder(certified / "report.html")


def test_photos_and_survey_are_held_against_what_was_measured(tmp_path: Path) -> None:
    photos = [path for day in sorted((site() / "visits").iterdir()) for path in sorted(day.glob("*_left.*"))][:2]
    here = [Path(shutil.copy(path, tmp_path / path.name)) for path in photos]
    (tmp_path / "markers.csv").write_text("id\n")
    plain = sample_report()
    assert plain.provenance is not None
    station = SimpleNamespace(name="A", left=here[0], right=here[1], side_by_side=False)
    visit = SimpleNamespace(date=plain.visit_date, stations=(station,), videos=())
    project: Any = SimpleNamespace(
        survey=tmp_path / "markers.csv", poses=None, control_points=None, last_workbook=None, visits=(visit,)
    )
    digests = {"left_digest": read_photo(here[0]).digest, "right_digest": read_photo(here[1]).digest}
    report = replace(
        plain,
        stations=tuple(replace(plain.stations[0], name=name, **digests) for name in ("A", "B")),
        provenance=replace(plain.provenance, survey_digest=places_digest(project)),
    )
    with open_output(tmp_path / "out") as out:
        published(out, report)
    day = plain.visit_date.isoformat()
    found = states(tmp_path / "out", project)
    assert (found[f"photos: {day} A"], found[f"photos: {day} B"]) == ("same", "gone")
    assert found["survey: markers.csv"] == "same"
    shutil.copy(here[1], here[0])
    (tmp_path / "markers.csv").write_text("id,corner\n")
    found = states(tmp_path / "out", project)
    assert found[f"photos: {day} A"] == found["survey: markers.csv"] == "other"
    here[0].unlink()
    assert states(tmp_path / "out", project)[f"photos: {day} A"] == "gone"


def test_of_a_workbook_that_another_folder_signed_only_its_own_valuation_has_its_digest(tmp_path: Path) -> None:
    plain = sample_report()
    first = with_valuation(plain, inputs_of(ValuationFile(), None, None)[0])
    for number, day in ((1, 20), (2, 21)):
        with open_output(tmp_path / f"out {number}") as out:
            published(out, first)
            named = {("", "signed_by"): "A. Surveyor", ("", "signed_on"): date(2026, 3, day)}
            typed(out.path / "quantities.xlsx", named)
        last = last_workbook(OutputFolder(path=tmp_path / "elsewhere"), None, out.path / "quantities.xlsx")
        assert last is not None
        first = with_valuation(plain, inputs_of(ValuationFile(), last, None)[0])
    assert first.valuation is not None
    one, two = first.valuation.certificates
    assert one.digests == {} and two.digests == {"workbook": file_digest(tmp_path / "out 2" / "quantities.xlsx")}


def test_a_file_that_cannot_be_read_is_named_and_no_traceback(certified: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def held(path: Path) -> str:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("asbuilt_bim.flow.output.verify.file_digest", held)
    told = CliRunner().invoke(app, ["verify", str(certified)])
    assert told.exit_code == 1 and "quantities" in told.stderr and "can't be read (Permission denied)" in told.stderr
