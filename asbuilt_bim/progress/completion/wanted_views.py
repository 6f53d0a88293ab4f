"""What to photograph next: the sides that would bring the bounds together most, and where to stand before each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from asbuilt_bim.bim.model import BimElement, BimModel, DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.completion.planned import due_by
from asbuilt_bim.progress.report import ElementProgress, StationRecord, WantedView
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.visits.sights import LIFT_M

MOST = 30
"""So many a day can be photographed; the rest comes up at the next visit."""
WORTH_IT = 0.1
"""Of an element, between its bounds: what is less open is known well enough."""
DISTANCES_M = 6.0, 4.5, 3.0
"""Before a side, the best first: 3 to 8 m is where it is measured well."""
FLOOR_MARGIN_M = 0.5
"""A floor reaches so far past the hull of its walls and columns: an edge board, a cantilever."""
_REACH_UP_M = 2.5  # above an element's foot: a camera further up stands on another floor, however low the element is


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Screens:
    """The upright design surfaces that hide others, seen from above: segments (N, 2, 2) and heights (N, 2) in m."""

    element: tuple[str, ...]
    segments_m: FloatArray
    heights_m: FloatArray


def wanted_views(
    design: BimModel,
    elements: Mapping[str, ElementProgress],
    surfaces: Mapping[str, SurfaceState],
    stations: Sequence[StationRecord],
    day: date,
) -> tuple[WantedView, ...]:
    """Return a view an element: what should stand by now first, then what should be begun, then by open m2.

    `elements` are by GlobalId, `surfaces` by face id; `stations` are the visit's.
    """
    begun, due = begun_by(design, day), due_by(design.tasks, day)
    open_m2 = {key: (e.completion.upper - e.completion.lower) * e.design_area_m2 for key, e in elements.items()}
    asked = [e for e in design.elements if _is_open(elements[e.global_id]) and e.faces]
    asked.sort(key=lambda e: ((key := e.global_id) not in due, key not in begun, -open_m2[key], e.name, key))
    if not asked:
        return ()
    screens, places, floors = (
        _screens(design, asked[:MOST]),
        {s.name: s.world_from_left for s in stations if s.world_from_left is not None},
        {storey: _floor(design, storey) for storey in {e.storey for e in asked[:MOST]}},
    )
    views = (
        _view(e, open_m2[e.global_id], surfaces, screens, places, floors[e.storey], e.global_id in begun)
        for e in asked[:MOST]
    )
    return tuple(view for view in views if view is not None)


def _is_open(element: ElementProgress) -> bool:
    """Say whether a photo can tell more of it: what is displaced is for a person to accept."""
    if element.state == "displaced":
        return False
    return element.completion.upper - element.completion.lower >= WORTH_IT and element.design_area_m2 > 0.0


def begun_by(design: BimModel, day: date) -> set[str]:
    """Return the elements that the plan has begun by a day, or says nothing of."""
    later = {e for t in design.tasks if t.schedule_start and t.schedule_start.date() > day for e in t.elements}
    now = {e for t in design.tasks if t.schedule_start and t.schedule_start.date() <= day for e in t.elements}
    return {element.global_id for element in design.elements} - (later - now)


def _view(
    element: BimElement,
    open_m2: float,
    surfaces: Mapping[str, SurfaceState],
    screens: _Screens,
    places: Mapping[str, FloatArray],
    floor_m: FloatArray,
    begun: bool,
) -> WantedView | None:
    """Return the view of the side of which most is unseen; of several the one that there is room before.

    Of sides of which as much is unseen, to a tenth, it is one that a person sees from the floor.
    """
    sides = [face for face in element.faces if face.role != "reveal" and surfaces[face.face_id].unknown_uv_m]
    sides.sort(key=lambda face: -surfaces[face.face_id].unknown_area_m2)
    found = [(face, *_stand(face, surfaces[face.face_id], screens)) for face in sides]
    if not found:
        return None
    face, middle, stand = next((one for one in found if one[2] is not None), found[0])
    least_m2 = (1.0 - WORTH_IT) * surfaces[face.face_id].unknown_area_m2
    for other, centre, place in found:
        if place is not None and surfaces[other.face_id].unknown_area_m2 >= least_m2 and stands_on(floor_m, place):
            face, middle, stand = other, centre, place
            break
    near = _nearest(stand, places, screens.heights_m[[one == element.global_id for one in screens.element]])
    return WantedView(
        element=element.global_id,
        face_id=face.face_id,
        begun=begun,
        open_m2=open_m2,
        unseen_m2=surfaces[face.face_id].unknown_area_m2,
        look_x_m=float(middle[0]),
        look_y_m=float(middle[1]),
        look_z_m=float(middle[2]),
        stand_x_m=None if stand is None else float(stand[0]),
        stand_y_m=None if stand is None else float(stand[1]),
        nearest_station=near[0],
        nearest_m=near[1],
    )


def stands_on(hull_m: FloatArray, place_m: FloatArray) -> bool:
    """Say whether a place (2,) or (3,) lies on a floor whose walls and columns have a hull (N, 2)."""
    return polygon.within_margin(hull_m, place_m[:2], FLOOR_MARGIN_M)


def _floor(design: BimModel, storey: str) -> FloatArray:
    """Return the hull (N, 2), from above, of a storey's elements: what its floor is taken to cover."""
    return polygon.hull_of(np.vstack([e.vertices_m[:, :2] for e in design.elements if e.storey == storey]))


