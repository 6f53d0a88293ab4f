"""Plain values into frozen dataclasses, with every mistake collected, not only the first.

Supported: dataclasses, `tuple[T, ...]`, `dict[str, T]`, `T | None`, `Literal`, `Annotated` with `Within`, `str`, `int`,
`float`, `bool`, `date`. Whatever else stands in a dataclass (a computed value, a matrix) can't be set from a file.
"""

from __future__ import annotations

import dataclasses
import difflib
import types
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

MOST = 1e15
"""Numbers of a file lie below: nothing that is measured is larger, and floats hold whole numbers no further."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Within:
    """Bounds of a number, both allowed, with its unit; `hint` says what a value outside usually is."""

    low: float
    high: float
    unit: str = ""
    hint: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """One mistake: where (`visits[0].date`), and what was expected against what is there."""

    path: str
    text: str


@dataclass(slots=True)
class Problems:
    """The mistakes found so far."""

    found: list[Problem] = field(default_factory=list)

    def add(self, path: str, text: str) -> None:
        """Note one mistake."""
        self.found.append(Problem(path=path, text=text))


class _Missing:
    """Stands for a value that could not be made; its mistake is in `Problems`."""


_MISSING = _Missing()


def structure(value: object, kind: Any, problems: Problems, path: str = "") -> Any:
    """Return `value` as `kind`; where that fails the mistakes are in `problems` and the answer is of no use."""
    result = _any(value, kind, problems, path)
    return None if result is _MISSING else result


def _any(value: object, kind: Any, problems: Problems, path: str) -> object:
    origin = get_origin(kind)
    if origin is Annotated:
        inner, *bounds = get_args(kind)
        result = _any(value, inner, problems, path)
        return _bounded(result, bounds, problems, path)
    if origin in (Union, types.UnionType):
        return _optional(value, kind, problems, path)
    if origin is Literal:
        choices = get_args(kind)
        if any(value == choice and type(value) is type(choice) for choice in choices):
            return value
        return _wrong(problems, path, " or ".join(show(choice) for choice in choices), value, choices)
    if origin is tuple:
        return _sequence(value, get_args(kind), problems, path)
    if origin is dict:
        return _mapping(value, get_args(kind)[1], problems, path)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _record(value, kind, problems, path)
    return _scalar(value, kind, problems, path)


def _scalar(value: object, kind: Any, problems: Problems, path: str) -> object:
    if kind is bool:
        return value if isinstance(value, bool) else _wrong(problems, path, "true or false", value)
    if kind is int:
        whole = isinstance(value, int) and not isinstance(value, bool)
        if isinstance(value, int) and whole and not -MOST < value < MOST:
            return _wrong(problems, path, f"a whole number of less than {MOST:.0e}", value)
        return value if whole else _wrong(problems, path, "a whole number", value)
    if kind is float:
        number = isinstance(value, int | float) and not isinstance(value, bool) and -MOST < value < MOST
        return float(value) if number else _wrong(problems, path, "a number", value)  # type: ignore[arg-type]
    if kind is str:
        if isinstance(value, str) and value.strip():
            return value
        quoted = "" if isinstance(value, str) or value is None else "; put it in quotes"
        return _wrong(problems, path, "text", value, after=quoted)
    if kind is date:
        plain = isinstance(value, date) and not isinstance(value, datetime)
        return value if plain else _wrong(problems, path, "a date such as 2026-03-02", value)
    problems.add(path, "can't be set in a file")
    return _MISSING


def _optional(value: object, kind: Any, problems: Problems, path: str) -> object:
    if value is None:
        return None
    kinds = [k for k in get_args(kind) if k is not type(None)]
    for candidate in kinds[:-1]:
        trial = Problems()
        result = _any(value, candidate, trial, path)
        if not trial.found:
            return result
    return _any(value, kinds[-1], problems, path)


def _sequence(value: object, arguments: tuple[Any, ...], problems: Problems, path: str) -> object:
    if not isinstance(value, list):
        return _wrong(problems, path, "a list (lines that start with '- ')", value)
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        kinds = [arguments[0]] * len(value)
    elif len(arguments) == len(value):
        kinds = list(arguments)
    else:
        return _wrong(problems, path, f"a list of {len(arguments)} values", value)
    items = [_any(item, k, problems, f"{path}[{i}]") for i, (item, k) in enumerate(zip(value, kinds, strict=True))]
    return _MISSING if any(item is _MISSING for item in items) else tuple(items)


def _mapping(value: object, kind: Any, problems: Problems, path: str) -> object:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        return _wrong(problems, path, "keys with values", value)
    items = {key: _any(item, kind, problems, f"{path}.{key}") for key, item in value.items()}
    return _MISSING if any(item is _MISSING for item in items.values()) else items


def _record(value: object, kind: type, problems: Problems, path: str) -> object:
    if not isinstance(value, dict):
        return _wrong(problems, path, "keys with values", value)
    hints = get_type_hints(kind, include_extras=True)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    prefix = f"{path}." if path else ""
    complete = True
    for key in value:
        if key not in fields:
            near = difflib.get_close_matches(str(key), fields, n=1, cutoff=0.6)
            hint = f"; did you mean {near[0]}?" if near else f"; known here: {', '.join(sorted(fields))}"
            if isinstance(key, int):  # {diameter_m: 0,30}
                hint = "; a decimal comma? write a point"
            problems.add(f"{prefix}{key}", f"unknown key{hint}")
            complete = False
    made: dict[str, object] = {}
    for name, declared in fields.items():
        if name in value:
            made[name] = _any(value[name], hints[name], problems, f"{prefix}{name}")
            complete = complete and made[name] is not _MISSING
        elif declared.default is dataclasses.MISSING and declared.default_factory is dataclasses.MISSING:
            problems.add(f"{prefix}{name}", "is missing")
            complete = False
    if not complete:
        return _MISSING
    try:
        return kind(**made)
    except ValueError as problem:
        problems.add(path, str(problem))
        return _MISSING


def _bounded(value: object, bounds: list[Any], problems: Problems, path: str) -> object:
    for bound in bounds:
        if not isinstance(bound, Within) or not isinstance(value, int | float):
            continue
        if not bound.low <= value <= bound.high:
            unit = f" {bound.unit}" if bound.unit else ""
            hint = f"; {bound.hint}" if bound.hint else ""
            problems.add(path, f"expected {bound.low:g} to {bound.high:g}{unit}, got {value:g}{unit}{hint}")
            return _MISSING
    return value


def _wrong(
    problems: Problems, path: str, expected: str, got: object, choices: tuple[object, ...] = (), after: str = ""
) -> _Missing:
    near = difflib.get_close_matches(str(got), [str(c) for c in choices], n=1, cutoff=0.6) if choices else []
    hint = f"; did you mean {near[0]}?" if near and len(choices) > 1 else ""
    problems.add(path, f"expected {expected}, got {show(got)}{hint}{after}")
    return _MISSING


def show(value: object) -> str:
    """Return a value as a message shows it: short, with its sort where that helps."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "keys with values"
    if isinstance(value, list):
        return "a list"
    text = str(value)
    text = text if len(text) <= 60 else text[:57] + "..."
    return f"'{text}'" if isinstance(value, str) else text
