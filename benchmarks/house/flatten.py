"""Any result as one flat table of paths and plain values, so that two programs' results can be held together."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

Plain = float | int | bool | str | None
Flat = dict[str, Plain]

LEFT_OUT = {
    *("seconds", "provenance", "program_version", "created", "libraries", "networks", "made_with", "program"),
    *("reason", "remedy", "what", "text", "texts", "code", "subject", "values", "value", "limit", "source", "method"),
    *("notes", "doubts", "rig_notes", "thumbnail_jpeg", "picture", "pictures", "options", "title", "description"),
}
"""Keys that hold times, versions, or wording: what may differ between two programs that give the same numbers."""
IDENTIFIER = re.compile(r"[\w$./: -]{1,64}")
SMALL_ARRAY = 16
DECIMALS = 12


def flatten(value: Any, path: str = "") -> Iterator[tuple[str, Plain]]:
    """Yield every number, state and name of a value with its path; arrays by their shape and digest."""
    if is_dataclass(value) and not isinstance(value, type):
        if not {"reason", "remedy"} <= {field.name for field in fields(value)} and type(value).__name__ != "Rejection":
            for field in fields(value):
                if field.name not in LEFT_OUT:
                    yield from flatten(getattr(value, field.name), f"{path}/{field.name}")
    elif isinstance(value, dict):
        for key in sorted(map(str, value)):
            if key not in LEFT_OUT:
                yield from flatten(value.get(key, value.get(_key_of(value, key))), f"{path}/{key}")
    elif isinstance(value, list | tuple | set | frozenset):
        items = sorted(value, key=repr) if isinstance(value, set | frozenset) else value
        yield f"{path}#", len(items)
        for number, item in enumerate(items):
            yield from flatten(item, f"{path}[{number}]")
    elif isinstance(value, np.ndarray) and value.size > SMALL_ARRAY:
        yield f"{path}@", f"{value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()[:16]}"
    elif isinstance(value, np.ndarray):
        yield from ((f"{path}({number})", float(item)) for number, item in enumerate(value.ravel()))
    else:
        yield from _plain(value, path)


def _plain(value: Any, path: str) -> Iterator[tuple[str, Plain]]:
    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, bytes):
        yield f"{path}@", hashlib.sha256(value).hexdigest()[:16]
    elif isinstance(value, np.generic):
        yield path, value.item()
    elif value is None or isinstance(value, bool | int | float):
        yield path, value
    if isinstance(value, str) and IDENTIFIER.fullmatch(value) and value.count(" ") < 3:
        yield path, value


def _key_of(value: dict[Any, Any], text: str) -> Any:
    return next(key for key in value if str(key) == text)


def file_table(path: Path) -> Flat:
    """Return the numbers of an output file, by where they stand in it; wording is left out."""
    readers = {".json": _json, ".csv": _csv, ".xlsx": _xlsx, ".ifc": _ifc, ".xml": _xml}
    reader = readers.get(path.suffix)
    return dict(reader(path)) if reader else {"exists": True}


def _json(path: Path) -> Iterator[tuple[str, Plain]]:
    yield from flatten(json.loads(path.read_text(encoding="utf-8")))


def _csv(path: Path) -> Iterator[tuple[str, Plain]]:
    with path.open(encoding="utf-8-sig", newline="") as stream:
        for row, cells in enumerate(csv.reader(stream)):
            yield from ((f"{row}:{column}", number) for column, cell in enumerate(cells) if _is(number := _float(cell)))


def _xlsx(path: Path) -> Iterator[tuple[str, Plain]]:
    from openpyxl import load_workbook

    for number, sheet in enumerate(load_workbook(path).worksheets):
        for row in sheet.iter_rows():
            for cell in row:
                if isinstance(cell.value, int | float):
                    yield f"{number}!{cell.coordinate}", cell.value


def _ifc(path: Path) -> Iterator[tuple[str, Plain]]:
    import ifcopenshell

    rows: dict[str, Counter[str]] = {}
    for entity in ifcopenshell.open(str(path)):
        if not entity.is_a("IfcOwnerHistory"):
            rows.setdefault(entity.is_a(), Counter())[repr(_numbers(list(entity)))] += 1
    for kind, found in sorted(rows.items()):
        yield f"{kind}#", found.total()
        yield f"{kind}@", hashlib.sha256(repr(sorted(found.items())).encode()).hexdigest()[:16]


def _numbers(values: Any) -> list[float]:
    found: list[float] = []
    for value in values if isinstance(values, list | tuple) else [getattr(values, "wrappedValue", values)]:
        if isinstance(value, list | tuple):
            found += _numbers(value)
        elif isinstance(number := getattr(value, "wrappedValue", value) if hasattr(value, "is_a") else value, float):
            found.append(round(number, 6))
    return found


def _xml(path: Path) -> Iterator[tuple[str, Plain]]:
    for number, element in enumerate(ElementTree.parse(path).iter()):
        if _is(found := _float(element.text or "")):
            yield f"{number}:{element.tag.rsplit('}', 1)[-1]}", found


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _is(number: float) -> bool:
    return not math.isnan(number)
