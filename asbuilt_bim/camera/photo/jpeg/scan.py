"""Is a JPEG's coded data whole? It is walked code by code and its blocks counted; no pixel is made.

Decoders don't tell: one turned bit in a code's length moves every block that follows, and the picture comes out whole
in size and shifted in what it shows. Counting finds it: what is left of the data then has too many blocks, or too few,
or a code that no table has. The decoder itself (`decode.py`) lets some of these pass, and takes what some cameras
leave at the end for damage. Counting can't find a turned bit within a value; `seam.py` looks for the step in brightness
that such a bit leaves. Nor can it find a wrong length that the codes after it make up for exactly, damage in
progressive pictures, or damage before the coded data that leaves valid tables.
"""

import functools
import re
import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

_CHUNK = 1_000_000  # bytes whose bit windows are held at once: 16 MB
_LONGEST_MCU = 4096  # bytes: 10 blocks of 64 codes of at most 27 bits are 2,160
_SPARE = 3  # bytes: what fills the last one up, and a little of what some cameras leave
_RESTART = re.compile(rb"\xff+([\xd0-\xd7])")
_END_OF_DATA = re.compile(rb"\xff[\x01-\xcf\xd8-\xfe]")
_BLOCK = 64
_ENDS = 1024  # added to an advance where the block's end is coded


