"""Makes `schemas/result-1.json` from the dataclasses of the report, so that the two can't drift apart.

`python -m asbuilt_bim.report.result.schema schemas/result-1.json` writes the file; a test compares them.
"""

import json
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from datetime import date, datetime
from enum import StrEnum
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from asbuilt_bim.codes import Note
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import DesignFaceRecord, ProgressReport, TaskProgress
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.report.result.arrays_json import ARRAY_FORMS, ArrayForm
from asbuilt_bim.report.result.convert import FORMER_NAMES, SHARES
from asbuilt_bim.report.result.document import FORMAT, VERSION
from asbuilt_bim.report.result.notes_json import CODES, note_fields
from asbuilt_bim.report.result.unseen_json import FORMER_KEY, KEY
from asbuilt_bim.report.wording.result_terms import describe, describe_class
from asbuilt_bim.report.wording.unstated import TEXTS

FORMER_UNSEEN, UNSEEN, UNSEEN_SHORT = "UnseenFace", "UnseenElement", "UnseenElementFace"
_NUMBER = {"type": "number"}
_SHAPES: dict[tuple[int | None, ...], str] = {
    (2,): "vector2",
    (3,): "vector3",
    (3, 3): "matrix3",
    (4, 4): "matrix4",
    (6, 6): "matrix6",
    (7, 7): "matrix7",
    (None, 2): "ring2",
    (None, 3): "ring3",
    (None, None): "grid",
}


def result_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of `result.json`."""
    definitions: dict[str, Any] = {name: _array_schema(shape) for shape, name in _SHAPES.items()}
    body = _object(ProgressReport, definitions)
    head = {
        "format": {"const": FORMAT, "description": "What this file is."},
        "version": {"const": VERSION, "description": "Raised when an older program could no longer read the file."},
        "minor": {"type": "integer", "minimum": 0, "description": "Raised when keys are added."},
    }
    definitions[FORMER_UNSEEN] = _former_unseen_face(definitions)
    definitions[UNSEEN_SHORT] = _unseen_face(definitions)
    definitions[UNSEEN] = _unseen_element()
    unseen = {
        key: {"type": "array", "items": {"$ref": f"#/$defs/{name}"}, "description": describe("", key)}
        for key, name in ((FORMER_KEY, FORMER_UNSEEN), (KEY, UNSEEN))
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "https://asbuilt-bim.org/schemas/result-1.json",
        "title": "asbuilt_bim result",
        "description": f"{body['description']} Lengths in metres, areas in m2, angles in radians, unless it says px.",
        "type": "object",
        "properties": head | body["properties"] | unseen,
        "required": [*head, *body["required"]],
        "additionalProperties": False,
        "$defs": dict(sorted(definitions.items())),
    }


def _unseen_element() -> dict[str, Any]:
    """Return the schema of what an element that nobody has seen holds of its faces."""
    faces = {"type": "array", "items": {"$ref": f"#/$defs/{UNSEEN_SHORT}"}}
    return {
        "type": "object",
        "description": describe_class(UNSEEN),
        "properties": {
            "element": {"type": "string", "description": describe(UNSEEN, "element")},
            "faces": faces | {"description": describe(UNSEEN, "faces")},
        },
        "required": ["element", "faces"],
        "additionalProperties": False,
    }


def _unseen_face(definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of such an element's face, without what follows from the rest."""
    of_face = definitions[DesignFaceRecord.__name__]["properties"]
    frame = {"type": "array", "items": {"$ref": "#/$defs/vector3"}, "minItems": 2, "maxItems": 3}
    own: dict[str, dict[str, Any]] = {
        "id": {"type": "string"},
        "frame_m": frame,
        "exposed_area_m2": _NUMBER,
        "radius_m": _NUMBER,
    }
    properties: dict[str, Any] = {name: of_face[name] for name in ("role", "area_m2", "exposed_uv_m")}
    for name, part in own.items():
        properties[name] = {**part, "description": describe(UNSEEN_SHORT, name)}
    return {
        "type": "object",
        "description": describe_class(UNSEEN_SHORT),
        "properties": properties,
        "required": ["id", "role", "frame_m", "area_m2", "exposed_uv_m"],
        "additionalProperties": False,
    }


