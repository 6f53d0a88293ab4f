"""Are surveyed corners those of a square print of the given size? Units, order of corners, wrong sizes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray

CORNERS = ("top-left", "top-right", "bottom-right", "bottom-left")
"""The corners of a print, in the order of `SurveyedMarker.corners_m`."""

UNIT_MISTAKES = {
    1000.0: "millimetres",
    100.0: "centimetres",
    1.0 / 0.3048: "feet",
    1.0 / 0.0254: "inches",
    0.001: "kilometres",
}
"""What the side's length says when it is this many times the print's size in metres."""

SHAPE_SHARE = 0.05
SHAPE_M = 0.010
"""A print is square: sides and diagonals differ by no more than this, whichever is larger."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fault:
    """What is wrong with one print; `remedy` where it is its size, which all prints may have wrong alike."""

    side_m: float
    text: str
    remedy: str = ""


def print_faults(
    prints_m: Mapping[int, FloatArray], size_m: float, rows: Mapping[int, Sequence[int]] = MappingProxyType({})
) -> list[str]:
    """Return a line for each print, by marker, whose corners (4, 3) in metres are no square of `size_m`.

    `rows` are the lines of the file that hold each marker's corners. Where most of them are wrong in size alike the
    given size is wrong, not the prints: that is one line.
    """
    found = ((marker, _fault(xyz, size_m, rows.get(marker, ()))) for marker, xyz in prints_m.items())
    faults = {marker: fault for marker, fault in found if fault is not None}
    alike = [fault for fault in faults.values() if fault.remedy]
    if len(alike) < 2 or 2 * len(alike) <= len(prints_m):
        return [f"marker {marker}: {_fault_text(fault, size_m)}" for marker, fault in faults.items()]
    sides = [fault.side_m for fault in alike]
    lines = [
        f"{len(alike)} of {len(prints_m)} markers: their sides are {min(sides):.4g} to {max(sides):.4g} m where the "
        f"print is {size_m:.3f} m; {alike[0].remedy}"
    ]
    return lines + [f"marker {marker}: {fault.text}" for marker, fault in faults.items() if not fault.remedy]


def _fault_text(fault: _Fault, size_m: float) -> str:
    if not fault.remedy:
        return fault.text
    return f"its side is {fault.side_m:.4g} m where the print is {size_m:.3f} m; {fault.remedy}"


def _fault(xyz: FloatArray, size_m: float, rows: Sequence[int]) -> _Fault | None:
    sides = np.linalg.norm(np.roll(xyz, -1, axis=0) - xyz, axis=1)
    side = float(np.mean(sides))
    if side <= 0.0:
        return _Fault(side_m=side, text="its corners lie in one place")
    for factor, unit in UNIT_MISTAKES.items():
        if abs(side / (size_m * factor) - 1.0) < SHAPE_SHARE:
            return _Fault(side_m=side, text="", remedy=f"the survey looks like {unit}; give it in metres")
    allowed = max(SHAPE_SHARE * min(side, size_m), SHAPE_M)
    diagonals = np.linalg.norm(xyz[2:] - xyz[:2], axis=1) / np.sqrt(2.0)
    worst = float(np.max(np.abs(np.concatenate([sides, diagonals]) - side)))
    if worst > allowed:
        return _Fault(side_m=side, text=_no_square(xyz, sides, size_m, allowed, worst, rows))
    normal = np.cross(xyz[2] - xyz[0], xyz[3] - xyz[1])
    warp = float(abs((xyz[1] - xyz[0]) @ normal) / np.linalg.norm(normal))
    if warp > allowed:
        text = f"its corners lie in no plane: {warp:.3f} m off (limit {allowed:.3f} m)"
        return _Fault(side_m=side, text=text)
    if abs(side - size_m) > max(SHAPE_SHARE * size_m, SHAPE_M):
        return _Fault(side_m=side, text="", remedy="check markers.size_m, or the survey")
    return None


def _no_square(
    xyz: FloatArray, sides: FloatArray, size_m: float, allowed: float, worst: float, rows: Sequence[int]
) -> str:
    """Say why four corners are no square: the one that lies off where the other three are of one, else their sides."""
    fits: list[str] = []
    for corner, name in enumerate(CORNERS):
        own, after, opposite, before = np.roll(xyz, -corner, axis=0)
        spans = np.linalg.norm([before - opposite, after - opposite, (before - after) / np.sqrt(2.0)], axis=1)
        if np.all(np.abs(spans - size_m) <= allowed):
            wanted, where = before + after - opposite, f" (line {rows[corner]})" if rows else ""
            fits.append(f"the {name} one{where} lies {np.linalg.norm(own - wanted):.3f} m off; by the other three "
                        f"it is near ({_list(wanted)}). Correct that row")  # fmt: skip
    if len(fits) == 1:
        return f"its corners are no square: {fits[0]}"
    where = f" (lines {', '.join(map(str, rows))})" if rows else ""
    return (
        f"its corners are no square in the order {', '.join(CORNERS)}: sides {_list(sides)} m, "
        f"off by {worst:.3f} m (limit {allowed:.3f} m); compare its rows{where} with the survey"
    )


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)
