"""The result of a visit: one typed value, of which every file is a view."""

from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Literal

from asbuilt_bim.bim.model import GridLine
from asbuilt_bim.bim.schedule import ScheduleSource, TaskLink
from asbuilt_bim.codes import Note, Reason, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.money import cents
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.tolerance import Tolerance, ToleranceCheck
from asbuilt_bim.progress.valuation.inputs import Observation, ValuationInputs
from asbuilt_bim.vision.masks.segment import InstanceSource

SHARE_DECIMALS = 9
"""What a result keeps of a share: 1 + 1e-16 of a weighted mean is 1, and of a million m2 a thousandth still shows."""

WHOLE = SubjectKind.SURVEY, SubjectKind.VISIT
OF_SCALE = Reason.LENGTHS_DOUBTFUL, Reason.LENGTHS_DOUBTFUL_TOGETHER
"""What a rejection is about that puts every number of its visit in doubt."""

State = Literal["complete", "part", "not started", "displaced", "unknown"]
"""`displaced`: it stands beside its design, and nobody has accepted that."""
ShownState = State | Literal["complete as far as seen"]  # what is complete, and wasn't seen nearly whole
ENOUGH = 0.5
"""Half: where less was seen, fewer photos can raise a best estimate, and none is shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Completion:
    """Completion in 0..1: best is what is likelier built than not; None when coverage is under 10 %.

    In `lower` unknown counts as open, in `upper` as built; a cell that a pour line may cut by what is sure of it.
    """

    best: float | None
    lower: float
    upper: float
    coverage: float  # cells of which photos decide a side / all cells

    @property
    def enough_seen(self) -> bool:
        """Say whether people get the best estimate: at least half was seen."""
        return self.best is not None and self.coverage >= ENOUGH

    @property
    def best_shown(self) -> float | None:
        """Return the best estimate as each file but `result.json` has it; None where too little was seen."""
        return self.best if self.enough_seen else None


NOTHING_SEEN = Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementProgress:
    """One wall or column after the visit."""

    global_id: str
    ifc_class: str
    kind: str
    name: str
    storey: str
    state: State
    completion: Completion
    cells_built: float  # volume-weighted cell counts would hide: plain counts of cells
    cells_open: float
    cells_unknown: float
    cells_conflict: float
    surface_coverage: float  # decided exposed surface / exposed surface
    design_area_m2: float  # exposed lateral surface
    design_volume_m3: float
    built_area_m2: float  # exposed surface seen built
    as_built_area_m2: float | None  # union of measured outlines over its faces; None where none was measured
    as_built_sigma_m2: float | None
    offset_m: float | None  # the largest by amount of its faces
    offset_sigma_m: float | None
    tilt_rad: float | None
    stations: tuple[str, ...]
    last_seen: date | None
    notes: tuple[Note, ...]
    doubts: tuple[Note, ...] = ()  # of the notes, what to look at before it is paid for
    best_when_seen: float | None = None  # the best estimate of the last visit that had one
    first_built: date | None = None  # the first visit that saw something of it built, of what is still held to stand
    complete_on: date | None = None  # the first visit since which it has been complete, and that much of it certain
    unfinished_on: date | None = None  # the last visit that saw it unfinished
    move_m: tuple[float, ...] | None = None  # how it stands beside its design, in the world
    accepted: bool = False  # by a person: what is said of it is of where it stands
    type_name: str = ""  # of its type in the IFC file
    as_far_as_seen: bool = False  # complete, and its lower bound is under `nearly_all`: not all of it was seen
    tilt_sigma_rad: float | None = None
    zones: tuple[str, ...] = ()  # names of the zones that it lies in
    tolerance: ToleranceCheck | None = None  # None where the project names none
    former_ids: tuple[str, ...] = ()  # GlobalIds that earlier exports gave it
    level_evidence: FloatArray | None = None  # log-likelihood of each level by all visits, (lines, rows + 1)

    @property
    def shown_state(self) -> ShownState:
        """Return the state as people get it."""
        return "complete as far as seen" if self.as_far_as_seen else self.state


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupProgress:
    """A storey, a task or the whole: completion weighted by the elements' exposed design area."""

    key: str  # GlobalId, or "" for the whole
    name: str
    elements: tuple[str, ...]
    completion: Completion
    complete: int  # numbers of elements by state
    part: int
    not_started: int
    unknown: int
    design_area_m2: float
    as_built_area_m2: float
    as_built_sigma_m2: float
    displaced: int = 0
    as_far_as_seen: int = 0  # of the complete ones

    @property
    def surely_complete(self) -> int:
        """Return how many are in the state complete as people get it: less those complete as far as seen."""
        return self.complete - self.as_far_as_seen


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskProgress:
    """A task: its elements' completion and its dates."""

    progress: GroupProgress
    schedule_start: datetime | None
    schedule_finish: datetime | None
    actual_start: date | None  # first visit that saw something built; None where unknown
    actual_finish: date | None  # only when all its elements are complete, and certainly so
    late: bool | None  # the day of its planned finish has passed, and it is not complete; None where unknown
    identification: str = ""
    outline: tuple[str, ...] = ()  # names of the summary tasks above it, the outermost first
    links: tuple[TaskLink, ...] = ()
    schedule_uid: str = ""  # what the schedule file knows it by, "" where there is none
    planned: float | None = None  # share that the plan wants by the end of the visit's day
    behind_days: int | None = None  # behind the plan, by the best estimate; negative: ahead
    behind_least_days: int | None = None  # at least, whatever was not seen
    behind_most_days: int | None = None  # at most, by what is certain
    others: int = 0  # building elements that it makes, too, and that are not measured here
    late_days: int | None = None  # from its planned finish to the visit's day where it is late, 0 where it isn't
    forecast_finish: datetime | None = None  # by what is certain, at the planned pace; None where nothing says when
    forecast_earliest: datetime | None = None  # the same, if all that may be built is built
    ifc_finish: datetime | None = None  # its own in the IFC, where the schedule file dates elements of it otherwise
    finish_from: str = ""  # the schedule file that its planned finish is from; "": the IFC

    @property
    def behind_days_shown(self) -> int | None:
        """Return the days behind as each file but `result.json` has them; None where too little was seen to say."""
        certain = self.behind_least_days == self.behind_most_days
        return self.behind_days if certain or self.progress.completion.enough_seen else None


