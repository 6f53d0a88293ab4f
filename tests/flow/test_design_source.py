"""The design is read once: from the cache for as long as its files, its scope and the code stay as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.errors import DesignError
from asbuilt_bim.flow import design_source
from asbuilt_bim.flow.design_source import design_of
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.scale.codec import plain_digest
from tests.ifc.models import ModelBuilder
from tests.site_fixture import contents, site


def _project(tmp_path: Path) -> Project:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (5.0, 0.2, 3.0))
    builder.cylinder("C", (8.0, 0.0, 0.0), 0.2, 3.0)
    path = builder.write(tmp_path / "model.ifc")
    return replace(read_project(site() / "project.yaml"), ifc=(path,), scope=None)


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Return a list that grows with each design that is really read."""
    found: list[object] = []

    def counted(*asked: object) -> BimModel:
        found.append(asked)
        return read_design(*asked)  # type: ignore[arg-type]

    monkeypatch.setattr(design_source, "read_design", counted)
    return found


def test_a_design_is_read_once_and_comes_back_as_it_was(tmp_path: Path, reads: list[object]) -> None:
    project, cache = _project(tmp_path), Cache(folder=tmp_path / "cache")
    first, again = design_of(project, cache), design_of(project, cache)
    assert len(reads) == 1
    assert plain_digest(first, BimModel) == plain_digest(again, BimModel)


def test_another_scope_another_name_and_another_file_are_read_anew(tmp_path: Path, reads: list[object]) -> None:
    project, cache = _project(tmp_path), Cache(folder=tmp_path / "cache")
    design_of(project, cache)
    assert len(design_of(replace(project, scope="IfcWall"), cache).elements) == 1
    assert len(reads) == 2
    renamed = tmp_path / "renamed.ifc"
    renamed.write_bytes(project.ifc[0].read_bytes())
    assert design_of(replace(project, ifc=(renamed,)), cache).file_name == "renamed.ifc"
    assert len(reads) == 3
    project.ifc[0].write_bytes(project.ifc[0].read_bytes() + b"\n")
    design_of(project, cache)
    assert len(reads) == 4


def test_other_code_reads_it_anew(tmp_path: Path, reads: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    project, cache = _project(tmp_path), Cache(folder=tmp_path / "cache")
    design_of(project, cache)
    monkeypatch.setattr(design_source, "reading_code_digest", lambda: "other")
    design_of(project, cache)
    assert len(reads) == 2


def test_a_design_that_is_refused_is_refused_each_time(tmp_path: Path, reads: list[object]) -> None:
    project, cache = _project(tmp_path), Cache(folder=tmp_path / "cache")
    project.ifc[0].write_text("nothing of the kind")
    for _ in range(2):
        with pytest.raises(DesignError, match="not an IFC file"):
            design_of(project, cache)
    assert len(reads) == 2


def test_the_samples_design_with_its_plan_comes_back_exactly(tmp_path: Path) -> None:
    project = replace(read_project(site() / "project.yaml"), ifc=(site() / contents()["ifc"],))
    cache = Cache(folder=tmp_path)
    first, again = design_of(project, cache), design_of(project, cache)
    assert again.tasks == first.tasks
    assert again.cost_lines == first.cost_lines
    assert again.notes == first.notes
    assert plain_digest(first, BimModel) == plain_digest(again, BimModel)
