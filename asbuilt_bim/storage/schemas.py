"""Finds the JSON Schemas (in the wheel or beside the package), and says in words where a document fails one."""

import json
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from jsonschema_rs import Draft202012Validator, ValidationError


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


def first_fault(name: str, document: Any, *, newer: bool = False) -> str:
    """Return a document's first fault as `place: what is wrong`, "" without one; `newer` lets unknown keys pass."""
    validator = _validator(name, newer)
    try:
        return _fault(validator, document)
    except ValueError:  # it holds what JSON doesn't; to look for that first would take longer
        try:
            return _fault(validator, _as_json(document))
        except ValueError as error:
            return f"the whole document: {error}"


def _fault(validator: Draft202012Validator, document: Any) -> str:
    try:
        validator.validate(document)
    except ValidationError as error:
        return _told(error)
    return ""


def all_faults(name: str, written: Any) -> list[str]:
    """Return every fault of what a person wrote, of some pages at most: a large document may have millions."""
    try:
        return [_told(error) for error in _validator(name, newer=False).iter_errors(_as_json(written))]
    except ValueError as error:
        return [f"the whole document: {error}"]


def _as_json(document: Any) -> Any:
    """Return a document as JSON has it: YAML's days and numbers in the place of keys are text, so are half characters.

    What is nested too deep for that is returned as it is.
    """
    try:
        return json.loads(json.dumps(document, default=str, ensure_ascii=False).encode("utf-8", "replace"))
    except RecursionError:
        return document


@cache
def _validator(name: str, newer: bool) -> Draft202012Validator:
    """Make the validator of one schema."""
    return Draft202012Validator(_open(schema(name)) if newer else schema(name))


def _open(part: Any) -> Any:
    """Return a copy of a schema that lets unknown keys pass."""
    if isinstance(part, list):
        return [_open(item) for item in part]
    if not isinstance(part, dict):
        return part
    return {key: _open(value) for key, value in part.items() if (key, value) != ("additionalProperties", False)}


def _told(error: ValidationError) -> str:
    """Say where a fault is, as `elements[3].completion.best`, and what is wrong, without printing the whole value."""
    place = ""
    for step in error.instance_path:
        place += f"[{step}]" if isinstance(step, int) else f".{step}" if place else str(step)
    message = str(error.message)
    short = message if len(message) <= 160 else f"{message[:70]} ... {message[-80:]}"
    return f"{place or 'the whole document'}: {short}"
