"""The design as plain data, in world metres; read by `ifc`, used by everything behind `register`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

import numpy as np

from asbuilt_bim.bim.schedule import ScheduleSource, TaskLink, WorkCalendar
from asbuilt_bim.codes import Note
from asbuilt_bim.geometry.arrays import FloatArray, IntArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame

ElementClass = Literal["wall", "column"]
CostMeasure = Literal["volume", "area", "length", "count", "other"]
"""What a cost line's quantity measures; `other`: a weight, an hour, a lump sum."""
COSTS_KEY = "costs:"
"""What the key of a line begins with that the costs file has and the IFC has not; a GlobalId has no colon."""
FaceRole = Literal["side", "end", "reveal"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignFace:
    """One planar or cylindrical lateral face of an element's design geometry, in world metres.

    `rings_uv_m`: polygons of the face as tuples of open rings (N, 2) in (u, v) metres, outer first (counter-clockwise),
    then holes. `exposed_uv_m`: the same, less contact with other elements. For a cylinder u runs along the lateral
    surface. `face_id` is the element's GlobalId + "-" + a digest of its rounded local geometry.
    """

    face_id: str
    element: str  # GlobalId
    role: FaceRole
    frame: PlaneFrame | CylinderFrame
    rings_uv_m: tuple[tuple[FloatArray, ...], ...]
    exposed_uv_m: tuple[tuple[FloatArray, ...], ...]
    area_m2: float
    exposed_area_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class BimElement:
    """One IfcWall or IfcColumn: where it belongs, its mesh, its lateral faces.

    `axis_from_world` (4, 4) gives element coordinates: x along the length (0 .. length_m), y across, z up
    (0 .. height_m). `volume_m3` is the net volume of the mesh. `qto` holds the file's own base quantities in SI,
    only to be shown beside the computed ones.
    """

    global_id: str
    ifc_class: str  # "IfcWall", "IfcWallStandardCase", "IfcColumn"
    kind: ElementClass
    name: str
    tag: str
    storey: str  # GlobalId of the storey, "" where it has none
    is_concrete: bool | None  # None: the file doesn't say
    vertices_m: FloatArray  # (N, 3) world
    triangles: IntArray  # (M, 3)
    axis_from_world: FloatArray
    length_m: float
    thickness_m: float
    height_m: float
    volume_m3: float
    faces: tuple[DesignFace, ...]
    qto: dict[str, float]
    source: int = 0  # which of the design's files holds it
    type_name: str = ""  # of its IfcWallType or IfcColumnType, else its ObjectType
    zones: tuple[str, ...] = ()  # names of the zones that it lies in

    @property
    def exposed_area_m2(self) -> float:
        """Return the exposed lateral area in m2: openings off, contact with other elements off, reveals not counted."""
        return sum(face.exposed_area_m2 for face in self.faces if face.role != "reveal")


@dataclass(frozen=True, slots=True, kw_only=True)
class Storey:
    """A building storey; `elevation_m` in world metres."""

    global_id: str
    name: str
    elevation_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A task of the work schedule and the elements that it makes."""

    global_id: str
    name: str
    identification: str
    elements: tuple[str, ...]  # GlobalIds
    schedule_start: datetime | None
    schedule_finish: datetime | None
    outline: tuple[str, ...] = ()  # names of the summary tasks above it, the outermost first
    links: tuple[TaskLink, ...] = ()  # predecessors, by the GlobalId of their tasks
    schedule_uid: str = ""  # what a schedule file beside the IFC knows it by
    calendar: WorkCalendar | None = None  # its own working time; None: that of the schedule
    others: int = 0  # building elements that it makes, too, and that are not measured here
    ifc_finish: datetime | None = None  # its own in the IFC, where a schedule file dates elements of it otherwise
    finish_from: str = ""  # the schedule file that its planned finish is from; "": the IFC


@dataclass(frozen=True, slots=True, kw_only=True)
class CostLine:
    """A cost item: planned quantity in the line's OWN unit, rate per that unit, and what it pays for."""

    global_id: str
    name: str
    identification: str
    elements: tuple[str, ...]  # GlobalIds
    unit: str  # "m3", "m2", "m", "pcs", or the file's own symbol
    measure: CostMeasure
    planned_quantity: float
    rate: float
    currency: str  # "" where the file doesn't say
    schedule: str = ""  # the cost schedule that it stands in
    unit_scale: float = 1.0  # m, m2, m3 or pieces in one of its units
    others: int = 0  # building elements that it pays for, too, and that are not measured here


@dataclass(frozen=True, slots=True, kw_only=True)
class GridLine:
    """A straight axis of a grid, from end to end in the world's x and y."""

    label: str
    x1_m: float
    y1_m: float
    x2_m: float
    y2_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """Any other solid of the design (slab, beam, stair) that may touch or hide an element; mesh in world metres."""

    global_id: str
    ifc_class: str
    vertices_m: FloatArray
    triangles: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class BimModel:
    """The design: walls and columns with their faces, what stands around them, storeys, tasks, cost lines."""

    file_name: str
    file_digest: str
    schema: str  # "IFC2X3", "IFC4", "IFC4X3"
    project_name: str
    storeys: tuple[Storey, ...]  # from below
    elements: tuple[BimElement, ...]
    obstacles: tuple[Obstacle, ...]
    tasks: tuple[Task, ...]
    cost_lines: tuple[CostLine, ...]
    notes: tuple[Note, ...]  # what the file holds that can't be used
    schedule: ScheduleSource | None = None  # the file beside the IFC that the tasks' dates came from
    north: tuple[float, float] | None = None  # where north points in the world's x and y; None where no file says it
    grid_lines: tuple[GridLine, ...] = ()
    former_ids: Mapping[str, str] = field(default_factory=dict)  # GlobalIds of earlier exports -> those of this one

    def today(self, global_id: str) -> str:
        """Return the GlobalId that an element has in this design, where an earlier export gave it another one."""
        return self.former_ids.get(global_id, global_id)

    def box_m(self) -> tuple[FloatArray, FloatArray] | None:
        """Return the lowest and the highest corner (3,) of all elements, world metres; None where none has a body."""
        vertices = [element.vertices_m for element in self.elements if len(element.vertices_m)]
        every = np.concatenate(vertices) if vertices else None
        return None if every is None else (every.min(axis=0), every.max(axis=0))

    def off_box_m(self, points_m: FloatArray) -> FloatArray:
        """Return how far points (N, 3), world metres, lie from the box of all elements (N,); 0 where it has none."""
        box = self.box_m()
        away: FloatArray = np.linalg.norm(points_m - np.clip(points_m, *(box or (points_m, points_m))), axis=1)
        return away

    def element(self, global_id: str) -> BimElement:
        """Return the element of a GlobalId.

        Raises:
            KeyError: the model has none such.
        """
        for element in self.elements:
            if element.global_id == global_id:
                return element
        raise KeyError(global_id)
