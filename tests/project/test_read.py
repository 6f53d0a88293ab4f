from __future__ import annotations

import re
from dataclasses import fields
from datetime import date
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.project.file import (
    BoardsFile,
    ControlPointsFile,
    MarkersFile,
    NetworksFile,
    PatternsFile,
    ProjectFile,
    RigFile,
    StationFile,
    TagsFile,
    TargetFile,
    VisitFile,
    VisitsFile,
)
from asbuilt_bim.project.options import Options
from asbuilt_bim.project.paths import safe_name
from asbuilt_bim.project.read import read_project
from asbuilt_bim.storage.schemas import schema
from asbuilt_bim.storage.structure import Problems, structure
from asbuilt_bim.vision.markers.find import FAMILIES, Family
from tests.project_folder import plain, write_project


def refusal(path: Path, **more: bool) -> str:
    with pytest.raises(ProjectError) as caught:
        read_project(path, **more)
    return str(caught.value)


def changed(**changes: Any) -> dict[str, Any]:
    """A good project file with values at `a__0__b` put in; None takes the key out."""
    contents = plain()
    for where, value in changes.items():
        *parents, last = [int(key) if key.isdigit() else key for key in where.split("__")]
        place: Any = contents
        for key in parents:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
    return contents


def test_an_option_that_earlier_versions_had_is_to_be_taken_out_and_not_taken_for_another() -> None:
    problems = Problems()
    structure({"progress": {"decided_share": 0.5, "margin_px": 3.0, "shown_shares": 0.2}}, Options, problems)
    assert [f"{one.path}: {one.text}" for one in problems.found] == [
        "progress.decided_share: unknown key: earlier versions had it, this one needs it no longer; take it out",
        "progress.margin_px: unknown key: earlier versions had it, this one needs it no longer; take it out",
        "progress.shown_shares: unknown key; did you mean shown_share?",
    ]
    today = {field.name for field in fields(ProgressOptions)}
    assert today.isdisjoint(ProgressOptions.REMOVED)


def test_a_project_is_read_with_absolute_paths_and_visits_in_the_order_of_dates(tmp_path: Path) -> None:
    project = read_project(write_project(tmp_path))
    assert [visit.date for visit in project.visits] == [date(2026, 3, 2), date(2026, 3, 16)]
    assert project.ifc == (tmp_path / "design.ifc",)
    assert project.visits[0].stations[1].left == tmp_path / "v/A2_left.jpg"
    assert [(left.name, right.name) for left, right in project.rig.pairs] == [
        (f"left_0{n}.jpg", f"right_0{n}.jpg") for n in (1, 2, 3)
    ]
    assert project.target.required
    assert project.relative(project.visits[0].stations[0].left) == "v/A1_left.jpg"
    assert project.folder / "calibration/right_02.jpg" in project.sources


def test_a_missing_photo_is_no_fault_of_the_project(tmp_path: Path) -> None:
    assert read_project(write_project(tmp_path)).visits  # none of the stations' photos is there


def test_a_long_path_with_umlauts_and_spaces_is_fine(tmp_path: Path) -> None:
    folder = tmp_path
    while len(str(folder)) < 250:
        folder = folder / "Bürogebäude Süd (Phase 2)"[: max(1, 250 - len(str(folder)))].strip()
    folder.mkdir(parents=True)
    assert read_project(write_project(folder, changed(name="Bürogebäude"))).name == "Bürogebäude"


