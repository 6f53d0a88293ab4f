"""A small project out of the shipped sample: a few stations, and the rig calibrated once a test session."""

from __future__ import annotations

import os
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.flow.rig_source import calibrate
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache

SITE = Path(os.environ.get("ASBUILT_BIM_SITE") or Path(__file__).parent.parent / "sample_models" / "site")


def site() -> Path:
    """The sample's folder; a test that needs it is skipped only in an sdist, which leaves the sample out."""
    if not (SITE / "project.yaml").is_file():
        pytest.skip(f"no sample site in {SITE}")
    return SITE


@cache
def contents() -> dict[str, Any]:
    """The sample's project file."""
    loaded: dict[str, Any] = yaml.safe_load((site() / "project.yaml").read_text(encoding="utf-8"))
    return loaded


def of_the_session(factory: pytest.TempPathFactory) -> Path:
    """A folder that all processes of one test session share, and no other session knows."""
    own = factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


def shared_cache(factory: pytest.TempPathFactory) -> Path:
    """The cache of the session: what any test measured with unchanged code, no other has to measure again."""
    return of_the_session(factory) / "cache"


def rig_file(factory: pytest.TempPathFactory) -> Path:
    """The sample's rig, calibrated once a session: a file is whole as soon as it is there."""
    path = of_the_session(factory) / "rig.yaml"
    if not path.exists():
        made = calibrate(read_project(site() / "project.yaml"), Cache(folder=None), lambda *_, **__: None)
        written = factory.mktemp("rig") / "rig.yaml"
        write_rig(made.rig, written)
        written.replace(path)
    return path


def small_project(folder: Path, rig: Path, stations: int = 1) -> dict[str, Any]:
    """Copy the sample's IFC, survey and the first `stations` of its last visit; return the project file's contents."""
    whole = contents()
    folder.mkdir(parents=True, exist_ok=True)
    for name in (whole["ifc"], whole["markers"]["survey"]):
        shutil.copyfile(site() / name, folder / name)
    shutil.copyfile(rig, folder / "rig.yaml")
    visit = whole["visits"][-1]
    made = [copy_station(folder, station) for station in visit["stations"][:stations]]
    return {**whole, "rig": {"file": "rig.yaml"}, "visits": [{"date": visit["date"], "stations": made}]}


def copy_station(folder: Path, station: dict[str, str], name: str = "") -> dict[str, str]:
    """Copy one station's photos under a new name and return its entry."""
    name = name or station["name"]
    entry = {"name": name}
    for side in ("left", "right"):
        entry[side] = f"photos/{name}_{side}.jpg"
        (folder / "photos").mkdir(exist_ok=True)
        shutil.copyfile(site() / station[side], folder / entry[side])
    return entry


def write(folder: Path, project: dict[str, Any]) -> Path:
    """Write the project file."""
    path = folder / "project.yaml"
    path.write_text(yaml.safe_dump(project, allow_unicode=True, sort_keys=False), encoding="utf-8")
    return path
