"""A plan of each storey: elements coloured by state, and where the photos were taken."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import hull_of
from asbuilt_bim.progress.report import DesignFaceRecord, ProgressReport, ShownState, StationRecord
from asbuilt_bim.report.drawings.colours import element_names, element_states
from asbuilt_bim.report.drawings.label_placing import Box, free_box
from asbuilt_bim.report.wording.completion import in_words
from asbuilt_bim.report.wording.of_page.next_words import towards_words

WIDTH = 1000.0  # of the drawing, in its own units
_MARGIN = 60.0
_TEXT = 17.0
MAX_NAME = 18
MOST_VIEWS = 12
"""Views that the page lists and the plans show; `result.json` has more."""
_MAX_LABELS = 60  # beyond, names would hide the plan; each element still has its tooltip


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanElement:
    """An element's outline in the drawing's units, and its label's place."""

    global_id: str
    name: str
    state: ShownState
    tooltip: str
    path: str
    label: tuple[float, float] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanStation:
    """A station: its place and the wedge that its left camera sees."""

    name: str
    x: float
    y: float
    wedge: str
    label: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanView:
    """A view to take, by its number: where to stand, and a line to what to look at; both "" where there is no place."""

    number: int
    x: float
    y: float
    line: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAxis:
    """An axis of a grid as far as the plan reaches, and its label's place at one end."""

    label: str
    line: str
    x: float
    y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceMark:
    """Something to mark on a storey's plan (GlobalId), in world metres: a tag to put up, where a photo was taken."""

    storey: str
    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanMark:
    """A mark in the drawing's units."""

    name: str
    x: float
    y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreyPlan:
    """The drawing of one storey, the part of the common sheet from `top` on; `y_axis` is where the world's y points.

    `north` is where north points on it, None where no file says that.
    """

    storey: str
    top: float
    width: float
    height: float
    elements: tuple[PlanElement, ...]
    stations: tuple[PlanStation, ...]
    views: tuple[PlanView, ...]
    five_metres: float
    y_axis: tuple[float, float]
    north: tuple[float, float] | None = None
    axes: tuple[PlanAxis, ...] = ()
    marks: tuple[PlanMark, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sheet:
    """How world metres become the drawing's units: turned along the building, y downwards."""

    origin_m: FloatArray  # (2,) world
    turn: FloatArray  # (2, 2)
    low_m: FloatArray  # (2,) after turning
    scale: float
    height: float

    def draw(self, points_m: FloatArray) -> FloatArray:
        """Return the drawing's points (N, 2) of world points (N, 2)."""
        turned = (points_m - self.origin_m) @ self.turn.T
        moved = (turned - self.low_m) * self.scale + _MARGIN
        return np.stack([moved[:, 0], self.height - moved[:, 1]], axis=1)


def storey_plans(
    report: ProgressReport, most: int = MOST_VIEWS, marks: Sequence[PlaceMark] = ()
) -> tuple[StoreyPlan, ...]:
    """Draw every storey that has exposed faces, all at one scale and turned along the building.

    `most` of the views to take are drawn, and all `marks`.
    """
    footprints = _footprints(report)
    sheet = _sheet_of(report, footprints, most, marks)
    if sheet is None:
        return ()
    order = {storey.key: index for index, storey in enumerate(report.storeys)}
    plans = []
    for storey in sorted({e.storey for e in report.elements}, key=lambda key: (order.get(key, len(order)), key)):
        inside = {e.global_id for e in report.elements if e.storey == storey and e.global_id in footprints}
        if inside:
            plans.append(_plan(storey, inside, footprints, sheet, report, most, marks))
    return tuple(plans)


def towards_on_plan(
    report: ProgressReport, most: int = MOST_VIEWS, marks: Sequence[PlaceMark] = ()
) -> Callable[[float, float], str] | None:
    """Return what names a world direction (x, y) by where it points on the plans; None where there are none.

    Where a file says where north is, the name has the compass's direction, too.
    """
    sheet = _sheet_of(report, _footprints(report), most, marks)
    if sheet is None:
        return None

    def named(x: float, y: float) -> str:
        right, up = sheet.turn @ np.array([x, y])
        if report.north is None:
            return towards_words(_eighths(right, up), None)
        north = np.array(report.north[:2])
        return towards_words(_eighths(right, up), _eighths(x * north[1] - y * north[0], x * north[0] + y * north[1]))

    return named


def _eighths(right: float, up: float) -> int:
    """Return a direction in eighths of a turn, anticlockwise from the right."""
    return round(math.atan2(up, right) / (math.pi / 4.0))


def storey_hulls(report: ProgressReport) -> dict[str, FloatArray]:
    """Return the hull (N, 2) in world x and y of each storey's elements: what its floor is taken to cover."""
    footprints = _footprints(report)
    points: dict[str, list[FloatArray]] = {}
    for element in report.elements:
        if element.global_id in footprints:
            points.setdefault(element.storey, []).append(footprints[element.global_id])
    return {storey: hull_of(np.vstack(found)) for storey, found in points.items()}


def _sheet_of(
    report: ProgressReport, footprints: dict[str, FloatArray], most: int, marks: Sequence[PlaceMark]
) -> _Sheet | None:
    """Return the sheet that holds all elements, stations and views; None where nothing is exposed."""
    if not footprints:
        return None
    stands = [s.world_from_left[None, :2, 3] for s in report.stations if s.world_from_left is not None]
    views = [np.array([[v.stand_x_m, v.stand_y_m]]) for v in report.wanted_views[:most] if v.stand_x_m is not None]
    others = [np.array([[mark.x_m, mark.y_m]]) for mark in marks]
    return _sheet(report, np.vstack([*footprints.values(), *stands, *views, *others]))


def _footprints(report: ProgressReport) -> dict[str, FloatArray]:
    """Return each element's hull (N, 2) in world x and y, of all its exposed faces."""
    points: dict[str, list[FloatArray]] = {}
    for face in report.faces:
        if len(corners := _corners(face)):
            points.setdefault(face.element, []).append(corners)
    return {element: hull_of(np.vstack(found)) for element, found in points.items()}


def _corners(face: DesignFaceRecord) -> FloatArray:
    """Return the world x and y (N, 2) that a face covers; a lateral surface gives its whole circle."""
    origin, u, v = face.frame_m
    if face.kind == "cylinder":
        angles = np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False)
        circle: FloatArray = origin[:2] + face.radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return circle
    rings = [polygon[0] for polygon in face.exposed_uv_m if polygon and len(polygon[0])]
    if not rings:
        return np.zeros((0, 2))
    uv = np.vstack(rings)
    corners: FloatArray = (origin + uv[:, :1] * u + uv[:, 1:2] * v)[:, :2]
    return corners


