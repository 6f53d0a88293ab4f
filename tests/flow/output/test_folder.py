from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output.folder import OutputFolder, Published, open_output, read_current
from asbuilt_bim.storage.schemas import first_fault

NOON = datetime(2026, 3, 2, 12, 0, tzinfo=UTC)
DIGEST = "0123456789abcdef"


def fill(text: str, overlays: tuple[str, ...] = ("A1.jpg",)):  # type: ignore[no-untyped-def]
    def write(folder: Path) -> None:
        (folder / "result.json").write_text(text)
        (folder / "report.html").write_text(f"page {text}")
        (folder / "design.asbuilt.ifc").write_text("ifc")
        (folder / "rig.yaml").write_text("rig")
        (folder / "overlays").mkdir()
        for name in overlays:
            (folder / "overlays" / name).write_text("picture")

    return write


def publish(out: OutputFolder, text: str, minutes: int = 0, **more: tuple[str, ...]) -> Published:
    when = NOON + timedelta(minutes=minutes)
    return out.publish(fill(text, **more), when=when, digest=DIGEST, ifc=["../design.ifc"])


def files(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_run_is_written_whole_made_current_and_copied(tmp_path: Path) -> None:
    with open_output(tmp_path / "out") as out:
        published = publish(out, "one")
    current = read_current(tmp_path / "out")
    assert current is not None
    assert current.folder == published.folder == tmp_path / "out/runs/20260302T120000Z-01234567"
    assert current.ifc == ("../design.ifc",)
    assert first_fault("current-1", json.loads((tmp_path / "out/current.json").read_text())) == ""
    assert (tmp_path / "out/report.html").read_text() == "page one"
    assert (tmp_path / "out/overlays/A1.jpg").is_file()
    assert not (tmp_path / "out/rig.yaml").exists()
    assert published.runs_kept == 1
    assert published.warnings == ()


def test_a_second_run_keeps_the_first_and_takes_its_stale_copies_away(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        first = publish(out, "one", overlays=("A1.jpg", "A2.jpg"))
        (tmp_path / "overlays/mine.txt").write_text("the user's own")
        second = publish(out, "two", minutes=1)
    assert first.folder.is_dir()
    assert second.runs_kept == 2
    assert sorted(p.name for p in (tmp_path / "overlays").iterdir()) == ["A1.jpg", "mine.txt"]
    assert (tmp_path / "result.json").read_text() == "two"


def test_what_a_person_typed_into_a_copy_is_kept_beside_the_new_one(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        first = publish(out, "one")
        (tmp_path / "report.html").write_text("my price")  # as long as the page, and as old
        os.utime(first.folder / "report.html", (NOON.timestamp(), NOON.timestamp()))
        (tmp_path / "tasks.csv").write_text("mine, of no run")
        os.utime(tmp_path / "report.html", (NOON.timestamp(), NOON.timestamp()))
        second = publish(out, "two", minutes=1)
        third = publish(out, "two", minutes=2)
    assert (tmp_path / "report.html").read_text() == "page two"
    assert (tmp_path / "report.edited-20260302T120000Z.html").read_text() == "my price"
    assert (tmp_path / "tasks.csv").read_text() == "mine, of no run"  # no run writes one here
    assert [w.split(": ")[1] for w in second.warnings] == [
        "isn't what any run kept here wrote; it is kept as report.edited-20260302T120000Z.html"
    ]
    assert third.warnings == ()


def test_what_a_person_drew_on_a_picture_is_kept_beside_the_new_one(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        publish(out, "one", overlays=("A1.jpg", "A2.jpg"))
        for name in ("A1.jpg", "A2.jpg"):  # the second is of no later run: its copy goes
            (tmp_path / "overlays" / name).write_text(f"a circle round a crack on {name}")
        warnings = publish(out, "two", minutes=1).warnings
    kept = sorted(path.read_text() for path in (tmp_path / "overlays").glob("*.edited-*.jpg"))
    assert kept == ["a circle round a crack on A1.jpg", "a circle round a crack on A2.jpg"]
    assert (tmp_path / "overlays/A1.jpg").read_text() == "picture" and len(warnings) == 2


def test_nothing_is_made_from_a_result_that_was_changed_since_its_run_wrote_it(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        run = publish(out, "measured").folder
        (run / "result.json").write_text("a wall more")
        with pytest.raises(OutputError, match=r"was changed since its run wrote it.*is as it was: copy it there"):
            out.current()
        (tmp_path / "result.json").write_text("a wall more")
        with pytest.raises(OutputError, match="put it back from a backup"):
            out.current()
        (run / "result.json").write_text("measured")
        assert out.current() is not None


def test_a_folder_of_before_results_had_digests_is_read(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        publish(out, "one")
        pointer = json.loads((tmp_path / "current.json").read_text())
        (tmp_path / "current.json").write_text(json.dumps({k: v for k, v in pointer.items() if k != "result_sha256"}))
        assert "result_sha256" in pointer and out.current() is not None


def test_two_runs_in_one_second_do_not_share_a_folder(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        assert publish(out, "one").folder != publish(out, "two").folder
        assert out.current() is not None


def test_old_runs_are_taken_away_whole_and_never_the_current_one(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        runs = [publish(out, str(minute), minutes=minute).folder.name for minute in range(4)]
        (tmp_path / "runs/my notes").mkdir()
        (tmp_path / "runs/my notes/plan.txt").write_text("mine")
        last = out.publish(fill("4"), when=NOON + timedelta(minutes=4), digest=DIGEST, ifc=["x"], keep_runs=2)
        left = sorted(path.name for path in (tmp_path / "runs").iterdir() if path.is_dir())
        assert left == [runs[3], last.folder.name, "my notes"] and last.runs_kept == 2
        assert last.bytes_kept == sum(len(data) for run in left[:2] for data in files(tmp_path / "runs" / run).values())
        for minute in (5, 6):
            later = NOON + timedelta(minutes=minute)
            set_aside = out.publish(fill("5"), when=later, digest=DIGEST, ifc=["x"], set_aside=True, keep_runs=1)
            assert set_aside.folder.is_dir() and set_aside.runs_kept == 2 and not set_aside.current
        current = out.current()
    assert current is not None and current.folder == last.folder and last.folder.is_dir()
    assert (tmp_path / "report.html").read_text() == "page 4"


def test_a_run_that_a_valuation_was_signed_on_is_never_taken_away(tmp_path: Path) -> None:
    with open_output(tmp_path) as out:
        runs = [publish(out, str(minute), minutes=minute).folder for minute in range(4)]
        when, signed_on = NOON + timedelta(minutes=4), runs[1]
        out.publish(fill("4"), when=when, digest=DIGEST, ifc=["x"], keep_runs=1, certified=lambda run: run == signed_on)
        assert [run.is_dir() for run in runs] == [False, True, False, False]


@pytest.mark.parametrize(
    "problem", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt(), OutputError("x")]
)
def test_a_run_that_fails_half_way_leaves_the_earlier_one_current(tmp_path: Path, problem: BaseException) -> None:
    def half(folder: Path) -> None:
        (folder / "result.json").write_text("half")
        raise problem

    with open_output(tmp_path) as out:
        publish(out, "one")
        before = files(tmp_path)
        with pytest.raises((OutputError, KeyboardInterrupt)):
            out.publish(half, when=NOON, digest=DIGEST, ifc=["x"])
    assert files(tmp_path) == before


def test_a_full_disk_is_named_with_what_to_do(tmp_path: Path) -> None:
    def full(folder: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(folder / "report.html"))

    with open_output(tmp_path) as out, pytest.raises(OutputError, match=r"disk is full.*Free some space"):
        out.publish(full, when=NOON, digest=DIGEST, ifc=["x"])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_the_systems_own_full_device_is_understood(tmp_path: Path) -> None:
    def full(folder: Path) -> None:
        with Path("/dev/full").open("w") as file:
            file.write("x")

    with open_output(tmp_path) as out, pytest.raises(OutputError, match="disk is full"):
        out.publish(full, when=NOON, digest=DIGEST, ifc=["x"])


@pytest.mark.parametrize("step", ["rename", "replace"])
def test_a_failure_while_the_run_is_made_current_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    def broken(self: Path, target: Path) -> Path:
        raise OSError(errno.EACCES, "Permission denied", str(target))

    with open_output(tmp_path) as out:
        publish(out, "one")
        before = files(tmp_path)
        monkeypatch.setattr(Path, step, broken)
        with pytest.raises(OutputError, match="no right to write"):
            publish(out, "two", minutes=1)
        monkeypatch.undo()
    assert files(tmp_path) == before


def test_a_copy_open_in_another_program_is_named_and_the_run_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Path.replace

    def locked(self: Path, target: Path) -> Path:
        if Path(target).name == "report.html":
            raise PermissionError(errno.EACCES, "Permission denied", str(target))
        return whole(self, target)

    with open_output(tmp_path) as out:
        publish(out, "one")
        monkeypatch.setattr(Path, "replace", locked)
        published = publish(out, "two", minutes=1)
    assert len(published.warnings) == 1
    assert "report.html" in published.warnings[0]
    assert str(published.folder / "report.html") in published.warnings[0]
    assert (tmp_path / "report.html").read_text() == "page one"
    assert (tmp_path / "result.json").read_text() == "two"
    assert not list(tmp_path.glob(".*.part"))


def test_a_copy_that_never_was_there_is_not_said_to_show_an_earlier_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Path.replace

    def full(self: Path, target: Path) -> Path:
        if Path(target).name == "report.html":
            raise OSError(errno.ENOSPC, "No space left on device", str(target))
        return whole(self, target)

    monkeypatch.setattr(Path, "replace", full)
    with open_output(tmp_path) as out:
        (warning,) = publish(out, "one").warnings
    assert "report.html: the disk is full; it is not there. The new one is" in warning


def test_a_second_run_at_the_same_time_is_refused(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from asbuilt_bim.flow.output.folder import open_output\n"
        "with open_output(Path(sys.argv[1])): print('in', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout is not None
    assert other.stdin is not None
    assert other.stdout.readline() == "in\n"
    with pytest.raises(OutputError, match="another run is writing here"), open_output(tmp_path):
        pass
    other.kill()  # a run that was killed leaves no lock behind
    other.communicate()
    with open_output(tmp_path):
        pass


def test_what_a_killed_run_left_is_cleared_away(tmp_path: Path) -> None:
    (tmp_path / "runs/20260302T120000Z-01234567.part").mkdir(parents=True)
    (tmp_path / "overlays").mkdir()
    for name in (".asbuilt-0a1b2c3d.part", "overlays/.asbuilt-0a1b2c3d.part", "mine.part"):
        (tmp_path / name).write_text("half a copy")
    with open_output(tmp_path):
        assert [path.name for path in tmp_path.rglob("*.part")] == ["mine.part"]


def test_a_place_that_cannot_be_written_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file/below"):
        with pytest.raises(OutputError, match="in the way"), open_output(place):
            pass


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
@pytest.mark.parametrize("name", ["overlays", "extra", "extra/plugin", "runs"])
def test_nothing_is_written_through_a_link_in_the_output_folder(tmp_path: Path, name: str) -> None:
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    (elsewhere / ".asbuilt-0a1b2c3d.part").write_text("someone's")
    with open_output(out) as folder:
        publish(folder, "one")
    if (out / name).exists():
        (out / name).rename(tmp_path / "moved")
    (out / name).parent.mkdir(exist_ok=True)
    (out / name).symlink_to(elsewhere, target_is_directory=True)
    with pytest.raises(OutputError, match=f"{name}: is a link, .*choose another --out"), open_output(out):
        pass
    assert files(elsewhere) == {".asbuilt-0a1b2c3d.part": b"someone's"}


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="an administrator may write everywhere")
def test_a_read_only_folder_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="no right to write"), open_output(tmp_path / "out"):
        pass


def test_sources_are_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    photo = tmp_path / "photos/A1.jpg"
    for out, source, says in [
        (tmp_path / "photos", photo, "holds this project's photos"),
        (tmp_path, tmp_path / "overlays/A1.jpg", "would be overwritten"),
        (tmp_path, tmp_path / "quantities.csv", "would be overwritten"),
        (tmp_path, tmp_path / "runs/x/rig.yaml", "result of an earlier run in this folder, .*; name the original file"),
        (tmp_path, tmp_path / "runs/x/result.json", "result of an earlier run in this folder, .*; copy it to a place"),
        (tmp_path / "out", tmp_path / "design.asbuilt.ifc", "result of an earlier run"),
    ]:
        with pytest.raises(OutputError, match=says), open_output(out, [source]):
            pass
    with open_output(tmp_path / "out", [photo, tmp_path / "design.ifc"]):
        pass


@pytest.mark.parametrize("name", ["report.html", "project.yaml", "runs/mine/notes.txt"])
def test_a_folder_that_holds_files_of_others_and_no_run_is_refused_as_it_is(tmp_path: Path, name: str) -> None:
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text("someone's")
    told = f"holds {Path(name).parts[0]}" if "/" not in name else "holds runs"
    with pytest.raises(OutputError, match=told) as refused, open_output(tmp_path):
        pass
    assert f"--out {tmp_path / 'out'}" in str(refused.value)
    assert files(tmp_path) == {name: b"someone's"}


def test_a_folder_is_still_ours_without_its_pointer_and_with_what_the_system_hides(tmp_path: Path) -> None:
    (tmp_path / ".DS_Store").write_text("hidden")
    (tmp_path / "runs").mkdir()
    with open_output(tmp_path) as out:
        publish(out, "one")
    (tmp_path / "current.json").unlink()
    with open_output(tmp_path) as out:
        publish(out, "two", minutes=1)
    assert (tmp_path / "report.html").read_text() == "page two"


def test_a_folder_of_others_among_the_runs_is_not_cleared_away(tmp_path: Path) -> None:
    (tmp_path / "runs/20260302T120000Z-01234567.part").mkdir(parents=True)
    (tmp_path / "runs/film.part").mkdir()
    with open_output(tmp_path):
        assert [path.name for path in (tmp_path / "runs").glob("*.part")] == ["film.part"]


@pytest.mark.parametrize(
    "pointer",
    [
        "nonsense",
        "[]",
        json.dumps({"format": "asbuilt-bim/current", "version": 1, "run": "../../etc"}),
        json.dumps({"format": "asbuilt-bim/current", "version": 2, "run": "runs/20260302T120000Z-01234567"}),
    ],
)
def test_a_damaged_pointer_is_refused_with_the_remedy(tmp_path: Path, pointer: str) -> None:
    (tmp_path / "current.json").write_text(pointer)
    with pytest.raises(OutputError, match="delete it"):
        read_current(tmp_path)
