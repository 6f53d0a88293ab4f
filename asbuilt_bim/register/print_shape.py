"""Are surveyed corners those of a square print of the given size? Units, order of corners, wrong sizes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

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


def print_faults(prints_m: Mapping[int, FloatArray], size_m: float) -> list[str]:
    """Return a line for each print, by marker, whose corners (4, 3) in metres are no square of `size_m`.

    Where most of them are wrong in size alike the given size is wrong, not the prints: that is one line.
    """
    faults = {marker: fault for marker, xyz in prints_m.items() if (fault := _fault(xyz, size_m)) is not None}
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


def _fault(xyz: FloatArray, size_m: float) -> _Fault | None:
    sides = np.linalg.norm(np.roll(xyz, -1, axis=0) - xyz, axis=1)
    side = float(np.mean(sides))
    if side <= 0.0:
        return _Fault(side_m=side, text="its corners lie in one place")
    for factor, unit in UNIT_MISTAKES.items():
        if abs(side / (size_m * factor) - 1.0) < SHAPE_SHARE:
            return _Fault(side_m=side, text="", remedy=f"the survey looks like {unit}; give it in metres")
    allowed = max(SHAPE_SHARE * side, SHAPE_M)
    diagonals = np.linalg.norm(xyz[2:] - xyz[:2], axis=1) / np.sqrt(2.0)
    worst = float(np.max(np.abs(np.concatenate([sides, diagonals]) - side)))
    if worst > allowed:
        text = (
            f"its corners are no square in the order {', '.join(CORNERS)}: sides {_list(sides)} m, "
            f"off by {worst:.3f} m (limit {allowed:.3f} m)"
        )
        return _Fault(side_m=side, text=text)
    normal = np.cross(xyz[2] - xyz[0], xyz[3] - xyz[1])
    warp = float(abs((xyz[1] - xyz[0]) @ normal) / np.linalg.norm(normal))
    if warp > allowed:
        text = f"its corners lie in no plane: {warp:.3f} m off (limit {allowed:.3f} m)"
        return _Fault(side_m=side, text=text)
    if abs(side - size_m) > max(SHAPE_SHARE * size_m, SHAPE_M):
        return _Fault(side_m=side, text="", remedy="check markers.size_m, or the survey")
    return None


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)
