"""What a hurried user gives the program: a clear message each, and the other stations count."""

from __future__ import annotations

import errno
import json
import re
import shutil
from pathlib import Path
from typing import Any

import cv2
import pytest
from click.testing import CliRunner, Result

from asbuilt_bim.cli import app
from asbuilt_bim.errors import OutputError
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.report.wording.reasons import words_of
from tests.photo_damage import DAMAGES, without_red
from tests.site_fixture import contents, copy_station, rig_file, site, small_project, write


def run(project: Path, out: Path, *more: str) -> Result:
    return CliRunner().invoke(app, ["run", str(project), "--out", str(out), "--workers", "1", *more])


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "130")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of one good station."""
    folder = tmp_path_factory.mktemp("good")
    return write(folder, small_project(folder, rig_file(tmp_path_factory)))


@pytest.fixture(scope="module")
def good_run(good: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a run of the good project left."""
    out = tmp_path_factory.mktemp("good_run") / "out"
    result = run(good, out)
    assert result.exit_code == 0, result.output
    return out


def copied(good: Path, folder: Path) -> tuple[Path, dict[str, Any]]:
    import yaml

    shutil.copytree(good.parent, folder, ignore=shutil.ignore_patterns("out"))
    return folder, yaml.safe_load((folder / "project.yaml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def damaged(good: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, dict[str, Any]]:
    """One run in which every station but one is bad, each in its own way."""
    folder, project = copied(good, tmp_path_factory.mktemp("bad") / "p")
    entry = contents()["visits"][-1]["stations"][0]
    stations = project["visits"][-1]["stations"]
    for name, (damage, _) in DAMAGES.items():
        made = copy_station(folder, entry, name)
        damage(folder / made["left"], folder / made["right"])
        stations.append(made)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "130")
        result = run(write(folder, project), folder / "out")
    return result, json.loads((folder / "out/result.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", DAMAGES)
def test_a_bad_station_is_left_out_by_name_with_its_reason(damaged: tuple[Result, dict[str, Any]], name: str) -> None:
    result, document = damaged
    (line,) = [row for row in result.stderr.splitlines() if f"station {name} was LEFT OUT" in row]
    for pattern in DAMAGES[name][1]:
        assert re.search(pattern, line), f"{pattern!r} is not in: {line}"
    assert name not in {station["name"] for station in document["stations"]}


def test_a_missing_photo_is_told_before_anything_is_measured(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, project = copied(good, tmp_path / "p")
    entry = project["visits"][-1]["stations"][0]
    entry["left"] = entry["left"].replace("left", "lefft")

    def never(*_given: object) -> None:
        raise OutputError("nobody waited for a measurement")

    monkeypatch.setattr("asbuilt_bim.terminal.commands.run_project", never)
    told = run(write(folder, project), folder / "out").stderr
    assert f"there is no {entry['left']} (" in told and told.index("there is no") < told.index("nobody waited")


def test_the_good_station_counts_whatever_the_others_are(damaged: tuple[Result, dict[str, Any]]) -> None:
    result, document = damaged
    assert result.exit_code == 0
    good_name = contents()["visits"][-1]["stations"][0]["name"]
    assert [station["name"] for station in document["stations"]] == [good_name]
    assert any(element["completion"]["best"] is not None for element in document["elements"])


def test_without_a_target_two_surveyed_markers_are_enough_where_the_project_says_so(good: Path, tmp_path: Path) -> None:
    folder, project = copied(good, tmp_path / "p")
    station = project["visits"][-1]["stations"][0]
    without_red(folder / station["left"], folder / station["right"])
    project["target"]["required"] = False
    result = run(write(folder, project), tmp_path / "out", "--strict")
    assert result.exit_code == 0, result.output


def test_of_two_discs_of_the_targets_size_the_one_taken_and_the_other_are_named(good: Path, tmp_path: Path) -> None:
    folder, project = copied(good, tmp_path / "p")
    truth = json.loads((site() / "truth.json").read_text(encoding="utf-8"))
    camera = truth["rig"]["left"]
    day, name, disc = min(  # the disc nearest the middle: moved aside there, the lens hardly changes it
        ((v["date"], s["name"], s["disc"]) for v in truth["visits"] for s in v["stations"]),
        key=lambda found: abs(found[2]["left_px"][0] - camera["width_px"] / 2),
    )
    visit = next(visit for visit in contents()["visits"] if str(visit["date"]) == day)
    station = copy_station(folder, next(s for s in visit["stations"] if s["name"] == name))
    project["visits"] = [{"date": visit["date"], "stations": [station]}]
    radius = camera["K"][0][0] * 0.5 * contents()["target"]["diameter_m"] / disc["depth_m"]
    for side in ("left", "right"):
        path = folder / station[side]
        image = cv2.imread(str(path))
        x, y, r = round(disc[f"{side}_px"][0]), round(disc[f"{side}_px"][1]), round(1.3 * radius)
        top = y - r - (side == "right")  # this far aside the lens puts it a row lower than in the left photo
        image[top : top + 2 * r, x + 2 * r : x + 4 * r] = image[y - r : y + r, x - r : x + r]
        cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, 95])
    result = run(write(folder, project), tmp_path / "out")
    assert result.exit_code == 0, result.output
    told = "\n".join(str(words_of(r)) for r in read_result(tmp_path / "out/result.json").rejections)
    assert re.search(r"red disc at .*it has the size of the target too.*the one at .* was taken", told), told


def test_a_path_of_250_characters_with_umlauts_and_spaces_is_fine(good: Path, tmp_path: Path) -> None:
    folder = tmp_path / "Bürogebäude Süd (2. Bauabschnitt)"
    while len(str(folder)) < 210:
        folder = folder / "Aufnahmen vom März äöü"[: max(4, 210 - len(str(folder)))].strip()
    copied(good, folder)
    result = run(folder / "project.yaml", tmp_path / "Ergebnis für März", "--strict")
    assert len(str(next((folder / "photos").iterdir()))) > 215
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize("factor", [1000, 1 / 0.3048])
def test_a_survey_in_another_unit_is_named_as_that(good: Path, tmp_path: Path, factor: float) -> None:
    folder, _ = copied(good, tmp_path / "p")
    _change_survey(folder, lambda row: [*row[:2], *(f"{float(v) * factor:.6f}" for v in row[2:])])
    result = run(folder / "project.yaml", tmp_path / "out")
    assert result.exit_code == 1
    assert re.search("millimetres|feet", result.stderr)
    assert "markers.csv" in result.stderr or "survey" in result.stderr


def test_a_survey_that_lacks_a_marker_in_view_leaves_that_marker_out(
    good: Path, good_run: Path, tmp_path: Path
) -> None:
    used = _markers_used(good_run)
    folder, _ = copied(good, tmp_path / "p")
    _change_survey(folder, lambda row: None if row[0] == str(used[0]) else row)
    result = run(folder / "project.yaml", tmp_path / "out")
    document = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    if len(used) > 2:
        assert result.exit_code == 0, result.output
    assert any(f"marker {used[0]}" in r["what"] for r in document["rejections"])


def test_too_few_markers_in_view_leave_the_station_out(good: Path, good_run: Path, tmp_path: Path) -> None:
    used = _markers_used(good_run)
    folder, _ = copied(good, tmp_path / "p")
    _change_survey(folder, lambda row: row if row[0] == str(used[0]) else None)
    result = run(folder / "project.yaml", tmp_path / "out", "--strict")
    assert result.exit_code == 1, result.output
    assert re.search(r"LEFT OUT: .*marker", result.stderr)
    assert re.search(r"limit 2|at least 2|at least two", result.stderr), result.stderr


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("hello", "IFC"),
        ("", "empty|IFC"),
        ("ISO-10303-21;\nHEADER;\n", "IFC|cut short|truncated"),
    ],
)
def test_a_file_that_is_no_ifc_is_refused(good: Path, tmp_path: Path, text: str, says: str) -> None:
    folder, _ = copied(good, tmp_path / "p")
    (folder / "design.ifc").write_text(text)
    result = run(folder / "project.yaml", tmp_path / "out")
    assert result.exit_code == 1
    assert "design.ifc" in result.stderr
    assert re.search(says, result.stderr)
    assert not (tmp_path / "out/report.html").exists()


