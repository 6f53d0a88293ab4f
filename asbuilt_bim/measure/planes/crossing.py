"""The line in which two planes meet, as the picture shows it, and how well the planes place it.

Two planes cross where their disparities are equal. At 8 m the disparities of faces at a right angle part by a twentieth
of a pixel a pixel. Where they are sure to a tenth of a pixel, the line is sure to two pixels and not to half of one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline.edges import Line, pixel_plane

LEAST_PART = 1e-4
"""A step in disparity of under 1 px in 10,000: the planes are one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Crossing:
    """The picture of the line in which two planes meet, and its sigma across itself."""

    line: Line
    sigma_px: float


def side_by_side(covariances: Sequence[FloatArray]) -> FloatArray:
    """Return the joint covariance (3n, 3n) of planes whose own (3, 3) know nothing of each other."""
    joint = np.zeros((3 * len(covariances), 3 * len(covariances)))
    for i, covariance in enumerate(covariances):
        joint[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = covariance
    return joint


def apart(joint: FloatArray, i: int, j: int) -> FloatArray:
    """Return the covariance (3, 3) of q_i - q_j of planes whose joint covariance is (3n, 3n)."""
    one, two = slice(3 * i, 3 * i + 3), slice(3 * j, 3 * j + 3)
    both: FloatArray = joint[one, one] + joint[two, two] - joint[one, two] - joint[two, one]
    return both


def crossing_near(
    line: Line, q_apart_px: FloatArray, covariance: FloatArray, camera: RectifiedCamera, most_px: float
) -> Crossing | None:
    """Return where two planes meet beside `line`; None where that is over `most_px` off an end, or nowhere.

    `q_apart_px` (3,) is one plane's q less the other's, `covariance` (3, 3) its own.
    """
    n = pixel_plane(q_apart_px, camera)
    part = float(np.hypot(n[0], n[1]))
    if part < LEAST_PART:
        return None
    ends = (line.start, line.stop)
    foot = [end - (n[0] * end[0] + n[1] * end[1] + n[2]) / part**2 * n[:2] for end in ends]
    if max(float(np.linalg.norm(f - end)) for f, end in zip(foot, ends, strict=True)) > most_px:
        return None
    ray = np.append((0.5 * (foot[0] + foot[1]) - [camera.cx_px, camera.cy_px]) / camera.f_px, 1.0)
    open_px = float(np.sqrt(max(float(ray @ covariance @ ray), 0.0))) / part
    return Crossing(line=Line(start=foot[0], stop=foot[1]), sigma_px=open_px)


def between(planes: Crossing, shown: Line, shown_px: float) -> Crossing:
    """Place an edge between where two planes meet and where the photos show it (sigma `shown_px`), by their weights.

    Where the two contradict each other, sigma is the wider for it (Birge 1932).
    """
    line = planes.line
    ends = ((shown.start, line.start), (shown.stop, line.stop))
    off = [float((photo - crossing) @ line.normal) for photo, crossing in ends]
    both_px = float(np.hypot(shown_px, planes.sigma_px))
    share = (planes.sigma_px / both_px) ** 2
    widened = max(1.0, abs(0.5 * sum(off)) / both_px)
    sigma_px = shown_px * planes.sigma_px / both_px * widened
    return Crossing(line=line.moved(share * off[0], share * off[1]), sigma_px=sigma_px)