@dataclass(frozen=True, slots=True, kw_only=True)
class CostProgress:
    """A cost line in its OWN unit; its as-built quantities are rounded, and whole where pieces are counted."""

    global_id: str
    name: str
    identification: str
    elements: tuple[str, ...]
    unit: str
    measure: str
    planned_quantity: float
    rate: float
    currency: str
    completion: Completion  # weighted by what the line's measure says: volume, area, length or count of each element
    as_built_best: float | None
    as_built_lower: float
    earned_best: float | None  # in cents
    earned_lower: float  # in cents
    schedule: str = ""  # the cost schedule that it stands in
    others: int = 0  # building elements that it pays for, too, and that are not measured here
    parts: dict[str, float] = field(default_factory=dict)  # by GlobalId: an element's share of the planned quantity
    design_quantity: float = 0.0  # of its measured elements, in its unit; of `other` measures their volume in m3
    designs: dict[str, float] = field(default_factory=dict)  # by GlobalId: what of `design_quantity` an element has
    lost: float = 0.0  # share of the planned quantity that stood for what a signed design had, and this one has not

    @property
    def best_quantity_shown(self) -> float | None:
        """Return the as-built quantity that people get as the best estimate; None where too little was seen."""
        return self.as_built_best if self.completion.enough_seen else None

    @property
    def earned_best_shown(self) -> float | None:
        """Return what that is worth, in cents."""
        return self.earned_best if self.completion.enough_seen else None

    @property
    def planned_value(self) -> float:
        """Return what the line is worth when it is finished, in cents."""
        return cents(self.planned_quantity * self.rate)

    @property
    def takes_off(self) -> bool:
        """Say whether the line takes money off: a deduction, a credit."""
        return self.planned_quantity * self.rate < 0.0

    @property
    def certain(self) -> float:
        """Return the share (0..1) that a certificate counts: the lower bound, or the upper of what is taken off."""
        return self.completion.upper if self.takes_off else self.completion.lower


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceRecord:
    """A measured face as it is kept in the result: what an overlay draws, and what it was matched to."""

    face_id: str
    label: str
    kind: Literal["plane", "cylinder"]
    outline_px: tuple[FloatArray, ...]  # rings in rectified left pixels
    outline_world_m: tuple[FloatArray, ...]  # rings (N, 3)
    area_m2: float
    area_sigma_calibration_m2: float
    area_sigma_image_m2: float
    whole: bool
    cut_by_frame: bool
    occluded: bool
    width_m: float
    height_m: float
    width_px: float
    design_faces: tuple[str, ...]  # DesignFace.face_ids, empty when unmatched
    elements: tuple[str, ...]
    source: InstanceSource = InstanceSource.GEOMETRY  # who found it
    segmenter: str = ""  # the name of the network or plugin that did


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationRecord:
    """One station as it is kept in the result."""

    name: str
    day: date
    left_photo: str  # path relative to the project folder
    right_photo: str
    left_digest: str
    right_digest: str
    f_px: float
    cx_px: float
    cy_px: float
    baseline_m: float
    width_px: int
    height_px: int
    rectified_from_left: FloatArray
    world_from_left: FloatArray | None  # None where it could not be placed
    pose_covariance: FloatArray | None
    pose_residual_px: float | None
    pose_method: str
    markers_used: tuple[int, ...]
    target_left_px: FloatArray | None
    target_right_px: FloatArray | None
    target_radius_px: float | None
    target_depth_m: float | None
    target_depth_sigma_m: float | None
    target_range_m: float | None
    target_diameter_m: float | None
    faces: tuple[FaceRecord, ...]
    picture: str  # overlay's base picture, relative to the run folder: "pictures/<station>.jpg", without EXIF
    seconds: dict[str, float]
    linked_to: tuple[str, ...] = ()  # stations that points of both photos link it to
    before_px: tuple[FloatArray, ...] = ()  # rings (N, 2) round what stands before its faces: blurred in pictures

    @property
    def overlay(self) -> str:
        """Return the overlay's path, relative to the run folder."""
        return f"overlays/{self.day.isoformat()}_{self.picture.rsplit('/', 1)[-1] or self.name + '.jpg'}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerRecord:
    """A marker that nobody surveyed, where photos found it: the next visit starts from it.

    `marker_covariance` (7, 7) is of [rotation vector (rad), centre (m)] in world axes, then of the size's logarithm.
    """

    marker_id: int
    world_from_marker: FloatArray  # (4, 4): x right of the print, y down, z into the wall
    size_m: float
    marker_covariance: FloatArray
    found_on: date  # the visit that found it there


