"""Options of matching."""

from dataclasses import dataclass

from asbuilt_bim.register.options import FURTHEST_M, PAST_M


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchOptions:
    """Limits of a match, each with its reason."""

    max_distance_m: float = FURTHEST_M  # a face further off is too small in the photo to be known from its neighbour
    max_angle_deg: float = 12.0  # walls of a building differ in direction by more; a good plane errs by less
    max_offset_m: float = 0.10  # half a thin wall: a front is never taken for its back
    sigmas: float = 3.0  # added to both limits for what the measurement itself may err
    border_m: float = PAST_M  # how far an outline may pass the design's border: pose, formwork joint, mask edge
    max_radius_share: float = 0.25  # the axis says which column it is; a pole or a barrel differs by more
    min_share: float = 0.02  # a smaller part of a face on a design face is its border's noise
    min_area_m2: float = 0.02  # the same, absolutely
    angle_scale_deg: float = 4.0  # how fast the score falls with the angle
    offset_scale_m: float = 0.04  # how fast it falls with the offset: good formwork errs by 1 to 2 cm
    class_penalty: float = 0.5  # soft: a wall's end looks like a column
    building_tilt_deg: float = 1.0  # how far a built face may turn from its design before the design says nothing of it
