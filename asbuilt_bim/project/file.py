"""What may stand in a project file, key by key; `read.py` makes paths and photos of it.

The names here are the keys of the file and of `schemas/project-1.json`.
"""

import re
from dataclasses import dataclass, field
from datetime import date
from typing import Annotated, Literal

from asbuilt_bim.camera.calibration.boards import FLATNESS_M, PRINT_SHARE
from asbuilt_bim.project.options import Options
from asbuilt_bim.register.by_design.rough import ABOUT_DEG, ABOUT_M
from asbuilt_bim.storage.structure import Within
from asbuilt_bim.vision.markers.find import Family

_MM = "a length in millimetres? metres are wanted here"


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardsFile:
    """`rig.boards`: photos of a calibration board, and what the board is."""

    kind: Literal["charuco", "chessboard"]
    columns: Annotated[int, Within(low=3, high=60)]  # charuco: squares; chessboard: inner corners
    rows: Annotated[int, Within(low=3, high=60)]
    square_m: Annotated[float, Within(low=0.002, high=1.0, unit="m", hint=_MM)]
    left: str | None = None  # a pattern with one or more *
    right: str | None = None
    both: str | None = None  # instead of left and right: photos that hold both eyes side by side
    marker_m: Annotated[float, Within(low=0.001, high=1.0, unit="m", hint=_MM)] | None = None
    dictionary: str | None = None
    distortion: Literal["five", "rational", "fisheye"] = "five"  # the model of lens that is fitted
    flatness_m: Annotated[float, Within(low=0.0, high=0.02, unit="m", hint=_MM)] = FLATNESS_M
    print_share: Annotated[float, Within(low=0.0, high=0.02)] = PRINT_SHARE

    def __post_init__(self) -> None:
        """Check what only two keys together can say.

        Raises:
            ValueError: a charuco board lacks its markers, a marker is larger than its square, or the photos aren't
                given one way.
        """
        _one_way(self.left, self.right, self.both)
        if self.kind == "charuco" and (self.marker_m is None or self.dictionary is None):
            raise ValueError("a charuco board needs marker_m and dictionary (such as DICT_5X5_100)")
        if self.marker_m is not None and self.marker_m >= self.square_m:
            raise ValueError(f"marker_m {self.marker_m:g} m must be smaller than square_m {self.square_m:g} m")


def _one_way(left: str | None, right: str | None, both: str | None) -> None:
    """Check that photos are given as left and right, or as both in one.

    Raises:
        ValueError: they aren't.
    """
    if (both is None) == (left is None or right is None) or (both is not None and (left or right)):
        raise ValueError("needs left and right, or both (one file that holds both eyes side by side)")


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlPointsFile:
    """`rig.control_points`: points measured on site and marked in one pair of photos, for a rig that sees no board."""

    file: str
    photo_size_px: tuple[Annotated[int, Within(low=1, high=100_000)], Annotated[int, Within(low=1, high=100_000)]]


@dataclass(frozen=True, slots=True, kw_only=True)
class TagsFile:
    """`rig.tags`: photos of tags of `markers.size_m`; without photos of their own, those of a visit, or of all."""

    visit: date | None = None
    left: str | None = None  # a pattern with one or more *
    right: str | None = None
    both: str | None = None  # instead of left and right: photos that hold both eyes side by side
    distortion: Literal["five", "rational", "fisheye"] = "five"  # the model of lens that is fitted
    flatness_m: Annotated[float, Within(low=0.0, high=0.02, unit="m", hint=_MM)] = FLATNESS_M
    print_share: Annotated[float, Within(low=0.0, high=0.02)] = PRINT_SHARE

    def __post_init__(self) -> None:
        """Check that photos come from one place.

        Raises:
            ValueError: they don't.
        """
        if self.has_photos:
            _one_way(self.left, self.right, self.both)
            if self.visit is not None:
                raise ValueError("needs a visit, or left and right (or both) of photos by themselves, not all of them")

    @property
    def has_photos(self) -> bool:
        """Say whether it names photos by themselves."""
        return any(text is not None for text in (self.left, self.right, self.both))