def test_every_mistake_is_named_at_once_with_its_line(tmp_path: Path) -> None:
    contents = changed(
        name=12, target={"diameter": 0.3, "diameter_m": 300}, visits__0__date="soon", ifc="../design.ifc"
    )
    contents["makers"] = contents.pop("markers")
    text = refusal(write_project(tmp_path, contents))
    assert "5 mistakes" in text or "6 mistakes" in text
    for says in [
        "line 3: name: expected text (a number or a date in quotes), got 12",
        "target.diameter: unknown key; did you mean diameter_m?",
        "target.diameter_m: expected 0.05 to 2 m, got 300 m; a length in millimetres?",
        "visits[0].date: expected a date such as 2026-03-02, got 'soon'",
        "makers: unknown key; did you mean markers?",
    ]:
        assert says in text, text


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"version": 2}, "version: expected 1, got 2"),
        ({"format": "asbuilt-bim/map"}, "format: expected 'asbuilt-bim/project', got 'asbuilt-bim/map'\n"),
        ({"rig": {"file": "rig.yaml", "boards": plain()["rig"]["boards"]}}, "rig: needs file"),
        ({"rig": {}}, "rig: needs file"),
        ({"rig__boards__kind": "charucco"}, "did you mean charuco?"),
        ({"rig__boards__marker_m": 0.09}, "marker_m 0.09 m must be smaller than square_m 0.08 m"),
        ({"rig__boards__dictionary": None}, "a charuco board needs marker_m and dictionary"),
        (
            {"rig__boards__square_m": 80},
            "rig.boards.square_m: expected 0.002 to 1 m, got 80 m; a length in millimetres?",
        ),
        (
            {"rig__boards__flatness_m": 0.2},
            "rig.boards.flatness_m: expected 0 to 0.02 m, got 0.2 m; a length in millimetres?",
        ),
        ({"rig__boards__print_share": 0.1}, "rig.boards.print_share: expected 0 to 0.02, got 0.1"),
        ({"rig__boards__left": "calibration/none_*.jpg"}, "rig.boards.left: 'calibration/none_*.jpg': no file fits it"),
        (
            {"rig__boards__left": "calibration/left_[1-4].jpg"},
            "of patterns only * is known here, [ ] stand for themselves",
        ),
        ({"ifc": []}, "ifc: is empty: a project has at least one IFC file"),
        ({"rig__boards__left": "*/left_*.jpg"}, "only the file's name may hold a *"),
        ({"visits": []}, "visits: is empty"),
        ({"visits__0__stations": []}, "visits[0].stations: is empty"),
        ({"visits__1__date": "2026-03-16"}, "visits[1].date: 2026-03-16 is the date of visits[0] too"),
        ({"visits__1__date": date(9999, 12, 31)}, "visits[1].date: expected a day of the years 1990 to 2200"),
        ({"ifc": "a/" + "x" * 300 + ".ifc"}, "ifc: is too long for a path: limit 4000 characters, and 255 between"),
        ({"markers__survey": "ab/" * 2000 + "m.csv"}, "markers.survey: is too long for a path"),
        ({"markers__size_m": 10**400}, "markers.size_m: expected a number, got 1000"),
        ({"rig__boards__columns": 10**400}, "rig.boards.columns: expected a whole number, got 1000"),
        ({"visits__1__stations__1__name": "a1"}, "'a1' is the name of visits[1].stations[0] too"),
        ({"visits__1__stations__1__name": "../A2"}, "holds '/', which file names can't"),
        ({"visits__1__stations__1__name": "con"}, "a name that Windows keeps for itself"),
        ({"visits__0__stations__0__right": "v/B1_left.jpg"}, "is the same file as left"),
        ({"visits__0__stations__0__left": 7}, "visits[0].stations[0].left: expected text (a number"),
        ({"visits__0": "2026-03-02"}, "visits[0]: expected keys with values, such as date, stations, got '2026"),
        ({"options": {"register": {"max_residual": 2}}}, "did you mean max_residual_px?"),
        ({"options": {"register": {"max_residual_px": "two"}}}, "options.register.max_residual_px: expected a number"),
        *(
            ({"target": {"diameter_m": written}}, f"got '{written}'; write a number alone, with a point and without q")
            for written in ("0,30", "0.30", "30 cm", "1.234,5")
        ),
        ({"target": {"diameter_m": 0}}, "target.diameter_m: expected 0.05 to 2 m, got 0 m\n"),
        (
            {"ifc": "new\tower.ifc"},
            "ifc: 'new\\tower.ifc' holds a line break, a tab or the like; in quotation marks write /",
        ),
        ({"ifc": "„design.ifc“"}, "ifc: '„design.ifc“': „ is no quotation mark here, but a part of the name"),
    ],
)
def test_each_mistake_says_where_and_what_was_expected(tmp_path: Path, changes: dict[str, Any], says: str) -> None:
    text = f"{refusal(write_project(tmp_path, changed(**changes)))}\n"
    assert says in text, text
    assert "project.yaml" in text


def test_keys_that_were_left_empty_are_told_what_may_stand_there(tmp_path: Path) -> None:
    path = write_project(tmp_path, {**plain(), "visits": None, "rig": None})
    assert "rig: expected keys with values, such as file, file_right, got nothing" in (said := refusal(path))
    assert "visits: expected a list (lines that start with '- date: ...'), or keys such as left, right; no" in said


