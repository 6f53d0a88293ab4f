"""A cache that can't be written costs hours in silence: the commands that measure say so, once."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.cli import app
from tests.camera.virtual import rig
from tests.site_fixture import small_project, write


@pytest.fixture
def unphotographed(tmp_path: Path) -> Path:
    """A project whose one photo pair is missing: its commands end in a second."""
    write_rig(rig(), tmp_path / "any.yaml")
    contents = small_project(tmp_path / "site", tmp_path / "any.yaml")
    for photo in (tmp_path / "site" / "photos").iterdir():
        photo.unlink()
    return write(tmp_path / "site", contents)


def said(command: str, project: Path, *more: str) -> str:
    named = ["--project", str(project)] if command == "plan" else [str(project)]
    place = project.parent / {"run": "out", "plan": "plan.html", "label": "labels.json"}[command]
    return CliRunner().invoke(app, [command, *named, "--out", str(place), *more]).stderr


@pytest.mark.parametrize(("command", "named"), [("run", "file"), ("plan", "file/below"), ("label", "file")])
def test_a_cache_that_cannot_be_written_is_told_once_with_its_place(
    command: str, named: str, unphotographed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("ASBUILT_BIM_CACHE", str(tmp_path / named))
    warned = said(command, unphotographed)
    assert warned.count("! cache ") == 1
    assert f"! cache {tmp_path / named}: can't be written (" in warned
    assert "so every run measures all anew; set ASBUILT_BIM_CACHE to a folder that you may write" in warned


def test_a_cache_that_can_be_written_or_is_switched_off_is_no_matter(
    unphotographed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASBUILT_BIM_CACHE", str(tmp_path / "new" / "cache"))
    assert "cache" not in said("run", unphotographed)
    monkeypatch.setenv("ASBUILT_BIM_CACHE", "off")
    assert "cache" not in said("run", unphotographed)
    monkeypatch.setenv("ASBUILT_BIM_CACHE", str(unphotographed))
    assert "cache" not in said("run", unphotographed, "--no-cache")


def test_a_disk_on_which_every_file_looks_like_anybodys_is_told_once(
    unphotographed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASBUILT_BIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("asbuilt_bim.terminal.open_cache.owner_only", lambda about: False)
    warned = said("run", unphotographed)
    assert warned.count("! cache ") == 1 and "shows every file as one that others may write" in warned
