"""How coarsely a JPEG stores its light: what it rounds away is no longer in the picture."""

import numpy as np

COARSE = 15
"""The lowest so many of 64 waves in a block of 8 x 8: five blocks' widths to two pixels, where concrete has texture."""
PER_WAVE = 8.0
"""A wave's coefficient is four times its amplitude, and is rounded away under half a step."""


def rounded_away_grey(data: bytes) -> float:
    """Return the amplitude, in grey levels, of texture that the JPEG bytes no longer hold; 0 of other files."""
    if data[:2] != b"\xff\xd8":
        return 0.0
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != 0xDA:
        size = int.from_bytes(data[at + 2 : at + 4], "big")
        steps = _light_steps(data[at + 4 : at + 2 + size]) if data[at + 1] == 0xDB else None
        if steps is not None:
            return float(np.mean(steps[:COARSE])) / PER_WAVE
        at += 2 + max(size, 2)
    return 0.0


def _light_steps(tables: bytes) -> list[int] | None:
    """Return the steps of table 0, that of light, in the order of frequency; None where it isn't among these."""
    at = 0
    while at < len(tables):
        wide, number = tables[at] >> 4, tables[at] & 15
        width = 2 if wide else 1
        body = tables[at + 1 : at + 1 + 64 * width]
        if number == 0 and len(body) == 64 * width:
            return [int.from_bytes(body[k : k + width], "big") for k in range(0, len(body), width)]
        at += 1 + 64 * width
    return None
