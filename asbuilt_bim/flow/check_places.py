"""Where today's stations stood, as a run will say: by tags first; then by what takes stereo, where tags don't do.

Only stations that tags don't place are measured whole, and those that may be linked to them. What is measured is kept,
so that the run needn't do it again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.flow.measure_visit import Progress, Workplace, measure_stations
from asbuilt_bim.flow.rig_check import Outcome
from asbuilt_bim.flow.rough_places import rough_places
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement
from asbuilt_bim.project.model import Project, Station, Visit
from asbuilt_bim.project.tables.places import KnownPlaces
from asbuilt_bim.register.placement import NO_TAGS, register
from asbuilt_bim.register.pose import Placement
from asbuilt_bim.register.tags import TagPlace


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedBy:
    """All that places stations: what is known of places, the design, and where and how they are measured whole."""

    known: KnownPlaces
    design: BimModel | None = None
    place: Workplace = field(default_factory=lambda: Workplace(workers=1))
    remembered: Mapping[int, TagPlace] = field(default_factory=lambda: NO_TAGS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedPlaces:
    """Where stations stood, and those that only a whole measurement refuses, by name."""

    placement: Placement
    refused: Mapping[str, RejectedStation]


def near_of(stations: Sequence[Station], project: Project) -> tuple[Station, ...]:
    """Return today's stations with the rough places that the project says of the same photos."""
    told = {one.left.resolve(): one.near for visit in project.visits for one in visit.stations}
    return tuple(replace(one, near=told.get(one.left.resolve())) for one in stations)


def placed_today(
    sighted: Sequence[StationMeasurement],
    stations: Sequence[Station],
    project: Project,
    rig: StereoRig,
    day: date,
    by: PlacedBy,
    progress: Progress,
) -> CheckedPlaces:
    """Place today's stations as a run does; without a design by what they were sighted to see alone."""
    whole: dict[str, Outcome] = {}
    rough = rough_places(Visit(date=day, stations=tuple(stations)), by.design) if by.design is not None else None

    def placed() -> Placement:
        seen = [whole.get(one.station, one) for one in sighted]
        measured = tuple(one for one in seen if isinstance(one, StationMeasurement))
        given, clicked = by.known.given(day), by.known.clicked(day, rig, measured)
        options = project.options.register
        return register(
            measured, by.known.survey, options, given=given, control_points=clicked, remembered=by.remembered,
            rough=rough,
        )  # fmt: skip

    def measured_too(names: set[str]) -> bool:
        todo = [one for one in stations if one.name in names - whole.keys()]
        whole.update(measure_stations(todo, "measure", project, rig, by.place, progress) if todo else {})
        return bool(todo)

    found = placed()
    here = {one.station for one in sighted}
    if by.design is not None and measured_too({one.name for one in stations if one.near} & _left(here, found)):
        found = placed()
    linkable = by.design is not None and (found.stations or whole) and len(here) > 1
    if linkable and _left(here, found) and measured_too(here):  # points of both photos may link it to any other
        found = placed()
    refused = {name: one for name, one in whole.items() if isinstance(one, RejectedStation)}
    return CheckedPlaces(placement=found, refused=refused)


def _left(names: set[str], placement: Placement) -> set[str]:
    return names - {one.pose.station for one in placement.stations}
