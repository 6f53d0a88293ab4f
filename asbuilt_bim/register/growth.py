"""First places of stations and prints: from stations that are placed to prints they see, to stations that see those.

Nothing here is exact, and what is wrong may stay in: the adjustment of the visit finds that.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import inverse
from asbuilt_bim.register.agree import largest_agreement
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.solve import Sighted, project_both
from asbuilt_bim.register.tags import SQUARE, guesses, square_through
from asbuilt_bim.vision.markers.find import MarkerSighting

MOST_OFF_PX = 20.0
"""What one corner adds at most where places of a print are compared: another print's sighting decides nothing."""
LEAST_SIGMA_M = 0.005


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Viewpoint:
    """A station as it is placed: its camera, and what it sees of prints, by id."""

    name: str
    camera: RectifiedCamera
    seen: Mapping[int, MarkerSighting]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Poses (4, 4) of stations by name, and poses and sizes of prints by id, all in one frame."""

    stations: dict[str, FloatArray] = field(default_factory=dict)
    tags: dict[int, tuple[FloatArray, float]] = field(default_factory=dict)


def grown(
    viewpoints: Sequence[Viewpoint],
    seeds: Mapping[str, FloatArray],
    surveyed_m: Mapping[int, FloatArray],
    sizes_m: Mapping[int, float],
    links: Sequence[PointLink] = (),
) -> Places:
    """Return all that can be reached from stations (4, 4) that are placed, and from surveyed corners (4, 3) of prints.

    A print starts where most of the stations that see it have it: one that was moved since it was surveyed, too. What
    prints don't reach is reached by `links`, the one of the most points first.
    """
    found = Places(stations=dict(seeds))
    by_name = {one.name: one for one in viewpoints}
    failed_with: dict[str, int] = {}
    while True:
        _place_tags(found, viewpoints, surveyed_m, sizes_m)
        waiting = []
        for one in viewpoints:
            count = len(one.seen.keys() & found.tags.keys())
            if one.name not in found.stations and count > failed_with.get(one.name, 0):
                waiting.append((-count, one.name))
        if not waiting:
            if not _by_link(found, by_name, links):
                return found
            continue
        count, name = min(waiting)
        pose = _station_pose(by_name[name], found)
        if pose is None:
            failed_with[name] = -count  # tried again once more prints are placed
        else:
            found.stations[name] = pose


def _by_link(found: Places, names: Collection[str], links: Sequence[PointLink]) -> bool:
    """Place one more station beside one that is placed, and say whether there was one."""
    for link in sorted(links, key=lambda one: (-one.points, one.first, one.second)):
        if link.first in found.stations and link.second not in found.stations and link.second in names:
            found.stations[link.second] = found.stations[link.first] @ link.first_from_second
            return True
        if link.second in found.stations and link.first not in found.stations and link.first in names:
            found.stations[link.first] = found.stations[link.second] @ inverse(link.first_from_second)
            return True
    return False


def turned_right(
    places: Places,
    viewpoints: Sequence[Viewpoint],
    surveyed_m: Mapping[int, FloatArray],
    sizes_m: Mapping[int, float],
) -> Places:
    """Return places with each print as its sightings together show it best.

    One photo of a small square leaves two turns open. The first station that sees it can't tell them apart; all can.
    """
    chosen = Places(stations=dict(places.stations), tags={})
    placed = [one for one in viewpoints if one.name in places.stations]
    _place_tags(chosen, placed, surveyed_m, sizes_m)
    for tag, place in places.tags.items():
        seeing = [(one, places.stations[one.name]) for one in placed if tag in one.seen]
        if tag not in chosen.tags or _off(place, seeing, tag) <= _off(chosen.tags[tag], seeing, tag):
            chosen.tags[tag] = place
    return chosen


def _place_tags(
    found: Places,
    viewpoints: Sequence[Viewpoint],
    surveyed_m: Mapping[int, FloatArray],
    sizes_m: Mapping[int, float],
) -> None:
    placed = [one for one in viewpoints if one.name in found.stations]
    for tag in sorted({tag for one in placed for tag in one.seen} - found.tags.keys()):
        seeing = [(one, found.stations[one.name]) for one in placed if tag in one.seen]
        choices: list[tuple[FloatArray, float]] = []
        if tag in surveyed_m:
            choices.append(square_through(surveyed_m[tag]))
        for one, pose in seeing:
            for left_from_tag, size in guesses(one.camera, one.seen[tag], sizes_m.get(tag)):
                choices.append((pose @ left_from_tag, size))
        if choices:
            found.tags[tag] = min(choices, key=lambda choice: _off(choice, seeing, tag))
    if not found.stations:
        found.tags.update({tag: square_through(corners) for tag, corners in sorted(surveyed_m.items())})


def _off(choice: tuple[FloatArray, float], seeing: Sequence[tuple[Viewpoint, FloatArray]], tag: int) -> float:
    """Return how far a print's corners would lie from where photos show them, each up to a limit, all together."""
    pose, size = choice
    corners = (SQUARE * size) @ pose[:3, :3].T + pose[:3, 3]
    total = 0.0
    for one, station in seeing:
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels, _ = project_both(one.camera, station, corners)
        sighting = one.seen[tag]
        off = np.linalg.norm(pixels[:, :2] - sighting.left_px, axis=1)
        ahead = (corners - station[:3, 3]) @ station[:3, 2] > 0.0
        total += float(np.where(ahead, np.fmin(off, MOST_OFF_PX), MOST_OFF_PX).sum())
        if sighting.right_px is not None:
            off = np.linalg.norm(pixels[:, 2:] - sighting.right_px, axis=1)
            total += float(np.where(ahead, np.fmin(off, MOST_OFF_PX), MOST_OFF_PX).sum())
    return total


def _station_pose(one: Viewpoint, found: Places) -> FloatArray | None:
    """Return where a station stands by the prints that are placed: what most of them agree on."""
    groups = []
    for tag in sorted(one.seen.keys() & found.tags.keys()):
        pose, size = found.tags[tag]
        sighting = one.seen[tag]
        side_px = float(np.mean(np.linalg.norm(np.roll(sighting.left_px, 1, axis=0) - sighting.left_px, axis=1)))
        range_m = one.camera.f_px * size / max(side_px, 1.0)
        apart_m = one.camera.baseline_m if sighting.right_px is not None else size
        depth_m = range_m**2 * sighting.sigma_px / (one.camera.f_px * apart_m)
        groups.append(
            Sighted(
                name=str(tag), world_m=(SQUARE * size) @ pose[:3, :3].T + pose[:3, 3], left_px=sighting.left_px,
                right_px=sighting.right_px, sigma_px=max(sighting.sigma_px, 0.25),
                sigma_m=float(np.hypot(depth_m, LEAST_SIGMA_M)),
            )
        )  # fmt: skip
    agreement = largest_agreement(one.camera, groups, min(2, len(groups)))
    return None if agreement is None else agreement.solution.world_from_left
