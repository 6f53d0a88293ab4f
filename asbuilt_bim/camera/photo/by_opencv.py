"""Decodes pictures of any format as they were stored, whatever their state."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage


def decoded_by_opencv(data: bytes) -> ByteImage | None:
    """Return the pixels (H, W, 3) of any picture, BGR as stored; None where it can't be decoded."""
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if image is None else np.asarray(image, dtype=np.uint8)
