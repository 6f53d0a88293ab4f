from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

BOOTSTRAP = Path(__file__).parent.parent / "bootstrap.py"


def bootstrap(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(BOOTSTRAP), *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=False,
    )


def test_it_needs_nothing_but_the_standard_library() -> None:
    tree = ast.parse(BOOTSTRAP.read_text(encoding="utf-8"))
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert {name.split(".")[0] for name in names} <= sys.stdlib_module_names


def test_an_old_python_can_read_it_to_say_that_it_is_too_old() -> None:
    ast.parse(BOOTSTRAP.read_text(encoding="utf-8"), feature_version=(3, 6))


@pytest.mark.parametrize("arguments", [(), ("tset",)])
def test_a_wrong_command_shows_the_two_right_ones(arguments: tuple[str, ...]) -> None:
    done = bootstrap(*arguments)
    assert done.returncode == 2
    assert "bootstrap.py run" in done.stdout
    assert "bootstrap.py test" in done.stdout


def test_a_set_up_environment_is_used_as_it_is(tmp_path: Path) -> None:
    # A stand-in for the environment's Python shows what is called: what is installed is not installed again.
    if os.name == "nt":
        pytest.skip("the stand-in is a shell script")
    (tmp_path / "bin").mkdir()
    (tmp_path / "pyvenv.cfg").write_text("")
    python = tmp_path / "bin" / "python"
    python.write_text(f'#!/bin/sh\necho "$@" >> "{tmp_path}/calls"\n')
    python.chmod(0o755)
    for _ in range(2):
        assert bootstrap("test", "-k", "x", ASBUILT_BIM_VENV=str(tmp_path)).returncode == 0
    assert bootstrap("run", "p.yaml", "--out", "o", ASBUILT_BIM_VENV=str(tmp_path)).returncode == 0
    calls = (tmp_path / "calls").read_text().splitlines()
    called = [call.removeprefix("-P ").split()[:2] for call in calls]
    assert called == [["-m", "pip"], ["-m", "pytest"], ["-m", "pytest"], ["-m", "asbuilt_bim"]]
    assert calls[0].startswith("-P ")  # a pip.py where one stands is no pip
    assert calls[-1] == "-P -m asbuilt_bim run p.yaml --out o"
