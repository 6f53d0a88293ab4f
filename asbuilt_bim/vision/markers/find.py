"""AprilTags and ArUco markers: their corners in both photos."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray, frozen
from asbuilt_bim.vision.markers.corners import refine_corners

Family = Literal[
    "apriltag_36h11",
    "apriltag_36h10",
    "apriltag_25h9",
    "apriltag_16h5",
    "aruco_4x4_50",
    "aruco_5x5_100",
    "aruco_6x6_250",
    "aruco_original",
]
"""The printed families that a project may name."""
FAMILIES: dict[str, int] = {
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36h11,
    "apriltag_36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "apriltag_25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "apriltag_16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "aruco_4x4_50": cv2.aruco.DICT_4X4_50,
    "aruco_5x5_100": cv2.aruco.DICT_5X5_100,
    "aruco_6x6_250": cv2.aruco.DICT_6X6_250,
    "aruco_original": cv2.aruco.DICT_ARUCO_ORIGINAL,
}

ROW_LIMIT_PX = 2.0
"""Corners of one marker lie on one row in both photos; more is another marker, or a rig that was knocked."""
MISFIT_LIMIT_PX = 0.5
"""Corners follow to a tenth of a pixel; half a pixel says that something stands before one of them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerSighting:
    """One marker in the rectified photos: corners (4, 2) top-left, top-right, bottom-right, bottom-left of the print.

    `right_px` is None where only the left photo shows it. `sigma_px` is each coordinate's standard deviation.
    """

    marker_id: int
    left_px: FloatArray
    right_px: FloatArray | None
    sigma_px: float


def find_markers(pair: RectifiedPair, family: str = "apriltag_36h11") -> tuple[MarkerSighting, ...]:
    """Find the markers of a family in both rectified photos, ordered by id.

    An id that stands twice in a photo is left out: it isn't known which of the two was surveyed. So is one whose
    corners don't fit between the photos.

    Raises: SurveyError for a family that isn't known.
    """
    return markers_and_twice(pair, family)[0]


def markers_and_twice(pair: RectifiedPair, family: str) -> tuple[tuple[MarkerSighting, ...], tuple[int, ...]]:
    """Return what `find_markers` finds, and the ids that it left out since a photo shows them more than once."""
    if family not in FAMILIES:
        raise SurveyError(f"markers.family: {family!r} is not known; use one of {', '.join(FAMILIES)}")
    left, left_twice = detect(pair.left, pair.valid_left, family)
    if not left:
        return (), ()
    right, right_twice = detect(pair.right, pair.valid_right, family)
    twice = left_twice | right_twice
    sightings = []
    for marker_id in sorted(left.keys() - twice):
        corners, sigma = left[marker_id]
        other, other_sigma = right.get(marker_id, (None, 0.0))
        misfit = 0.0 if other is None else _misfit(corners, other)
        if misfit > MISFIT_LIMIT_PX:
            continue
        sightings.append(
            MarkerSighting(
                marker_id=marker_id,
                left_px=frozen(corners),
                right_px=None if other is None else frozen(other),
                sigma_px=max(sigma, other_sigma, misfit),
            )
        )
    return tuple(sightings), tuple(sorted(twice))


def other_family(pair: RectifiedPair, family: str) -> tuple[str, int] | None:
    """Return a family of which both photos show two markers and more, and how many; for a pair with none of `family`.

    Clutter is read as a marker of a small family now and then, but not as two, each on one row of both photos.
    """
    for other in FAMILIES:
        if other != family and len(detect(pair.left, pair.valid_left, other)[0]) >= 2:
            both = [one for one in find_markers(pair, other) if one.right_px is not None]
            if len(both) >= 2:
                return other, len(both)
    return None


def detect(
    image: ByteImage, valid: BoolArray, family: str, *, bowed: bool = False
) -> tuple[dict[int, tuple[FloatArray, float]], set[int]]:
    """Return corners (4, 2) and sigma by id, and the ids that stand there more than once.

    `bowed` is for original photos, whose lens bends straight edges.
    """
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.relativeCornerRefinmentWinSize = 0.2  # of a module: stays clear of the code's own edges
    parameters.adaptiveThreshWinSizeMax = 43  # near markers have modules of tens of pixels
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(FAMILIES[family]), parameters)
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    found, ids, _ = detector.detectMarkers(grey)
    markers: dict[int, tuple[FloatArray, float]] = {}
    twice: set[int] = set()
    modules = detector.getDictionary().markerSize + 2
    numbers = [int(i) for i in np.asarray(ids if ids is not None else []).ravel()]
    for corners, marker_id in zip(found, numbers, strict=True):
        square = np.asarray(corners, dtype=np.float64).reshape(4, 2)
        if marker_id in markers:
            twice.add(marker_id)
        elif _inside(square, valid):
            markers[marker_id] = refine_corners(grey, square, modules, bowed=bowed)
    return markers, twice


def _inside(corners: FloatArray, valid: BoolArray) -> bool:
    column, row = np.rint(corners).astype(int).T
    height, width = valid.shape
    in_frame = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    return bool(in_frame.all()) and bool(valid[row, column].all())


def _misfit(left: FloatArray, right: FloatArray) -> float:
    """Return how badly corners (4, 2) of both photos fit one flat marker, as the sigma of a coordinate in pixels.

    Rows must be equal (up to what they have in common: that is the rig's), and disparity linear over the marker.
    """
    rows, disparity = left[:, 1] - right[:, 1], left[:, 0] - right[:, 0]
    if abs(np.median(rows)) > ROW_LIMIT_PX or disparity.min() <= 0.0:
        return np.inf
    plane = np.c_[np.ones(4), left - left.mean(axis=0)]
    bent = disparity - plane @ np.linalg.lstsq(plane, disparity, rcond=None)[0]
    uneven = rows - rows.mean()
    return float(np.sqrt((bent @ bent + uneven @ uneven) / 4.0 / 2.0))  # 1 + 3 degrees, of differences
