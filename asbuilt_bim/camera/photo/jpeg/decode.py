"""Decodes a JPEG with libjpeg-turbo and hears what it says: OpenCV decodes damage as well, and its words go unheard.

The pixels are those of OpenCV, to the last bit. The decoder tells of data that is missing, left over or makes no sense.
What it can't tell is found by `scan.py` in baseline pictures, and by `seam.py` in all.
"""

import numpy as np
import simplejpeg

from asbuilt_bim.camera.photo.by_opencv import decoded_by_opencv
from asbuilt_bim.geometry.arrays import ByteImage

_DAMAGE = ("Corrupt JPEG data", "Premature end", "Inconsistent progression")
"""How libjpeg's words begin where data is damaged; its others are of headers that some programs write oddly."""
_LEFT_OVER = "extraneous bytes before marker 0xd9"


def decoded_jpeg(data: bytes, *, counted: bool) -> tuple[ByteImage | None, str]:
    """Return the pixels (H, W, 3), BGR as stored, None where there are none, and what the decoder says is damaged.

    `counted`: `scan.py` found every block, so what is left over at the end is some camera's own.
    """
    said = ""
    try:
        four = simplejpeg.decode_jpeg_header(data, strict=False)[2] in ("CMYK", "YCCK")
        pixels = simplejpeg.decode_jpeg(data, "CMYK" if four else "BGR", strict=True)
        return (decoded_by_opencv(data) if four else np.asarray(pixels, dtype=np.uint8)), ""
    except KeyError:  # simplejpeg's own, of a colour space without a name
        said = "Unsupported color space"
    except (ValueError, RuntimeError) as problem:
        said = str(problem)
    if said.startswith(_DAMAGE) and not (counted and _LEFT_OVER in said):
        return None, f"its decoder says: {said.removeprefix('Corrupt JPEG data: ')}"
    if counted and _LEFT_OVER in said:
        return np.asarray(simplejpeg.decode_jpeg(data, "BGR", strict=False), dtype=np.uint8), ""
    image = decoded_by_opencv(data)
    if counted or image is None:
        return image, ""
    return None, f"or of a kind that can't be checked for damage ({said}); save it as plain JPEG or PNG, or"
