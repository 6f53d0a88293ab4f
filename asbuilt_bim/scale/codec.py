"""Frozen dataclasses of arrays to bytes and back, exactly, without pickle: a cache must never run code.

Arrays of one type lie end to end behind the rest, which is JSON: a design of 16,000 elements holds half a million.
"""

import gc
import hashlib
import json
import math
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Any, TypeVar, get_origin

import numpy as np
from cattrs.preconf.json import make_converter

from asbuilt_bim.codes import Value

T = TypeVar("T")
MAX_PLAIN_BYTES = 2_000_000_000
"""A station is a few megabytes, a large design some hundred; what unpacks to more than this is damaged."""


@dataclass(slots=True)
class _Pool:
    """Arrays of one type that lie end to end, and how many numbers they have together."""

    parts: list[np.ndarray] = field(default_factory=list)
    count: int = 0


_WRITTEN: ContextVar[dict[str, _Pool]] = ContextVar("arrays that are written, by their type")
_READ: ContextVar[dict[str, np.ndarray]] = ContextVar("arrays that are read, end to end, by their type")


def _is_array(kind: Any) -> bool:
    return kind is np.ndarray or get_origin(kind) is np.ndarray


def _array_out(array: np.ndarray) -> list[Any]:
    """Put an array to those of its type; it is known by its type, by where it begins among them, and by its shape."""
    pool = _WRITTEN.get().setdefault(array.dtype.str, _Pool())
    pool.parts.append(np.ascontiguousarray(array).reshape(-1))
    pool.count += array.size
    return [array.dtype.str, pool.count - array.size, *array.shape]


def _array_in(value: list[Any], _: Any) -> np.ndarray:
    name, start, *shape = value
    array = _READ.get()[name][start : start + math.prod(shape)].reshape(shape).copy()  # the rest may go
    array.flags.writeable = False
    return array


def _value_in(value: Any, _: Any) -> Value:
    """Return a value of a rejection as it was: JSON has lists where we have tuples, and all else alike."""
    kept: Value = tuple(value) if isinstance(value, list) else value
    return kept


def _inflate(data: bytes) -> bytes:
    engine = zlib.decompressobj()
    plain = engine.decompress(data, MAX_PLAIN_BYTES)
    if not engine.eof:
        raise ValueError("cut short, or larger than any measurement")
    return plain


def _array_named(array: np.ndarray) -> dict[str, Any]:
    data = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
    return {"dtype": array.dtype.str, "shape": list(array.shape), "sha256": data}


def _converter(array_out: Callable[[np.ndarray], Any]) -> Any:
    converter = make_converter(detailed_validation=False)
    converter.register_unstructure_hook_func(_is_array, array_out)
    converter.register_structure_hook_func(_is_array, _array_in)
    converter.register_unstructure_hook(float, float)  # numpy's scalars are no JSON
    converter.register_unstructure_hook(int, int)
    converter.register_unstructure_hook(bool, bool)
    converter.register_unstructure_hook(date, lambda day: day.isoformat())
    converter.register_structure_hook(date, lambda text, _: date.fromisoformat(text))
    converter.register_structure_hook(datetime, lambda text, _: datetime.fromisoformat(text))
    converter.register_structure_hook_func(lambda kind: kind == Value, _value_in)
    return converter


_CONVERTER = _converter(_array_out)
_NAMER = _converter(_array_named)


def plain_digest(value: object, kind: Any) -> str:
    """Return the SHA-256 of a value's content: the same for equal arrays, names and numbers, on any machine."""
    plain = _NAMER.unstructure(value, unstructure_as=kind)
    return hashlib.sha256(json.dumps(plain, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def to_bytes(value: object, kind: Any) -> bytes:
    """Return `value` (a dataclass of type `kind`, or a union of such) as compressed bytes."""
    pools: dict[str, _Pool] = {}
    token = _WRITTEN.set(pools)
    try:
        plain = _CONVERTER.unstructure(value, unstructure_as=kind)
    finally:
        _WRITTEN.reset(token)
    head = [json.dumps(part, allow_nan=True, separators=(",", ":")).encode() for part in (_counts(pools), plain)]
    arrays = [part.tobytes() for pool in pools.values() for part in pool.parts]
    return zlib.compress(b"\n".join([*head, b"".join(arrays)]), 1)


def _counts(pools: dict[str, _Pool]) -> dict[str, int]:
    return {name: pool.count for name, pool in pools.items()}


def from_bytes(data: bytes, kind: type[T]) -> T:
    """Return what `to_bytes` made.

    Raises:
        Exception: of any sort, where the bytes are damaged or of another type; the caller computes anew.
    """
    counts, plain, arrays = _inflate(data).split(b"\n", 2)
    pools, at = {}, 0
    for name, count in json.loads(counts).items():
        dtype = np.dtype(str(name))
        if dtype.hasobject:
            raise ValueError("arrays of objects aren't kept")
        pools[name] = np.frombuffer(arrays, dtype=dtype, count=count, offset=at)
        at += pools[name].nbytes
    token = _READ.set(pools)
    try:
        with _collector_paused():
            result: T = _CONVERTER.structure(json.loads(plain), kind)
    finally:
        _READ.reset(token)
    return result


@contextmanager
def _collector_paused() -> Iterator[None]:
    """Look for no cycles of objects meanwhile: what is read is a tree, and looking through it again costs half."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
