"""Damage done to bytes by a seed: what a torn copy, a bad disk or an angry hand leaves of a file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Damage = Callable[[bytes, int, np.random.Generator], bytes]
LENGTHS = (1, 2, 7, 16, 40, 400, 4096)
HOSTILE = (
    b"\x00",
    b"\xff",
    b"'",
    b'"',
    b"-1",
    b"1e999",
    b"nan",
    b"\n",
    b"\xef\xbb\xbf",
    b"\xed\xa0\x80",
    b"99999999999",
)
"""What stumbling blocks are made of: ends of text, numbers without a value, marks, halves of characters."""


def _length(rng: np.random.Generator) -> int:
    return int(rng.choice(LENGTHS))


def flip(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Turn one bit."""
    return data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :]


def cut(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Lose some bytes in the midst."""
    return data[:at] + data[at + _length(rng) :]


def zeros(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Lose a block of a disk: zeros in its place."""
    count = min(_length(rng), len(data) - at)
    return data[:at] + bytes(count) + data[at + count :]


def exchange(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Exchange two pieces."""
    count = min(_length(rng), len(data) // 2)
    first, second = sorted((min(at, len(data) - count), int(rng.integers(max(1, len(data) - count)))))
    if second < first + count:
        return data[:first] + data[first + count :] + data[first : first + count]
    middle = data[first + count : second]
    return data[:first] + data[second : second + count] + middle + data[first : first + count] + data[second + count :]


def end(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Break off; of a picture, half of the times with its end put on again."""
    return data[:at] + data[-12:] * int(rng.integers(2))


def double(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Have a piece twice."""
    count = _length(rng)
    return data[: at + count] + data[at:]


def insert(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Put in what readers stumble over."""
    return data[:at] + HOSTILE[int(rng.integers(len(HOSTILE)))] + data[at:]


TORN: dict[str, Damage] = {"bit": flip, "cut": cut, "zeros": zeros, "exchanged": exchange, "ended": end}
"""What happens to files by themselves."""
ANY: dict[str, Damage] = TORN | {"doubled": double, "inserted": insert}


def mutated(
    data: bytes, rng: np.random.Generator, kinds: dict[str, Damage] = ANY, first: int = 0, times: int = 1
) -> tuple[str, bytes]:
    """Return what was done, and the bytes after it, from byte `first` on; half of the times a bit is turned."""
    names = [*kinds, *["bit"] * (len(kinds) - 2)]
    done = []
    for _ in range(times):
        if len(data) <= first + 1:
            break
        name = names[int(rng.integers(len(names)))]
        data = kinds[name](data, int(rng.integers(first, len(data))), rng)
        done.append(name)
    return "+".join(done), data
