"""The page of a planned visit: plans with numbered places, and the list to print and walk by."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.report import WantedView
from asbuilt_bim.progress.visits.expected import ExpectedStation, VisitPlan
from asbuilt_bim.progress.visits.tags import NEEDED
from asbuilt_bim.report.drawings.colours import ORDER
from asbuilt_bim.report.page.environment import environment
from asbuilt_bim.report.page.plan import PlaceMark, StoreyPlan, storey_plans, towards_on_plan
from asbuilt_bim.report.tables import NO_STOREY, storey_names
from asbuilt_bim.report.wording.of_page.visit_words import (
    BY_HULL,
    LIMITED,
    NO_DATES,
    NOT_WORTH,
    NOTHING_KNOWN,
    OUTSIDE,
    element_list,
    helpful_words,
    list_words,
    look_words,
    near_words,
    place_words,
    promise_words,
    shown_words,
    sigma_words,
    tag_words,
)
from asbuilt_bim.report.wording.values import plain

MADE_BY = b'<meta name="generator" content="asbuilt-bim plan">'
_LOOK_M = 2.5  # of the line on the plan that says where to look


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkRow:
    """A station on the list, in words; `enough` says whether it sees the tags that it needs."""

    number: int
    storey: str
    place: str
    look: str
    shows: str
    sigma: str
    tags: str
    enough: bool
    at: str


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkParts:
    """What a page shows of a plan: drawings, rows, tags to put up, and what stays unseen."""

    plans: tuple[StoreyPlan, ...]
    rows: tuple[WalkRow, ...]
    tags: tuple[tuple[str, str], ...]
    remarks: tuple[str, ...]
    storeys: dict[str, str]


def plan_html(plan: VisitPlan, *, with_result: bool) -> str:
    """Return the page of a plan: everything escaped, without scripts and without requests."""
    parts = walk_parts(plan)
    return (
        environment()
        .get_template("plan.html.j2")
        .render(
            project_name=plan.known.project_name,
            day=plan.day,
            promise=plan_promise(plan),
            remarks=(*(() if with_result else (NOTHING_KNOWN,)), *parts.remarks),
            parts=parts,
            later=plan.later,
            order=ORDER,
            no_storey=NO_STOREY,
        )
    )


def plan_promise(plan: VisitPlan) -> str:
    """Say what a plan promises by the stations that will be placed, and what the others would add."""
    sure_m2, visit = plan.placed_m2, plan.visit
    more_m2 = visit.seen_m2 - sure_m2
    return promise_words(
        len(plan.stations), sure_m2, visit.asked_m2, plan.day.isoformat(), plan.unplaced, more_m2, unhelped(plan)
    )


def unhelped(plan: VisitPlan) -> tuple[int, ...]:
    """Return the stations that will see too few tags, and that none of the places for further ones helps."""
    helped = {number for tag in plan.tags for number in tag.needy}
    return tuple(number for number in plan.unplaced if number not in helped)


def plan_page(plan: VisitPlan, *, with_result: bool) -> bytes:
    """Return the page as the file holds it."""
    return plan_html(plan, with_result=with_result).encode("utf-8", "replace")


def walk_parts(plan: VisitPlan, taken: Sequence[PlaceMark] = ()) -> WalkParts:
    """Return what a page shows of a plan; `taken` are places to mark on the drawings, too."""
    names = storey_names(plan.known)
    marks = [PlaceMark(storey=t.storey, name=f"T{i}", x_m=float(t.middle_m[0]), y_m=float(t.middle_m[1]))
             for i, t in enumerate(plan.tags, start=1)]  # fmt: skip
    marks += taken
    views = tuple(_view(one) for one in plan.stations)
    drawn = replace(plan.known, wanted_views=views, stations=())
    used = {one.storey for one in marks} | {one.planned.storey for one in plan.stations}
    plans = [one for one in storey_plans(drawn, len(views), marks) if one.storey in used]
    towards = towards_on_plan(drawn, len(views), marks)
    rows = []
    for station in plan.stations:
        ahead = station.planned.world_from_left[:2, 2]
        rows.append(_row(station, plan, names, towards(float(ahead[0]), float(ahead[1])) if towards else ""))
    tags = tuple(
        (f"T{i}", helpful_words(_name(t.element), t.over_floor_m, t.middle_m.tolist(), t.needy))
        for i, t in enumerate(plan.tags, start=1)
    )
    return WalkParts(plans=tuple(plans), rows=tuple(rows), tags=tags, remarks=_remarks(plan, names), storeys=names)


def places_of(poses: Mapping[str, FloatArray], plan: VisitPlan) -> tuple[PlaceMark, ...]:
    """Return where stations stood (poses (4, 4) by name), each on the storey whose floor is the next below it."""
    floors: dict[str, float] = {}
    for element in plan.due:
        foot = float(element.vertices_m[:, 2].min())
        floors[element.storey] = min(foot, floors.get(element.storey, foot))
    found = []
    for name, pose in poses.items():
        below = [(z, storey) for storey, z in floors.items() if z <= pose[2, 3]]
        if below:
            storey = max(below)[1]
            found.append(PlaceMark(storey=storey, name=plain(name), x_m=float(pose[0, 3]), y_m=float(pose[1, 3])))
    return tuple(found)


def _row(station: ExpectedStation, plan: VisitPlan, names: dict[str, str], towards: str) -> WalkRow:
    planned, main = station.planned, station.shown[0].element
    x, y, _ = planned.world_from_left[:3, 3].tolist()
    bearing = math.degrees(math.atan2(planned.world_from_left[0, 2], planned.world_from_left[1, 2])) % 360.0
    return WalkRow(
        number=planned.number,
        storey=names.get(planned.storey, NO_STOREY),
        place=place_words([(_name(element), away) for element, away in station.nearest]),
        look=look_words(_name(main), station.distance_m, towards),
        shows=shown_words([(_name(one.element), one.m2) for one in station.shown]),
        sigma=sigma_words(station.sigma, station.distance_m),
        tags=tag_words(station.tags, NEEDED if plan.by_tags else 0),
        enough=station.planned.number not in plan.unplaced,
        at=near_words(names.get(planned.storey, ""), (x, y), bearing),
    )


def _name(element: BimElement) -> str:
    return plain(element.name or element.global_id)


def _view(station: ExpectedStation) -> WantedView:
    """Return a planned station as the drawings take views: where to stand, and a line to where to look."""
    pose = station.planned.world_from_left
    look = pose[:3, 3] + _LOOK_M * pose[:3, 2]
    return WantedView(
        element=station.shown[0].element.global_id,
        face_id="",
        begun=True,
        open_m2=station.planned.gain_m2,
        unseen_m2=station.planned.gain_m2,
        look_x_m=float(look[0]),
        look_y_m=float(look[1]),
        look_z_m=float(look[2]),
        stand_x_m=float(pose[0, 3]),
        stand_y_m=float(pose[1, 3]),
        nearest_station="",
        nearest_m=None,
    )


def _remarks(plan: VisitPlan, names: dict[str, str]) -> tuple[str, ...]:
    """Say what no station shows, and what the plan rests on."""
    by_id = {one.global_id: _name(one) for one in plan.due}
    found = [] if plan.has_dates else [NO_DATES]
    for hidden, words in ((True, OUTSIDE), (False, LIMITED if plan.visit.limited else NOT_WORTH)):
        left = plan.visit.unseen_m2(hidden=hidden)
        if left:
            found.append(f"{words} {element_list([(by_id[key], m2) for key, m2 in left.items()])}.")
    found += [f"{names.get(storey, NO_STOREY)} {BY_HULL}" for storey in plan.visit.by_hull]
    less_today = plan.visit.asked_m2 > plan.visit.wanted.total_m2
    found += [list_words(less_today=less_today)] if plan.known.stations and plan.stations else []
    return tuple(found)
