"""The ring that straight sides close: corners where neighbours' lines cross, the contour's own points between."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline.contour import Side
from asbuilt_bim.measure.outline.edges import Line


def close_ring(settled: Sequence[Line | None], found: list[Side]) -> FloatArray:
    """Walk round the sides: corners where neighbours' lines cross, the contour's own points where there is no line."""
    points: list[FloatArray] = []
    count = len(settled)
    for i, edge in enumerate(settled):
        following = settled[(i + 1) % count]
        corner = found[i].points[-1]
        if edge is None:
            points.extend(found[i].points[2:-2:2])
            if following is None:
                points.append(corner)
            continue
        if following is None:
            points.append(_foot(edge, corner))
            continue
        crossing = _meet(edge, following)
        if crossing is not None and float(np.linalg.norm(crossing - corner)) < 20.0:
            points.append(crossing)
        else:
            points.extend([_foot(edge, corner), _foot(following, corner)])
    # a free side before a line starts at the line's own foot
    for i, edge in enumerate(settled):
        if edge is not None and settled[i - 1] is None:
            points = _with_foot(points, found[i], edge)
    return np.array(points)


def _with_foot(points: list[FloatArray], side: Side, edge: Line) -> list[FloatArray]:
    foot = _foot(edge, side.points[0])
    nearest = int(np.argmin([np.sum((p - side.points[0]) ** 2) for p in points]))
    return [*points[: nearest + 1], foot, *points[nearest + 1 :]]


def _foot(line: Line, point: FloatArray) -> FloatArray:
    foot: FloatArray = line.start + ((point - line.start) @ line.direction) * line.direction
    return foot


def _meet(one: Line, other: Line) -> FloatArray | None:
    a, b = one.direction, other.direction
    cross = float(a[0] * b[1] - a[1] * b[0])
    if abs(cross) < np.sin(np.radians(15.0)):
        return None
    gap = other.start - one.start
    meeting: FloatArray = one.start + a * float(gap[0] * b[1] - gap[1] * b[0]) / cross
    return meeting


def pixel_area(ring: FloatArray) -> float:
    """Return a ring's signed area in pixels."""
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
