"""The target's circle where the lens is out of focus: two ways to place its outline, that err apart, and their mean.

`edge_model` takes what is behind a disc for one colour at each edge, `soft_edges` for unknown. Before what changes
within a blur's reach the first errs with it, the second by noise; each is as good as the other on average (rms 0.33 %
of the distance on 199 blurred development pairs), and their mean is better than either.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.circle import SpaceCircle, outlines_of
from asbuilt_bim.vision.disc import FIRST_SUPPORT, followed
from asbuilt_bim.vision.edge_model import COLOUR_BLUR_PX
from asbuilt_bim.vision.target_pairing import Pairing, TargetOptions, circle_of, size_fits

_ROUNDS = 3
_SLACK = 2.0
"""Of the outline that was found: within less its own points are the only ones left, and it stays where it is."""


def second_look(found: Pairing, camera: RectifiedCamera) -> SpaceCircle | None:
    """Return the circle of the second way; None where it follows none."""
    circle = found.circle
    for _ in range(_ROUNDS):
        guides = outlines_of(circle, camera)
        if guides[0] is None or guides[1] is None:
            return None
        left = followed(found.left.patch, guides[0], found.blur_px, _SLACK, FIRST_SUPPORT, is_soft=True)
        right = followed(found.right.patch, guides[1], found.blur_px, _SLACK, FIRST_SUPPORT, is_soft=True)
        again = None if left is None or right is None else circle_of(left, right, camera, start=circle)
        if again is None:
            return None
        circle = again
    return circle


def refined(found: Pairing, camera: RectifiedCamera) -> Pairing:
    """Return a pairing with the mean of both ways' circles; as it is where there is no second one."""
    circle = second_look(found, camera) if _is_soft(found) else None
    return found if circle is None else replace(found, circle=_mean(found.circle, circle))


def stands(found: Pairing, camera: RectifiedCamera, options: TargetOptions) -> bool:
    """Say whether a second look, where it is worth one, sees a circle of the target's size too.

    A disc's comes out within 2 % of its size, 6 % at most (215 development pairs, all followed); a jacket's or half a
    disc's outline is a circle only as the first way has it.
    """
    if not _is_soft(found):
        return True
    circle = second_look(found, camera)
    return circle is not None and size_fits(circle, options)


def _is_soft(found: Pairing) -> bool:
    """Say whether what is behind bends an edge: where the lens blurs less than JPEG's halved colours do, these do."""
    return found.blur_px >= COLOUR_BLUR_PX


def _mean(one: SpaceCircle, other: SpaceCircle) -> SpaceCircle:
    """Return the circle between two of nearly the same place; it leans as the second one does.

    Both saw the same photos: their mean isn't taken for surer than they are.
    """
    return replace(
        other,
        centre_px=frozen(0.5 * (one.centre_px + other.centre_px)),
        disparity_px=0.5 * (one.disparity_px + other.disparity_px),
        radius_m=float(np.sqrt(one.radius_m * other.radius_m)),
        covariance=frozen(0.5 * (one.covariance + other.covariance)),
    )
