"""What judging progress may be told."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgressOptions:
    """Limits of built, open and unknown, each with its reason."""

    spacing_m: float = 0.05  # samples of the design's surface; a cell of a column is two of them high
    max_distance_m: float = 20.0  # further off a wall's thickness drowns in the disparity's noise
    max_incidence_deg: float = 80.0  # beyond, a pixel covers six times its width of the surface
    building_tolerance_m: float = 0.05  # concrete may stand this far from its design and still be that concrete
    sigmas: float = 3.0  # the tolerance grows with what the measurement may err
    rig_sigma_px: float = 0.25  # disparity that a calibrated rig may err by in common (yaw of some 0.01 degrees)
    max_blur_m: float = 0.25  # built is said only where front and back of a wall can be told apart
    margin_px: int = 3  # reference pixels round a sample that must say the same: stereo smears depth edges
    decided_share: float = 0.25  # of one side's samples in a cell: fewer don't decide it
    clear_share: float = 0.8  # a side is clear where this share of its samples agrees; pour lines are not
    complete_from: float = 0.97  # best; a column of 3 m has 30 cells, so one wrong cell is not yet a part
    not_started_to: float = 0.02  # best; the foot of a column may hide one cell of formwork or starter bars
    known_from: float = 0.10  # coverage, under which completion has no best value
    enough_coverage: float = 0.50  # from here on what was seen stands for the state; below, the ends must be seen
