"""Walls that go on in one plane, taken as one: where one element of the model ends and the next begins no photo shows.

Two walls poured side by side, of one material and flush, are two elements of the IFC file and one surface of the photo.
A segmenter that calls them one is wrong by the model and right by the photo; the flow divides them by the model.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.networks.detection import Sighting
from asbuilt_bim.vision.networks.kinds import instance_of
from benchmarks.networks.figures import TrueThing
from benchmarks.networks.pictures import Shot

MOST_TURNED_DEG = 2.0
MOST_OFF = 0.01
"""Of two walls in one plane the one's plane gives the other's 1/Z within this share."""
LEAST_TOUCHING_PX = 16
LEAST_PX = 60
MOST_SPOTS = 1500
Surface = tuple[FloatArray, FloatArray, FloatArray]  # rays (N, 3), their 1/Z, the plane (3,): 1/Z of a ray


def rows_as_one(shot: Shot) -> Shot:
    """Return a pair whose truth takes walls that touch and lie in one plane as one element."""
    numbers = [int(n) for n in np.unique(shot.element[shot.element > 0]) if shot.kinds[n - 1] == "wall"]
    surfaces = {n: found for n in numbers if (found := _surface(shot, n)) is not None}
    element = shot.element.copy()
    for one, other in combinations(surfaces, 2):
        if _in_one_plane(surfaces[one], surfaces[other]) and _touching(shot.element, one, other):
            kept, gone = element[shot.element == one][0], element[shot.element == other][0]
            element[element == gone] = kept
    return replace(shot, element=element)


def said_by_truth(things: list[TrueThing]) -> list[Instance]:
    """Return true things as a segmenter would say them that makes no mistake."""
    return [
        instance_of(Sighting(number=0, score=1.0, mask=thing.mask), "column" if thing.kind == "column" else "wall", "")
        for thing in things
    ]


def _surface(shot: Shot, number: int) -> Surface | None:
    """Return an element's rays, their 1/Z and its largest plane; None where too little of it shows."""
    rows, columns = np.nonzero((shot.element == number) & (shot.inverse_depth_per_m > 0.0))
    if len(rows) < LEAST_PX:
        return None
    some = slice(None, None, max(1, len(rows) // MOST_SPOTS))
    rows, columns = rows[some], columns[some]
    rays = shot.pair.camera.rays(np.stack([columns, rows], axis=-1).astype(np.float64))
    rays = rays / rays[:, 2:]
    inverse = shot.inverse_depth_per_m[rows, columns].astype(np.float64)
    plane = np.linalg.lstsq(rays, inverse, rcond=None)[0]
    for _ in range(5):  # its end's or its reveals' pixels leave, by the worst two fifths in turn
        miss = np.abs(rays @ plane - inverse) / inverse
        near = miss <= max(float(np.quantile(miss, 0.6)), 1e-4)
        plane = np.linalg.lstsq(rays[near], inverse[near], rcond=None)[0]
    return rays, inverse, np.asarray(plane, dtype=np.float64)


def _in_one_plane(one: Surface, other: Surface) -> bool:
    cosine = one[2] @ other[2] / (np.linalg.norm(one[2]) * np.linalg.norm(other[2]))
    if cosine < np.cos(np.radians(MOST_TURNED_DEG)):
        return False
    off = [float(np.median(np.abs(a[0] @ b[2] - a[1]) / a[1])) for a, b in ((one, other), (other, one))]
    return min(off) <= MOST_OFF


def _touching(element: NDArray[np.int32], one: int, other: int) -> bool:
    around = cv2.dilate((element == one).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return int(np.count_nonzero(around & (element == other))) >= LEAST_TOUCHING_PX
