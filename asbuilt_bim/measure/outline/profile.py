"""Places along an outline, to look from them at what lies beyond it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline.edges import Line

IntArray = NDArray[np.intp]

ON_EDGE_PX = 3.0


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
