"""Which stations of a visit points link: looked for where a station isn't placed by what it sees of the survey."""

from collections.abc import Collection, Sequence
from functools import partial
from itertools import combinations

import cv2
import numpy as np

from asbuilt_bim.measure.depth_reference import unpack
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.point_links import PointLink, Shown, link_by_points
from asbuilt_bim.scale.share import Share
from asbuilt_bim.vision.landmarks.find import Landmarks, find_landmarks

FEW = 150
"""Looks of a station that are tried first: which stations may show the same at all."""
FEW_ALIKE = 4
"""Of them that have one and no second partner: chance gives one or two in a hundred and fifty."""
_RATIO = 0.75


def look_for_links(
    measured: Sequence[StationMeasurement], unplaced: Collection[str], share: Share
) -> tuple[PointLink, ...]:
    """Return how stations stand to each other by points that both show; each pair has one that isn't placed yet.

    Looked at are the rectified left photo and the disparities that a measurement keeps; one that was sighted alone has
    none, and links to nothing.
    """
    able = sorted((one for one in measured if one.depth_ref.png and one.thumbnail_jpeg), key=lambda one: one.station)
    if not unplaced or len(able) < 2:
        return ()
    shown = dict(zip((one.station for one in able), share(_shown, able), strict=True))
    pairs = [
        (one.station, other.station)
        for one, other in combinations(able, 2)
        if one.station in unplaced or other.station in unplaced
    ]
    found = share(partial(_linked, shown), pairs)
    return tuple(link for link in found if link is not None)


def _shown(measured: Sequence[StationMeasurement]) -> list[Shown]:
    return [Shown(name=one.station, camera=one.camera, landmarks=landmarks_of(one)) for one in measured]


def landmarks_of(station: StationMeasurement) -> Landmarks:
    """Return what a station's kept picture and disparities show of points."""
    grey = cv2.imdecode(np.frombuffer(station.thumbnail_jpeg, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    disparity, sigma, scale = unpack(station.depth_ref)
    picture = np.zeros((1, 1), dtype=np.uint8) if grey is None else np.asarray(grey, dtype=np.uint8)
    return find_landmarks(picture, station.camera.width_px / picture.shape[1], disparity, sigma, scale)


def _linked(shown: dict[str, Shown], pairs: Sequence[tuple[str, str]]) -> list[PointLink | None]:
    return [
        link_by_points(shown[one], shown[other]) if _alike(shown[one].landmarks, shown[other].landmarks) else None
        for one, other in pairs
    ]


def _alike(one: Landmarks, other: Landmarks) -> bool:
    """Say whether two stations may show the same: a few looks tell, at a tenth of the price."""
    if min(len(one.looks), len(other.looks)) < 2:
        return False
    few = one.looks[:: max(1, len(one.looks) // FEW)]
    found = cv2.BFMatcher(cv2.NORM_L2).knnMatch(few, other.looks, k=2)
    return sum(best.distance < _RATIO * second.distance for best, second in found) >= FEW_ALIKE
