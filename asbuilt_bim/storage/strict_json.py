"""JSON read with no surprises: no doubled keys, no NaN; a mistake has its line."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from typing import Any, NoReturn


class _DoubledKeyError(ValueError):
    """A key stands twice in one mapping."""


def parse_json(text: str | bytes) -> Any:
    """Return what a JSON text holds.

    Raises:
        ValueError: it is no JSON, holds NaN or Infinity, or a key twice in one mapping; the text says where.
        RecursionError: it is nested too deep.
    """
    try:
        return json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique)
    except _DoubledKeyError as problem:
        plain = text if isinstance(text, str) else text.decode(json.detect_encoding(text))
        raise ValueError(f"{problem}, in the mapping that begins in line {_line(plain)}") from None


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number of JSON")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise _DoubledKeyError(f'the key "{next(key for key in keys if keys.count(key) > 1):.60}" stands twice')
    return found


def _line(text: str) -> int:
    """Return the line of the first mapping with a doubled key: the slow reader tells where each begins."""
    places: list[int] = []
    decoder: Any = json.JSONDecoder(object_pairs_hook=_unique)
    read: Callable[..., Any] = decoder.parse_object

    def noted(found: tuple[str, int], *rest: Any) -> Any:
        try:
            return read(found, *rest)
        except _DoubledKeyError:
            places.append(found[1])
            raise

    decoder.parse_object = noted
    decoder.scan_once = json.scanner.py_make_scanner(decoder)  # type: ignore[attr-defined]
    with contextlib.suppress(_DoubledKeyError):
        decoder.decode(text)
    return text.count("\n", 0, places[0]) + 1 if places else 1
