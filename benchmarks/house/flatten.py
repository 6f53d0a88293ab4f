"""Any result as one flat table of paths and plain values, so that two programs' results can be held together."""

from __future__ import annotations

import csv
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
    *("seconds", "provenance", "program_version", "minor", "created", "libraries", "networks", "made_with", "program"),
    *("reason", "remedy", "what", "text", "texts", "code", "subject", "values", "value", "limit", "source", "method"),
    *("notes", "doubts", "rig_notes", "thumbnail_jpeg", "picture", "pictures", "options", "title", "description"),
}
"""Keys that hold times, versions, or wording: what may differ between two programs that give the same numbers."""
IDENTIFIER = re.compile(r"[\w$./: -]{1,64}")
SMALL_ARRAY = 16
SUMMARIES = {"mean": np.mean, "spread": np.std, "least": np.min, "most": np.max}


def flatten(value: Any, path: str = "") -> Iterator[tuple[str, Plain]]:
    """Yield every number, state and name of a value with its path; large arrays by their shape and spread."""
    if is_dataclass(value) and not isinstance(value, type):
        if not {"reason", "remedy"} <= {field.name for field in fields(value)} and type(value).__name__ != "Rejection":
            for field in fields(value):
                if field.name not in LEFT_OUT:
                    yield from _named(field.name, getattr(value, field.name), f"{path}/{field.name}")
    elif isinstance(value, dict):
        for key in sorted(map(str, value)):
            if key not in LEFT_OUT:
                yield from _named(key, value.get(key, value.get(_key_of(value, key))), f"{path}/{key}")
    elif isinstance(value, list | tuple | set | frozenset):
        items = sorted(value, key=repr) if isinstance(value, set | frozenset) else value
        yield f"{path}#", len(items)
        for number, item in enumerate(items):
            yield from flatten(item, f"{path}[{number}]")
    elif isinstance(value, np.ndarray) and value.size > SMALL_ARRAY:
        yield f"{path}@shape", str(value.shape)
        finite = np.where(np.isfinite(value), value, 0.0).astype(np.float64)
        yield from ((f"{path}@{name}", float(reduce(finite))) for name, reduce in SUMMARIES.items())
    elif isinstance(value, np.ndarray):
        yield from ((f"{path}({number})", float(item)) for number, item in enumerate(value.ravel()))
    else:
        yield from _plain(value, path)


def _named(name: str, value: Any, path: str) -> Iterator[tuple[str, Plain]]:
    """Flatten a field; of regions only their area, since where a ring begins depends on the last digit."""
    if name.endswith("_uv_m") and isinstance(value, list | tuple):
        yield f"{path}@area", float(sum(_ring_area(ring) for ring in _rings(value)))
    elif name not in ("outline_px", "outline_world_m"):
        yield from flatten(value, path)


def _rings(value: Any) -> Iterator[Any]:
    """Yield the rings (N, 2) in nested tuples, lists or arrays."""
    if isinstance(value, np.ndarray) or (value and isinstance(value[0], list | tuple) and _is_point(value[0])):
        yield np.asarray(value, dtype=np.float64)
    else:
        for item in value:
            yield from _rings(item)


def _is_point(value: Any) -> bool:
    return len(value) == 2 and all(isinstance(number, int | float) for number in value)


def _ring_area(ring: Any) -> float:
    u, v = ring[:, 0], ring[:, 1]
    return float(abs(u @ np.roll(v, -1) - v @ np.roll(u, -1)) / 2.0)


def _plain(value: Any, path: str) -> Iterator[tuple[str, Plain]]:
    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, bytes):
        yield f"{path}@", len(value) > 0
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

    counts: Counter[str] = Counter()
    sums: Counter[str] = Counter()
    for entity in ifcopenshell.open(str(path)):
        if not entity.is_a("IfcOwnerHistory"):
            counts[entity.is_a()] += 1
            sums[entity.is_a()] += sum(map(abs, _numbers(list(entity))))  # type: ignore[assignment]
    for kind, count in sorted(counts.items()):
        yield f"{kind}#", count
        yield f"{kind}@sum", float(sums[kind])


def _numbers(values: Any) -> list[float]:
    found: list[float] = []
    for value in values if isinstance(values, list | tuple) else [getattr(values, "wrappedValue", values)]:
        if isinstance(value, list | tuple):
            found += _numbers(value)
        elif isinstance(number := getattr(value, "wrappedValue", value) if hasattr(value, "is_a") else value, float):
            found.append(number)
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
