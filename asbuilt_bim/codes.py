"""What the program has to say, as codes: a reason, what it is about, and the values. Sentences are made at the edge.

Nothing reads prose: code asks for a `Reason`, people read what `report/wording` makes of it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

Value = str | int | float | bool | tuple[str, ...] | tuple[int, ...] | tuple[float, ...]
"""What a sentence may be filled with: numbers in SI with their unit in the key's name, names, lists of names."""
Values = Mapping[str, Value]


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
    """Why something was left out, or what a person has to know. A value keeps its meaning for good."""

    UNSTATED = "unstated"  # read from a file that was written before there were codes

    # Rejections.
    # Photos of a station.
    PHOTO_UNUSABLE = "photo unusable"
    PHOTO_MISSING = "photo missing"
    PHOTOS_GREY = "photos without colour"
    PHOTO_TURNED = "photo turned"  # its pixels
    PHOTO_SIZE = "photo of another size"
    PHOTO_HELD_TURNED = "photo held turned"  # by its EXIF: the camera was
    PHOTO_OF_OTHER_SIDE = "photo of the other side"  # by its serial number
    PHOTOS_OF_OTHER_SIDES = "photos of the other sides"  # both of them
    PHOTOS_OF_ONE_CAMERA = "photos of one camera"
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
    PHOTOS_SAVED_AGAIN = "photos saved again"  # other files that show what another station's show, noise and all
    PHOTOS_OF_OTHER_DAY = "photos of another day"
    STATION_OF_OTHER_DAY = "station of another day"  # by its visit's PHOTOS_OF_OTHER_DAY
    # The state of a station's photos: the cause of what else is refused there.
    PHOTO_CLIPPED = "photo clipped"
    PHOTO_DARK = "photo dark"
    PHOTO_GRAINY = "photo grainy"
    PHOTO_COMPRESSED = "photo compressed"
    PHOTO_HAZY = "photo hazy"
    PHOTO_TINTED = "photo in coloured light"
    PHOTO_MOVED = "photo moved"  # while it was exposed
    PHOTO_UNSHARP = "photo unsharp"
    PHOTO_SMEARED = "photo smeared"  # unsharp in parts: drops, dirt on the lens
    PHOTO_VEILED = "photo veiled"  # a part of one lens shows less contrast than the other
    # A station that could not be worked on.
    STATION_FAILED = "station failed"  # an exception says why
    STATION_MEMORY = "station out of memory"
    STATION_CRASHED = "station crashed"  # an error of this program's own
    STATION_WORKER_LOST = "station lost with its worker"
    STATION_ENDLESS = "station without end"
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
    RIG_SIZE_CONTRADICTED = "rig of photos of another size"  # by its own numbers
    RIG_PROJECTIONS_CONTRADICT = "projections contradict each other"  # of a ROS pair
    RIG_BASELINE_NOT_OF_TYPE = "baseline not of its type of camera"
    RIG_FILES_CONTRADICT = "files of one camera contradict each other"
    SCALE_WRONG = "scale wrong"
    LENGTHS_DOUBTFUL = "lengths doubtful"  # known lengths of one kind or more
    LENGTHS_DOUBTFUL_TOGETHER = "lengths doubtful together"
    # Depth, masks and faces.
    DEPTH_WITHOUT_NETWORK = "depth without a network"
    DEPTH_WITHOUT_TARGET = "depth without the target"
    DEPTH_FAILED = "depth failed"
    MASK_UNUSED = "mask unused"
    INSTANCE_WITHOUT_SURFACE = "instance without a surface"  # a network sees it, the depth doesn't
    NETWORK_SAW_NOTHING = "network saw nothing"  # and geometry something
    INSTANCE_WITHOUT_DEPTH = "instance without depth"  # method: paper
    INSTANCE_WITHOUT_FACE = "instance without a face"
    SURFACE_TOO_FAR = "surface too far for the rig"
    SURFACES_OF_OTHER_COLOUR = "surfaces of another colour"  # than concrete's: not measured
    FACE_NARROW = "face too narrow"
    FACE_UNCERTAIN = "face too uncertain"
    FACE_WITHOUT_END = "face whose end nobody saw"  # and no design says where it ends
    # Places of stations.
    MARKER_NOT_SURVEYED = "marker not surveyed"
    MARKER_CONTRADICTS = "marker contradicts the others"
    MARKER_FAR = "marker far from the building"
    MARKER_TWICE = "marker twice in a photo"  # two prints of one number: neither counts
    MARKERS_OF_OTHER_FAMILY = "markers of another family"
    MARKERS_TOO_FEW = "markers too few"
    MARKERS_DISAGREE = "markers disagree"
    MARKERS_AMBIGUOUS = "markers ambiguous"
    CONTROL_POINTS_TOO_FEW = "control points too few"
    CONTROL_POINTS_DISAGREE = "control points disagree"
    CONTROL_POINT_CONTRADICTS = "control point contradicts the others"
    MARKER_MOVED = "marker moved"  # since it was surveyed, or it was surveyed wrongly
    MARKER_MOVED_SINCE = "marker moved since an earlier visit"
    MARKERS_EXCHANGED = "markers exchanged"  # each stands where the other is known to
    MARKER_IN_ANOTHER_PLACE = "marker in another place"  # by the other stations of its visit
    STATION_NOT_LINKED = "station not linked"  # by any marker to a station that is placed
    STATION_ON_ONE_MARKER = "station on one marker"  # which links it to the others, and nothing checks that one
    DESIGN_TOO_LITTLE_SEEN = "too little seen to place by the design"
    DESIGN_NOT_FOUND = "not found in the design"  # near the rough place, what the station sees is nowhere designed
    DESIGN_AMBIGUOUS = "ambiguous in the design"  # another place fits nearly as well
    DESIGN_HEIGHT_OPEN = "height open by the design"  # feet and heads of the faces don't agree
    DESIGN_POSE_CONTRADICTS = "place in the design contradicts"  # what markers say
    STATION_CONTRADICTS = "station contradicts the others"  # of another site, whose markers have the same numbers
    SURVEY_CONTRADICTS = "survey contradicts itself"  # most of its markers don't stand to each other as it says
    POSE_CONTRADICTS = "given pose contradicts"  # what markers say
    POSE_RESIDUAL = "pose residual too large"
    POSE_UNCERTAIN = "pose uncertain"
    SURVEY_MIRRORED = "survey mirrored"
    STATION_SURVEY_MIRRORED = "station in a mirrored survey"
    STATION_SURVEY_REFUSED = "station in a refused survey"
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
    DESIGN_UNLIKE = "design unlike"  # not one measured face fits it
    DESIGN_HARDLY_ALIKE = "design hardly alike"
    SHIFT_OTHER_THAN_ACCEPTED = "shift other than accepted"
    # Against the visits before.
    VISIT_UNDOES = "visit undoes earlier ones"  # what they saw built is open, on a broad front
    STATION_VISIT_UNDOES = "station in a visit that undoes"
    VISITS_CONTRADICT = "visits contradict each other"  # one saw built what a later one sees open: neither decides
    STATION_VISIT_CONTRADICTS = "station in a visit that contradicts another"
    # Calibration.
    BOARD_NOT_FOUND = "board not found"
    BOARD_PAIR_TWICE = "board pair twice"
    BOARD_PAIR_OF_ONE_PHOTO = "board pair of one photo"  # as left and as right
    BOARD_PAIR_OF_OTHER_CAMERA = "board pair of another camera"
    BOARD_PAIR_MISFIT = "board pair misfit"
    BOARD_PAIR_MOVED = "board pair moved"  # between left and right
    BOARD_PAIR_MIXED = "board pair mixed"  # each photo is another pair's
    BOARD_PAIR_EXCHANGED = "board pair exchanged"  # left and right
    CONTROL_POINT_MISFIT = "control point misfit"
    TAG_MISFIT = "tag misfit"  # of a tag that a rig is made from
    TAGS_NOT_FOUND = "no tag found in both photos"

    # Notes.

    # On places.
    PLACED_BY_DESIGN = "placed by the design"  # with its sigma, and the second best place

    # On the IFC file.
    CONTACT_NOT_TAKEN_OFF = "contact not taken off"
    TOUCHED_ALL_OVER = "touched all over"
    GLOBAL_ID_INVALID = "GlobalId invalid"
    GLOBAL_ID_TWICE = "GlobalId twice"
    GLOBAL_IDS_MORE = "more GlobalIds left out"
    NOT_ON_ONE_MAP = "not on one map"
    IN_EARLIER_FILE = "in an earlier file"
    NO_BODY = "no usable body"
    ELEMENT_UNUSABLE = "element can't be used"
    ELEMENT_TOO_LONG = "element too long"
    NO_UPRIGHT_FACE = "no upright face"
    ELEMENT_TWICE = "element twice"  # two elements in one place
    NO_STOREY = "no storey"
    NOT_IN_TASKS = "in no task"
    NOT_IN_COST_LINES = "in no cost line"

    # On planned dates in the IFC file.
    WORK_SCHEDULES_SEVERAL = "several work schedules"
    FINISH_WORKED_OUT = "finish worked out"
    PLANS_DIFFER = "plans differ"
    DATE_UNREADABLE = "date unreadable"
    FINISH_BEFORE_START = "finish before start"
    FINISH_UNKNOWN = "finish unknown"
    TASK_DATES_MORE = "more tasks without dates"

    # On cost lines.
    COST_NOT_IN_IFC2X3 = "no prices in IFC2X3"
    COST_NO_QUANTITY = "cost item without quantity"
    COST_MIXED_QUANTITIES = "cost item with mixed quantities"
    COST_UNIT_IMPOSSIBLE = "unit of cost item impossible"
    COST_RATES_SEVERAL = "several rates"
    COST_NO_RATE = "cost item without rate"
    COST_QUANTITY_IMPOSSIBLE = "quantity impossible"
    COST_RATE_IMPOSSIBLE = "rate impossible"
    COST_NESTED = "nested cost items count"
    COST_PART_UNMEASURED = "cost item part unmeasured"
    COST_TAKES_OFF = "cost item takes off"
    COST_SCHEDULES_SEVERAL = "several cost schedules"
    COST_PAID_TWICE = "paid twice"
    COST_OF_OTHER_WORK = "cost items of other work"
    COSTS_INSTEAD = "costs file counts instead"  # of the IFC's cost items
    COSTS_FORMULAS = "formulas in a table"  # their last saved values count
    COST_COVERS_NOTHING = "cost item covers nothing"
    COST_COVER_UNKNOWN = "cost item names unknown elements"
    COST_UNIT_UNKNOWN = "unit of cost item unmeasured"  # neither volume, area, length nor number

    # On what a person knows, and on the valuation.
    ACCEPT_MOVED_UNKNOWN = "accepted as moved, and unknown"
    OBSERVATION_UNKNOWN = "observation of an unknown element"
    OBSERVATION_CONTRADICTS = "observation contradicts photos"
    OBSERVATION_SHOWN = "observations shown, not counted"
    OBSERVATION_LATER = "observed after the visit"
    CERTIFIED_FALLS = "certified amount falls"
    CERTIFIED_LINE_CHANGED = "certified line changed"  # its text, rate or contract quantity
    CONTRACT_NOT_DESIGN = "contract quantity off the design"
    DESIGN_LOST_WORK = "design lost certified work"
    DESIGN_ADDED_WORK = "design has more than was signed"
    CERTIFIED_LINE_GONE = "certified cost line gone"
    OVERRIDE_UNUSED = "override without its element"
    OVERRIDE_UNSIGNED = "override without reason or person"
    OVERRIDE_NOT_WHOLE = "override of a piece is no whole one"
    OVERRIDE_UNREADABLE = "override is no percentage"
    TERMS_KEPT = "terms of the last workbook kept"
    RETENTION_CHANGED = "retention is another than was signed"
    TAX_CHANGED = "tax is another than was signed"
    RATE_CHANGED = "rate changed by a person"
    RATE_UNUSED = "changed rate without its line"
    RATE_UNREADABLE = "rate in the workbook unreadable"
    VARIATION_UNREADABLE = "variation unreadable"
    CERTIFICATE_LATER = "certificate of a later visit"

    # On the schedule file beside the IFC.
    SCHEDULE_PROJECTS = "several projects in schedule"
    SCHEDULE_BASELINES = "baselines in schedule"
    SCHEDULE_RECURRING = "recurring exceptions in schedule"
    SCHEDULE_OWN_CALENDARS = "own calendars in schedule"
    SCHEDULE_LOST_CALENDARS = "lost calendars in schedule"
    SCHEDULE_DURATIONS_UNREAD = "durations not read"
    SCHEDULE_ACTUALS_UNREAD = "actuals not read"
    SCHEDULE_DATE_UNREADABLE = "date in schedule unreadable"
    SCHEDULE_FINISH_BEFORE_START = "finish before start in schedule"
    SCHEDULE_DATE_CONTRADICTED = "date in schedule contradicted"
    SCHEDULE_DATE_MISSING = "date in schedule missing"
    SCHEDULE_DATES_MORE = "more dates in schedule"
    SCHEDULE_ROWS_UNDATED = "tasks of schedule without dates"
    SCHEDULE_DATES_TAKEN = "dates of schedule before the IFC's"
    SCHEDULE_AMBIGUOUS = "tasks fit more than once"
    SCHEDULE_TASK_TAKEN = "task of another row"
    SCHEDULE_NUMBER_ALONE = "mere number links nothing"
    SCHEDULE_NOT_LINKED = "tasks not linked"
    SCHEDULE_IDS_UNKNOWN = "GlobalIds of schedule unknown"
    SCHEDULE_LACKS_TASKS = "schedule lacks tasks"

    # On surfaces and elements.
    PARTLY_HIDDEN = "partly hidden"
    STANDS_OFF = "stands off the design"
    STARTER_BARS = "may be starter bars"
    SURFACE_UNCLEAR = "surface unclear"
    OTHER_COLOUR = "of another colour"  # than the visit's concrete: counted or not
    PAST_OUTLINE = "goes on past its outline"
    AREAS_APART = "areas apart"
    PAST_DESIGN = "goes on past the design"
    GONE = "gone"
    GONE_LITTLE = "a little gone"
    OTHER_SIZE = "other size than designed"
    NOT_SEEN = "not seen"
    SEEN_LITTLE = "seen too little"
    NOT_SEEN_AGAIN = "not seen again"
    SEEN_TO_TOP = "seen to its top"
    TOP_NOT_SEEN = "top not seen"
    SEEN_WITH_FOOT = "seen with its foot"
    FOOT_NOT_SEEN = "foot not seen"
    LEVEL_UNCLEAR = "level unclear"
    PHOTOS_DISAGREE = "photos disagree"
    CONTRADICTS_ITSELF = "contradicts itself"  # in most of what photos show of it: so nothing is decided
    DISPLACED = "displaced"  # it stands beside its design
    DISPLACED_WITH_OTHERS = "displaced with others"  # as most of its storey, or as an earlier visit found
    DISPLACED_ACCEPTED = "displaced and accepted"

    # On visits and revisions of the design.
    PHOTOS_IN_PROJECT = "photos in the project already"
    VISITS_GONE = "visits gone"  # that the earlier run in the folder counted
    OTHER_PROGRAM = "made by another program"  # the earlier run in the folder, or the last one under history
    CERTIFIED_PHOTOS_CHANGED = "photos changed since they were certified"
    CERTIFIED_OTHERWISE = "certified other shares than the run says"
    CERTIFIED_FILES_CHANGED = "files changed since they were certified on"
    BUILT_EARLY = "built before its tasks begin"  # several elements: of another storey, or day?
    PHOTOS_OF_SEVERAL_DAYS = "photos of several days"  # they disagree about several elements
    VISIT_TO_COME = "visit to come"  # its day is after that of the run
    PHOTOS_A_DAY_OFF = "photos a day off"  # they count: a camera's clock may be
    STATIONS_NOT_USED = "stations not used"
    DECIDED_NOTHING = "decided nothing"  # of an element: its visit did not, by the fault that is named
    LATER_VISIT_UNDOES = "later visit undoes this one"
    SHIFT_ACCEPTED = "shift accepted"
    SHIFT_NOT_NEEDED = "shift not needed"  # one is accepted, and none is found
    DESIGN_REMOVED = "removed from the design"
    DESIGN_ADDED = "added to the design"
    DESIGN_RESHAPED = "reshaped in the design"
    DESIGN_MOVED = "moved in the design"
    DESIGN_OTHER_STOREY = "on another storey in the design"
    DESIGN_OTHER_TASK = "of another task in the design"
    DESIGN_RENAMED = "renamed in the design"
    DESIGN_NEW_IDS = "new GlobalIds in the design"

    # On the rig and its calibration.
    RIG_USED_REFINED = "rig used refined"
    RIG_REFINED_BY_LENGTHS = "rig refined by known lengths"
    RIG_ROWS_APART = "rig with rows apart"
    AREAS_WIDENED = "areas widened"  # their sigma, by what known lengths say of the scale
    RIG_KNOCKED_BETWEEN = "rig knocked between stations"
    CALIBRATION_COVERAGE = "boards cover little"
    CALIBRATION_HOLD_OUT = "views kept back miss"
    CALIBRATION_LENGTH = "diagonals wrong"
    CALIBRATION_SCALE = "scale known badly"
    CALIBRATION_LENS = "other lens model fits better"
    TAGS_COVERAGE = "tags cover little"
    TAGS_LENGTH = "tags' sides wrong"
    CONTROL_POINTS_FEW = "too few points for the lens"
    CONTROL_POINTS_REACH = "points reach over little"
    CONTROL_POINTS_HOLD_OUT = "points kept back miss"

    # On a task: what its schedule is given.
    TASK_UNKNOWN = "task unknown"
    TASK_COMPLETE = "task complete"
    TASK_NOTHING_BUILT = "nothing of task built"
    TASK_MEASURED = "task measured"
    TASK_PART_MEASURED = "task part measured"

    # On a number in the IFC copy: what it rests on.
    BASIS_UNKNOWN = "too little seen"
    BASIS_NO_TIME = "no task time"
    BASIS_SEVERAL_TIMES = "several task times"
    BASIS_SHARED_TIME = "task time shared"
    BASIS_COMPLETE = "completion 1"
    BASIS_LOWER = "completion lower bound"
    BASIS_COST = "quantity by its certain bound"
    BOUNDS = "at least and possibly"