@dataclass(frozen=True, slots=True, kw_only=True)
class JpegFrame:
    """The picture's size and its smallest coded unit (MCU) in pixels; `data` is where the first scan's codes begin."""

    width_px: int
    height_px: int
    mcu_px: tuple[int, int]  # width, height
    blocks: tuple[tuple[bytes, bytes], ...]  # of an MCU: DC and AC table of each; () where none are counted
    restart: int  # MCUs between restart markers, 0 where there are none
    data: int

    @property
    def mcus(self) -> int:
        """Return how many MCUs the picture has."""
        return -(-self.width_px // self.mcu_px[0]) * -(-self.height_px // self.mcu_px[1])


def jpeg_frame(data: bytes) -> JpegFrame | None:
    """Read the segments up to the first scan's data; None where `data` is no JPEG, or one of an unknown kind."""
    tables: dict[int, bytes] = {}
    parts: list[tuple[int, int, int]] = []  # id, sampling across, sampling down
    restart, kind, size, at = 0, 0, (0, 0), 2
    try:
        while data[:2] == b"\xff\xd8" and data[at] == 0xFF:
            marker = data[at + 1]
            if marker == 0xFF:
                at += 1
                continue
            (length,) = struct.unpack_from(">H", data, at + 2)
            body, at = data[at + 4 : at + 2 + length], at + 2 + length
            if marker == 0xC4:
                _note_tables(body, tables)
            elif marker == 0xDD:
                (restart,) = struct.unpack(">H", body)
            elif marker in (0xC0, 0xC1, 0xC2):
                kind, size = marker, (body[3] << 8 | body[4], body[1] << 8 | body[2])
                parts = [(body[i], body[i + 1] >> 4, body[i + 1] & 15) for i in range(6, 6 + 3 * body[5], 3)]
            elif marker == 0xDA:
                return _frame(kind, size, parts, body, tables, restart, at)
    except (IndexError, KeyError, struct.error):  # what can't be read so is for the decoder to judge
        pass
    return None


def _note_tables(body: bytes, tables: dict[int, bytes]) -> None:
    while body:
        end = 17 + sum(body[1:17])
        if end > len(body):
            raise IndexError("a table that is longer than its segment")
        tables[body[0]] = body[1:end]
        body = body[end:]


def _frame(
    kind: int,
    size: tuple[int, int],
    parts: list[tuple[int, int, int]],
    scan: bytes,
    tables: dict[int, bytes],
    restart: int,
    at: int,
) -> JpegFrame | None:
    if not parts or not all(size) or not all(0 < a <= 4 and 0 < b <= 4 for _, a, b in parts):
        return None
    across, down = max(a for _, a, _ in parts), max(b for _, _, b in parts)
    blocks: list[tuple[bytes, bytes]] = []
    if kind != 0xC2 and scan[0] == len(parts):  # one scan that holds all: baseline and extended
        for i, (_, a, b) in enumerate(parts):
            chosen = scan[2 + 2 * i]
            blocks += [(tables[chosen >> 4], tables[0x10 | chosen & 15])] * (1 if len(parts) == 1 else a * b)
    mcu = (8, 8) if len(parts) == 1 else (8 * across, 8 * down)
    return JpegFrame(width_px=size[0], height_px=size[1], mcu_px=mcu, blocks=tuple(blocks), restart=restart, data=at)


def damage_in_scan(data: bytes, frame: JpegFrame) -> str:
    """Return what is wrong with the coded data, "" where every block is there and nothing beside."""
    if not frame.blocks:
        return ""
    end = _END_OF_DATA.search(data, frame.data)
    coded = data[frame.data : end.start() if end else len(data)]
    pieces = _RESTART.split(coded)
    left = frame.mcus
    for number, piece in enumerate(pieces[::2]):
        if number and pieces[2 * number - 1][0] != 0xD0 + (number - 1) % 8:
            return f"its restart marker {number} is not the one that belongs there"
        wanted = min(frame.restart or left, left)
        if wanted == 0:
            break  # some cameras end with a restart marker, or with data of their own
        plain = piece.replace(b"\xff\x00", b"\xff")
        done, at = _walk(plain, frame.blocks, wanted)
        left -= wanted
        if done < wanted:
            where = f"block {frame.mcus - left - wanted + done + 1} of {frame.mcus}"
            return f"its coded data breaks off or makes no sense at {where}"
        if len(plain[at + 7 >> 3 :].strip(b"\xff").strip(b"\x00")) <= _SPARE:
            continue
        more, behind = _walk(plain, frame.blocks, frame.mcus, at)
        if more and 8 * len(plain) - behind < 8 * _SPARE:  # what isn't blocks to its end is some camera's own data
            return f"its coded data holds {more} blocks more than the picture has"
    return "" if left == 0 else f"its coded data ends {left} of {frame.mcus} blocks too early"


def _walk(data: bytes, blocks: tuple[tuple[bytes, bytes], ...], wanted: int, at: int = 0) -> tuple[int, int]:
    """Return how many MCUs the data holds from bit `at` on, at most `wanted`, and the bit behind the last of them."""
    tables = [(_dc_steps(dc), *_ac_steps(ac)) for dc, ac in blocks]
    done, start = 0, 0  # `at` counts from the byte `start`
    while True:
        start, at = start + (at >> 3), at & 7
        piece = data[start : start + _CHUNK + _LONGEST_MCU]
        windows, last = _windows(piece), start + _CHUNK + _LONGEST_MCU >= len(data)
        limit = 8 * len(piece) if last else 8 * _CHUNK
        while done < wanted and at < limit:
            after = _mcu(windows, at, tables)
            if after < 0 or after > 8 * len(piece):
                return done, 8 * start + at
            at, done = after, done + 1
        if done == wanted or last:
            return done, 8 * start + at


def _mcu(windows: memoryview, at: int, tables: list[tuple[list[int], list[int], list[int]]]) -> int:
    """Return the bit behind the MCU that begins at bit `at`, -1 where a code is none or leaves block or data."""
    try:
        for dc, many, single in tables:
            step = dc[windows[at]]
            if not step:
                return -1
            at += step
            k = 1
            while k < _BLOCK:
                step = many[windows[at]]
                to = k + (step >> 5)
                if to > _BLOCK and not _ENDS <= to < _ENDS + _BLOCK:  # together they leave the block: one at a time
                    step = single[windows[at]]
                    to = k + (step >> 5)
                    if to > _BLOCK and not _ENDS <= to < _ENDS + _BLOCK:
                        return -1
                if not step:
                    return -1
                at += step & 31
                k = to
    except IndexError:
        return -1
    return at


def _windows(data: bytes) -> memoryview:
    """Return the 16 bits from each bit of the data on; behind its end stand ones, as encoders fill up."""
    byte = np.frombuffer(data + b"\xff" * 6, dtype=np.uint8).astype(np.uint32)
    three = byte[:-2] << 16 | byte[1:-1] << 8 | byte[2:]
    shifted = three[:, None] >> (8 - np.arange(8, dtype=np.uint32))[None]
    return memoryview((shifted & 0xFFFF).astype(np.uint16).tobytes()).cast("H")


def _codes(table: bytes) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return by the next 16 bits: the code's length (0 where there is none) and its symbol."""
    length, symbol = np.zeros(1 << 16, dtype=np.int64), np.zeros(1 << 16, dtype=np.int64)
    code, at = 0, 16
    for bits in range(1, 17):
        for _ in range(table[bits - 1]):
            first = code << 16 - bits
            length[first : first + (1 << 16 - bits)], symbol[first : first + (1 << 16 - bits)] = bits, table[at]
            code, at = code + 1, at + 1
        code <<= 1
    return length, symbol


@functools.lru_cache(maxsize=16)
def _dc_steps(table: bytes) -> list[int]:
    """Return by the next 16 bits how many bits the difference of a block's mean takes, 0 where there is no code."""
    length, symbol = _codes(table)
    steps: list[int] = np.where((length > 0) & (symbol <= 11), length + symbol, 0).tolist()
    return steps


@functools.lru_cache(maxsize=16)
def _ac_steps(table: bytes) -> tuple[list[int], list[int]]:
    """Return by the next 16 bits the bits and 32 times the places of all codes that lie whole in them, and of one.

    One code may need more than the 16 bits, then it stands alone in both. 0 where there is no code.
    """
    length, symbol = _codes(table)
    run, size = symbol >> 4, symbol & 15
    bits = np.where((length > 0) & (size <= 10), length + size, 0)
    places = np.where(size > 0, run + 1, np.where(run == 15, 16, _ENDS))
    many_bits, many_places = bits.copy(), places.copy()
    value = np.arange(1 << 16)
    while True:
        behind = (value << np.minimum(many_bits, 16)) & 0xFFFF
        fits = (many_bits > 0) & (many_places < _ENDS) & (bits[behind] > 0) & (many_bits + bits[behind] <= 16)
        if not fits.any():
            break
        many_places = np.where(fits, many_places + places[behind], many_places)
        many_bits = np.where(fits, many_bits + bits[behind], many_bits)
    one = np.where(bits > 0, places * 32 + bits, 0)
    return np.where(many_bits > 0, many_places * 32 + many_bits, 0).tolist(), one.tolist()