def _sheet(report: ProgressReport, points_m: FloatArray) -> _Sheet:
    """Turn the plan along the faces' main direction and fit it to the drawing."""
    turn = _turn(_building_angle(report))
    origin = points_m.mean(axis=0)
    turned = (points_m - origin) @ turn.T
    if np.ptp(turned[:, 1]) > np.ptp(turned[:, 0]):
        turn = _turn(math.pi / 2) @ turn
        turned = (points_m - origin) @ turn.T
    size = np.maximum(np.ptp(turned, axis=0), 1.0)
    scale = (WIDTH - 2 * _MARGIN) / float(size[0])
    height = float(size[1]) * scale + 2 * _MARGIN
    return _Sheet(origin_m=origin, turn=turn, low_m=turned.min(axis=0), scale=scale, height=height)


def _building_angle(report: ProgressReport) -> float:
    """Return the faces' main direction modulo a right angle, in radians, weighted by area."""
    u = np.array([face.frame_m[1, :2] for face in report.faces if face.kind == "plane"]).reshape(-1, 2)
    weights = np.array([face.area_m2 for face in report.faces if face.kind == "plane"])
    angles = 4.0 * np.arctan2(u[:, 1], u[:, 0])
    return math.atan2(float(np.sum(weights * np.sin(angles))), float(np.sum(weights * np.cos(angles)))) / 4.0


def _turn(angle_rad: float) -> FloatArray:
    """Return the matrix that turns by minus the angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, s], [-s, c]])


def _plan(
    storey: str,
    inside: set[str],
    footprints: dict[str, FloatArray],
    sheet: _Sheet,
    report: ProgressReport,
    most: int,
    marks: Sequence[PlaceMark],
) -> StoreyPlan:
    """Draw one storey."""
    outlines = {key: sheet.draw(footprints[key]) for key in inside}
    taken: list[Box] = [_bounds(outline) for outline in outlines.values()]
    seen = [s for s in report.stations if s.world_from_left is not None and inside & _seen_by(s)]
    stations = tuple(_station(station, sheet, taken) for station in seen)
    states, names = element_states(report), element_names(report)
    done = {e.global_id: e.completion for e in report.elements}
    elements = []
    for key in sorted(inside, key=lambda k: names[k]):
        outline = outlines[key]
        tooltip = f"{names[key]}: {states[key]}, {in_words(done[key])}"
        label = _label(names[key], outline, sheet, taken) if len(inside) <= _MAX_LABELS else None
        elements.append(
            PlanElement(
                global_id=key,
                name=names[key],
                state=states[key],
                tooltip=tooltip,
                path=closed_path(outline),
                label=label,
            )
        )
    up = sheet.turn @ np.array([0.0, 1.0])
    views = tuple(_views(inside, sheet, report, most))
    marked = tuple(_mark(mark, sheet) for mark in marks if mark.storey == storey)
    levels = [y for outline in outlines.values() for y in outline[:, 1]]
    levels += [*(station.y for station in stations), *(view.y for view in views), *(mark.y for mark in marked)]
    top = max(min(levels) - _MARGIN, 0.0)
    north = None if report.north is None else sheet.turn @ np.array(report.north[:2])
    return StoreyPlan(
        storey=storey,
        top=top,
        width=WIDTH,
        height=max(levels) + _MARGIN - top,
        elements=tuple(elements),
        stations=stations,
        views=views,
        five_metres=5.0 * sheet.scale,
        y_axis=(float(up[0]), float(-up[1])),
        north=None if north is None else (float(north[0]), float(-north[1])),
        axes=tuple(_axes(report, sheet, (0.0, top, WIDTH, max(levels) + _MARGIN))),
        marks=marked,
    )


def _mark(mark: PlaceMark, sheet: _Sheet) -> PlanMark:
    x, y = sheet.draw(np.array([[mark.x_m, mark.y_m]]))[0].tolist()
    return PlanMark(name=mark.name, x=x, y=y)


def _views(inside: set[str], sheet: _Sheet, report: ProgressReport, most: int) -> Iterator[PlanView]:
    """Yield the views to take of a storey's elements, numbered as the page lists them."""
    for number, view in enumerate(report.wanted_views[:most], start=1):
        if view.element not in inside:
            continue
        look = (view.look_x_m, view.look_y_m)
        stand = look if view.stand_x_m is None or view.stand_y_m is None else (view.stand_x_m, view.stand_y_m)
        points = sheet.draw(np.array([stand, look]))
        (x, y), (to_x, to_y) = points.tolist()
        yield PlanView(number=number, x=x, y=y, line=f"M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}")


