"""Names with umlauts where the system's names aren't UTF-8: they work where they can, and are refused early else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder
from tests.project_folder import plain, write_project

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="names are UTF-8 on this system, whatever the locale")


def in_ascii(*arguments: str | Path, status: int = 0) -> str:
    """What a command of Python prints in a locale without umlauts."""
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "COLUMNS": "400"}
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


def test_a_design_in_a_folder_with_an_umlaut_is_read_and_its_copy_written(tmp_path: Path) -> None:
    folder = tmp_path / "Büro Süd"
    folder.mkdir()
    builder = ModelBuilder()
    builder.box("IfcColumn", "column", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    source = builder.write(folder / "Pläne.ifc")
    in_ascii("-m", "asbuilt_bim", "strip", source, "--out", folder / "ohne Zusätze.ifc")
    assert sorted(path.name for path in folder.iterdir()) == ["Pläne.ifc", "ohne Zusätze.ifc"]
    assert len(read_design(folder / "ohne Zusätze.ifc").elements) == 1


def test_a_name_in_a_project_that_no_file_can_have_here_is_refused_with_its_line(tmp_path: Path) -> None:
    contents = plain()
    contents["ifc"] = "Büro.ifc"
    said = in_ascii("-m", "asbuilt_bim", "run", write_project(tmp_path, contents), status=1)
    assert "'B?ro.ifc' holds a letter that file names can't in this locale (ascii); set PYTHONUTF8=1" in said
    assert "  line 4: ifc: 'B?ro.ifc' holds" in said


def test_a_draft_of_a_folder_with_such_names_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "Pläne.ifc").write_bytes(b"")
    said = in_ascii("-m", "asbuilt_bim", "init", tmp_path, status=1)
    assert said.startswith("error: a file's or folder's name holds a letter that file names can't in this locale")
