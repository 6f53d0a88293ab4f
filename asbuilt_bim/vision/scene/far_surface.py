"""What stands upright beyond a rig's reach: seen, but too far for its area to be known. It is named."""

import cv2
import numpy as np

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.grow import GrowOptions, upright_pixels
from asbuilt_bim.vision.scene.read import Scene

OF_PHOTO = 0.05
"""A twentieth of the photo: a smaller surface that far off is background."""


def far_surface(scene: Scene, sky: BoolArray, options: GrowOptions, station: str) -> tuple[Rejection, ...]:
    """Name the largest upright surface beyond the rig's reach; `sky` (H, W) is none. Empty where there is none."""
    level = scene.level
    least_px = float(np.hypot(options.mode_sigma_px, options.rig_sigma_px))  # nearer to 0 it could be endlessly far
    with np.errstate(invalid="ignore"):
        far = (level.d_px > least_px) & (level.d_px <= options.least_disparity_px)
    far &= upright_pixels(level)[0] & ~sky
    if np.mean(far) < OF_PHOTO:
        return ()
    closed = cv2.morphologyEx(far.view(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    _, parts, stats, _ = cv2.connectedComponentsWithStats(np.asarray(closed, dtype=np.uint8))
    sizes = np.bincount(parts[far & (parts > 0)], minlength=len(stats))
    largest = int(np.argmax(sizes))
    share = float(sizes[largest] / far.size)
    if share < OF_PHOTO:
        return ()
    power = level.view.f_px * level.baseline_m
    x, y, width, height = (int(value) for value in stats[largest][:4])
    return (
        rejected(
            Reason.SURFACE_TOO_FAR,
            about(SubjectKind.INSTANCE, "surface", station),
            distance_m=power / float(np.median(level.d_px[far & (parts == largest)])),
            limit_m=options.reach_m(level.view.f_px, level.baseline_m),
            share=share,
            box_px=(x, y, x + width, y + height),
        ),
    )
