"""What the program has to say, as codes: a reason, what it is about, and the values. Sentences are made at the edge.

Nothing reads prose: code asks for a `Reason`, people read what `report/wording` makes of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

Value = str | int | float | bool | tuple[str, ...] | tuple[int, ...] | tuple[float, ...]
"""What a sentence may be filled with: numbers in SI with their unit in the key's name, names, lists of names."""


class SubjectKind(StrEnum):
    """What kind of thing is spoken of."""

    UNSTATED = "unstated"  # read from a file that was written before there were codes
    VISIT = "visit"
    STATION = "station"
    PHOTO = "photo"
    TARGET = "target"
    DISC = "red disc"  # in a photo, not the target; its name is where it stands there
    MARKER = "marker"
    CONTROL_POINT = "control point"
    BOARD_PAIR = "board pair"  # two photos of the calibration board
    FACE = "face"
    INSTANCE = "instance"  # a wall or column seen in a photo, before it is measured
    ELEMENT = "element"
    STOREY = "storey"
    TASK = "task"
    COST_LINE = "cost line"
    SURVEY = "survey"
    RIG = "rig"
    DESIGN = "design"
    SCHEDULE = "schedule"
    FILE = "file"


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a rejection or a note is about: its kind, its name or id, and the station where it was seen."""

    kind: SubjectKind
    name: str = ""  # of a station its name, of a face "A3/2", of an element its GlobalId
    station: str = ""  # "" where it is about no station, or is the station itself

    @property
    def at_station(self) -> str:
        """Return the station that it is, or belongs to; "" where there is none."""
        return self.name if self.kind is SubjectKind.STATION else self.station


class Reason(StrEnum):
    """Why something was left out, or what a person has to know. A value keeps its meaning; new ones are added."""

    UNSTATED = "unstated"  # read from a file that was written before there were codes

    # Rejections.
    # Photos of a station.
    PHOTO_UNUSABLE = "photo unusable"  # of a station, or of a board pair: the detail names it
    PHOTO_TURNED = "photo turned"  # its pixels
    PHOTO_SIZE = "photo of another size"
    PHOTO_HELD_TURNED = "photo held turned"  # by its EXIF: the camera was
    PHOTO_OF_OTHER_SIDE = "photo of the other side"  # by its serial number
    PHOTO_OF_OTHER_MODEL = "photo of another camera model"
    PHOTO_OF_OTHER_CAMERA = "photo of another camera"
    PHOTO_ZOOMED = "photo zoomed"
    PHOTOS_UNUSABLE = "photos unusable"  # both together can't be rectified
    PHOTOS_DIFFER_IN_SIZE = "photos differ in size"
    PHOTO_TWICE = "photo twice"  # as left and as right
    PHOTOS_SWAPPED = "photos swapped"
    PHOTOS_UPSIDE_DOWN = "photos upside down"
    PHOTOS_UPSIDE_DOWN_SWAPPED = "photos upside down and swapped"
    PHOTOS_LOOK_SWAPPED = "photos look swapped"
    PHOTOS_UNRELATED = "photos unrelated"  # too little in common
    PHOTOS_BEHIND_RIG = "photos behind the rig"  # turned outwards, or both photos upside down
    PHOTOS_ROWS_APART = "photos with rows apart"
    PHOTOS_OVERLAP = "photos overlap too little"
    PHOTOS_OF_OTHER_STATION = "photos of another station"
    PHOTOS_OF_OTHER_DAY = "photos of another day"
    # A station that could not be worked on.
    STATION_FAILED = "station failed"  # an exception says why
    STATION_MEMORY = "station out of memory"
    STATION_CRASHED = "station crashed"  # an error of this program's own
    STATION_WORKER_LOST = "station lost with its worker"
    # The target.
    DISC_NOT_TARGET = "disc not the target"
    DISC_SPARE = "disc spare"  # another one was taken
    TARGET_SIZE_DOUBTFUL = "target size doubtful"
    TARGET_AMBIGUOUS = "target ambiguous"
    TARGET_ROWS_APART = "target with rows apart"
    TARGET_IN_ONE_PHOTO = "target in one photo"
    TARGET_UNPAIRED = "target unpaired"  # discs in both photos, not one the same
    TARGET_ABSENT = "target absent"
    SCALE_UNCHECKED = "scale unchecked"  # neither the target nor enough markers
    # The rig.
    RIG_KNOCKED = "rig knocked"
    RIG_MOVED = "rig moved"  # by less than the limit
    RIG_UNDETERMINED = "rig undetermined"
    RIG_REFINED = "rig refined"
    SCALE_WRONG = "scale wrong"
    LENGTHS_DOUBTFUL = "lengths doubtful"  # known lengths of one kind or more
    LENGTHS_DOUBTFUL_TOGETHER = "lengths doubtful together"
    # Depth, masks and faces.
    DEPTH_WITHOUT_NETWORK = "depth without a network"
    DEPTH_WITHOUT_TARGET = "depth without the target"
    DEPTH_FAILED = "depth failed"
    MASK_UNUSED = "mask unused"
    INSTANCE_WITHOUT_SURFACE = "instance without a surface"  # a network sees it, the depth doesn't
    INSTANCE_WITHOUT_DEPTH = "instance without depth"  # method: paper
    INSTANCE_WITHOUT_FACE = "instance without a face"
    FACE_NARROW = "face too narrow"
    FACE_UNCERTAIN = "face too uncertain"
    # Places of stations.
    MARKER_NOT_SURVEYED = "marker not surveyed"
    MARKER_CONTRADICTS = "marker contradicts the others"
    MARKER_FAR = "marker far from the building"
    MARKERS_TOO_FEW = "markers too few"
    MARKERS_DISAGREE = "markers disagree"
    MARKERS_AMBIGUOUS = "markers ambiguous"
    CONTROL_POINTS_TOO_FEW = "control points too few"
    CONTROL_POINTS_DISAGREE = "control points disagree"
    CONTROL_POINT_CONTRADICTS = "control point contradicts the others"
    POSE_RESIDUAL = "pose residual too large"
    POSE_UNCERTAIN = "pose uncertain"
    SURVEY_MIRRORED = "survey mirrored"
    STATION_SURVEY_MIRRORED = "station in a mirrored survey"
    # Measured against the design.
    FACE_WITHOUT_DESIGN = "face without a design face"  # none in view has its shape and direction
    FACE_PAST_DESIGN = "face past the design"  # matched, but a part lies on no design face
    FACE_TURNED = "face turned"  # this and the next four: against the nearest design face
    FACE_APART = "face apart"
    FACE_OF_OTHER_RADIUS = "face of another radius"
    FACE_BEFORE = "face before the design"
    FACE_BEHIND = "face behind the design"
    SURVEY_SHIFTED = "survey shifted"
    SURVEY_SHIFTED_IN_HEIGHT = "survey shifted in height"
    SURVEY_ELSEWHERE = "survey elsewhere"  # turned, or moved by more than a column's spacing
    DESIGN_UNLIKE = "design unlike"  # not one measured face fits it
    DESIGN_HARDLY_ALIKE = "design hardly alike"
    # Calibration.
    BOARD_NOT_FOUND = "board not found"
    BOARD_PAIR_TWICE = "board pair twice"
    BOARD_PAIR_OF_OTHER_CAMERA = "board pair of another camera"
    BOARD_PAIR_MISFIT = "board pair misfit"
    BOARD_PAIR_MOVED = "board pair moved"  # between left and right
    CONTROL_POINT_MISFIT = "control point misfit"

    # Notes.


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """Something that a person has to know: the code, what it is about, and the values that its sentence needs."""

    code: Reason
    subject: Subject
    values: Mapping[str, Value] = field(default_factory=dict)
