"""Plain values into frozen dataclasses by cattrs, strictly: every mistake is collected, not only the first.

Supported: dataclasses, `tuple[T, ...]`, `dict[str, T]`, `T | None`, `tuple | T`, `Literal`, `Annotated` with `Within`,
`str`, `int`, `float`, `bool`, `date`. What else stands in a dataclass (a computed value, a matrix) can't be set.
"""

import dataclasses
import difflib
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from cattrs import Converter
from cattrs.errors import BaseValidationError, ForbiddenExtraKeysError
from cattrs.gen import make_dict_structure_fn, override

Hook = Callable[[Any, Any], Any]
_WRITTEN = re.compile(r"\s*[+-]?[\d.,]+\s*[^\d.,]*")
MOST = 1e15
"""Numbers of a file lie below: nothing that is measured is larger, and floats hold whole numbers no further."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Within:
    """Bounds of a number, both allowed, with its unit; `hint` says what a value above usually is."""

    low: float
    high: float
    unit: str = ""
    hint: str = ""

    def checked(self, value: float) -> float:
        """Return the number, or raise ValueError where it lies outside."""
        if not self.low <= value <= self.high:
            unit, hint = self.unit and f" {self.unit}", f"; {self.hint}" if self.hint and value > self.high else ""
            raise ValueError(f"expected {self.low:g} to {self.high:g}{unit}, got {value:g}{unit}{hint}")
        return value


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """One mistake: where (`visits[0].date`), and what was expected against what is there.

    `meant` is the place that an unknown key was taken for, by its name; `missing` says that nothing stands at `path`.
    """

    path: str
    text: str
    meant: str = ""
    missing: bool = False


@dataclass(slots=True)
class Problems:
    """The mistakes found so far."""

    found: list[Problem] = field(default_factory=list)

    def add(self, path: str, text: str) -> None:
        """Note one mistake."""
        self.found.append(Problem(path=path, text=text))


def structure(value: object, kind: Any, problems: Problems) -> Any:
    """Return `value` as `kind`; where that fails the mistakes are in `problems` and the answer is None."""
    try:
        return _CONVERTER.structure(value, kind)
    except Exception as error:  # cattrs gathers whatever a hook or a __post_init__ raises
        _collect(error, "", problems)
        meant = {problem.meant for problem in problems.found} - {""}  # a key that is only misspelt isn't missing, too
        problems.found[:] = [problem for problem in problems.found if not (problem.missing and problem.path in meant)]
        return None


def _collect(error: BaseException, path: str, problems: Problems) -> None:
    """Note each mistake in cattrs' tree of errors, with the path that its notes give.

    A class may name in `REMOVED` the keys that earlier versions had.
    """
    if isinstance(error, ForbiddenExtraKeysError):
        known, removed = _keys(error.cl), getattr(error.cl, "REMOVED", ())
        for key in sorted(error.extra_fields, key=str):
            near = "" if key in removed else _nearest(key, known)
            hint = f"; did you mean {near}?" if near else f"; known here: {', '.join(sorted(known))}"
            if isinstance(key, int) or str(key).isdecimal():  # {diameter_m: 0,30}, {square_m: 0,08}
                hint = "; a decimal comma? write a point"
            elif key in removed:
                hint = ": earlier versions had it, this one needs it no longer; take it out"
            meant = f"{path}.{near}".lstrip(".") if near else ""
            problems.found.append(Problem(path=f"{path}.{key}".lstrip("."), text=f"unknown key{hint}", meant=meant))
    elif isinstance(error, KeyError):
        problems.found.append(Problem(path=path, text="is missing", missing=True))
    elif not isinstance(error, BaseValidationError):
        problems.add(path, str(error))
    else:
        for inner in error.exceptions:
            note = next(iter(getattr(inner, "__notes__", ())), None)  # of a field, a key or an index
            key = getattr(note, "name", getattr(note, "index", ""))
            step = f"[{key}]" if isinstance(key, int) else f".{key}" if key else ""
            _collect(inner, f"{path}{step}".lstrip("."), problems)


def _nearest(value: object, known: Iterable[object]) -> str:
    return next(iter(difflib.get_close_matches(str(value), map(str, known), n=1, cutoff=0.6)), "")


def _near(value: object, known: Iterable[object]) -> str:
    near = _nearest(value, known)
    return f"; did you mean {near}?" if near else ""


def _shown(value: object) -> str:
    text = f"'{value:.60}'" if isinstance(value, str) else f"{value!s:.60}"
    return {"None": "nothing", "True": "true", "False": "false"}.get(text, text)


def _only(fits: Callable[[Any], object], expected: str, read: Hook | None = None, near: tuple[Any, ...] = ()) -> Hook:
    """Return a hook that refuses what doesn't fit, and reads the rest."""

    def hook(value: object, kind: Any) -> object:
        if not fits(value):
            raise ValueError(f"expected {expected}, got {_shown(value)}{_near(value, near)}")
        return read(value, kind) if read else value

    return hook


