"""Frozen dataclasses of arrays to bytes and back, exactly, without pickle: a cache must never run code."""

import base64
import hashlib
import json
import zlib
from collections.abc import Callable
from datetime import date
from typing import Any, TypeVar, get_origin

import numpy as np
from cattrs.preconf.json import make_converter

from asbuilt_bim.codes import Value

T = TypeVar("T")
MAX_PLAIN_BYTES = 512_000_000
"""A station's measurement is a few megabytes; anything that unpacks to more than this is damaged."""


def _is_array(kind: Any) -> bool:
    return kind is np.ndarray or get_origin(kind) is np.ndarray


def _array_out(array: np.ndarray) -> dict[str, Any]:
    data = base64.b85encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 1)).decode("ascii")
    return {"dtype": array.dtype.str, "shape": list(array.shape), "data": data}


def _array_in(value: dict[str, Any], _: Any) -> np.ndarray:
    dtype = np.dtype(str(value["dtype"]))
    if dtype.hasobject:
        raise ValueError("arrays of objects aren't kept")
    array = np.frombuffer(_inflate(base64.b85decode(value["data"])), dtype=dtype).reshape(value["shape"])
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


def _converter(array_out: Callable[[np.ndarray], dict[str, Any]]) -> Any:
    converter = make_converter()
    converter.register_unstructure_hook_func(_is_array, array_out)
    converter.register_structure_hook_func(_is_array, _array_in)
    converter.register_unstructure_hook(float, float)  # numpy's scalars are no JSON
    converter.register_unstructure_hook(int, int)
    converter.register_unstructure_hook(bool, bool)
    converter.register_unstructure_hook(date, lambda day: day.isoformat())
    converter.register_structure_hook(date, lambda text, _: date.fromisoformat(text))
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
    plain = _CONVERTER.unstructure(value, unstructure_as=kind)
    return zlib.compress(json.dumps(plain, allow_nan=True, separators=(",", ":")).encode(), 1)


def from_bytes(data: bytes, kind: type[T]) -> T:
    """Return what `to_bytes` made.

    Raises:
        Exception: of any sort, where the bytes are damaged or of another type; the caller computes anew.
    """
    result: T = _CONVERTER.structure(json.loads(_inflate(data)), kind)
    return result