def _axes(report: ProgressReport, sheet: _Sheet, box: tuple[float, float, float, float]) -> Iterator[PlanAxis]:
    """Yield the grid's axes cut to a box (left, top, right, bottom), each with its label inside."""
    for one in report.grid_lines:
        ends = sheet.draw(np.array([[one.x1_m, one.y1_m], [one.x2_m, one.y2_m]]))
        cut = _within(ends[0], ends[1], box)
        if cut is not None:
            (x1, y1), (x2, y2) = cut
            low, high = np.array(box[:2]) + _TEXT, np.array(box[2:]) - _TEXT
            x, y = np.clip([x1, y1], low, high)
            yield PlanAxis(label=one.label, line=f"M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}", x=float(x), y=float(y))


def _within(
    start: FloatArray, end: FloatArray, box: tuple[float, float, float, float]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the part of a line from `start` to `end` (2,) within a box, None where there is none."""
    along, low, high = end - start, 0.0, 1.0
    for axis in (0, 1):
        if abs(along[axis]) < 1e-9:
            if not box[axis] <= start[axis] <= box[axis + 2]:
                return None
            continue
        near, far = sorted((limit - start[axis]) / along[axis] for limit in (box[axis], box[axis + 2]))
        low, high = max(low, float(near)), min(high, float(far))
    if low >= high:
        return None
    first, last = start + low * along, start + high * along
    return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))


def _bounds(outline: FloatArray) -> Box:
    """Return the box around an outline (N, 2)."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])


def _seen_by(station: StationRecord) -> set[str]:
    """Return the elements that a station's faces were matched to."""
    return {element for face in station.faces for element in face.elements}


def _label(name: str, outline: FloatArray, sheet: _Sheet, taken: list[Box]) -> tuple[float, float]:
    """Place an element's name near its middle."""
    x, y = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
    short = name if len(name) <= MAX_NAME else f"{name[: MAX_NAME - 1]}…"
    width = 0.6 * _TEXT * len(short)
    left, top, _, _ = free_box((float(x), float(y) + 1.4 * _TEXT), width, 1.2 * _TEXT, (WIDTH, sheet.height), taken)
    return left + width / 2.0, top + 0.95 * _TEXT


def _station(station: StationRecord, sheet: _Sheet, taken: list[Box]) -> PlanStation:
    """Draw a station and the wedge it sees, 2.5 m deep."""
    pose = station.world_from_left
    assert pose is not None  # only placed stations come here
    half = math.atan2(station.width_px / 2.0, station.f_px)
    rays = [[math.sin(angle), 0.0, math.cos(angle)] for angle in np.linspace(-half, half, 9)]
    arc = pose[:2, 3] + 2.5 * (np.array(rays) @ pose[:3, :3].T)[:, :2]
    points = sheet.draw(np.vstack([pose[None, :2, 3], arc]))
    x, y = float(points[0, 0]), float(points[0, 1])
    width = 0.6 * _TEXT * len(station.name) + 8.0
    left, top, _, _ = free_box((x, y + 1.3 * _TEXT), width, 1.2 * _TEXT, (WIDTH, sheet.height), taken)
    label = (left + width / 2.0, top + 0.95 * _TEXT)
    return PlanStation(name=station.name, x=x, y=y, wedge=closed_path(points), label=label)


def closed_path(ring: FloatArray) -> str:
    """Return a ring (N, 2) as SVG path data with one decimal, without points that half of that decimal can't show."""
    points = np.asarray(ring, dtype=np.float64)
    if len(points) > 4:  # a wall's corners stay as they are
        points = cv2.approxPolyDP(points.astype(np.float32), 0.05, closed=True)[:, 0].astype(np.float64)
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "Z"
