"""Tags in the original photos of a rig that isn't known yet: what a rig is made from where there is no board."""

import numpy as np

from asbuilt_bim.camera.calibration.tags import TagSighting
from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray, frozen
from asbuilt_bim.vision.markers.corners import SIGMA_UNREFINED_PX
from asbuilt_bim.vision.markers.find import FAMILIES, detect


def tags_in_pair(pair: str, left: ByteImage, right: ByteImage, family: str) -> list[TagSighting]:
    """Return the tags of a family that both ORIGINAL photos (BGR) of a pair show, ordered by id.

    An id that stands twice in a photo is left out: it isn't known which of the two the other photo shows. So is a tag
    whose edges can't be followed to a fraction of a pixel.

    Raises: SurveyError for a family that isn't known.
    """
    if family not in FAMILIES:
        raise SurveyError(f"tags of family {family!r} are not known; use one of {', '.join(FAMILIES)}")
    in_left, in_right = _once(left, family), _once(right, family)
    return [
        TagSighting(pair=pair, tag_id=tag_id, left_px=frozen(in_left[tag_id]), right_px=frozen(in_right[tag_id]))
        for tag_id in sorted(in_left.keys() & in_right.keys())
    ]


def _once(image: ByteImage, family: str) -> dict[int, FloatArray]:
    everywhere = np.ones(image.shape[:2], dtype=bool)
    found, twice = detect(image, everywhere, family, bowed=True)
    return {
        tag_id: corners
        for tag_id, (corners, sigma) in found.items()
        if tag_id not in twice and sigma < SIGMA_UNREFINED_PX
    }