@pytest.mark.parametrize(
    "outside", ["../design.ifc", "v/../../design.ifc", "/etc/design.ifc", "C:\\site\\design.ifc", "..\\design.ifc"]
)
def test_a_path_out_of_the_project_needs_leave(tmp_path: Path, outside: str) -> None:
    path = write_project(tmp_path / "site", changed(ifc=outside))
    assert "leads out of the project folder" in refusal(path)
    assert "--allow-outside" in refusal(path)
    assert read_project(path, allow_outside=True).ifc[0].name in (outside.replace("\\", "/").rsplit("/", 1)[-1],)


def test_a_link_out_of_the_project_needs_leave(tmp_path: Path) -> None:
    path = write_project(tmp_path / "site")
    (tmp_path / "other").mkdir()
    try:
        (tmp_path / "site/v").symlink_to(tmp_path / "other")
    except OSError:
        pytest.skip("this system makes no links")
    assert "leads out of the project folder by a link" in refusal(path)
    read_project(path, allow_outside=True)


def test_boards_outside_need_leave_too(tmp_path: Path) -> None:
    write_project(tmp_path)
    path = write_project(tmp_path / "site", changed(rig__boards__left="../calibration/left_*.jpg"))
    assert "rig.boards.left: '../calibration/left_*.jpg' leads out" in refusal(path)
    assert len(read_project(path, allow_outside=True).rig.pairs) == 3


def test_a_folder_of_thousands_of_pairs_is_refused_before_they_fill_the_memory(tmp_path: Path) -> None:
    path = write_project(tmp_path)
    for number in range(500):
        for side in ("left", "right"):
            (tmp_path / f"calibration/{side}_x{number}.jpg").touch()
    assert "rig.boards: 503 pairs, limit 500; twenty are plenty" in refusal(path)


def test_board_photos_that_differ_in_capitals_alone_are_named_and_none_is_dropped(tmp_path: Path) -> None:
    path = write_project(tmp_path)
    (tmp_path / "calibration/left_02.JPG").touch()
    if len(list((tmp_path / "calibration").glob("left_02.*"))) == 1:
        pytest.skip("this file system takes them for one")
    assert "rig.boards.left: left_02.JPG and left_02.jpg differ in capitals alone" in refusal(path)


def test_a_board_photo_without_its_partner_is_named(tmp_path: Path) -> None:
    path = write_project(tmp_path)
    (tmp_path / "calibration/right_02.jpg").unlink()
    assert "rig.boards.left: left_02.jpg: no right photo of that name (3 here, 2 right)" in refusal(path)


def test_paths_written_on_windows_are_read_everywhere(tmp_path: Path) -> None:
    contents = changed(rig__boards__left="calibration\\left_*.jpg", visits__0__stations__0__left="v\\B1_left.jpg")
    project = read_project(write_project(tmp_path, contents))
    assert project.visits[1].stations[0].left == tmp_path / "v/B1_left.jpg"
    assert len(project.rig.pairs) == 3


@pytest.mark.parametrize(
    ("tags", "names"),
    [
        ({}, ["A1", "A2", "B1"]),
        ({"visit": date(2026, 3, 16)}, ["B1"]),
        ({"left": "calibration/left_*.jpg", "right": "calibration/right_*.jpg"}, ["left_01", "left_02", "left_03"]),
    ],
)
def test_a_rig_of_tags_takes_a_visit_s_photos_or_all_or_its_own(
    tmp_path: Path, tags: dict[str, Any], names: list[str]
) -> None:
    project = read_project(write_project(tmp_path, {**plain(), "rig": {"tags": tags}}))
    assert sorted(left.stem.removesuffix("_left") for left, _ in project.rig.pairs) == names


@pytest.mark.parametrize(
    ("tags", "says"),
    [
        ({"visit": date(2026, 3, 17)}, "rig.tags.visit: there is no visit of 2026-03-17"),
        ({"left": "v/*.jpg"}, "needs left and right, or both"),
        ({"both": "calibration/left_*.jpg", "visit": date(2026, 3, 16)}, "not all of them"),
        ({"size_m": 0.2}, "size_m"),
    ],
)
def test_a_rig_of_tags_that_cannot_be_is_named(tmp_path: Path, tags: dict[str, Any], says: str) -> None:
    with pytest.raises(ProjectError, match=re.escape(says)):
        read_project(write_project(tmp_path, {**plain(), "rig": {"tags": tags}}))


@pytest.mark.parametrize("name", ["A1", "Achse 3-4", "Süd_2", "北側", "N.3"])
def test_ordinary_names_are_safe(name: str) -> None:
    assert safe_name(name) == ""


