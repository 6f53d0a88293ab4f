from __future__ import annotations

import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner, Result
from rich.table import Table
from rich.text import Text

from asbuilt_bim.cli import app
from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.project.model import Visit
from asbuilt_bim.terminal.crash import KEPT, write_crash_log
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.terminal.summary_table import warn_of_visit
from tests.ifc.models import ModelBuilder
from tests.project_folder import plain, write_project
from tests.report.sample_report import sample_report
from tests.site_fixture import contents, rig_file, site, small_project, write

OUTPUTS = ("result.json", "report.html", "quantities.csv", "quantities.xlsx", "design.asbuilt.ifc", "current.json")


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "130")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["Haus", "Süd/project.yaml"], "(Süd/project.yaml); a path with a blank in it needs quotation marks round it"),
        (["project.yaml", "\u2014out", "results"], "an option begins with two hyphens, not with \u2014"),
    ],
)
def test_a_blank_without_quotes_and_a_dash_for_hyphens_are_told_as_what_they_are(words: list[str], says: str) -> None:
    result = invoke("run", *words)
    assert result.exit_code == 2 and says in result.stderr


def test_a_day_of_another_form_is_told_with_the_one_to_write() -> None:
    result = invoke("run", "project.yaml", "--visit", "02.03.2026")
    assert result.exit_code == 2 and "'02.03.2026' is no day of the calendar; write it as 2026-03-02" in result.stderr


def test_a_length_with_a_decimal_comma_is_told_with_a_point() -> None:
    result = invoke("print", "target", "--diameter", "0,3", "--out", "target.pdf")
    assert result.exit_code == 2 and "write it with a point, such as 0.30" in result.stderr


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("Bürogebäude Süd")
    return write(folder, small_project(folder, rig_file(tmp_path_factory), stations=2))


@pytest.fixture(scope="module")
def first_run(project: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "130")
        out = project.parent / "out"
        return out, invoke("run", project, "--out", out, "--workers", 1)