def _former_unseen_face(definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a face of an element that nobody has seen: a design face without a state."""
    face: dict[str, Any] = definitions[DesignFaceRecord.__name__]
    state = definitions[SurfaceState.__name__]
    properties = {name: part for name, part in face["properties"].items() if name != "surface"}
    return face | {
        "description": describe_class(UNSEEN),
        "properties": properties | {"unknown_uv_m": state["properties"]["unknown_uv_m"]},
        "required": [name for name in face["required"] if name != "surface"],
    }


def _object(cls: type[Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of one dataclass; those it holds go into `definitions`."""
    hints = get_type_hints(cls)
    noted = note_fields(cls)
    properties: dict[str, Any] = {}
    required: list[str] = []
    for field in fields(cls):
        if field.name in ARRAY_FORMS:
            part = _array_field(ARRAY_FORMS[field.name], optional=type(None) in get_args(hints[field.name]))
        else:
            part = _schema_of(hints[field.name], definitions)
        if field.name in SHARES:
            part = part | {"minimum": 0, "maximum": 1}
        if field.name in noted:
            codes = {"type": "array", "items": _schema_of(Note, definitions)}
            properties[CODES[field.name]] = codes | {"description": describe(cls.__name__, CODES[field.name])}
            part = {"type": "array", "items": {"type": "string"}}
        properties[field.name] = part | {"description": describe(cls.__name__, field.name)}
        if field.default is MISSING and field.default_factory is MISSING:
            required.append(field.name)
    if cls is TaskProgress:
        properties |= {
            former: properties[name] | {"description": describe(cls.__name__, former)}
            for name, former in FORMER_NAMES.items()
        }
    if cls is Rejection:  # results before version 1.4 have its English texts only
        properties |= {name: {"type": "string", "description": describe(cls.__name__, name)} for name in TEXTS}
        required = ["what", "reason"]
    return {
        "type": "object",
        "description": describe_class(cls.__name__),
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _schema_of(kind: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of one annotation."""
    plain = {str: {"type": "string"}, bool: {"type": "boolean"}, int: {"type": "integer"}, float: _NUMBER}
    dated = {date: {"type": "string", "format": "date"}, datetime: {"type": "string", "format": "date-time"}}
    if kind in plain or kind in dated:
        return dict((plain | dated)[kind])
    if is_dataclass(kind) and isinstance(kind, type):
        definitions.setdefault(kind.__name__, {})
        definitions[kind.__name__] = definitions[kind.__name__] or _object(kind, definitions)
        return {"$ref": f"#/$defs/{kind.__name__}"}
    if isinstance(kind, type) and issubclass(kind, StrEnum):  # more may be added: an older program reads on
        return {"type": "string", "examples": [str(member) for member in kind]}
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin in (Union, UnionType):
        return {"anyOf": [{"type": "null"} if a is type(None) else _schema_of(a, definitions) for a in arguments]}
    if origin is tuple and len(arguments) == 2 and arguments[1] is Ellipsis:
        return {"type": "array", "items": _schema_of(arguments[0], definitions)}
    if origin in (dict, Mapping):
        return {"type": "object", "additionalProperties": _schema_of(arguments[1], definitions)}
    raise TypeError(f"no JSON form is known for {kind}: enter arrays in ARRAY_FORMS, or extend result_schema")


def _array_field(form: ArrayForm, *, optional: bool) -> dict[str, Any]:
    """Return the schema of an array field."""
    part: dict[str, Any] = {"$ref": f"#/$defs/{_SHAPES[form.shape]}"}
    for _ in range(form.nesting):
        part = {"type": "array", "items": part}
    return {"anyOf": [part, {"type": "null"}]} if optional else part


def _array_schema(shape: tuple[int | None, ...]) -> dict[str, Any]:
    """Return the schema of nested lists of numbers of one shape."""
    part: dict[str, Any] = dict(_NUMBER)
    for length in reversed(shape):
        bounds = {} if length is None else {"minItems": length, "maxItems": length}
        part = {"type": "array", "items": part} | bounds
    return part


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(result_schema(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