WHY_STATE = frozenset(
    {
        *(Reason.DECIDED_NOTHING, Reason.NOT_SEEN, Reason.SEEN_LITTLE, Reason.NOT_SEEN_AGAIN),
        Reason.CONTRADICTS_ITSELF,
        *(Reason.TOP_NOT_SEEN, Reason.FOOT_NOT_SEEN, Reason.LEVEL_UNCLEAR, Reason.SEEN_TO_TOP),
        Reason.SEEN_WITH_FOOT,
        *(Reason.DISPLACED, Reason.DISPLACED_WITH_OTHERS),
    }
)
"""Codes that say why an element has the state that it has, where that isn't plain."""
NOT_COUNTED = frozenset({Reason.STANDS_OFF, Reason.STARTER_BARS, Reason.SURFACE_UNCLEAR, Reason.OTHER_COLOUR})
"""Codes of measured faces that don't count as concrete; one of another colour does, where its note says so."""

REVISIONS = frozenset(
    {
        Reason.DESIGN_REMOVED,
        Reason.DESIGN_ADDED,
        Reason.DESIGN_RESHAPED,
        Reason.DESIGN_MOVED,
        Reason.DESIGN_OTHER_STOREY,
        Reason.DESIGN_OTHER_TASK,
        Reason.DESIGN_RENAMED,
        Reason.DESIGN_NEW_IDS,
    }
)
"""Codes of what a revision did to the design."""