def _nearest(
    stand: FloatArray | None, places: Mapping[str, FloatArray], heights_m: FloatArray
) -> tuple[str, float | None]:
    """Return the station nearest to a place (3,) of those on the element's own floor, and how far off it is."""
    foot, head = float(heights_m[:, 0].min()), float(heights_m[:, 1].max())
    floor = [name for name, place in places.items() if foot < place[2, 3] < max(head, foot + _REACH_UP_M)]
    if stand is None or not floor:
        return "", None
    away = {name: float(np.linalg.norm(places[name][:2, 3] - stand[:2])) for name in floor}
    nearest = min(away, key=lambda name: (away[name], name))
    return nearest, away[nearest]


def _stand(face: DesignFace, surface: SurfaceState, screens: _Screens) -> tuple[FloatArray, FloatArray | None]:
    """Return the middle of the largest unseen piece (3,), and a place (3,) before it that the design leaves free."""
    largest = max(surface.unknown_uv_m, key=polygon.rings_area)
    uv = polygon.centroid((largest,))
    middle = face.frame.from_uv(uv)
    others = np.array([element != face.element for element in screens.element], dtype=np.bool_)
    level = (screens.heights_m[:, 0] <= middle[2]) & (middle[2] <= screens.heights_m[:, 1])
    walls = screens.segments_m[others & level]
    eye = face.frame.from_uv(uv, LIFT_M)
    for distance in DISTANCES_M:
        stand = face.frame.from_uv(uv, distance)
        if not _crosses(eye[:2], stand[:2], walls):
            return middle, stand
    return middle, None


def _crosses(start_m: FloatArray, end_m: FloatArray, segments_m: FloatArray) -> bool:
    """Say whether a sight from above (2,), (2,) crosses one of the segments (N, 2, 2)."""
    a, b = segments_m[:, 0], segments_m[:, 1]
    starts, ends = _side(a, b, start_m), _side(a, b, end_m)
    before, behind = _side(start_m, end_m, a), _side(start_m, end_m, b)
    return bool(np.any((starts * ends < 0.0) & (before * behind < 0.0)))


def _side(a: FloatArray, b: FloatArray, point: FloatArray) -> FloatArray:
    """Return on which side of a to b points lie: the cross product, positive to the left."""
    along, away = b - a, point - a
    side: FloatArray = along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]
    return side


def _screens(design: BimModel, asked: Sequence[BimElement]) -> _Screens:
    """Return what may hide some elements: planes by their widths, lateral surfaces by two diameters."""
    names: list[str] = []
    segments: list[FloatArray] = []
    heights: list[tuple[float, float]] = []
    reach_m = max(DISTANCES_M) + 1.0  # no sight is longer than the first
    low, high = (
        np.array([side(one.vertices_m[:, :2], axis=0) for one in design.elements]) for side in (np.min, np.max)
    )
    some = {one.global_id for one in asked}
    near = np.zeros(len(low), dtype=bool)
    for number in (number for number, one in enumerate(design.elements) if one.global_id in some):
        near |= ((low <= high[number] + reach_m) & (high >= low[number] - reach_m)).all(axis=1)
    around = [element for element, is_near in zip(design.elements, near.tolist(), strict=True) if is_near]
    for face in (face for element in around for face in element.faces):
        u0, v0, u1, v1 = polygon.bounds(face.rings_uv_m)
        corners = face.frame.from_uv([[u0, v0], [u1, v1]])
        radius = getattr(face.frame, "radius_m", 0.0)
        turns = [0.0, np.pi * radius / 2.0] if radius else []
        ends = [face.frame.from_uv([[u, v0], [u + np.pi * radius, v0]]) for u in turns] or [corners]
        for pair in ends:
            names.append(face.element)
            segments.append(pair[:, :2])
            heights.append((float(corners[:, 2].min()), float(corners[:, 2].max())))
    return _Screens(element=tuple(names), segments_m=np.array(segments), heights_m=np.array(heights))
