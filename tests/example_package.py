"""The example plugin package as an installer would leave it: its modules and its metadata, put on the path."""

from __future__ import annotations

import importlib
import shutil
import sys
import tomllib
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent / "example_plugin"


def install_example(folder: Path) -> Path:
    """Lay the package out in a folder as `pip install --target` does; return the folder, to be put on the path."""
    project = tomllib.loads((SOURCE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    shutil.copytree(SOURCE / "src", folder, dirs_exist_ok=True)
    info = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"]
    lines = [f"[{group}]\n" + "\n".join(f"{k} = {v}" for k, v in points.items()) for group, points in groups.items()]
    (info / "entry_points.txt").write_text("\n\n".join(lines) + "\n")
    return folder


@pytest.fixture
def example_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Have the example installed for one test."""
    folder = install_example(tmp_path / "site-packages")
    monkeypatch.syspath_prepend(str(folder))
    importlib.invalidate_caches()
    for name in [name for name in sys.modules if name.split(".")[0] == "asbuilt_bim_example"]:
        monkeypatch.delitem(sys.modules, name)
    return folder