@dataclass(frozen=True, slots=True, kw_only=True)
class RigFile:
    """`rig`: a rig file of this program or another, photos of boards or tags, or control points; one of the four."""

    file: str | None = None
    file_right: str | None = None  # ROS and EuRoC keep a file a camera, OpenCV's samples intrinsics and extrinsics
    file_pose: str | None = None  # how the cameras stand, where each has a file that says its lens alone
    cameras: tuple[str, ...] = ()  # left and right, by the file's own names, where it holds more
    photo_size_px: tuple[int, int] | None = None  # OpenCV's files don't say it
    unit_m: Annotated[float, Within(low=0.0005, high=1.0, unit="m")] = 1.0  # of T in OpenCV's files: 0.001 for mm
    fisheye: bool = False  # four coefficients in OpenCV's files may be a fisheye's
    boards: BoardsFile | None = None
    tags: TagsFile | None = None
    control_points: ControlPointsFile | None = None
    refine: bool = False  # where it was knocked since: measure with the rig as each visit's photos show it

    def __post_init__(self) -> None:
        """Check that there is one source of the rig.

        Raises:
            ValueError: none or several are given.
        """
        if [self.file, self.boards, self.tags, self.control_points].count(None) != 3:
            raise ValueError(
                "needs file (a rig.yaml), boards (photos of a calibration board), tags or control_points, one of the "
                "four"
            )
        if self.photo_size_px is not None and not all(1 <= side <= 100_000 for side in self.photo_size_px):
            raise ValueError(f"photo_size_px {list(self.photo_size_px)} is no width and height in pixels")


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetFile:
    """`target`: the red disc."""

    diameter_m: Annotated[float, Within(low=0.05, high=2.0, unit="m", hint=_MM)] | None = None
    required: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkersFile:
    """`markers`: the AprilTags and their survey; without one they link stations that are placed otherwise."""

    survey: str | None = None
    size_m: Annotated[float, Within(low=0.02, high=3.0, unit="m", hint=_MM)] | None = None
    family: Family = "apriltag_36h11"
    sigma_m: Annotated[float, Within(low=0.0001, high=0.1, unit="m", hint=_MM)] = 0.003

    def __post_init__(self) -> None:
        """Check what only two keys together can say.

        Raises:
            ValueError: markers are surveyed, and their size isn't given.
        """
        if self.survey is not None and self.size_m is None:
            raise ValueError("a survey needs size_m, the side of the markers' black square in metres")


@dataclass(frozen=True, slots=True, kw_only=True)
class PosesFile:
    """`poses`: a table of where stations stood, by a total station, GNSS or the camera's own tracking."""

    file: str
    coordinates: Literal["ifc", "map"] = "ifc"  # the map's: by the IFC file's map conversion


