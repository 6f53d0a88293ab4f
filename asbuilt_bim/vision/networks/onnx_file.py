"""An ONNX file looked at before anything is loaded: is it one, and does it reach for files that aren't its own?

Only the few messages on the way to tensors are walked; everything else is skipped by its length. Protobuf's wire format
is a key of field number and wire type, then a varint, 4 or 8 bytes, or a length and bytes.

Reference: ONNX IR specification, onnx.proto3 (ModelProto, GraphProto, NodeProto, AttributeProto, TensorProto).
"""

import mmap
from collections.abc import Iterator
from pathlib import Path

from asbuilt_bim.errors import NetworkError

MAX_BYTES = 500_000_000
"""Networks that run on a laptop are a tenth of it."""
MAX_DEPTH = 32
_EXTERNAL_DATA = 13
_NEXT: dict[str, dict[int, str]] = {
    "model": {7: "graph", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse"},
    "function": {7: "node"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse", 23: "sparse"},
    "sparse": {1: "tensor", 2: "tensor"},
}
"""Which fields of which message lead to tensors."""


class _DamagedError(Exception):
    """The bytes are no protobuf."""


def check_onnx_file(path: Path) -> None:
    """Check that a file can be an ONNX model and that its external data, if any, lie in its own folder.

    Raises:
        NetworkError: it is too large, empty, no ONNX model, or names files outside its folder.
    """
    data_files(path)


def data_files(path: Path) -> tuple[Path, ...]:
    """Return the files beside an ONNX model that hold its data, by name; none where it holds all itself.

    Raises:
        NetworkError: it is too large, empty, no ONNX model, or names files outside its folder.
    """
    size = path.stat().st_size
    if not 16 <= size <= MAX_BYTES:
        raise NetworkError(
            f"network {path}: {size} bytes (limit 16 to {MAX_BYTES}); this is no network for this program"
        )
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        try:
            fields = {number for number, _, _ in _fields(data, 0, size)}
            places = list(_external(data, 0, size, "model", 0))
        except (_DamagedError, IndexError) as problem:
            raise NetworkError(f"network {path}: is no ONNX file, or a damaged one; export it again") from problem
    if 7 not in fields:
        raise NetworkError(f"network {path}: is no ONNX file (no graph in it); export it again")
    beside = sorted({_beside(path, place) for place in places})
    total = size + sum(file.stat().st_size for file in beside)
    if total > MAX_BYTES:
        raise NetworkError(f"network {path}: {total} bytes with its data exceed {MAX_BYTES}; use a smaller network")
    return tuple(beside)


def _beside(path: Path, place: str) -> Path:
    """Return the file that a tensor's data lie in, in the ONNX file's own folder or below it."""
    folder = path.resolve().parent
    target = (folder / place.replace("\\", "/")).resolve()
    odd = not place or "\0" in place or ":" in place or place.startswith(("/", "\\"))
    if odd or not target.is_relative_to(folder):
        raise NetworkError(f"network {path}: its data '{place[:80]}' lie outside its folder; this is refused")
    if not target.is_file():
        raise NetworkError(f"network {path}: its data file '{place[:80]}' is not there; put it beside it")
    return target


def _external(data: mmap.mmap, start: int, end: int, kind: str, depth: int) -> Iterator[str]:
    """Give the `location` of every tensor below a message that keeps its data in another file."""
    if depth > MAX_DEPTH:
        raise _DamagedError
    for number, low, high in _fields(data, start, end):
        if kind == "tensor" and number == _EXTERNAL_DATA and high > low:
            entry = {n: bytes(data[a:b]) for n, a, b in _fields(data, low, high)}
            if entry.get(1) == b"location":
                yield entry.get(2, b"").decode("utf-8", errors="replace")
        below = _NEXT.get(kind, {}).get(number)
        if below is not None and high > low:
            yield from _external(data, low, high, below, depth + 1)


def _fields(data: mmap.mmap, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Give (field number, first byte, byte after the last) of a message's fields; scalars have no bytes."""
    while at < end:
        key, at = _varint(data, at, end)
        number, wire = key >> 3, key & 7
        low = at
        if wire == 0:
            _, at = _varint(data, at, end)
            low = at
        elif wire == 1:
            low = at = at + 8
        elif wire == 5:
            low = at = at + 4
        elif wire == 2:
            length, low = _varint(data, at, end)
            at = low + length
        else:
            raise _DamagedError
        if at > end or number == 0:
            raise _DamagedError
        yield number, low, at


def _varint(data: mmap.mmap, at: int, end: int) -> tuple[int, int]:
    value = shift = 0
    while at < end and shift < 64:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
    raise _DamagedError
