"""Elements that nobody has seen are written short, and read back as they were."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.geometry import polygon
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.globalid_remap import remapped_ids
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.revision import design_changes
from asbuilt_bim.project.options import Options
from asbuilt_bim.report.result.convert import report_to_plain
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.storage.schemas import first_fault
from tests.ifc.models import ModelBuilder
from tests.report.sample_report import sample_report

SHORT = {"id", "role", "frame_m", "area_m2", "exposed_uv_m"}
SHORT_AND_CUT = SHORT | {"exposed_area_m2"}
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


def written(report: ProgressReport, folder: Path) -> dict[str, Any]:
    """Write a result and return what its file holds."""
    write_result(report, folder / "result.json")
    document: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return document


@pytest.mark.parametrize("visit", [0, 1])
def test_unseen_faces_are_written_without_a_state_and_read_back(
    reports: list[ProgressReport], visit: int, tmp_path: Path
) -> None:
    document = written(reports[visit], tmp_path)
    assert (document["faces"], document["unobserved"], len(document["unseen"])) == ([], [], 4)
    assert [set(face) for face in document["unseen"][0]["faces"]] == [SHORT, SHORT_AND_CUT, SHORT, SHORT]
    assert first_fault("result-1", document) == ""
    again = read_result(tmp_path / "result.json")
    before, after = report_to_plain(reports[visit]), report_to_plain(again)
    assert {key for key in before if before[key] != after[key]} <= {"faces"}  # to the last digit but for their frames
    assert [face["surface"].keys() for face in after["faces"]] == [face["surface"].keys() for face in before["faces"]]
    assert written(again, tmp_path) == document


def test_an_unseen_element_has_no_key_that_says_nothing(reports: list[ProgressReport], tmp_path: Path) -> None:
    first, *others = reports[0].elements
    known = replace(first, first_built=FIRST, type_name="W200")
    elements = written(replace(reports[0], elements=(known, *others)), tmp_path)["elements"]
    assert elements[0].keys() - elements[1].keys() == {"first_built", "type_name"}
    assert "complete_on" not in elements[0] and "as_built_area_m2" in elements[0]
    again = read_result(tmp_path / "result.json").elements
    assert (again[0].first_built, again[0].type_name, again[1].first_built) == (FIRST, "W200", None)


@pytest.fixture(scope="module")
def round_one(tmp_path_factory: pytest.TempPathFactory) -> tuple[BimModel, ProgressReport]:
    """A round column and a wall, turned in the world, of which nothing is seen."""
    builder = ModelBuilder()
    builder.cylinder("C", (7.123456789, -3.0, 0.0), 0.2, 3.0)
    builder.box("IfcWall", "W", (1.0 / 3.0, 2.0 / 7.0, 0.0), (5.0, 0.2, 3.0), turn_deg=17.0)
    design = read_design(builder.write(tmp_path_factory.mktemp("round") / "model.ifc"))
    return design, monitor((), (), (), design, EMPTY_HISTORY, FIRST, Options())


def test_the_ring_of_an_unseen_round_column_has_its_corners_alone_and_covers_the_same(
    round_one: tuple[BimModel, ProgressReport], tmp_path: Path
) -> None:
    _, report = round_one
    document = written(report, tmp_path)
    rings = {e["element"]: [r for f in e["faces"] for p in f["exposed_uv_m"] for r in p] for e in document["unseen"]}
    column = next(e.global_id for e in report.elements if e.kind == "column")
    assert [len(ring) for ring in rings[column]] == [4]
    for was, now in zip(report.faces, read_result(tmp_path / "result.json").faces, strict=True):
        assert polygon.area(now.exposed_uv_m) == pytest.approx(polygon.area(was.exposed_uv_m), abs=1e-4)
        assert (now.kind, now.role, now.face_id) == (was.kind, was.role, was.face_id)
        np.testing.assert_allclose(now.frame_m, was.frame_m, atol=1e-6)
        assert now.radius_m == pytest.approx(was.radius_m, abs=1e-6)


def test_an_unseen_element_is_known_again_by_where_it_stands(
    round_one: tuple[BimModel, ProgressReport], tmp_path: Path
) -> None:
    design, report = round_one
    written(report, tmp_path)
    before = read_result(tmp_path / "result.json")
    changes = design_changes(before, report)
    assert (changes.gone, changes.new, changes.reshaped, changes.moved) == ((), (), (), ())
    others = {e.global_id: f"{e.global_id[:-2]}zz" for e in design.elements}
    exported = replace(design, elements=tuple(_named(e, others[e.global_id]) for e in design.elements))
    assert remapped_ids(before, exported) == others


def _named(element: BimElement, global_id: str) -> BimElement:
    faces = tuple(replace(face, element=global_id) for face in element.faces)
    return replace(element, global_id=global_id, faces=faces)


def test_unseen_faces_of_versions_1_7_to_1_10_are_read(reports: list[ProgressReport], tmp_path: Path) -> None:
    plain = report_to_plain(reports[1])
    former = [
        {key: value for key, value in face.items() if key != "surface"}
        | {"unknown_uv_m": face["surface"]["unknown_uv_m"]}
        for face in plain["faces"]
    ]
    head = {"format": "asbuilt-bim/result", "version": 1, "minor": 10}
    document = {**head, **plain, "faces": [], "unseen_faces": former}
    (tmp_path / "before.json").write_text(json.dumps(document), encoding="utf-8")
    assert report_to_plain(read_result(tmp_path / "before.json")) == plain


def test_seen_and_unseen_faces_come_back_in_the_order_of_the_elements(
    reports: list[ProgressReport], tmp_path: Path
) -> None:
    one = reports[0]
    element = one.elements[1].global_id
    faces = tuple(
        replace(face, surface=replace(face.surface, open_area_m2=0.5)) if face.element == element else face
        for face in one.faces
    )
    document = written(replace(one, faces=faces), tmp_path)
    assert {face["element"] for face in document["faces"]} == {element}
    again = read_result(tmp_path / "result.json")
    assert [face.face_id for face in again.faces] == [face.face_id for face in one.faces]
    assert again.unobserved == one.unobserved
    assert [face.surface.open_area_m2 for face in again.faces if face.element == element] == [0.5] * 4


def test_results_without_the_key_are_read_as_before(tmp_path: Path) -> None:
    document = written(sample_report(), tmp_path)
    before = {key: value for key, value in document.items() if key != "unseen"} | {"minor": 6}
    (tmp_path / "before.json").write_text(json.dumps(before), encoding="utf-8")
    plain = report_to_plain(read_result(tmp_path / "before.json"))
    assert plain["elements"] == report_to_plain(sample_report())["elements"]
