"""Options of judging progress."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgressOptions:
    """Limits of built, open and unknown, each with its reason."""

    spacing_m: float = 0.05  # samples of the design's surface; a cell of a column is two of them high
    max_distance_m: float = 20.0  # further off the disparity's noise hides a wall's thickness
    max_incidence_deg: float = 80.0  # beyond, a pixel covers six times its width of the surface
    building_tolerance_m: float = 0.05  # concrete may stand this far from its design and still be that concrete
    sigmas: float = 3.0  # the tolerance grows with what the measurement may err
    rig_sigma_px: float = 0.15  # disparity that a calibrated rig may err by in common (yaw of 0.008 degrees)
    max_blur_m: float = 0.45  # built where 3 sigma are within a column's own depth: what stands there is it
    shown_share: float = 0.25  # of a side's samples must be decided for it to show anything: a prop may hide the rest
    tinted_share: float = 0.5  # of an outline without the colour of concrete, from which that is told; 1 takes any
    min_face_m2: float = 0.10  # a smaller face may be clutter, a smaller hole a mismatch: neither proves a thing
    cover_m: float = 0.025  # of concrete over its steel, the least that standards ask for outside
    min_patch_m2: float = 0.35  # a larger face is no starter bars, however deep it lies: they make patches
    complete_from: float = 0.97  # of its height; a column of 3 m lacks one cell of 30, which is not yet a part
    kicker_m: float = 0.15  # cast with the slab, 75 to 150 mm high: with it alone nothing has started
    known_from: float = 0.10  # coverage, under which completion has no best value
    nearly_all: float = 0.90  # certain, under which what is complete is told as far as it was seen
    enough_coverage: float = 0.50  # coverage under which a state is told with what was seen
    REMOVED: ClassVar = frozenset({
        "clear_share", "decided_share", "found_share", "margin_px", "max_lean_deg", "not_started_to", "sole_share",
        "solid_share", "starter_bars_m", "through_share",
    })  # fmt: skip  # options of earlier versions: what they set is fitted now
