"""How far the numbers in bought stereo cameras' memories were found to be off: what such a rig is trusted to.

`benchmarks/rigs/factory.py` measures them again: a ZED at two resolutions against known distances, against its owner's
calibration with boards, and its rows; an OAK-D's rows. Two cameras are few: of several figures the larger counts.
"""

import math
from dataclasses import replace

from asbuilt_bim.camera.rig import RigWidth, StereoRig, radians_each

FACTORY = RigWidth(turn_rad=radians_each(0.005, 0.05, 0.005, 0.05, 0.33), lens_px=0.3, scale_share=0.007)
"""The yaw is what distances and the owner's boards show, 0.02 to 0.06 degrees, 0.048 rms. The scale is 0.6 % of
baseline and 0.35 % of focal length. Pitch and roll were up to 0.09 and 0.16 degrees off. They show in every pair's
rows, change no area, and are held as narrow as any rig's, so that rows that lie apart are noticed and mended."""


def with_factory_width(rig: StereoRig, baseline_share: float = 0.0) -> StereoRig:
    """Return a rig out of a camera's memory with the width of such cameras.

    `baseline_share`: by how much another source contradicts its baseline; it is added.
    """
    return replace(rig, width=_widened(FACTORY, baseline_share))


def with_doubt(rig: StereoRig, baseline_share: float) -> StereoRig:
    """Return a rig of another program whose baseline another source contradicts by a share of it."""
    return replace(rig, width=_widened(rig.width, baseline_share))


def _widened(width: RigWidth, share: float) -> RigWidth:
    return replace(width, scale_share=math.hypot(width.scale_share, share))