PHOTO_FAULTS = frozenset(
    {
        *(Reason.PHOTO_CLIPPED, Reason.PHOTO_DARK, Reason.PHOTO_GRAINY, Reason.PHOTO_COMPRESSED, Reason.PHOTO_HAZY),
        *(Reason.PHOTO_TINTED, Reason.PHOTO_MOVED, Reason.PHOTO_UNSHARP, Reason.PHOTO_SMEARED),
        Reason.PHOTO_VEILED,
    }
)
"""Codes of the state of a station's photos."""
GIVEN_CONTRADICTED = frozenset(
    {
        *(Reason.POSE_CONTRADICTS, Reason.DESIGN_POSE_CONTRADICTS, Reason.CONTROL_POINT_CONTRADICTS),
        *(Reason.MARKER_CONTRADICTS, Reason.MARKER_TWICE),
    }
)
"""Codes of what somebody gave for a station's place, and was left out."""
EYES_SWAPPED = frozenset(
    {Reason.PHOTO_OF_OTHER_SIDE, Reason.PHOTOS_OF_OTHER_SIDES, Reason.PHOTOS_SWAPPED, Reason.PHOTOS_LOOK_SWAPPED}
)
"""Codes of a pair whose left and right photo are exchanged: new names mend it, no new photo is needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """Something that a person has to know: the code, what it is about, and the values that its sentence needs."""

    code: Reason
    subject: Subject
    values: Values = field(default_factory=dict)


def each_once(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Return the notes in their order, equal ones once."""
    kept: list[Note] = []
    for note in notes:
        if note not in kept:
            kept.append(note)
    return tuple(kept)


def about(kind: SubjectKind, name: str = "", station: str = "") -> Subject:
    """Return a subject, in short."""
    return Subject(kind=kind, name=name, station=station)


def noted(code: Reason, subject: Subject, /, **values: Value) -> Note:
    """Return a note, in short."""
    return Note(code=code, subject=subject, values=values)