@dataclass(frozen=True, slots=True, kw_only=True)
class WantedView:
    """A side of an element to photograph next, in world metres."""

    element: str  # GlobalId
    face_id: str
    begun: bool  # the plan has begun it by now, or says nothing of it
    open_m2: float  # of the element's design area, between its bounds
    unseen_m2: float  # of this side
    look_x_m: float  # the middle of what is unseen of it
    look_y_m: float
    look_z_m: float
    stand_x_m: float | None  # None where the design leaves no 3 m free before any side
    stand_y_m: float | None
    nearest_station: str  # of this visit and on the element's floor, "" where none was placed
    nearest_m: float | None  # from there, as seen from above


@dataclass(frozen=True, slots=True, kw_only=True)
class RigRecord:
    """How the rig stood at some stations of the visit, against its calibration: fitted to their own photos."""

    stations: tuple[str, ...]
    state: Literal["sound", "doubtful", "knocked", "undetermined"]
    refined: bool  # the stations were measured with the rig as their photos show it
    pitch_rad: float  # of the right camera, about x, y, z of the rectified frame
    yaw_rad: float
    roll_rad: float
    pitch_sigma_rad: float  # the matches' and the calibration's
    yaw_sigma_rad: float
    roll_sigma_rad: float
    area_effect: float  # relative error of an area at 5 m, used as calibrated
    area_effect_sigma: float
    rows_px: float
    matches: int
    station_rows_px: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What the numbers were made from."""

    program_version: str
    created: str  # ISO date and time, UTC
    project_name: str
    ifc_name: str
    ifc_digest: str
    rig_digest: str
    survey_digest: str
    options_digest: str
    networks: dict[str, str]  # name -> digest
    libraries: dict[str, str]  # name -> version
    program_digest: str = ""  # of its code and its networks; "" in results from before this was recorded


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignFaceRecord:
    """A design face as it is kept: its frame and exposed polygons.

    `frame_m` rows: origin, u, v; for a cylinder origin, axis, zero.
    """

    face_id: str
    element: str
    kind: Literal["plane", "cylinder"]
    role: str
    frame_m: FloatArray  # (3, 3)
    radius_m: float  # 0 for a plane
    area_m2: float
    exposed_area_m2: float
    exposed_uv_m: tuple[tuple[FloatArray, ...], ...]
    surface: SurfaceState


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgressReport:
    """All that a run found out, for one visit and what earlier ones had decided."""

    project_name: str
    visit_date: date
    earlier_visits: tuple[date, ...]
    elements: tuple[ElementProgress, ...]
    storeys: tuple[GroupProgress, ...]
    whole: GroupProgress
    tasks: tuple[TaskProgress, ...]
    cost_lines: tuple[CostProgress, ...]
    faces: tuple[DesignFaceRecord, ...]
    stations: tuple[StationRecord, ...]
    rejections: tuple[Rejection, ...]
    unmatched: tuple[Rejection, ...]
    unobserved: tuple[str, ...]  # design face ids
    notes: tuple[Note, ...]
    provenance: Provenance | None = None  # the edge fills it in
    schedule: ScheduleSource | None = None  # the file beside the IFC that planned dates came from
    rig: tuple[RigRecord, ...] = ()  # a record for each stretch of stations between which the rig was knocked
    wanted_views: tuple[WantedView, ...] = ()  # what to photograph next, the most valuable first
    observations: tuple[Observation, ...] = ()  # what persons saw, never mixed into measured values
    tolerance: Tolerance | None = None  # that the project asks for
    north: tuple[float, ...] | None = None  # where north points in the world's x and y
    grid_lines: tuple[GridLine, ...] = ()
    valuation: ValuationInputs | None = None  # what persons wrote into the workbook, and what was certified before
    pictures: Literal["elements", "whole"] = "elements"  # what pictures that leave show sharp
    csv: Literal["comma", "semicolon"] = "comma"  # with decimal points, or with decimal commas
    people_sought: bool | None = None  # by a network, in every photo; None: from before this was recorded
    people_outlined: int = 0  # outlines that a person gave, of all visits; what they hold is blurred in pictures
    markers: tuple[MarkerRecord, ...] = ()  # those that nobody surveyed, of this visit and the ones before
    complete_from: float = ProgressOptions().complete_from  # of the project, by which it was judged

    @property
    def placed(self) -> frozenset[str]:
        """Return the names of the visit's stations that count."""
        return frozenset(station.name for station in self.stations if station.world_from_left is not None)

    @property
    def nothing_seen(self) -> bool:
        """Say whether not one station of the visit counts: all that is reported was known before."""
        return not self.placed

    @property
    def faults(self) -> tuple[Rejection, ...]:
        """Return what puts the visit, the survey, the design or the scale in doubt: every number depends on them."""
        return tuple(one for one in self.rejections if one.subject.kind in WHOLE or one.code in OF_SCALE)

    @property
    def knows_nothing(self) -> bool:
        """Say whether no visit, this one or an earlier, has seen anything of any element."""
        return self.nothing_seen and not self.whole.completion.coverage > 0.0
