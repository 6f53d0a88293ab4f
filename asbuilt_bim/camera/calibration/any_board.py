"""Whether a photo shows a calibration board of whatever size: nobody has said yet what is printed on it."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage

_WIDE_PX = 1600
"""A board fills a good part of its photo: half the resolution of most cameras shows it."""
_DICTIONARIES = ("DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL")
"""Those of ChArUco boards, each with all smaller ones of its size in it; a site's AprilTags are in none of them."""
_FEWEST_MARKERS = 6
"""Half of those on the smallest usual board (5 x 5 squares). A site's own markers of such a kind stand far apart."""
_SMALLEST = (5, 4)
"""Inner corners of the smallest chessboard looked for: bricks and tiles make small grids, too."""


def shows_board(image: ByteImage) -> bool:
    """Say whether a photo (BGR or grey) shows a chessboard or a ChArUco board."""
    grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if grey.shape[1] > _WIDE_PX:
        scale = _WIDE_PX / grey.shape[1]
        grey = np.asarray(cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    for name in _DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(grey)
        if ids is not None and len(np.unique(ids)) >= _FEWEST_MARKERS:
            return True
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, _, _ = cv2.findChessboardCornersSBWithMeta(grey, _SMALLEST, flags)
    return bool(found)
