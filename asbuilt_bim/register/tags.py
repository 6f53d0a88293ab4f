"""A printed square in space: its place, its size, its corners, and a first guess of all that from one sighting."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.triangulate import square_poses
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply, laid_over, rotate
from asbuilt_bim.vision.markers.find import MarkerSighting

SQUARE = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
"""Corners (4, 3) of a print of side 1 in its own axes: x right, y down the print, z into the wall."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagPlace:
    """Where a print is: `world_from_tag` (4, 4), the side of its black square, and `covariance` (7, 7).

    The covariance is of [rotation vector (rad), centre (m)] in world axes about the centre, then of the size's
    logarithm.
    """

    world_from_tag: FloatArray
    size_m: float
    covariance: FloatArray

    @property
    def centre_m(self) -> FloatArray:
        """Return the print's middle (3,)."""
        centre: FloatArray = self.world_from_tag[:3, 3]
        return centre

    @property
    def corners_m(self) -> FloatArray:
        """Return its corners (4, 3): top-left, top-right, bottom-right, bottom-left of the print."""
        return apply(self.world_from_tag, SQUARE * self.size_m)

    @property
    def sigma_m(self) -> float:
        """Return the standard deviation of the centre, as of one coordinate."""
        return float(np.sqrt(np.trace(self.covariance[3:6, 3:6]) / 3.0))


def square_through(corners_m: FloatArray) -> tuple[FloatArray, float]:
    """Return the pose (4, 4) and the side of the square nearest to four corners (4, 3).

    Reference: Umeyama 1991, least-squares estimation of transformation parameters between two point patterns.
    """
    pose = laid_over(SQUARE, corners_m)
    size = np.sum(rotate(pose, SQUARE) * (corners_m - pose[:3, 3])) / np.sum(SQUARE**2)
    return pose, float(size)


def guesses(camera: RectifiedCamera, sighting: MarkerSighting, size_m: float | None) -> list[tuple[FloatArray, float]]:
    """Return where a sighting may put its print: `left_from_tag` (4, 4) and the side, one guess or two.

    Both photos give one. One photo gives two, which a small square hardly tells apart, and needs the size.
    """
    if sighting.right_px is not None:
        disparity = sighting.left_px[:, 0] - sighting.right_px[:, 0]
        if disparity.min() > 0.0:
            return _by_both(camera, sighting, float(disparity.mean()))
    if size_m is None:
        return []
    return [(pose, size_m) for pose in square_poses(SQUARE * size_m, camera.rays(sighting.left_px))]


def _by_both(camera: RectifiedCamera, sighting: MarkerSighting, disparity_px: float) -> list[tuple[FloatArray, float]]:
    """Take the size from the mean disparity, and the pose from the square's shape, nearer than single disparities."""
    assert sighting.right_px is not None
    corners = camera.points(sighting.left_px, sighting.left_px[:, 0] - sighting.right_px[:, 0])
    _, size = square_through(corners)
    middle = camera.points(sighting.left_px.mean(axis=0), disparity_px)
    found = []
    for pose in square_poses(SQUARE * size, camera.rays(sighting.left_px)):
        there = pose.copy()
        there[:3, 3] *= np.linalg.norm(middle) / np.linalg.norm(pose[:3, 3])
        found.append((there, size * float(np.linalg.norm(middle) / np.linalg.norm(pose[:3, 3]))))
    return found or [square_through(corners)]
