"""Middlebury's calib.txt, which ETH3D writes too: a pair that is rectified already, its baseline in millimetres."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.text import numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid


def is_middlebury(document: Plain) -> TypeGuard[Mapping[str, Plain]]:
    """Say whether a document is a calib.txt."""
    return isinstance(document, Mapping) and all(key in document for key in ("cam0", "cam1", "baseline", "doffs"))


def middlebury_rig(document: Mapping[str, Plain], where: str) -> StereoRig:
    """Make a rig of two straight cameras side by side: only the photos of that pair belong to it.

    Raises: RigError for what isn't there, or where the two cameras' rows aren't one.
    Reference: Scharstein et al. 2014, vision.middlebury.edu/stereo.
    """
    first, second = numbers(document["cam0"]), numbers(document["cam1"])
    sizes = [numbers(document.get(key)) for key in ("width", "height", "baseline", "doffs")]
    if first is None or second is None or len(first) != 9 or len(second) != 9:
        raise RigError(f"{where}: cam0 and cam1 need 9 numbers each: [f 0 cx; 0 f cy; 0 0 1]")
    if any(one is None or len(one) != 1 for one in sizes):
        raise RigError(f"{where}: needs width, height, baseline (mm) and doffs")
    width, height, baseline, apart = (one[0] for one in sizes if one)
    off = float(np.abs(np.array(second) - first - np.array([0, 0, apart, *[0] * 6])).max())
    if off > 0.01:
        raise RigError(f"{where}: cam1 differs from cam0 by more than doffs ({off:.3g}); this pair isn't rectified")
    cameras = [
        Intrinsics(
            K=frozen(np.reshape(K, (3, 3))), distortion=frozen(np.zeros(5)), width_px=int(width), height_px=int(height)
        )
        for K in (first, second)
    ]
    return rig_of_unknown_sigma(cameras[0], cameras[1], rigid(np.eye(3), [-0.001 * baseline, 0.0, 0.0]))
