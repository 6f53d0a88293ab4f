"""Whether a photo has any colour: a grey one says nothing of what things are made of."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage

ROUNDING = 2
"""Grey levels by which the three channels of a grey photo may differ: JPEG and rectifying round each by itself."""
OF_PIXELS = 0.001
"""Share of pixels that may differ by more: a coloured thing is larger."""


def is_grey(image: ByteImage) -> bool:
    """Say whether a photo (H, W, 3) has no chroma at all: taken without colour, or turned to grey since."""
    if image.ndim == 2 or image.size == 0:
        return True
    blue, green, red = cv2.split(image[::2, ::2])
    apart = cv2.max(cv2.max(blue, green), red) - cv2.min(cv2.min(blue, green), red)
    return float(np.mean(apart > ROUNDING)) <= OF_PIXELS