Metres = Annotated[float, Within(low=-1e7, high=1e7, unit="m")]
Compass = Literal[
    "north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class NearFile:
    """`near`: where a station stood, roughly; the design is searched from there."""

    storey: str | None = None  # name or GlobalId
    grid: str | None = None  # two axes of the IFC file's grid, such as B-3
    x_m: Metres | None = None
    y_m: Metres | None = None
    looking: Compass | None = None
    bearing_deg: Annotated[float, Within(low=-360.0, high=360.0, unit="deg")] | None = None
    within_m: Annotated[float, Within(low=0.1, high=50.0, unit="m")] = ABOUT_M
    within_deg: Annotated[float, Within(low=1.0, high=90.0, unit="deg")] = ABOUT_DEG

    def __post_init__(self) -> None:
        """Check what only several keys together can say.

        Raises:
            ValueError: nothing is said, or one thing twice or by half.
        """
        if self.storey is None and self.grid is None and self.x_m is None:
            raise ValueError("needs a storey, a crossing of grid axes (grid: B-3), or x_m and y_m")
        if (self.x_m is None) != (self.y_m is None):
            raise ValueError("needs x_m and y_m, both")
        if self.grid is not None and self.x_m is not None:
            raise ValueError("needs grid, or x_m and y_m, not all of them")
        if self.looking is not None and self.bearing_deg is not None:
            raise ValueError("needs looking or bearing_deg, not both")


@dataclass(frozen=True, slots=True, kw_only=True)
class StationFile:
    """One of `visits[].stations`."""

    name: str
    left: str | None = None
    right: str | None = None
    both: str | None = None  # instead of left and right: a photo that holds both eyes side by side
    near: NearFile | None = None  # instead of its visit's

    def __post_init__(self) -> None:
        """Check that the photos are given one way.

        Raises:
            ValueError: they aren't.
        """
        _one_way(self.left, self.right, self.both)


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternsFile:
    """Stations by patterns of file names: what stands for the `*` is a station's name."""

    left: str | None = None
    right: str | None = None
    both: str | None = None  # instead of left and right: photos that hold both eyes side by side

    def __post_init__(self) -> None:
        """Check that the photos are given one way, and that left and right have as many `*`.

        Raises:
            ValueError: they aren't, or haven't.
        """
        _one_way(self.left, self.right, self.both)
        names = [re.split(r"[\\/]", text)[-1] for text in (self.left, self.right, self.both) if text is not None]
        if any("*" not in name for name in names):
            raise ValueError("a pattern needs a * in the file's name, which stands for the station's name")
        if len({name.count("*") for name in names}) > 1:
            raise ValueError("left and right need as many *: two photos are a pair where they stand for the same text")


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoFile:
    """`visits[].video`: a walk recorded by the rig, whose frames become stations."""

    left: str | None = None
    right: str | None = None
    both: str | None = None  # instead of left and right: a video that holds both eyes side by side

    def __post_init__(self) -> None:
        """Check that the videos are given one way.

        Raises:
            ValueError: they aren't.
        """
        _one_way(self.left, self.right, self.both)


@dataclass(frozen=True, slots=True, kw_only=True)
class VisitFile:
    """One of `visits`: its stations, videos of which stations are made, or both."""

    date: date
    stations: tuple[StationFile, ...] | PatternsFile = ()
    video: tuple[VideoFile, ...] | VideoFile = ()  # a walk, or several of one day
    camera_clock_wrong: bool = False  # the photos' own days don't count
    near: NearFile | None = None  # of its stations that say nothing themselves
    near_stations: dict[str, NearFile] = field(default_factory=dict)  # by name: stations by patterns say nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class VisitsFile(PatternsFile):
    """`visits` by patterns: a visit for each day that the photos' EXIF tells."""

    dates: Literal["exif"]
    near: NearFile | None = None  # as of a visit, of every day
    near_stations: dict[str, NearFile] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class ValuationFile:
    """`valuation`: how the first workbook begins; from then on what stands in the last one counts."""

    retention_percent: Annotated[float, Within(low=0.0, high=100.0, unit="%")] = 0.0
    tax_percent: Annotated[float, Within(low=0.0, high=100.0, unit="%")] = 0.0
    observations: Literal["shown", "count"] = "shown"
    last: str | None = None  # the last workbook, where it lies in another folder than --out

    def __post_init__(self) -> None:
        """Check that percentages aren't shares.

        Raises:
            ValueError: one may be: it is above 0 and under 1.
        """
        for name, value in (("retention_percent", self.retention_percent), ("tax_percent", self.tax_percent)):
            if 0.0 < value < 1.0:
                raise ValueError(f"{name}: {value:g} may be a share; write {100.0 * value:g} for {100.0 * value:g} %")


@dataclass(frozen=True, slots=True, kw_only=True)
class ToleranceFile:
    """`tolerance`: what elements may lie off their design and lean, by a standard or in own values."""

    standard: Literal["en13670-1"] | None = None
    name: str = ""  # of own values: what the contract calls them
    offset_m: Annotated[float, Within(low=0.001, high=1.0, unit="m", hint=_MM)] | None = None
    plumb_m: Annotated[float, Within(low=0.001, high=1.0, unit="m", hint=_MM)] | None = None
    plumb_share: Annotated[float, Within(low=0.0, high=0.1)] = 0.0  # of the height, where that is more

    def __post_init__(self) -> None:
        """Check that there are limits, by one way.

        Raises:
            ValueError: there are none, or a standard and own values at once.
        """
        own = self.offset_m is not None or self.plumb_m is not None
        if own == (self.standard is not None):
            raise ValueError("needs standard (en13670-1), or own values: offset_m, plumb_m or both")
        if self.plumb_share and self.plumb_m is None:
            raise ValueError("plumb_share needs plumb_m, the limit of low elements")


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyShiftFile:
    """`accept_survey_shift`: how far off the design the survey may lie, since a person has looked at it."""

    move_m: tuple[Metres, Metres, Metres]
    turn_deg: Annotated[float, Within(low=-180.0, high=180.0, unit="deg")] = 0.0  # counter-clockwise, from above
    about_m: tuple[Metres, Metres] | None = None  # where the turn's axis stands

    def __post_init__(self) -> None:
        """Check what only two keys together can say.

        Raises:
            ValueError: a turn has no axis.
        """
        if self.turn_deg and self.about_m is None:
            raise ValueError("a turn needs about_m, the x and y of its axis; the run that named the shift tells it")


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworksFile:
    """`networks`: cards of networks (YAML beside their ONNX files), `bundled`, or `plugin:NAME`; none is needed."""

    segment: str | None = None
    depth: str | None = None
    stereo: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectFile:
    """The whole project file, as it was written."""

    format: Literal["asbuilt-bim/project"]
    version: Literal[1]
    name: str
    ifc: tuple[str, ...] | str  # one file, or several that are one design
    rig: RigFile
    visits: tuple[VisitFile, ...] | VisitsFile
    target: TargetFile = field(default_factory=TargetFile)
    markers: MarkersFile = field(default_factory=MarkersFile)
    poses: PosesFile | None = None
    control_points: str | None = None  # a table of points with coordinates, clicked in left photos
    networks: NetworksFile = field(default_factory=NetworksFile)
    options: Options = field(default_factory=Options)
    scope: str | None = None
    history: tuple[str, ...] = ()  # result.json of earlier runs, whose visits are no longer listed here
    schedule: str | None = None  # MS Project XML, Primavera P6 XML or CSV
    costs: str | None = None  # CSV or .xlsx
    observations: str | None = None  # CSV or .xlsx
    valuation: ValuationFile = field(default_factory=ValuationFile)
    tolerance: ToleranceFile | None = None
    pictures: Literal["elements", "whole"] = "elements"  # what pictures in reports show sharp
    csv: Literal["comma", "semicolon"] = "comma"  # commas and decimal points, or semicolons and decimal commas
    people: str | None = None  # a table of outlines drawn in left photos, to blur
    accept_moved: tuple[str, ...] = ()  # GlobalIds of elements that may count where they stand, beside their design
    accept_survey_shift: SurveyShiftFile | None = None
    writers: tuple[str, ...] = ()  # report writers that other packages add
