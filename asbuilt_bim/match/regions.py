"""Carries outlines and design faces into one another's coordinates."""

from collections.abc import Callable

import numpy as np

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region

Frame = PlaneFrame | CylinderFrame

WIDE_M = 1000.0
"""Wider than any lateral surface: a band of heights all round a column."""


def mapped(region: Region, change: Callable[[FloatArray], FloatArray]) -> Region:
    """Return a region with every ring (N, 2) changed by a function, repaired where it crosses itself."""
    return polygon.region_of([[change(ring) for ring in rings] for rings in region])


def to_frame(region: Region, source: Frame, target: Frame) -> Region:
    """Carry a region of one frame's (u, v) into another's: along the normal on planes, radially on lateral surfaces.

    On a lateral surface the region is cut at the target's seam, so that u stays within (-pi r, pi r].
    """
    if isinstance(target, CylinderFrame):
        return _rolled(region, source, target)
    return mapped(region, lambda ring: target.to_uv(source.from_uv(ring)))


def design_region(design: DesignFace, frame: Frame) -> Region:
    """Return a design face in a measured frame's (u, v); of a lateral surface only the heights count."""
    if isinstance(design.frame, PlaneFrame) and isinstance(frame, PlaneFrame):
        return to_frame(design.rings_uv_m, design.frame, frame)
    bands = []
    for rings in design.rings_uv_m:
        ends = np.array([[0.0, rings[0][:, 1].min()], [0.0, rings[0][:, 1].max()]])
        low, high = sorted(float(v) for v in frame.to_uv(design.frame.from_uv(ends))[:, 1])
        bands.append(polygon.box(-WIDE_M, low, WIDE_M, high))
    return polygon.union(bands)


def _rolled(region: Region, source: Frame, target: CylinderFrame) -> Region:
    around = 2.0 * np.pi * target.radius_m

    def unrolled(ring: FloatArray) -> FloatArray:
        uv = target.to_uv(source.from_uv(ring))
        uv[:, 0] = np.unwrap(uv[:, 0], period=around)
        return uv

    pieces = []
    for rings in region:
        flat = [unrolled(ring) for ring in rings]
        for hole in flat[1:]:  # a hole lies in its outer ring's turn
            hole[:, 0] += around * np.round((flat[0][:, 0].mean() - hole[:, 0].mean()) / around)
        low, high = polygon.bounds(polygon.polygon(flat))[1::2]
        strip = polygon.box(-around / 2, low - 1.0, around / 2, high + 1.0)
        turns = [[np.column_stack([ring[:, 0] + turn * around, ring[:, 1]]) for ring in flat] for turn in (-1, 0, 1)]
        pieces += [polygon.intersection(polygon.polygon(turn), strip) for turn in turns]
    return polygon.union(pieces)
