"""Faces of elements that nobody has seen are written once and short, and read back as they were."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.options import Options
from asbuilt_bim.report.result.convert import report_to_plain
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.storage.schemas import first_faults
from tests.ifc.models import ModelBuilder
from tests.report.sample_report import sample_report

FIRST, SECOND = date(2026, 3, 2), date(2026, 3, 16)


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> list[ProgressReport]:
    """Two visits that see nothing of four walls; the second one's outlines begin at other corners."""
    builder = ModelBuilder()
    for number in range(4):
        builder.box("IfcWall", f"W{number}", (0.0, 3.0 * number, 0.0), (5.0, 0.2, 3.0))
    builder.box("IfcSlab", "S", (0.0, 0.2, 1.0), (5.0, 2.8, 0.2))
    design = read_design(builder.write(tmp_path_factory.mktemp("unseen") / "model.ifc"))
    first = monitor((), (), (), design, EMPTY_HISTORY, FIRST, Options())
    return [first, monitor((), (), (), design, remember(EMPTY_HISTORY, first), SECOND, Options())]


@pytest.mark.parametrize("visit", [0, 1])
def test_unseen_faces_are_written_without_a_state_and_read_back(
    reports: list[ProgressReport], visit: int, tmp_path: Path
) -> None:
    write_result(reports[visit], tmp_path / "result.json")
    document = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert (len(document["faces"]), len(document["unseen_faces"])) == (0, 16)
    assert not any("surface" in face for face in document["unseen_faces"])
    assert first_faults("result-1", document) == []
    assert report_to_plain(read_result(tmp_path / "result.json")) == report_to_plain(reports[visit])


def test_seen_and_unseen_faces_come_back_in_the_order_of_the_elements(
    reports: list[ProgressReport], tmp_path: Path
) -> None:
    one = reports[0]
    element = one.elements[1].global_id
    faces = tuple(
        replace(face, surface=replace(face.surface, open_area_m2=0.5)) if face.element == element else face
        for face in one.faces
    )
    write_result(replace(one, faces=faces), tmp_path / "result.json")
    document = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert {face["element"] for face in document["faces"]} == {element}
    again = read_result(tmp_path / "result.json")
    assert [face.face_id for face in again.faces] == [face.face_id for face in one.faces]
    assert [face.surface.open_area_m2 for face in again.faces if face.element == element] == [0.5] * 4


def test_results_without_the_key_are_read_as_before(tmp_path: Path) -> None:
    write_result(sample_report(), tmp_path / "result.json")
    document = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    before = {key: value for key, value in document.items() if key != "unseen_faces"} | {"minor": 6}
    (tmp_path / "before.json").write_text(json.dumps(before), encoding="utf-8")
    plain = report_to_plain(read_result(tmp_path / "before.json"))
    assert plain["elements"] == report_to_plain(sample_report())["elements"]
