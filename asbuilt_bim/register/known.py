"""What is known of a station or a print before it is adjusted, as whitened rows: survey, given poses, sizes, points."""

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import skew, vector_from_rotation
from asbuilt_bim.register.block_adjustment import STATION, TAG, Known, Rows
from asbuilt_bim.register.solve import COMMON_SHARE, Sighted, whitened
from asbuilt_bim.register.tags import SQUARE


def surveyed_corners(name: str, index: int, corners_m: FloatArray, sigma_m: float) -> Known:
    """Return rows of a print's surveyed corners (4, 3): half of their variance is common to the four."""
    own, common = sigma_m * np.sqrt(1.0 - COMMON_SHARE), sigma_m * np.sqrt(COMMON_SHARE)
    share = 1.0 - 1.0 / np.sqrt(1.0 + 4.0 * (common / own) ** 2)

    def rows(pose: FloatArray, size_m: float) -> Rows:
        arms = (SQUARE * size_m) @ pose[:3, :3].T
        slopes = np.zeros((4, 3, TAG))
        slopes[:, :, :3] = -skew(arms)
        slopes[:, :, 3:6] = np.eye(3)
        slopes[:, :, 6] = arms
        both = np.concatenate([(arms + pose[:3, 3] - corners_m)[:, :, None], slopes], axis=2)
        white = ((both - share * both.mean(axis=0, keepdims=True)) / own).reshape(12, -1)
        return white[:, 0], white[:, 1:]

    return Known(name=name, of_tag=True, index=index, rows=rows)


def surveyed_centre(name: str, index: int, centre_m: FloatArray, sigma_m: float) -> Known:
    """Return rows of a print's surveyed middle (3,)."""
    slopes = np.zeros((3, TAG))
    slopes[:, 3:6] = np.eye(3) / sigma_m
    return Known(name=name, of_tag=True, index=index, rows=lambda pose, _: ((pose[:3, 3] - centre_m) / sigma_m, slopes))


def known_size(name: str, index: int, size_m: float, share: float) -> Known:
    """Return the row of a print's size, known to a `share` of it."""
    slopes = np.zeros((1, TAG))
    slopes[0, 6] = 1.0 / share
    return Known(
        name=name, of_tag=True, index=index, rows=lambda _, size: (np.array([np.log(size / size_m) / share]), slopes)
    )


def known_pose(name: str, index: int, pose: FloatArray, covariance: FloatArray, *, of_tag: bool = False) -> Known:
    """Return rows of a pose that is known with a covariance (6, 6): small motions in world axes about its centre."""
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    slopes = np.zeros((STATION, TAG if of_tag else STATION))
    slopes[:, :STATION] = root

    def rows(now: FloatArray, _: float) -> Rows:
        off = np.concatenate([vector_from_rotation(now[:3, :3] @ pose[:3, :3].T), now[:3, 3] - pose[:3, 3]])
        return root @ off, slopes

    return Known(name=name, of_tag=of_tag, index=index, rows=rows)


def known_points(name: str, index: int, camera: RectifiedCamera, seen: Sighted) -> Known:
    """Return rows of points whose coordinates are known, as a station's photos show them."""

    def rows(pose: FloatArray, _: float) -> Rows:
        white = whitened(camera, pose, seen)
        return white[:, 0], -white[:, 1:]

    return Known(name=name, of_tag=False, index=index, rows=rows)
