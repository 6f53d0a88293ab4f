"""What a run folder holds: visits carried over from earlier runs, and `report` writes what `run` wrote."""

from __future__ import annotations

import errno
import shutil
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output import publish
from asbuilt_bim.flow.output.folder import open_output
from asbuilt_bim.flow.output.places import CHANGES
from asbuilt_bim.flow.output.publish import (
    previous_result,
    provenance,
    publish_again,
    publish_run,
    with_other_program,
    with_visits_gone,
)
from asbuilt_bim.flow.pipeline import RunResult
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.version import __version__
from tests.camera.rig_formats.test_rig_file import full_rig
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on
from tests.report.sample_report import sample_report
from tests.site_fixture import site

NOON = datetime(2026, 3, 17, 12, 0, tzinfo=UTC)
EARLIER, TODAY = date(2026, 3, 2), date(2026, 3, 16)


@pytest.fixture
def project(tmp_path: Path) -> Project:
    made = read_project(site() / "project.yaml")
    builder = ModelBuilder(schema="IFC4X3")
    builder.box("IfcColumn", "full", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.box("IfcColumn", "third", (3.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    return replace(made, ifc=(builder.write(tmp_path / "small.ifc"),))


def _result(project: Project) -> RunResult:
    design = read_design(project.ifc)
    station = sample_report().stations[0]

    def visit(day: date, third: float | None) -> ProgressReport:
        report = report_on(design, {"full": 1.0, "third": third})
        since = {"complete": EARLIER}
        seen = tuple(
            replace(e, last_seen=day, stations=("A1",), complete_on=since.get(e.state)) for e in report.elements
        )
        return replace(
            report, visit_date=day, elements=seen, stations=(replace(station, name="A1", day=day, faces=()),)
        )

    return RunResult(
        rig=full_rig(), calibration=None, design=design, reports=(visit(TODAY, 1.0 / 3.0),),
        pictures={}, seconds={}, from_cache=0, past=(visit(EARLIER, None),),
    )  # fmt: skip


def test_the_ifc_copy_tells_the_visits_carried_over_and_report_writes_what_run_wrote(
    project: Project, tmp_path: Path
) -> None:
    with open_output(tmp_path / "out", project.sources) as out:
        first = publish_run(out, _result(project), project, NOON)
        again = publish_again(out, (), NOON)
    copies = [ifcopenshell.open(str(one.folder / "small.asbuilt.ifc")) for one in (first, again)]
    lines = [[str(entity) for entity in file] for file in copies]
    assert lines[0] == lines[1]
    (full,) = [one for one in copies[0].by_type("IfcColumn") if one.Name == "full"]
    (history,) = [r.RelatingControl for r in full.HasAssignments if r.is_a("IfcRelAssignsToControl")]
    (series, *_) = history.IsDefinedBy[0].RelatingPropertyDefinition.HasProperties
    assert len(series.PropertyReference.Values) == 2
    installed = ifcopenshell.util.element.get_psets(full)["Pset_ConstructionOccurence"]["InstallationDate"]
    assert installed == EARLIER.isoformat()
    photos = {one.Name: one.Location for one in copies[0].by_type("IfcDocumentReference") if one.Identification}
    assert photos == {f"{EARLIER} A1": None, f"{TODAY} A1": f"overlays/{TODAY}_A1.jpg"}


def test_making_outputs_again_on_a_full_disk_is_said_in_one_line(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(source: Path, target: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(target))

    with open_output(tmp_path / "out", project.sources) as out:
        publish_run(out, _result(project), project, NOON)
        monkeypatch.setattr(shutil, "copyfile", full)
        monkeypatch.setattr(shutil, "copy2", full)
        with pytest.raises(OutputError, match=r"^\S+: the disk is full; nothing of this run was kept"):
            publish_again(out, (), NOON)


def test_what_a_person_accepts_is_in_the_digest_of_the_options(project: Project) -> None:
    result, accepted = _result(project), replace(project, accept_moved=("0abc",))
    plain, other = (provenance(result, one, NOON).options_digest for one in (project, accepted))
    assert plain != other == provenance(result, accepted, NOON).options_digest


def test_visits_that_the_last_run_counted_and_this_one_lacks_are_told_the_later_ones_too(project: Project) -> None:
    result = _result(project)
    alone = replace(result.reports[-1], earlier_visits=())
    later = replace(alone, visit_date=date(2026, 4, 1), earlier_visits=(EARLIER, TODAY))
    told = with_visits_gone(replace(result, reports=(alone,)), later).reports[-1].notes
    (note,) = [one for one in told if one.code is Reason.VISITS_GONE]
    assert note.values["visits"] == (EARLIER.isoformat(), "2026-04-01")
    kept = replace(later, notes=())
    assert with_visits_gone(replace(result, reports=(kept,)), later).reports == (kept,)
    assert with_visits_gone(replace(result, reports=(alone,)), None).reports == (alone,)


def test_a_run_after_one_by_another_program_says_so_in_its_changes_and_on_its_page_and_one_by_the_same_does_not(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = _result(project)
    with open_output(tmp_path / "out", project.sources) as out:
        publish_run(out, result, project, NOON)
        before = previous_result(out)
        assert before is not None and before.provenance is not None
        assert with_other_program(result, before) is result
        digest = before.provenance.program_digest
        monkeypatch.setattr(publish, "program_digest", lambda: "0" * 64)
        folder = publish_run(out, with_other_program(result, before), project, NOON).folder
    said = f"The last run was made by another version of the program ({__version__}, {digest[:8]}): what changed may "
    for name in (CHANGES, "report.html"):
        assert said in (folder / name).read_text(encoding="utf-8")


def test_a_result_of_before_programs_were_told_apart_is_another_programs_also_under_history(project: Project) -> None:
    result = _result(project)
    (carried,) = result.past
    old = replace(carried, provenance=publish.provenance(result, project, NOON))
    assert old.provenance is not None
    old = replace(old, provenance=replace(old.provenance, program_version="0.3.0", program_digest=""))
    for one, before in ((result, old), (replace(result, past=(old,)), None)):
        (note, *_) = with_other_program(one, before).reports[-1].notes
        assert note.code is Reason.OTHER_PROGRAM and note.values["program"] == "0.3.0"
    assert with_other_program(replace(result, past=()), None).reports == result.reports


def test_a_run_keeps_its_project_file_and_tables_as_they_were_and_no_photo(tmp_path: Path) -> None:
    for name in ("project.yaml", "markers.csv", "costs/boq.csv", "plan/boq.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    tables = {"poses": None, "control_points": None, "people": None, "observations": tmp_path / "gone.csv"}
    project: Any = SimpleNamespace(
        path=tmp_path / "project.yaml", survey=tmp_path / "markers.csv", costs=tmp_path / "costs/boq.csv",
        schedule=tmp_path / "plan/boq.csv", **tables,
    )  # fmt: skip
    publish._keep_inputs(project, tmp_path / "inputs")
    kept = {file.name: file.read_text() for file in (tmp_path / "inputs").iterdir()}
    assert kept == {
        "project.yaml": "project.yaml", "markers.csv": "markers.csv", "boq.csv": "costs/boq.csv",
        "2 boq.csv": "plan/boq.csv",
    }  # fmt: skip
