"""Finds the JSON Schemas (in the wheel or beside the package), and says in words where a document fails one."""

import json
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

MAX_FAULTS = 5
ARRAY_DEFINITIONS = ("vector2", "vector3", "matrix3", "matrix4", "matrix6", "ring2", "ring3")
"""Definitions of pure number arrays: here only known to be lists, since numpy holds them to shape and finiteness
a thousand times faster when they are read (`arrays_json`)."""


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


def schema_bytes(name: str) -> bytes:
    """Return a schema's file, to be laid beside a document.

    Raises:
        FileNotFoundError: no schema has this name.
    """
    return (schema_folder() / f"{name}.json").read_bytes()


@cache
def schema(name: str) -> dict[str, Any]:
    """Read one schema by its name, such as `result-1`; treat what is returned as read-only.

    Raises:
        FileNotFoundError: no schema has this name.
    """
    loaded: dict[str, Any] = json.loads((schema_folder() / f"{name}.json").read_text(encoding="utf-8"))
    return loaded


def first_faults(name: str, document: Any, *, newer: bool = False) -> list[str]:
    """Return up to `MAX_FAULTS` faults as `place: what is wrong`; `newer` lets unknown keys pass."""
    errors = _validator(name, newer).iter_errors(document)
    faults: list[str] = []
    for error in errors:
        faults.append(f"{_place(error)}: {_short(error)}")
        if len(faults) == MAX_FAULTS:
            break
    return faults


@cache
def _validator(name: str, newer: bool) -> Draft202012Validator:
    """Make the validator of one schema."""
    return Draft202012Validator(_adapted(schema(name), newer))


def _adapted(part: Any, newer: bool) -> Any:
    """Return a copy of a schema with number arrays left to numpy and, for newer files, unknown keys allowed."""
    if isinstance(part, list):
        return [_adapted(item, newer) for item in part]
    if not isinstance(part, dict):
        return part
    copied = {key: _adapted(value, newer) for key, value in part.items()}
    if newer and copied.get("additionalProperties") is False:
        del copied["additionalProperties"]
    if isinstance(copied.get("$defs"), dict):
        copied["$defs"] |= {key: {"type": "array"} for key in ARRAY_DEFINITIONS if key in copied["$defs"]}
    return copied


def _place(error: ValidationError) -> str:
    """Write a fault's place as `elements[3].completion.best`."""
    text = ""
    for step in error.absolute_path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else str(step)
    return text or "the whole document"


def _short(error: ValidationError) -> str:
    """Say what is wrong without printing the whole value."""
    message = str(error.message)
    return message if len(message) <= 160 else f"{message[:70]} ... {message[-80:]}"
