"""A project file's mistakes are named at once: the wrong keys, and what is wrong with the rest."""

from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.project.read import read_project

WHOLE = """format: asbuilt-bim/project
version: 1
name: Site
ifc: design.ifc
rig: {file: rig.yaml}
markers: {survey: markers.csv, size_m: 0.25}
visits:
  - date: 2026-03-02
    stations:
      - {name: A1, left: A1_left.jpg, right: A1_right.jpg}
      - {name: A2, left: A2_left.jpg, right: A2_right.jpg}
      - {name: A3, left: A3_left.jpg, right: A3_right.jpg}
"""


def named(folder: Path, *changes: tuple[str, str]) -> list[str]:
    text = WHOLE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    for name in ("design.ifc", "rig.yaml", "markers.csv"):
        (folder / name).touch()
    path = folder / "project.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ProjectError) as caught:
        read_project(path)
    return [row.strip() for row in str(caught.value).splitlines()[1:]]


def test_a_wrong_key_hides_no_missing_file_and_no_station_that_is_there_twice(tmp_path: Path) -> None:
    rows = named(tmp_path, ("name: Site", "nmae: Site"), ("design.ifc", "desing.ifc"), ("name: A3", "name: A2"))
    assert rows == [
        "line 3: nmae: unknown key; did you mean name?",
        "line 4: ifc: there is no desing.ifc (design.ifc lies there: is it that?)",
        "line 12: visits[0].stations[2].name: 'A2' is the name of visits[0].stations[1] too; names are unique"
        "; that is visit 1, station 3",
    ]


def test_a_wrong_value_that_something_else_cannot_be_without_hides_no_missing_file(tmp_path: Path) -> None:
    boards = (
        'boards: {kind: charuco, columns: 9, rows: 7, square_m: 80, marker_m: 0.06, left: "l*.jpg", right: "r*.jpg"}'
    )
    rows = named(tmp_path, ("file: rig.yaml", boards), ("design.ifc", "desing.ifc"))
    assert rows[0] == "line 4: ifc: there is no desing.ifc (design.ifc lies there: is it that?)"
    assert rows[1].startswith("line 5: rig.boards.square_m: expected 0.002 to 1 m")


def test_places_are_those_of_the_file_also_after_a_station_that_cannot_be_read(tmp_path: Path) -> None:
    rows = named(tmp_path, ("left: A1_left", "lft: A1_left"), ("name: A3", "name: A2"))
    assert rows[0].startswith("line 10: visits[0].stations[0].lft: unknown key")
    assert rows[1:] == [
        "line 12: visits[0].stations[2].name: 'A2' is the name of visits[0].stations[1] too; names are unique"
        "; that is visit 1, station 3"
    ]


def test_files_of_a_part_that_cannot_be_read_are_looked_for_all_the_same(tmp_path: Path) -> None:
    rows = named(tmp_path, ("survey: markers.csv, size_m", "survey: marker.csv, sise_m"))
    assert rows == [
        "line 6: markers.sise_m: unknown key; did you mean size_m?",
        "line 6: markers.survey: there is no marker.csv (markers.csv lies there: is it that?)",
    ]


@pytest.mark.parametrize(
    "change",
    [
        ("rig: {file: rig.yaml}", "rig: {fiel: rig.yaml}"),
        ("markers: {survey", "markrs: {survey"),
        ("ifc: design.ifc", "ifk: design.ifc"),
        ("visits:", "visit:"),
        ("version: 1", "version: 2"),
    ],
)
def test_nothing_is_said_of_what_only_follows_from_a_mistake(tmp_path: Path, change: tuple[str, str]) -> None:
    rows = named(tmp_path, change)
    key = change[1].partition(":")[0]
    assert 1 <= len(rows) <= 2 and any(key in row for row in rows)
    assert not any("is empty" in row or "is placed" in row or "there is no" in row for row in rows)


def test_a_pattern_says_what_is_there_instead(tmp_path: Path) -> None:
    lines = WHOLE.splitlines()
    stations = '    stations: {left: "2026-03-02/*_left.jpg", right: "2026-03-02/*_right.jpg"}'
    (tmp_path / "02.03.2026").mkdir()
    text = "\n".join([*lines[:8], stations])
    rows = named(tmp_path, (WHOLE, text))
    assert (
        len(rows) == 1
        and "there is no folder" in rows[0]
        and rows[0].endswith("beside it: 02.03.2026; that is visit 1")
    )
    (tmp_path / "2026-03-02").mkdir()
    assert named(tmp_path, (WHOLE, text))[0].endswith("which is empty; that is visit 1")
    for name in ("a.jpg", "b.jpg", "c.jpg", "d.jpg"):
        (tmp_path / "2026-03-02" / name).touch()
    assert named(tmp_path, (WHOLE, text))[0].endswith("which holds a.jpg, b.jpg, c.jpg and 1 more; that is visit 1")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("markers: {survey", "markrs: {survey"), "line 6: markrs: unknown key; did you mean markers?"),
        (("visits:", "visit:"), "visit: unknown key; did you mean visits?"),
        (("size_m:", "sizem:"), "line 6: markers.sizem: unknown key; did you mean size_m?"),
    ],
)
def test_a_misspelt_key_is_told_once_and_not_as_missing_too(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    (row,) = named(tmp_path, change)
    assert row.endswith(says)


def test_a_retention_or_tax_that_may_be_a_share_is_refused(tmp_path: Path) -> None:
    for key, value in (("retention_percent", "0.05"), ("tax_percent", "0.19")):
        (row,) = named(tmp_path, ("visits:", f"valuation: {{{key}: {value}}}\nvisits:"))
        assert f"{key}: {value} may be a share; write {100 * float(value):g} for" in row
