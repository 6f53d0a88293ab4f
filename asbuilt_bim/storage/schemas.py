"""Finds the JSON Schemas: in the wheel under `asbuilt_bim/schemas`, in a checkout beside the package."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any


def schema_folder() -> Traversable:
    """Return the folder of schemas, whichever way the package was installed.

    Raises:
        FileNotFoundError: the package was installed without them.
    """
    packed = resources.files("asbuilt_bim") / "schemas"
    if packed.is_dir():
        return packed
    beside = Path(__file__).resolve().parents[2] / "schemas"
    if beside.is_dir():
        return beside
    raise FileNotFoundError(f"the JSON Schemas are neither in {packed} nor in {beside}: install asbuilt-bim again")


@cache
def schema(name: str) -> dict[str, Any]:
    """Read one schema by its name, such as `result-1`; treat what is returned as read-only.

    Raises:
        FileNotFoundError: no schema has this name.
    """
    loaded: dict[str, Any] = json.loads((schema_folder() / f"{name}.json").read_text(encoding="utf-8"))
    return loaded
