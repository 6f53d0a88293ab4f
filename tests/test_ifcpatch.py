from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path

import ifcopenshell
import pytest
from click.testing import CliRunner

import asbuilt_bim
from asbuilt_bim.cli import app
from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import write_asbuilt
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.reports import report_on
from tests.site_fixture import site

pytest.importorskip("ifcpatch", reason="ifcpatch isn't installed: pip install ifcpatch")


def patch(folder: Path, source: Path, result: Path) -> subprocess.CompletedProcess[str]:
    """Run the real ifcpatch in a process of its own, as a user does."""
    recipes = CliRunner().invoke(app, ["ifcpatch-dir"]).output.strip()
    command = [
        "-m",
        "ifcpatch",
        "-r",
        "AsBuiltProgress",
        "-i",
        str(source),
        "-o",
        str(folder / "out.ifc"),
        "-a",
        str(result),
    ]
    place = {**os.environ, "IFCPATCH_RECIPE_DIR": recipes}
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=place, capture_output=True, text=True, check=False
    )


def data_of(path: Path) -> list[str]:
    return [str(entity) for entity in ifcopenshell.open(str(path))]


def test_ifcpatch_finds_the_recipe_and_writes_what_a_run_writes(tmp_path: Path) -> None:
    source = site() / "design.ifc"
    design = read_design(source, None)
    report = report_on(design, {element.name: 0.5 for element in design.elements[:6]})
    write_result(report, tmp_path / "result.json")
    done = patch(tmp_path, source, tmp_path / "result.json")
    assert done.returncode == 0, done.stderr
    write_asbuilt(source, read_result(tmp_path / "result.json"), tmp_path / "direct.ifc", words=note_words)
    assert data_of(tmp_path / "out.ifc") == data_of(tmp_path / "direct.ifc")
    again = patch(tmp_path, tmp_path / "out.ifc", tmp_path / "result.json")
    assert again.returncode == 0
    assert data_of(tmp_path / "out.ifc") == data_of(tmp_path / "direct.ifc")


def test_a_result_that_cannot_be_used_is_refused_in_a_sentence_and_nothing_is_written(tmp_path: Path) -> None:
    source = site() / "design.ifc"
    design = read_design(source, None)
    result = tmp_path / "result.json"
    write_result(report_on(design, {}), result)
    document = json.loads(result.read_text(encoding="utf-8"))
    document["elements"][0]["global_id"] = "0000000000000000000000"
    for text, says in [(json.dumps(document), "belongs to another design"), ("{", "damaged")]:
        result.write_text(text, encoding="utf-8")
        done = patch(tmp_path, source, result)
        assert done.returncode == 1
        assert "error: AsBuiltProgress:" in done.stderr
        assert says in done.stderr
        assert "Traceback" not in done.stderr
        assert not (tmp_path / "out.ifc").exists()


def test_a_result_that_is_no_path_is_refused_in_a_sentence() -> None:
    recipe = runpy.run_path(str(Path(asbuilt_bim.__file__).parent / "ifcpatch_recipes" / "AsBuiltProgress.py"))
    with pytest.raises(AsBuiltError, match=r"^result: None is no path"):
        recipe["Patcher"](ifcopenshell.file(), result=None).patch()


def test_ifcpatch_reads_the_recipes_documentation() -> None:
    import importlib.util

    import ifcpatch

    folder = Path(CliRunner().invoke(app, ["ifcpatch-dir"]).output.strip())
    spec = importlib.util.spec_from_file_location("AsBuiltProgress", folder / "AsBuiltProgress.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    told = ifcpatch._extract_docs(module.Patcher, "__init__", ("file", "logger"))
    assert list(told["inputs"]) == ["result"]
    assert told["inputs"]["result"]["default"] == "result.json"
    assert "asbuilt-bim run" in told["inputs"]["result"]["description"]
