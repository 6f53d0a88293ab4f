"""Holds a document against one of the package's JSON Schemas, and says in words where it fails."""

from __future__ import annotations

from functools import cache
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from asbuilt_bim.storage.schemas import schema

MAX_FAULTS = 5
ARRAY_DEFINITIONS = ("vector2", "matrix3", "matrix4", "matrix6", "ring2", "ring3")
"""Definitions of pure number arrays: here only known to be lists, since numpy holds them to shape and finiteness
a thousand times faster when they are read (`arrays_json`)."""


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
