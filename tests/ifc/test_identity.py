"""What has no GlobalId of its own is named as the file is read: no result could tell of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import ModelBuilder
from tests.notes import the

SIZE = (2.0, 0.2, 3.0)


def design(builder: ModelBuilder, tmp_path: Path) -> BimModel:
    return read_design(builder.write(tmp_path / "ids.ifc"))


def two_walls(builder: ModelBuilder) -> tuple[Any, Any]:
    one, other = (builder.box("IfcWall", name, (0.0, at, 0.0), SIZE) for name, at in (("W1", 0.0), ("W2", 3.0)))
    return one, other


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("", "its GlobalId is empty"),
        ("short", "its GlobalId 'short' (5 characters) is not 22"),
        ("2XQ$n5SLP5MBLyL442paF", "(21 characters)"),
        ("2XQ$n5SLP5MBLyL442paF-", "(22 characters) is not 22 letters, digits, _ or $"),
    ],
)
def test_a_wall_whose_global_id_is_none_is_left_out_and_named(key: str, says: str, tmp_path: Path) -> None:
    builder = ModelBuilder()
    bad, good = two_walls(builder)
    bad.GlobalId = key
    found = design(builder, tmp_path)
    assert [element.name for element in found.elements] == ["W2"]
    words = note_words(the(found.notes, Reason.GLOBAL_ID_INVALID))
    assert words.startswith("left out: IfcWall W1: ") and says in words
    builder.file.remove(good)
    with pytest.raises(DesignError, match="GlobalId invalid: IfcWall, W1"):
        design(builder, tmp_path)


def test_a_wall_without_any_global_id_is_left_out_and_named(tmp_path: Path) -> None:
    builder = ModelBuilder()
    bad, _ = two_walls(builder)
    key = bad.GlobalId
    path = builder.write(tmp_path / "null.ifc")
    path.write_text(path.read_text().replace(f"'{key}'", "$"))
    found = read_design(path)
    assert [element.name for element in found.elements] == ["W2"]
    assert the(found.notes, Reason.GLOBAL_ID_INVALID).values["global_id"] == ""


def test_an_id_whose_first_sign_real_programs_write_though_no_128_bits_have_it_is_one(tmp_path: Path) -> None:
    builder = ModelBuilder()
    one, _ = two_walls(builder)
    one.GlobalId = "Ktln$X5Sr_RTvQ3d6MLJxs"
    found = design(builder, tmp_path)
    assert {element.name for element in found.elements} == {"W1", "W2"} and found.notes == ()


def test_tasks_costs_and_storeys_of_one_id_count_once_and_the_second_is_named(tmp_path: Path) -> None:
    builder = ModelBuilder()
    one, other = two_walls(builder)
    tasks = [builder.task(name, [one]) for name in ("pour", "strike")]
    items = [builder.cost(name, [wall], "IfcQuantityVolume", 1.2, 200.0) for name, wall in (("a", one), ("b", other))]
    for first, second in (tasks, items, builder.levels):
        second.GlobalId = first.GlobalId
    found = design(builder, tmp_path)
    assert [task.name for task in found.tasks] == ["pour"]
    assert [line.name for line in found.cost_lines] == ["a"]
    assert [storey.name for storey in found.storeys] == ["Level 0"]
    twice = [note for note in found.notes if note.code == Reason.GLOBAL_ID_TWICE]
    left_out = {(note.subject.kind, note.values["thing"]) for note in twice}
    kinds = SubjectKind
    assert left_out == {(kinds.TASK, "strike"), (kinds.COST_LINE, "b"), (kinds.STOREY, "Level 1")}


def test_elements_of_a_storey_without_an_id_belong_to_none(tmp_path: Path) -> None:
    builder = ModelBuilder()
    two_walls(builder)
    builder.levels[0].GlobalId = "short"
    found = design(builder, tmp_path)
    assert {element.storey for element in found.elements} == {""}
    assert the(found.notes, Reason.GLOBAL_ID_INVALID).values["thing"] == "Level 0"


def test_elements_of_a_second_storey_of_one_id_do_not_count_in_the_first(tmp_path: Path) -> None:
    builder = ModelBuilder()
    for level in (0, 1):
        builder.box("IfcWall", f"W{level}", (0.0, 0.0, 0.0), SIZE, level=level)
    builder.levels[1].GlobalId = builder.levels[0].GlobalId
    found = design(builder, tmp_path)
    assert {element.name: bool(element.storey) for element in found.elements} == {"W0": True, "W1": False}
    assert the(found.notes, Reason.NO_STOREY).values["count"] == 1