@pytest.fixture(scope="module")
def second_run(
    project: Path, first_run: tuple[Path, Result], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Result]:
    """The same again into a copy of the folder that the first run left."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "130")
        out = tmp_path_factory.mktemp("twice") / "out"
        shutil.copytree(first_run[0], out)
        return out, invoke("run", project, "--out", out, "--workers", 1)


def test_one_command_writes_every_output_and_sums_up(first_run: tuple[Path, Result]) -> None:
    out, result = first_run
    assert result.exit_code == 0, result.output
    for name in OUTPUTS:
        assert (out / name).stat().st_size > 0
    assert len(list((out / "overlays").glob("*.jpg"))) == 2
    assert "Ground floor" in result.output
    assert "whole" in result.output
    assert str(out / "report.html") in result.output
    for station in contents()["visits"][-1]["stations"][:2]:
        assert f"({station['name']})" in result.output  # progress, line by line


def test_a_narrow_terminal_gets_lines_that_fit(first_run: tuple[Path, Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    result = invoke("report", first_run[0])
    assert result.exit_code == 0, result.output
    assert "Ground floor: at least " in result.output
    assert max(len(line) for line in result.output.splitlines() if not line.startswith("Report")) <= 80


def test_a_second_run_measures_nothing_again_and_says_what_changed(second_run: tuple[Path, Result]) -> None:
    _, result = second_run
    assert result.exit_code == 0, result.output
    assert "2 of 2 stations were measured before" in result.output
    assert re.search(r"^Took \d+ s: read the IFC <?\d+ %; .*measure <?\d+ %; .*write <?\d+ %\.$", result.output, re.M)
    assert "Nothing has changed against the earlier run" in result.output
    assert re.search(r"[23] runs are kept", result.output)  # `report` leaves one, too


def of_one_station(project: Path, name: str, **changes: object) -> Path:
    """Write the project with its first station alone, and changes, beside it."""
    asked = {**yaml.safe_load(project.read_text(encoding="utf-8")), **changes}
    (visit,) = asked["visits"]
    asked["visits"] = [{**visit, "stations": visit["stations"][:1]}]
    project.with_name(name).write_text(yaml.safe_dump(asked, allow_unicode=True), encoding="utf-8")
    return project.with_name(name)


def test_a_run_with_other_options_says_that_they_are_others_and_takes_old_runs_away_where_asked(
    project: Path, second_run: tuple[Path, Result], tmp_path: Path
) -> None:
    before, kept = second_run
    shutil.copytree(before, tmp_path / "out")
    assert re.search(r"\d runs are kept in \S+: \d+ MB; --keep-runs N", kept.stdout)
    options = {**contents().get("options", {}), "progress": {"known_from": 0.11}}
    other = of_one_station(project, "other.yaml", options=options)
    result = invoke("run", other, "--out", tmp_path / "out", "--workers", 1, "--keep-runs", 2)
    assert result.exit_code == 0, result.output
    assert len([run for run in (tmp_path / "out/runs").iterdir() if run.is_dir()]) == 2
    assert "options: another than before" in result.output
    assert "options: another than before" in (tmp_path / "out/changes.txt").read_text(encoding="utf-8")
    assert invoke("report", tmp_path / "out").exit_code == 0
    assert "options: another than before" in (tmp_path / "out/changes.txt").read_text(encoding="utf-8")


def test_every_output_can_be_made_again_from_the_result_and_the_ifc(
    first_run: tuple[Path, Result], tmp_path: Path
) -> None:
    out, _ = first_run
    moved = tmp_path / "moved"
    shutil.copytree(out, moved / "out")
    shutil.copyfile(out.parent / "design.ifc", moved / "design.ifc")
    before = {name: (moved / "out" / name).read_bytes() for name in ("quantities.csv", "result.json")}
    result = invoke("report", moved / "out")
    assert result.exit_code == 0, result.output
    assert {name: (moved / "out" / name).read_bytes() for name in before} == before
    copy = moved / "out" / "design.asbuilt.ifc"
    plain = copy.read_bytes()
    assert b"AsBuilt_Colour" not in plain
    photos = re.findall(rb"IFCDOCUMENTREFERENCE\('(overlays[^']+)'", plain)
    assert photos and all(
        (copy.parent / photo.decode()).is_file() for photo in photos
    )  # links that a viewer can follow
    page = moved / "out" / "report.html"
    assert "All else is blurred" in page.read_text(encoding="utf-8")
    assert invoke("report", moved / "out", "--whole-photos", "--colour").exit_code == 0
    assert "Pictures show whole photos" in page.read_text(encoding="utf-8")
    assert (moved / "out" / "result.json").read_bytes() == before["result.json"]
    assert b"AsBuilt_Colour complete" in copy.read_bytes()
    (moved / "design.ifc").write_bytes((moved / "design.ifc").read_bytes() + b"\n")
    result = invoke("report", moved / "out")
    assert result.exit_code == 1
    assert "has changed since this result was made" in result.stderr
    assert invoke("report", moved / "out", "--ifc", out.parent / "design.ifc").exit_code == 0


def test_a_design_of_two_files_gets_a_copy_of_each_and_can_be_made_again(
    project: Path, first_run: tuple[Path, Result]
) -> None:
    tower = ModelBuilder(schema="IFC2X3", origin_m=(500.0, 500.0, 540.0))
    tower.box("IfcWall", "tower", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    tower.write(project.parent / "tower.ifc")
    two = of_one_station(project, "two.yaml", ifc=["design.ifc", "tower.ifc"])
    out = project.parent / "out of two"
    result = invoke("run", two, "--out", out, "--workers", 1)
    assert result.exit_code == 0, result.output
    copies = {"design.asbuilt.ifc", "tower.asbuilt.ifc"}
    assert {path.name for path in out.glob("*.asbuilt.ifc")} == copies
    for name in copies:
        (out / name).unlink()
    assert invoke("report", out).exit_code == 0
    assert {path.name for path in out.glob("*.asbuilt.ifc")} == copies
    (project.parent / "tower.ifc").rename(project.parent / "moved.ifc")
    assert "tower.ifc" in invoke("report", out).stderr
    named = ["--ifc", project.parent / "design.ifc", "--ifc", project.parent / "moved.ifc"]
    assert invoke("report", out, *named).exit_code == 0


def test_results_hold_no_absolute_path_and_pictures_no_exif(first_run: tuple[Path, Result]) -> None:
    out, _ = first_run
    for path in out.rglob("*"):
        if path.suffix in (".json", ".html", ".csv", ".ifc", ".yaml"):
            assert str(out.parent).encode() not in path.read_bytes(), path
        if path.suffix == ".jpg":
            assert b"Exif" not in path.read_bytes()[:4096], path


def test_unknown_is_never_written_as_nought_per_cent(first_run: tuple[Path, Result]) -> None:
    out, _ = first_run
    rows = list(csv.DictReader(io.StringIO((out / "quantities.csv").read_text(encoding="utf-8-sig"))))
    best, coverage = (next(key for key in rows[0] if word in key) for word in ("Best", "Coverage"))
    unseen = [row for row in rows if float(row[coverage]) < 0.1]
    assert unseen, "two stations can't see the whole building"
    assert {row[best] for row in unseen} <= {"", "unknown"}
    assert {row["State"] for row in unseen} == {"unknown"}


def test_a_station_left_out_is_named_loudly_and_strict_makes_it_an_error(project: Path, tmp_path: Path) -> None:
    shutil.copytree(project.parent, tmp_path / "p", ignore=shutil.ignore_patterns("out"))
    station = contents()["visits"][-1]["stations"][0]["name"]
    (tmp_path / f"p/photos/{station}_right.jpg").unlink()
    result = invoke(
        "run", tmp_path / "p/project.yaml", "--out", tmp_path / "out", "--strict", "--workers", 1, "--quiet"
    )
    assert result.exit_code == 1, result.output
    assert (
        f"station {station} was LEFT OUT: its right photo is missing: there is no photos/{station}_r" in result.stderr
    )
    assert result.stdout == ""
    assert f"WITHOUT 1 OF 2 STATIONS: of the visit of 2026-03-16 {station} counts" in result.stderr.splitlines()[-2]
    assert (tmp_path / "out/report.html").is_file()
    assert "Took" not in result.output


def test_a_visit_without_one_good_station_still_gives_a_report(project: Path, tmp_path: Path) -> None:
    shutil.copytree(project.parent, tmp_path / "p", ignore=shutil.ignore_patterns("out", "photos"))
    result = invoke("run", tmp_path / "p/project.yaml", "--out", tmp_path / "out", "--workers", 1)
    assert result.exit_code == 1, result.output
    assert "NOT ONE station could be used" in result.stderr
    assert "not one station could be used, so nothing is known of any element" in result.stderr
    assert "No element was seen late" not in result.stdout
    document = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    assert {element["state"] for element in document["elements"]} == {"unknown"}
    assert {element["completion"]["best"] for element in document["elements"]} == {None}
    assert document["whole"]["completion"]["upper"] == 1.0


def test_a_run_that_saw_nothing_does_not_take_the_place_of_one_that_did(
    project: Path, first_run: tuple[Path, Result], tmp_path: Path
) -> None:
    shutil.copytree(project.parent, tmp_path / "p", ignore=shutil.ignore_patterns("photos"))
    out = tmp_path / "p/out"
    before = {name: (out / name).read_bytes() for name in OUTPUTS}
    (out / "runs/20200101T000000Z-00000000").mkdir()
    runs = set((out / "runs").iterdir())
    result = invoke("run", tmp_path / "p/project.yaml", "--out", out, "--workers", 1, "--keep-runs", 1)
    assert result.exit_code == 1, result.output
    assert runs < set((out / "runs").iterdir())  # a run that saw nothing takes none away
    assert {name: (out / name).read_bytes() for name in OUTPUTS} == before
    (own,) = set((out / "runs").iterdir()) - runs
    told = result.stderr + result.stdout
    assert "stay those of the earlier run, visit of 2026-03-16: this run saw nothing" in told and str(own) in told
    assert (own / "report.html").is_file() and "Earlier report: " in told
    assert "nothing is known of any element" in result.stderr
    assert "completion" not in result.stdout  # no table of unknowns as if it were the state


def test_where_the_list_of_changes_is_cut_it_says_how_many_there_are_and_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import asbuilt_bim.terminal.commands as commands

    monkeypatch.setattr(commands, "changes", lambda *_: tuple(f"element {number}" for number in range(17)))
    commands._show(sample_report(), sample_report(), Screen(), tmp_path / "changes.txt")
    told = capsys.readouterr().out
    assert "element 14" in told and "element 15" not in told
    assert f"... and 2 more; all 17 stand in {tmp_path / 'changes.txt'}" in told


def test_what_is_wrong_with_the_whole_visit_is_said_once_and_quiet_or_not(capsys: pytest.CaptureFixture[str]) -> None:
    doubt = Rejection(
        code=Reason.RIG_REFINED,
        subject=Subject(kind=SubjectKind.RIG),
        values={"turn_rad": (0.0, 0.001, 0.0), "turn_sigma_rad": (0.0, 0.0, 0.0), "area_effect": 0.1,
                "area_sigma": 0.01, "area_distance_m": 5.0, "rows_px": 0.2, "matches": 900,
                "stations": (), "refined": False},
    )  # fmt: skip
    face = Rejection(code=Reason.FACE_WITHOUT_DESIGN, subject=Subject(kind=SubjectKind.FACE, name="A1/2", station="A1"))
    report = replace(sample_report(), rejections=(doubt, face))
    visit = Visit(date=report.visit_date, stations=())
    warn_of_visit(visit, report, Screen(quiet=True))
    told = capsys.readouterr().err
    assert f"visit {report.visit_date}: rig: refined from 900 matches" in told and "A1/2" not in told


def test_what_is_wrong_with_the_photos_of_a_station_that_counts_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    report = sample_report()
    (counts, *_) = sorted(report.placed)
    dark = [
        Rejection(
            code=Reason.PHOTO_DARK,
            subject=Subject(kind=SubjectKind.STATION, name=name),
            values={"stops": -4.5, "limit_stops": -3.5},
        )
        for name in (counts, "elsewhere")
    ]
    warn_of_visit(
        Visit(date=report.visit_date, stations=()), replace(report, rejections=tuple(dark)), Screen(quiet=True)
    )
    said = capsys.readouterr().err
    assert f"station {counts}: its photos are too dark" in said and "elsewhere" not in said


def test_a_wrong_project_file_is_an_error_with_every_mistake(tmp_path: Path) -> None:
    wrong = plain()
    wrong["nam"] = wrong.pop("name")
    wrong["target"]["diameter_m"] = 300
    result = invoke("run", write_project(tmp_path, wrong), "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "did you mean name?" in result.stderr
    assert "millimetres" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_visit_that_is_not_there_is_refused(project: Path, tmp_path: Path) -> None:
    result = invoke("run", project, "--out", tmp_path, "--visit", "1999-01-01")
    assert result.exit_code == 1
    assert "has no visit of 1999-01-01" in result.stderr


@pytest.mark.parametrize("name", ["report.html", "quantities.csv"])
def test_the_photos_folder_is_no_place_for_outputs(project: Path, name: str) -> None:
    result = invoke("run", project, "--out", project.parent / "photos")
    assert result.exit_code == 1
    assert "holds this project's photos" in result.stderr
    assert not (project.parent / "photos" / name).exists()


def test_an_output_place_that_cannot_be_written_is_refused_at_once(project: Path) -> None:
    result = invoke("run", project, "--out", project)
    assert result.exit_code == 1
    assert "in the way" in result.stderr


def test_a_folder_without_a_run_says_how_to_make_one(tmp_path: Path) -> None:
    result = invoke("report", tmp_path)
    assert result.exit_code == 1
    assert "asbuilt-bim run" in result.stderr
    assert "no such folder" in invoke("report", tmp_path / "none").stderr


def test_inspect_shows_what_is_understood() -> None:
    result = invoke("inspect", site() / contents()["ifc"])
    assert result.exit_code == 0, result.output
    assert "Ground floor" in result.output


def test_inspect_of_what_is_no_ifc_says_so(tmp_path: Path) -> None:
    (tmp_path / "x.ifc").write_text("hello")
    result = invoke("inspect", tmp_path / "x.ifc")
    assert result.exit_code == 1
    assert "x.ifc" in result.stderr


def test_calibrate_does_not_write_over_a_source(project: Path) -> None:
    before = (project.parent / "rig.yaml").read_bytes()
    result = invoke("calibrate", project, "--out", project.parent / "rig.yaml")
    assert result.exit_code == 1
    assert (project.parent / "rig.yaml").read_bytes() == before


def test_an_unexpected_error_is_one_line_and_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import asbuilt_bim.terminal.commands as commands

    def broken(*_: object) -> int:
        raise RuntimeError("by chance")

    monkeypatch.setattr(commands, "inspect_command", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = invoke("inspect", "x.ifc")
    assert result.exit_code == 1
    assert "the fault is its own: RuntimeError: by chance" in result.stderr
    assert "Traceback" not in result.output
    (log,) = tmp_path.glob("asbuilt-bim-*.log")
    assert "Traceback" in log.read_text(encoding="utf-8")
    assert isinstance(invoke("--debug", "inspect", "x.ifc").exception, RuntimeError)


def test_an_interrupted_run_says_what_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    import asbuilt_bim.terminal.commands as commands

    def stopped(*_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, "inspect_command", stopped)
    result = invoke("inspect", "x.ifc")
    assert result.exit_code == 1
    assert "the earlier result stands" in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["calibrate", "p.yaml"],
        ["nonsense"],
        ["run", "p.yaml", "--out", "o", "--workers", "0"],
        ["measure", "l.jpg", "r.jpg", "--rig", "r.yaml", "--out", "o", "--target-diameter", "nan"],
        ["strip", "design.ifc", "--out", "a" * 300],
        ["run", "p.yaml", "--out", "a/" * 3000],
        ["calibrate", "p.yaml", "--out", "r.yaml", "--check-length", "nan", "--check-points", "1,1 1,1 2,2 2,2"],
        ["calibrate", "p.yaml", "--out", "r.yaml", "--check-length", "inf", "--check-points", "1,1 1,1 2,2 2,2"],
    ],
)
def test_a_wrong_command_line_is_exit_2(arguments: list[str]) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2 and "Usage" in result.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights of their own there")
@pytest.mark.parametrize("command", ["run", "label", "strip", "report", "inspect"])
def test_a_link_that_leads_back_to_itself_is_a_wrong_command_line(command: str, tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    places = ["--out", loop] if command in ("run", "label", "strip") else []
    result = invoke(command, tmp_path / "any" if places else loop, *places)
    assert result.exit_code == 2
    assert "leads back to itself" in " ".join(result.output.split())


def test_a_console_that_lacks_a_letter_shows_another_and_does_not_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="cp1252"))
    screen = Screen()
    screen.say("北側 1.35 ± 0.02 m² [bold]not markup[/bold]")
    sys.stdout.flush()
    assert raw.getvalue().decode("cp1252").strip() == "?? 1.35 ± 0.02 m² [bold]not markup[/bold]"


def test_names_out_of_files_give_the_terminal_no_orders(capsys: pytest.CaptureFixture[str]) -> None:
    screen = Screen()
    evil = "Wall \x1b]0;pwned\x07\x1b[2J\x9b31m \u202e end"
    table = Table(title=evil)
    table.add_column(evil)
    table.add_row(Text(evil))
    screen.say(evil)
    screen.say(table)
    screen.warn(evil)
    screen.error(evil)
    with screen.steps() as progress:
        progress(evil, 1, 2, evil)
    shown = "".join(capsys.readouterr())
    assert shown.count("pwned") >= 6 and shown.count("end") >= 6
    assert not any(c in shown for c in "\x1b\x07\x9b\u202e")


def test_a_folder_that_holds_no_run_stays_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    for folder in (tmp_path / "notes", tmp_path / "mistyped"):
        result = invoke("report", folder)
        assert result.exit_code == 1 and ("holds no run" in result.stderr or "no such folder" in result.stderr)
    assert list(tmp_path.rglob("*")) == [tmp_path / "notes"]


def test_a_program_that_fails_often_keeps_ten_logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "asbuilt-bim-notes.log").write_text("somebody's", encoding="utf-8")
    logs = [write_crash_log(RuntimeError("by chance")) for _ in range(KEPT + 3)]
    assert len(list(tmp_path.glob("asbuilt-bim-crash-*.log"))) == KEPT
    assert logs[-1] is not None and logs[-1].exists() and (tmp_path / "asbuilt-bim-notes.log").exists()


def test_strip_writes_over_a_file_only_when_asked_to(tmp_path: Path) -> None:
    notes = tmp_path / "notes.txt"
    notes.write_text("mine", encoding="utf-8")
    design = site() / "design.ifc"
    refused = invoke("strip", design, "--out", notes)
    assert refused.exit_code == 1 and "is there already" in refused.stderr.replace("\n", " ")
    assert notes.read_text(encoding="utf-8") == "mine"
    assert invoke("strip", design, "--out", notes, "--replace").exit_code == 0
    refused = invoke("strip", design, "--out", tmp_path, "--replace")
    assert refused.exit_code == 1 and "is a folder; name a file" in refused.stderr.replace("\n", " ")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no device that is always full")
@pytest.mark.parametrize("arguments", [["--help"], ["ifcpatch-dir"], ["inspect", str(site() / "design.ifc")]])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_printing_on_a_full_disk_is_said_in_words(arguments: list[str], unbuffered: str) -> None:
    command = [sys.executable, "-m", "asbuilt_bim", *arguments]
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, env=environment)
    assert run.returncode == 1
    assert run.stderr.decode().startswith("error: the disk is full, so what is printed")
    assert b"Traceback" not in run.stderr and b"Exception ignored" not in run.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell that closes an output")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
@pytest.mark.parametrize("arguments", [["--version"], ["inspect", str(site() / "design.ifc")]])
def test_a_closed_output_is_no_failure(arguments: list[str], closed: str) -> None:
    command = ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-m", "asbuilt_bim", *arguments]
    done = subprocess.run(command, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("day", ["2026-02-30", "02.03.2026", "yesterday"])
def test_a_day_that_is_none_is_named_with_how_days_are_written(day: str) -> None:
    done = CliRunner().invoke(app, ["run", "project.yaml", "--out", "out", "--visit", day])
    assert done.exit_code == 2 and "is no day" in done.output and "2026-03-02" in done.output


def test_the_list_of_commands_breaks_no_sentence_off() -> None:
    listed = CliRunner().invoke(app, ["--help"]).output.partition("Commands:")[2]
    assert "check " in listed and "..." not in listed


def test_what_takes_long_and_has_no_steps_is_shown_at_a_terminal_and_leaves_nothing_in_a_log(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Screen().waiting("Reading a.ifc"):
        pass
    assert capsys.readouterr().out == ""
    monkeypatch.setenv("FORCE_COLOR", "1")
    with Screen().waiting("Reading \x1b[31ma.ifc"):
        pass
    assert "Reading [31ma.ifc" in capsys.readouterr().out.replace("\ufffd", "")


def test_a_log_holds_no_password_of_an_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("sys.argv", ["asbuilt-bim", "run", "--scheduler", "tls://anna:secret@10.0.0.5:8786"])
    log = write_crash_log(RuntimeError("tcp://anna:secret@10.0.0.5 is gone"))
    assert log is not None
    text = log.read_text(encoding="utf-8")
    assert "secret" not in text and text.count("//...@10.0.0.5") == 2
