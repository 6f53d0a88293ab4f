"""The options of a station's measurement."""

from dataclasses import dataclass, field

from asbuilt_bim.measure.depth_source import Method, depth_method
from asbuilt_bim.measure.station_faces import FaceOptions
from asbuilt_bim.vision.scene.geometric import GeometricOptions
from asbuilt_bim.vision.stereo.depth import DepthMethod
from asbuilt_bim.vision.stereo.depth_paper import Inversion
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher
from asbuilt_bim.vision.target.find import TargetOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureOptions:
    """The options of each step of a station's measurement."""

    target: TargetOptions = field(default_factory=TargetOptions)
    marker_family: str = "apriltag_36h11"  # the one that surveyors print; its corners decode at 20 px
    matcher: SemiGlobalMatcher = field(default_factory=SemiGlobalMatcher)
    geometric: GeometricOptions = field(default_factory=GeometricOptions)
    faces: FaceOptions = field(default_factory=FaceOptions)
    least_markers_without_target: int = 2  # with `target.required: false`, two surveyed markers hold the scale
    most_width_px: int = 2048  # a larger photo is measured at this width: see working_size
    method: Method = "default"  # paper: the published pipeline, to compare with
    depth: DepthMethod | None = None  # None: the method's own (default: stereo, paper: paper)
    inversion: Inversion = "complement"  # how method: paper inverts the network's map

    def __post_init__(self) -> None:
        """Check what only two keys together can say.

        Raises:
            ValueError: the method can't measure on the depth map that is asked for.
        """
        depth_method(self.method, self.depth)