@pytest.mark.parametrize(
    "name", ["a/b", "a\\b", "..", ".a", "a.", " a", "nul.x", "LPT1", "a\nb", "a" * 65, "a?", "\u202ea"]
)
def test_names_that_no_file_can_have_are_refused(name: str) -> None:
    assert safe_name(name) != ""


@pytest.mark.parametrize(
    ("place", "kind"),
    [
        ([], ProjectFile),
        (["rig"], RigFile),
        (["rig", "boards"], BoardsFile),
        (["rig", "tags"], TagsFile),
        (["rig", "control_points"], ControlPointsFile),
        (["target"], TargetFile),
        (["markers"], MarkersFile),
        (["networks"], NetworksFile),
        (["visits", "[]"], VisitFile),
        (["visits"], VisitsFile),
        (["visits", "[]", "stations"], PatternsFile),
        (["visits", "[]", "stations", "[]"], StationFile),
    ],
)
def test_the_schema_knows_the_same_keys(place: list[str], kind: type) -> None:
    whole = schema("project-1")
    parts = _alternatives(whole, whole)
    for key in place:
        below = [part.get("items") if key == "[]" else part.get("properties", {}).get(key) for part in parts]
        parts = [alternative for part in below if part for alternative in _alternatives(part, whole)]
    parts = [part for part in parts if "properties" in part]
    assert set().union(*(part["properties"] for part in parts)) == {f.name for f in fields(kind)}
    assert all(part.get("additionalProperties") is False for part in parts)


def test_the_schema_names_the_families_that_are_read() -> None:
    assert schema("project-1")["$defs"]["markers"]["properties"]["family"]["enum"] == [*get_args(Family)]
    assert [*FAMILIES] == [*get_args(Family)]


def _alternatives(part: dict[str, Any], whole: dict[str, Any]) -> list[dict[str, Any]]:
    while "$ref" in part:
        found: Any = whole
        for key in part["$ref"].removeprefix("#/").split("/"):
            found = found[key]
        part = found
    return (
        [one for alternative in part["oneOf"] for one in _alternatives(alternative, whole)]
        if "oneOf" in part
        else [part]
    )


def test_the_readmes_example_is_a_good_project_file(tmp_path: Path) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    example = readme.split("```yaml\n")[1].split("```")[0]
    path = write_project(tmp_path)
    path.write_text(example, encoding="utf-8")
    assert read_project(path).name == "My site"


def test_the_design_may_be_several_files_each_named_once(tmp_path: Path) -> None:
    path = write_project(tmp_path, changed(ifc=["structure.ifc", "architecture.ifc"]))
    assert read_project(path).ifc == (tmp_path / "structure.ifc", tmp_path / "architecture.ifc")
    assert "ifc: is empty" in refusal(write_project(tmp_path, changed(ifc=[])))
    twice = refusal(write_project(tmp_path, changed(ifc=["a.ifc", "a.ifc"])))
    assert "ifc[1]: is the same file as ifc[0]" in twice
    assert "ifc: expected text" in refusal(write_project(tmp_path, changed(ifc=5)))


def test_a_photo_named_under_two_stations_is_a_mistake_in_the_project_file(tmp_path: Path) -> None:
    contents = plain()
    contents["visits"][1]["stations"][1] |= {"left": "v/A1_left.jpg", "right": "v/A1_right.jpg"}
    with pytest.raises(ProjectError) as refused:
        read_project(write_project(tmp_path, contents))
    assert "visits[1].stations[1].right: is a photo of visits[1].stations[0] too" in str(refused.value)
    assert "visits[1].stations[1].left: is a photo of visits[1].stations[0] too" in str(refused.value)


def test_a_shift_of_the_survey_may_be_accepted_with_its_value(tmp_path: Path) -> None:
    accepted = {"move_m": [0.2, 0.0, -0.05], "turn_deg": 90.0, "about_m": [10.0, 20.0]}
    shift = read_project(write_project(tmp_path, changed(accept_survey_shift=accepted))).accepted_shift
    assert shift is not None and shift.turn_rad == pytest.approx(np.pi / 2)
    assert shift.undo() @ [10.2, 21.0, 0.0, 1.0] == pytest.approx([11.0, 20.0, 0.05, 1.0])  # turned and moved back
    assert read_project(write_project(tmp_path)).accepted_shift is None


def test_an_accepted_turn_without_its_axis_is_a_mistake(tmp_path: Path) -> None:
    accepted = {"move_m": [0.2, 0.0, 0.0], "turn_deg": 1.0}
    assert "a turn needs about_m" in refusal(write_project(tmp_path, changed(accept_survey_shift=accepted)))
