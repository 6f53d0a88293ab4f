"""Options of registration."""

from dataclasses import dataclass

FURTHEST_M = 20.0  # a face further off is too small in the photo to be known from its neighbour
PAST_M = 0.10  # how far an outline may pass the design's border: pose, formwork joint, mask edge


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisterOptions:
    """Limits of a pose, each with its reason."""

    min_markers: int = 2  # one marker alone turns about its own normal: 4 corners hold no check
    min_control_points: int = 6  # four fix a pose; two more let a wrong one be found
    max_residual_px: float = 3.0  # a sound rig and survey leave under 1 px
    max_sigma_at_5_m_m: float = 0.03  # a face 5 m ahead must be known from its neighbour, and built from open
    min_corner_sigma_px: float = 0.25  # what the lens model leaves over, however sharp the corner is
    rig_disparity_px: float = 0.1  # what a calibration leaves of the right camera's yaw: 0.2 % of 5 m, in common
    rig_direction_px: float = 0.5  # how well a calibration knows the principal point: it turns every pose in common
    control_point_sigma_m: float = 0.005  # a point measured by tape or total station on rough concrete
    control_point_sigma_px: float = 1.0  # clicked by hand
