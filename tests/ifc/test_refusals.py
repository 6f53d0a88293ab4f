"""Files that are no design are refused by name, with what to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.geometry.bodies import read_bodies
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder
from tests.notes import the


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "empty"),
        (b"dear site office,\nhere is the model", "not an IFC file"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "binary"),
        (b"PK\x03\x04rest of a zip", "archive is damaged"),
        (b"<?xml version='1.0'?><ifcXML/>", "XML"),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=IFCWALL(", "cut short"),
    ],
)
def test_what_is_no_ifc_is_refused_and_named(content: bytes, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "Entwurf größer.ifc"
    path.write_bytes(content)
    with pytest.raises(DesignError, match=expected) as caught:
        read_design(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_named_without_a_word_of_a_project_that_there_may_not_be(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"nowhere\.ifc: there is no such file; check the path"):
        read_design(tmp_path / "nowhere.ifc")


def test_an_unsupported_schema_is_named(tmp_path: Path) -> None:
    path = ModelBuilder(schema="IFC4").write(tmp_path / "old.ifc")
    path.write_bytes(path.read_bytes().replace(b"'IFC4'", b"'IFC2X_FINAL'"))
    with pytest.raises(DesignError, match=r"IFC2X_FINAL.*export it as IFC2X3, IFC4, IFC4X3"):
        read_design(path)


def test_a_file_without_walls_and_columns_is_refused(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcSlab", "S", (0.0, 0.0, 0.0), (2.0, 2.0, 0.2))
    with pytest.raises(DesignError, match="no IfcWall or IfcColumn"):
        read_design(builder.write(tmp_path / "slabs.ifc"))


def test_walls_without_any_body_are_refused(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.bare("IfcWall", "ghost")
    with pytest.raises(DesignError, match=r"ghost.*export it with its geometry"):
        read_design(builder.write(tmp_path / "ghost.ifc"))


def test_two_elements_with_one_global_id_are_refused(tmp_path: Path) -> None:
    builder = ModelBuilder()
    first = builder.box("IfcWall", "one", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    second = builder.box("IfcWall", "two", (5.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    path = builder.write(tmp_path / "twins.ifc")
    path.write_text(path.read_text().replace(second.GlobalId, first.GlobalId))
    with pytest.raises(DesignError, match=r"one.*two.*couldn't be told apart"):
        read_design(path)


def test_a_scope_that_matches_nothing_or_cannot_be_read_is_named(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    path = builder.write(tmp_path / "w.ifc")
    with pytest.raises(DesignError, match="in the scope 'IfcColumn'; widen it"):
        read_design(path, scope="IfcColumn")
    with pytest.raises(DesignError, match="can't be read"):
        read_design(path, scope="IfcWall, (((")


def test_a_wall_of_three_kilometres_is_noted_as_a_wrong_unit(tmp_path: Path) -> None:
    builder = ModelBuilder(millimetres=False)
    builder.box("IfcWall", "mm", (0.0, 0.0, 0.0), (3000.0, 200.0, 2500.0))
    builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    notes = read_design(builder.write(tmp_path / "unit.ifc")).notes
    assert the(notes, Reason.ELEMENT_TOO_LONG).values["length_m"] == pytest.approx(3000.0)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("IFCBUILDINGSTOREY(", "IFCBUILDINGSTOREY($,$,$,$,$,$,$,$,$,$);\n#9999=IFCBUILDINGSTOREY("),
        ("IFCLOCALPLACEMENT(#", "IFCLOCALPLACEMENT($);\n#9998=IFCLOCALPLACEMENT(#"),
        ("IFCAXIS2PLACEMENT3D(#", "IFCAXIS2PLACEMENT3D('x',#"),
    ],
)
def test_a_damaged_file_is_refused_or_read_but_never_ends_in_a_trace(before: str, after: str, tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    path = builder.write(tmp_path / "damaged.ifc")
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))
    try:
        assert read_design(path).elements
    except DesignError as error:
        assert str(path) in str(error)


@pytest.mark.parametrize(
    ("schema", "says"),
    [
        ("('" + "A" * 400 + "')", "FILE_SCHEMA is a name of 400 characters, limit 64"),
        ("(/* plain */ '" + "A" * 400 + "')", "FILE_SCHEMA is a name of 400 characters, limit 64"),
        ("('IFC4', '" + "A" * 400 + "')", "FILE_SCHEMA is a name of 400 characters, limit 64"),
        ("('IFC4')); FILE_DESCRIPTION(('" + "A" * 1_000_000 + "'", "its header doesn't end within 1 MB"),
        ("(12)", "FILE_SCHEMA is no list of names"),
        ("'IFC4'", "FILE_SCHEMA is no list of names"),
        ("('IFC9')", "schema IFC9 or damaged"),
    ],
)
def test_a_header_that_ends_ifcopenshells_process_is_refused_before_it_is_opened(
    schema: str, says: str, tmp_path: Path
) -> None:
    path = ModelBuilder().write(tmp_path / "header.ifc")
    text = path.read_text()
    assert "FILE_SCHEMA(('IFC4'))" in text
    path.write_text(text.replace("FILE_SCHEMA(('IFC4'))", f"/* FILE_SCHEMA(('IFC4')); */ FILE_SCHEMA ({schema})"))
    with pytest.raises(DesignError, match=says):
        read_design(path)


def test_a_schema_named_in_a_string_of_the_header_is_not_the_files(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    path = builder.write(tmp_path / "header.ifc")
    author = r"it''s \S\' FILE_SCHEMA(12); ENDSEC;"
    path.write_text(path.read_text().replace("FILE_NAME('", f"FILE_NAME('{author}", 1))
    assert read_design(path).schema == "IFC4"


@pytest.mark.parametrize(
    ("prefix", "says"),
    [
        ("KILO", "mostly 4000000 m long or more (limit 1000 m). Its unit of length is 1000 m"),
        (None, "mostly 4000 m long or more (limit 1000 m). Its unit of length is 1 m"),
        ("EXA", "its unit of length is 1e+18 m (limits 1e-06 and 10000 m)"),
    ],
)
def test_a_unit_that_makes_walls_of_kilometres_is_refused_before_their_geometry_is_made(
    prefix: str | None, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    builder = ModelBuilder()
    for number in range(3):
        wall = builder.box("IfcWall", f"W{number}", (0.0, 5.0 * number, 0.0), (4.0, 0.2, 3.0))
        builder.opening(wall, (1.0, 0.0, 1.0), (1.0, 0.2, 1.0))
    builder.file.by_type("IfcSIUnit")[0].Prefix = prefix

    def drawn(file: Any, products: Sequence[Any], scale: float, *, uncut: bool = False, **more: Any) -> Any:
        assert uncut, "the geometry was made"  # the few that are looked at first are drawn without their openings
        return read_bodies(file, products, scale, uncut=True, **more)

    monkeypatch.setattr("asbuilt_bim.ifc.read.elements.read_bodies", drawn)
    with pytest.raises(DesignError) as caught:
        read_design(builder.write(tmp_path / "unit.ifc"))
    assert says in str(caught.value)


def test_one_wall_beyond_all_places_is_left_out_and_the_others_count(tmp_path: Path) -> None:
    builder = ModelBuilder()
    for number, size_m in enumerate((4.0, 4.0, 1e200)):
        builder.box("IfcWall", f"W{number}", (0.0, 5.0 * number, 0.0), (size_m, 0.2, 3.0))
    found = read_design(builder.write(tmp_path / "far.ifc"))
    assert [element.name for element in found.elements] == ["W0", "W1"]
    (label,) = the(found.notes, Reason.NO_BODY).values["elements"]  # type: ignore[misc]
    assert "W2" in str(label)
