"""Options of judging progress."""

from dataclasses import dataclass


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
    decided_share: float = 0.5  # of one side's samples in a cell must say the same: fewer, and clutter could decide
    sole_share: float = 0.25  # the same where none says otherwise: what a prop or a neighbour hides says nothing
    tinted_share: float = 0.5  # of an outline without the colour of concrete, from which that is told; 1 takes any
    min_face_m2: float = 0.10  # a smaller face may be clutter, a smaller hole a mismatch: neither proves a thing
    cover_m: float = 0.025  # of concrete over its steel, the least that standards ask for outside
    min_patch_m2: float = 0.35  # a larger face is no starter bars, however deep it lies: they make patches
    clear_share: float = 0.8  # a side is clear where this share of its samples agrees; pour lines are not
    complete_from: float = 0.97  # best; a column of 3 m has 30 cells, so one wrong cell is not yet a part
    not_started_to: float = 0.02  # best; the foot of a column may hide one cell of formwork or starter bars
    known_from: float = 0.10  # coverage, under which completion has no best value
    nearly_all: float = 0.90  # coverage from which "complete" needs no look at the top
    enough_coverage: float = 0.50  # coverage from which "not started" needs no look at the foot, but near it
    starter_bars_m: float = 1.0  # starter bars hide a foot up to here: 40 diameters of 25 mm
