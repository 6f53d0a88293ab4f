"""Places along an outline, to look from them at what lies beyond it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.outline.edges import Line, pixel_plane
from asbuilt_bim.measure.workbench import Workbench

IntArray = NDArray[np.intp]

ON_EDGE_PX = 3.0
LEAST_RUN_PX, LEAST_RUN_SHARE = 10.0, 0.03
"""What holds along less of an outline is its border's noise."""
UNKNOWN_SIGMA_PX = 4.0
UNSETTLED_PX, SURE_SIGMAS = tuple(np.arange(1.0, 49.0)), 3.0
"""How far past a side is looked for what isn't the face; a face that goes on further isn't measured at all."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outward:
    """What lies so far off an outline, at each of its N places."""

    off_px: float
    inside: BoolArray  # (N,) the photo
    measured: BoolArray  # (N,)
    step_px: FloatArray  # (N,) disparity before the face's plane; what isn't measured counts as far away
    sigma_px: FloatArray  # (N,) of the disparity
    label: NDArray[Any]  # (N,) the surface that the scene was read as there


def outwards(
    bench: Workbench, points: FloatArray, normals: FloatArray, p: FloatArray, offs_px: Sequence[float]
) -> Iterator[Outward]:
    """Step outwards from places (N, 2) along their normals, and hold what lies there against the plane `p`."""
    level, labels = bench.scene.level, bench.scene.labels
    for off_px in offs_px:
        at = points + off_px * normals
        x, y = np.round(at).astype(np.intp).T
        inside = (x >= 0) & (x < labels.shape[1]) & (y >= 0) & (y < labels.shape[0])
        x, y = np.where(inside, x, 0), np.where(inside, y, 0)
        yield Outward(
            off_px=off_px,
            inside=inside,
            measured=inside & level.measured[y, x],
            step_px=np.nan_to_num(level.disparity_px[y, x]) - (at @ p[:2] + p[2]),
            sigma_px=np.nan_to_num(level.sigma_px[y, x], nan=UNKNOWN_SIGMA_PX, posinf=UNKNOWN_SIGMA_PX),
            label=labels[y, x],
        )


def unsettled_px(bench: Workbench, line: Line, q_px: FloatArray) -> float:
    """Return how far past a side nothing is seen that isn't the face: depth lost, or not surely off its plane."""
    count = max(2, int(line.length_px / 2.0))
    points = line.start + ((np.arange(count) + 0.5) / count)[:, None] * (line.stop - line.start)
    normals = np.broadcast_to(line.normal, points.shape)
    ended, reach = np.zeros(count, dtype=bool), np.full(count, UNSETTLED_PX[-1])
    for seen in outwards(bench, points, normals, pixel_plane(q_px, bench.pair.camera), UNSETTLED_PX):
        other = ~seen.inside | (seen.measured & (np.abs(seen.step_px) > SURE_SIGMAS * seen.sigma_px))
        reach[other & ~ended] = seen.off_px
        ended |= other
    return float(np.mean(reach))


def walk(ring: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return places (N, 2) about 2 px apart along a ring, normals (N, 2) off the face, and the length of each."""
    ends = np.roll(ring, -1, axis=0)
    lengths = np.linalg.norm(ends - ring, axis=1)
    places, normals, steps = [], [], []
    for start, stop, length in zip(ring, ends, lengths, strict=True):
        if length < 1e-6:
            continue
        count = max(1, int(length / 2.0))
        share = (np.arange(count) + 0.5) / count
        along = (stop - start) / length
        places.append(start + share[:, None] * (stop - start))
        normals.append(np.broadcast_to(np.array([along[1], -along[0]]), (count, 2)))
        steps.append(np.full(count, length / count))
    return np.concatenate(places), np.concatenate(normals), np.concatenate(steps)


def at_places(image: NDArray[Any], points: FloatArray) -> NDArray[Any]:
    """Return the image (H, W) at places (N, 2), those outside taken at its border."""
    x = np.clip(np.round(points[:, 0]).astype(np.intp), 0, image.shape[1] - 1)
    y = np.clip(np.round(points[:, 1]).astype(np.intp), 0, image.shape[0] - 1)
    return np.asarray(image[y, x])


def owners(lines: Sequence[Line], points: FloatArray, normals: FloatArray) -> IntArray:
    """Return per place (N,) the number of the straight side that it lies on, -1 for none."""
    owner = np.full(len(points), -1, dtype=np.intp)
    nearest = np.full(len(points), ON_EDGE_PX)
    for number, line in enumerate(lines):
        along = (points - line.start) @ line.direction
        off = np.abs((points - line.start) @ line.normal)
        within = (along > -ON_EDGE_PX) & (along < line.length_px + ON_EDGE_PX) & (normals @ line.normal > 0.9)
        mine = within & (off < nearest)
        owner[mine], nearest[mine] = number, off[mine]
    return owner