def _text(value: object, _: Any) -> str:
    """Return text that isn't blank; a file that is named as other keys name theirs is told how to write it."""
    if isinstance(value, dict) and isinstance(file := value.get("file"), str):
        raise ValueError(f"expected a file's name alone; write {file} without {{file: }}")
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"expected text (a number or a date in quotes), got {_shown(value)}")
    return value


def _number(value: Any, *sorts: type) -> bool:
    return isinstance(value, sorts) and not isinstance(value, bool) and -MOST < value < MOST  # type: ignore[operator]


def _real(value: Any, _: Any) -> float:
    """Return a number; one that is written as in Germany, in quotes or with its unit is told how to write it."""
    if _number(value, int, float):
        return float(value)
    written = _WRITTEN.fullmatch(value) if isinstance(value, str) else None
    advice = "; write a number alone, with a point and without quotes; its unit stands in the key" if written else ""
    raise ValueError(f"expected a number, got {_shown(value)}{advice}")


def _day(value: Any, _: Any) -> date:
    """Return a day, also one in quotes, which YAML takes for text."""
    if isinstance(value, str) and len(value) == len("2026-03-02"):
        with suppress(ValueError):
            value = date.fromisoformat(value)
    if type(value) is not date:
        raise ValueError(f"expected a date such as 2026-03-02, got {_shown(value)}")
    return value


def _of(*origins: Any) -> Callable[[Any], bool]:
    return lambda kind: get_origin(kind) in origins


_CONVERTER = Converter(structure_fallback_factory=lambda _: _only(lambda value: False, "nothing in a file"))
for _kind, _hook in (
    (bool, _only(lambda value: isinstance(value, bool), "true or false")),
    (int, _only(lambda value: _number(value, int), "a whole number")),
    (float, _real),
    (str, _text),
    (date, _day),
):
    _CONVERTER.register_structure_hook(_kind, _hook)


@_CONVERTER.register_structure_hook_factory(_of(Literal))
def _literal(kind: Any) -> Hook:
    choices = get_args(kind)
    same = [(type(choice), choice) for choice in choices]  # True is no 1
    return _only(
        lambda value: (type(value), value) in same,
        " or ".join(map(_shown, choices)),
        near=choices if len(choices) > 1 else (),
    )


@_CONVERTER.register_structure_hook_factory(_of(Annotated))
def _bounded(kind: Any) -> Hook:
    inner, within = get_args(kind)
    return lambda value, _: within.checked(_CONVERTER.structure(value, inner))


@_CONVERTER.register_structure_hook_factory(_of(tuple))
def _tuple(kind: Any) -> Hook:
    first, *rest = get_args(kind)
    if rest == [...]:
        several = list[first]  # type: ignore[valid-type]
        words = "a list (lines that start with '- ')"
        return _only(
            lambda value: isinstance(value, list), words, lambda value, _: tuple(_CONVERTER.structure(value, several))
        )
    size = len(rest) + 1
    each = _CONVERTER.gen_structure_hetero_tuple(kind)
    return _only(lambda value: isinstance(value, list) and len(value) == size, f"a list of {size} values", each)


def _keys(kind: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(kind) if field.init]


@_CONVERTER.register_structure_hook_factory(lambda kind: _of(Union, UnionType)(kind) and NoneType not in get_args(kind))
def _tuple_or(kind: Any) -> Hook:
    several, one = get_args(kind)
    item = get_args(several)[0]
    line = f"'- {_keys(item)[0]}: ...'" if dataclasses.is_dataclass(item) else "'- '"
    other = f"keys such as {', '.join(_keys(one)[:2])}" if dataclasses.is_dataclass(one) else "text"

    def read(value: object, _: Any) -> object:
        if value is None:
            raise ValueError(f"expected a list (lines that start with {line}), or {other}; nothing stands there")
        return _CONVERTER.structure(value, several if isinstance(value, list) else one)

    return read


@_CONVERTER.register_structure_hook_factory(_of(dict))
def _mapping(kind: Any) -> Hook:
    return _only(lambda value: isinstance(value, dict), "keys with values", _CONVERTER.gen_structure_mapping(kind))


@_CONVERTER.register_structure_hook_factory(dataclasses.is_dataclass)
def _record(kind: Any) -> Hook:
    """Return the reader of a dataclass; cattrs itself loses what `Annotated` says."""

    def field_of(hint: Any) -> Any:
        return override(struct_hook=lambda value, _: _CONVERTER.structure(value, hint))

    each = {name: field_of(hint) for name, hint in get_type_hints(kind, include_extras=True).items()}
    read = make_dict_structure_fn(kind, _CONVERTER, _cattrs_forbid_extra_keys=True, **each)
    return _only(lambda value: isinstance(value, dict), f"keys with values, such as {', '.join(_keys(kind)[:2])}", read)