def test_an_ifc_without_storeys_is_used_and_said_to_have_none(good: Path, tmp_path: Path) -> None:
    result = run(without(good, tmp_path, "IfcBuildingStorey"), tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert re.search(
        r"design.ifc: .*belong to no storey \(the file holds no IfcBuildingStorey or",
        result.stderr,
    )


def test_an_ifc_without_walls_and_columns_is_refused(good: Path, tmp_path: Path) -> None:
    result = run(without(good, tmp_path, "IfcWall", "IfcColumn"), tmp_path / "out")
    assert result.exit_code == 1, result.output
    assert re.search("design.ifc.*no IfcWall or IfcColumn", result.stderr, re.DOTALL), result.stderr


def without(good: Path, tmp_path: Path, *classes: str) -> Path:
    """Return a project whose design lacks all products of some classes."""
    import ifcopenshell
    import ifcopenshell.util.element

    folder, _ = copied(good, tmp_path / "p")
    model = ifcopenshell.open(str(folder / "design.ifc"))
    for name in classes:
        for product in model.by_type(name):
            model.remove(product)
    model.write(str(folder / "design.ifc"))
    return folder / "project.yaml"


def test_a_disk_that_fills_half_way_leaves_the_earlier_result(
    good: Path, good_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    shutil.copytree(good_run, out)
    before = {p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()}

    def full(_sources: object, _report: object, folder: Path, **_: object) -> None:
        (folder / "design.asbuilt.ifc").write_bytes(b"half a file")
        raise OSError(errno.ENOSPC, "No space left on device", str(folder))

    monkeypatch.setattr("asbuilt_bim.flow.output.publish.write_copies", full)
    result = run(good, out)
    assert result.exit_code == 1
    assert "disk is full" in result.stderr
    assert {p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()} == before


def test_a_path_out_of_the_project_needs_the_option(good: Path, tmp_path: Path) -> None:
    folder, project = copied(good, tmp_path / "p")
    shutil.move(folder / "design.ifc", tmp_path / "design.ifc")
    project["ifc"] = "../design.ifc"
    path = write(folder, project)
    refused = run(path, tmp_path / "out")
    assert refused.exit_code == 1
    assert "--allow-outside" in refused.stderr
    assert run(path, tmp_path / "out", "--allow-outside").exit_code == 0


def test_yaml_that_would_run_code_is_refused(good: Path, tmp_path: Path) -> None:
    path = tmp_path / "project.yaml"
    marker = tmp_path / "ran"
    path.write_text(f"name: !!python/object/apply:os.mkdir ['{marker}']\n")
    result = run(path, tmp_path / "out")
    assert result.exit_code == 1
    assert "nothing that runs code" in result.stderr
    assert not marker.exists()


def _markers_used(out: Path) -> list[int]:
    document = json.loads((out / "result.json").read_text(encoding="utf-8"))
    used: list[int] = document["stations"][0]["markers_used"]
    return used


def _change_survey(folder: Path, change) -> None:  # type: ignore[no-untyped-def]
    path = folder / "markers.csv"
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    kept = [made for row in rows if row.strip() and (made := change(row.split(",")))]
    path.write_text("\n".join([header, *(",".join(row) for row in kept)]) + "\n", encoding="utf-8")
