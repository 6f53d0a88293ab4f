"""What matching says: every measured face is matched or unmatched, every design face is observed or not."""

from dataclasses import dataclass

from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.register.pose import PlacedStation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceMatch:
    """One measured face, or the part of it that lies on one design face.

    `outline_uv_m`: polygons (tuples of rings, outer first) of the measured outline on the DESIGN face's (u, v) metres,
    clipped to the design face's own borders (with the tolerance). A face that runs over several elements gives several
    matches, divided along the design's borders. `area_m2` is this part's as-built area, sigma split as in MeasuredFace.
    `offset_m`: measured plane minus design plane along the design's outward normal.
    """

    station: str
    face_id: str  # MeasuredFace.face_id
    design_face: str  # DesignFace.face_id
    element: str
    outline_uv_m: tuple[tuple[FloatArray, ...], ...]
    area_m2: float
    area_sigma_calibration_m2: float
    area_sigma_image_m2: float
    whole: bool  # the measured face was seen whole and lies on this design face alone
    overlap: float  # share of the measured face that lies on this design face, 0..1
    offset_m: float
    offset_sigma_m: float
    tilt_rad: float | None  # from plumb along the face's up, where the vertical is known by the markers
    tilt_sigma_rad: float | None = None
    past_design_m2: float = 0.0  # of the measured face, on no design face; given with its largest part


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchResult:
    """A partition: every measured face is in `matches` or in `unmatched` (with why); `unobserved` design faces."""

    stations: tuple[PlacedStation, ...]
    matches: tuple[FaceMatch, ...]
    unmatched: tuple[Rejection, ...]  # what = "face A3/2"
    unobserved: tuple[str, ...]  # DesignFace.face_id
