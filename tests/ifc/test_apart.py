"""IFC files are read and written in a process of its own, whose end is a refusal by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc import apart
from asbuilt_bim.ifc.read import design
from asbuilt_bim.ifc.write.strip import strip
from asbuilt_bim.scale.apart import Ended, run_apart
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on


@pytest.fixture(autouse=True)
def really_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "run_apart", run_apart)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    builder.opening(wall, (0.5, 0.0, 0.5), (1.0, 0.2, 1.0))
    builder.box("IfcColumn", "C", (3.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    return builder.write(tmp_path / "model.ifc")


def test_a_design_that_is_read_apart_is_the_same_to_the_last_bit(model: Path) -> None:
    here, there = design.read_design(model), apart.read_design(model)
    assert here.file_digest == there.file_digest
    for one, other in zip(here.elements, there.elements, strict=True):
        assert one.vertices_m.tobytes() == other.vertices_m.tobytes()
        assert [face.face_id for face in one.faces] == [face.face_id for face in other.faces]
        assert [face.exposed_area_m2 for face in one.faces] == [face.exposed_area_m2 for face in other.faces]
    assert not np.shares_memory(here.elements[0].vertices_m, there.elements[0].vertices_m)


def test_a_copy_that_is_written_apart_is_the_same_and_can_be_stripped_apart(model: Path, tmp_path: Path) -> None:
    report = report_on(design.read_design(model), {"W": 1.0, "C": 0.5})
    (copy,) = apart.write_copies([model], report, tmp_path / "out")
    apart.write_asbuilt(model, report, tmp_path / "alone.ifc")
    assert copy.name == "model.asbuilt.ifc"
    assert (tmp_path / "alone.ifc").read_bytes().count(b"IFC") == copy.read_bytes().count(b"IFC")
    assert apart.strip_asbuilt(copy, tmp_path / "plain.ifc") > 0
    assert strip(design.open_ifc(tmp_path / "plain.ifc")) == 0


def test_a_refusal_apart_reads_as_the_refusal_here(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"nowhere\.ifc: there is no such file; check the path"):
        apart.read_design(tmp_path / "nowhere.ifc")
    with pytest.raises(DesignError, match=r"nowhere\.ifc: there is no such file; check the path"):
        apart.inspect_file(tmp_path / "nowhere.ifc")


@pytest.mark.parametrize(
    ("ended", "says"),
    [
        (Ended(why="died", detail="SIGSEGV"), r"model\.ifc: it crashed the IFC library \(SIGSEGV\).*export it again"),
        (Ended(why="time", detail="more than 20 s of processor time"), r"took more than 20 s .*ASBUILT_BIM_LIMITS=4"),
        (Ended(why="memory", detail="more than 1.5 GB of memory"), r"took more than 1\.5 GB of memory, far more"),
    ],
)
def test_a_process_that_ended_is_a_refusal_by_name(
    ended: Ended, says: str, model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def end(*arguments: Any, **limits: Any) -> Ended:
        return ended

    monkeypatch.setattr(apart, "run_apart", end)
    with pytest.raises(DesignError, match=says):
        apart.read_design(model)


def test_larger_files_may_take_longer_and_more_memory(tmp_path: Path) -> None:
    small, large = tmp_path / "small.ifc", tmp_path / "large.ifc"
    small.write_bytes(b"x")
    large.write_bytes(bytes(3_000_000))
    assert apart.limits_of([large]).seconds > 5 * apart.limits_of([small]).seconds
    assert apart.limits_of([large, large]).memory_bytes > apart.limits_of([large]).memory_bytes
    assert apart.limits_of([tmp_path, tmp_path / "missing.ifc"]) == apart.limits_of([])
