"""A measured face: its outline in metres, its area, and how sure that is."""

from dataclasses import dataclass, field, replace

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.vision.masks.segment import InstanceClass, InstanceSource


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredFace:
    """One planar or cylindrical piece of an instance, in the LEFT frame.

    `outline_uv_m`: rings (N, 2) in the frame's (u, v) metres, the first the outer one (counter-clockwise), then holes
    (clockwise); open rings (first point not repeated). `outline_px`: the same rings in rectified left pixels.
    `area_m2` is what Green's theorem gives on `outline_uv_m`; `area_sigma_m2` splits into `area_sigma_calibration_m2`
    (shared by all faces of the rig) and `area_sigma_image_m2` (its own). `area_sigma_open_m2`, in neither, is what
    sides leave open farther off that may not be the face's ends: a design, or who drew a mask, says where those are.
    `covariance` (3, 3): plane at its centroid, [offset along the normal (m), tilt about u (rad), tilt about v (rad)],
    image part; `covariance_calibration` is the rig's part of the same.
    """

    face_id: str  # "A3/2": station / number
    label: InstanceClass
    score: float
    frame: PlaneFrame | CylinderFrame
    outline_uv_m: tuple[FloatArray, ...]
    outline_px: tuple[FloatArray, ...]
    area_m2: float
    area_sigma_calibration_m2: float
    area_sigma_image_m2: float
    covariance: FloatArray
    width_m: float
    height_m: float
    width_px: float  # of the narrow side, in the photo
    distance_m: float  # centroid from the left camera
    cut_by_frame: bool
    occluded: bool  # something nearer touches its outline
    flatness_rms_m: float
    instance: int  # index into StationMeasurement.instances' order
    open_edge: bool = False  # a side isn't likely enough to be the face's end: it may be larger
    whole_probability: float = 0.0  # that every side is the face's end; the flags say what speaks against it
    source: InstanceSource = InstanceSource.GEOMETRY  # who found the instance
    segmenter: str = ""  # the name of the network or plugin that did
    covariance_calibration: FloatArray = field(default_factory=lambda: frozen(np.zeros((3, 3))))
    area_sigma_open_m2: float = 0.0

    @property
    def area_sigma_m2(self) -> float:
        """Return the whole standard deviation of the area in m2."""
        return float((self.area_sigma_calibration_m2**2 + self.area_sigma_image_m2**2) ** 0.5)

    @property
    def place_covariance(self) -> FloatArray:
        """Return how well its place is known in all, (3, 3) as `covariance`."""
        return self.covariance + self.covariance_calibration

    def of_wider_scale(self, share: float) -> "MeasuredFace":
        """Return it with an area that may be off by a share more, and lengths by half of that: its place with them."""
        away_m = self.distance_m
        if isinstance(self.frame, PlaneFrame):
            away_m = float(self.frame.normal @ self.frame.origin_m)
        place = np.array(self.covariance_calibration)
        place[0, 0] += (0.5 * share * away_m) ** 2
        area = float(np.hypot(self.area_sigma_calibration_m2, share * self.area_m2))
        return replace(self, area_sigma_calibration_m2=area, covariance_calibration=frozen(place))

    def without_design(self) -> "MeasuredFace":
        """Return it as it stands where no design says where it ends: what its sides leave open is in its own sigma."""
        image_m2 = float(np.hypot(self.area_sigma_image_m2, self.area_sigma_open_m2))
        return replace(self, area_sigma_image_m2=image_m2, area_sigma_open_m2=0.0)

    @property
    def whole(self) -> bool:
        """Say whether the face was seen whole: not cut by the frame nor hidden in part, and every side is its end."""
        return not (self.cut_by_frame or self.occluded or self.open_edge)
