"""A visit's stations placed together, tied to each other by prints that nobody surveyed.

First places grow from what is known; one robust least squares moves all of them; what is off then is left out, and
named. The rest is adjusted again, and its covariance is the result's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import rigid
from asbuilt_bim.register.anchors import anchored
from asbuilt_bim.register.between import Between, between
from asbuilt_bim.register.block_adjustment import Adjusted, CommonNoise, Known, Rows, Sightings, State, adjust, ahead
from asbuilt_bim.register.growth import Places, Viewpoint, turned_right
from asbuilt_bim.register.known import known_pose, known_size, surveyed_centre, surveyed_corners
from asbuilt_bim.register.moved import moved_since
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.point_links import BETWEEN_PX, COMMON_PX, PointLink
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.redundancy import hanging
from asbuilt_bim.register.tags import TagPlace

LEFT_OUT_SIGMAS = 3.0
"""A sighting or a known place is left out from here on: the root mean square of its rows is never this by chance."""
REACHES = (64.0, 8.0)
"""Of the weights, in sigmas: wide at first, so that a loop that doesn't meet yet isn't torn open, then narrow."""
NOISE = CommonNoise(direction_px=COMMON_PX, between_px=BETWEEN_PX, edge_px=0.1)
"""Of the sample's 49 sightings against their survey: 0.05 px from photo to photo, corners 0.02 to 0.17 px outwards; in
both alike 0.25 px, most of which is the survey's. A rig that was calibrated worse shows in the variance factor."""
LEAST_FINDER_PX = 0.05
"""No corner is found better."""
TURNS = 3
"""Times that all is adjusted at most, with prints turned over in between that most sightings show so."""
MOST_LEFT_OUT = 30  # one after the other, once the coarse ones are out
SIZE_SHARE = 0.01
"""What a print's given size errs by: printers and paper stretch."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sources:
    """What is known of places before: poses of stations, surveyed prints, prints' sizes, and rows of their own."""

    poses: Mapping[str, tuple[FloatArray, FloatArray]]  # (4, 4) and covariance (6, 6), by station
    survey: Mapping[int, SurveyedMarker]
    remembered: Mapping[int, TagPlace]  # prints that nobody surveyed, where an earlier visit found them
    sizes_m: Mapping[int, float]
    starts: Mapping[str, FloatArray]  # where stations are found to stand alone: a start, no knowledge
    points: Mapping[str, Sequence[Known]]  # rows of control points, by station
    links: Sequence[PointLink] = ()  # of stations by points that both show
    size_share: float = SIZE_SHARE
    noise: CommonNoise = NOISE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VisitPlaces:
    """Where stations and prints are, with covariances, and what was left out since it contradicts the rest.

    `used` are the prints that place a station, `not_used` those that it sees where no other station does.
    """

    poses: Mapping[str, tuple[FloatArray, FloatArray]]
    residual_px: Mapping[str, float]
    used: Mapping[str, tuple[int, ...]]
    tags: Mapping[int, TagPlace]
    not_used: Mapping[str, tuple[int, ...]]
    moved_m: Mapping[int, FloatArray]  # (3,) by which surveyed or remembered prints were moved
    poses_off_m: Mapping[str, FloatArray]  # (3,) of given poses that contradict
    torn: tuple[int, int] | None = None  # how many known places agree, of how many: not most of them
    shared: Mapping[str, frozenset[int]] = field(default_factory=dict)  # prints of a station that are others' or known
    linked_to: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # stations that points link it to
    hanging: Mapping[str, int] = field(default_factory=dict)  # stations that one print alone holds, and which


NONE_PLACED = VisitPlaces(
    poses={}, residual_px={}, used={}, tags={}, not_used={}, moved_m={}, poses_off_m={}
)  # fmt: skip


def place_visit(viewpoints: Sequence[Viewpoint], sources: Sources, options: RegisterOptions) -> VisitPlaces:
    """Place all stations that hang together with anything known; the order of stations makes no difference."""
    first = _placed(viewpoints, sources, options)
    moved = moved_since(first.tags, sources.remembered, first.moved_m)
    if not moved:
        return first
    still = {tag: place for tag, place in sources.remembered.items() if tag not in moved}
    again = _placed(viewpoints, replace(sources, remembered=still), options)
    return replace(again, moved_m={**again.moved_m, **moved})


def _placed(viewpoints: Sequence[Viewpoint], sources: Sources, options: RegisterOptions) -> VisitPlaces:
    viewpoints = sorted(viewpoints, key=lambda one: one.name)
    places = anchored(viewpoints, sources.starts, _corners(sources), sources.sizes_m, sources.links)
    if not places.stations:
        return NONE_PLACED
    done = None
    for _ in range(TURNS):
        block = _block(viewpoints, places, sources, options)
        done = _without_faults(block, options)
        if done is None:
            return NONE_PLACED
        before = _places(block, done[0])
        places = turned_right(before, viewpoints, _four(sources), sources.sizes_m)
        if all(places.tags[tag] is place for tag, place in before.tags.items()):
            break
    assert done is not None
    found = _result(block, *done, options)
    still = {tag for tag in _corners(sources) if tag not in found.moved_m}
    sure = (sources.poses.keys() | sources.points.keys()) - found.poses_off_m.keys()
    shared = _shared(viewpoints, places, sources)
    found = replace(found, shared=shared, hanging=hanging(found.used, still, sure, found.linked_to))
    anchors = [one for one in block.known if not one.name.startswith("size")]
    kept = len(anchors) - len(found.moved_m) - len(found.poses_off_m)
    if 2 * kept > len(anchors) or not found.moved_m:
        return found
    return replace(NONE_PLACED, torn=(kept, len(anchors)), shared=shared)


def _four(sources: Sources) -> dict[int, FloatArray]:
    return {tag: points for tag, points in _corners(sources).items() if len(points) == 4}


def _corners(sources: Sources) -> dict[int, FloatArray]:
    """Return what is known before of prints: four corners (4, 3), or the centre alone (1, 3)."""
    surveyed = {tag: one.corners_m for tag, one in sources.survey.items()}
    return {tag: one.corners_m for tag, one in sources.remembered.items()} | surveyed


def _shared(viewpoints: Sequence[Viewpoint], places: Places, sources: Sources) -> dict[str, frozenset[int]]:
    """Return by station which of its prints another station sees that is placed, or that are known."""
    known = _corners(sources).keys()
    seen_by: dict[int, set[str]] = {}
    for one in viewpoints:
        for tag in one.seen if one.name in places.stations else ():
            seen_by.setdefault(tag, set()).add(one.name)
    return {
        one.name: frozenset(tag for tag in one.seen if tag in known or seen_by.get(tag, set()) - {one.name})
        for one in viewpoints
    }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Block:
    """Everything that is adjusted together; coordinates are from `origin_m`."""

    names: tuple[str, ...]
    ids: tuple[int, ...]
    state: State
    seen: Sightings
    known: tuple[Known, ...]
    between: tuple[Between, ...]
    origin_m: FloatArray
    sources: Sources


def _places(block: _Block, made: Adjusted) -> Places:
    """Return adjusted places in the world."""
    back = rigid(np.eye(3), block.origin_m)
    state = made.state
    return Places(
        stations={name: back @ pose for name, pose in zip(block.names, state.stations, strict=True)},
        tags={
            tag: (back @ pose, float(size))
            for tag, pose, size in zip(block.ids, state.tags, state.sizes_m, strict=True)
        },
    )


def _block(viewpoints: Sequence[Viewpoint], places: Places, sources: Sources, options: RegisterOptions) -> _Block:
    here = [one for one in viewpoints if one.name in places.stations]
    ids = tuple(sorted({tag for one in here for tag in one.seen} & places.tags.keys()))
    row = {tag: number for number, tag in enumerate(ids)}
    origin = np.mean([places.stations[one.name][:3, 3] for one in here], axis=0)
    shift = rigid(np.eye(3), -origin)
    pairs = [
        (number, row[tag], one.seen[tag]) for number, one in enumerate(here) for tag in sorted(one.seen) if tag in row
    ]
    pixels = np.full((len(pairs), 4, 4), 0.0)
    for k, (_, _, sighting) in enumerate(pairs):
        pixels[k, :, :2] = sighting.left_px
        pixels[k, :, 2:] = sighting.left_px if sighting.right_px is None else sighting.right_px
    seen = Sightings(
        station=np.array([s for s, _, _ in pairs], dtype=np.intp),
        tag=np.array([t for _, t, _ in pairs], dtype=np.intp),
        pixels=pixels, both=np.array([one.right_px is not None for _, _, one in pairs], dtype=bool),
        corner_px=np.array([max(one.sigma_px, LEAST_FINDER_PX) for _, _, one in pairs]),
        noise=sources.noise, cameras=[one.camera for one in here],
    )  # fmt: skip
    state = State(
        stations=np.array([shift @ places.stations[one.name] for one in here]),
        tags=np.array([shift @ places.tags[tag][0] for tag in ids]).reshape(-1, 4, 4),
        sizes_m=np.array([places.tags[tag][1] for tag in ids]),
    )
    names = tuple(one.name for one in here)
    return _Block(
        names=names, ids=ids, state=state, seen=seen, origin_m=origin, sources=sources,
        known=_known(names, ids, sources, origin), between=_between(names, sources.links),
    )  # fmt: skip


def _between(names: Sequence[str], links: Sequence[PointLink]) -> tuple[Between, ...]:
    row = {name: number for number, name in enumerate(names)}
    inside = [one for one in links if one.first in row and one.second in row]
    ordered = sorted(inside, key=lambda one: (one.first, one.second))
    return tuple(between(one, row[one.first], row[one.second]) for one in ordered)


def _known(names: Sequence[str], ids: Sequence[int], sources: Sources, origin: FloatArray) -> tuple[Known, ...]:
    """Return the rows of all that is known, in an order of their own."""
    rows: list[Known] = []
    again = [tag for tag in ids if tag in sources.remembered and tag not in sources.survey]
    for index, tag in enumerate(ids):
        one = sources.survey.get(tag)
        if one is not None and len(one.corners_m) == 4:
            rows.append(surveyed_corners(f"tag {tag}", index, one.corners_m - origin, one.sigma_m))
        elif one is not None:
            rows.append(surveyed_centre(f"tag {tag}", index, one.corners_m[0] - origin, one.sigma_m))
        elif tag in again:
            rows += _remembered(index, tag, sources.remembered[tag], origin, len(again))
        if tag in sources.sizes_m and tag not in again:
            rows.append(known_size(f"size {tag}", index, sources.sizes_m[tag], sources.size_share))
    for index, name in enumerate(names):
        if name in sources.poses:
            pose, covariance = sources.poses[name]
            near = pose.copy()
            near[:3, 3] -= origin
            rows.append(known_pose(f"station {name}", index, near, covariance))
        rows.extend(_from_origin(one, index, origin) for one in sources.points.get(name, ()))
    return tuple(rows)


def _from_origin(one: Known, index: int, origin: FloatArray) -> Known:
    """Return the rows of a control point, which lies in the world, for the pose of its station from the origin."""

    def rows(pose: FloatArray, size_m: float) -> Rows:
        there = pose.copy()
        there[:3, 3] += origin
        return one.rows(there, size_m)

    return replace(one, index=index, rows=rows)


def _remembered(index: int, tag: int, place: TagPlace, origin: FloatArray, count: int) -> list[Known]:
    """Return rows of a print where an earlier visit found it.

    All of its prints err in common there, by how much isn't kept. A covariance `count` times as large is never too
    small then, whatever they have in common.

    Reference: Julier & Uhlmann 1997, a non-divergent estimation algorithm in the presence of unknown correlations.
    """
    pose = place.world_from_tag.copy()
    pose[:3, 3] -= origin
    widened = count * place.covariance
    size = known_size(f"size {tag}", index, place.size_m, float(np.sqrt(widened[6, 6])))
    return [known_pose(f"tag {tag}", index, pose, widened[:6, :6], of_tag=True), size]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Kept:
    """Which sightings (K,), known things (L,) and links (T,) stayed."""

    seen: BoolArray
    known: BoolArray
    between: BoolArray


def _without_faults(block: _Block, options: RegisterOptions) -> tuple[Adjusted, _Kept] | None:
    """Adjust, leave out what is off the most, and adjust again, until nothing is off."""
    state = block.state
    sigma_px = options.rig_disparity_px
    made: Adjusted | None = None
    shown = ahead(state, block.seen)
    seen = block.seen.kept(shown)
    for reach in REACHES:
        made = adjust(state, seen, block.known, sigma_px, between=block.between, reach=reach)
        if made is None:
            return None
        state = made.state
    assert made is not None
    shown[shown] = made.seen_off <= LEFT_OUT_SIGMAS
    kept = _Kept(seen=shown, known=made.known_off <= LEFT_OUT_SIGMAS,
                 between=made.between_off <= LEFT_OUT_SIGMAS)  # fmt: skip
    for _ in range(MOST_LEFT_OUT):
        known = [one for one, keep in zip(block.known, kept.known, strict=True) if keep]
        links = [one for one, keep in zip(block.between, kept.between, strict=True) if keep]
        made = adjust(state, block.seen.kept(kept.seen), known, sigma_px, between=links, reach=None)
        if made is None:
            return None
        state = made.state
        offs = ((made.known_off, kept.known), (made.seen_off, kept.seen), (made.between_off, kept.between))
        off, which = max(offs, key=lambda one: float(np.max(one[0], initial=0.0)))
        if np.max(off, initial=0.0) <= LEFT_OUT_SIGMAS:
            break
        which[np.flatnonzero(which)[int(np.argmax(off))]] = False
    return made, kept


def _result(block: _Block, made: Adjusted, keep: _Kept, options: RegisterOptions) -> VisitPlaces:
    back = rigid(np.eye(3), block.origin_m)
    kept = block.seen.kept(keep.seen)
    poses, residual, used = {}, {}, {}
    for number, name in enumerate(block.names):
        mine = kept.station == number
        covariance = made.station_covariance[number].copy()
        covariance[:3, :3] += np.eye(3) * (options.rig_direction_px / block.seen.cameras[number].f_px) ** 2
        poses[name] = (back @ made.state.stations[number], covariance)
        off = np.where(
            kept.both[mine, None, None], made.residual_px[mine], made.residual_px[mine][..., :2].repeat(2, -1)
        )
        residual[name] = float(np.sqrt(np.mean(np.square(off)))) if mine.any() else 0.0
        used[name] = tuple(block.ids[tag] for tag in kept.tag[mine])
    tags = {
        tag: TagPlace(world_from_tag=back @ made.state.tags[j], size_m=float(made.state.sizes_m[j]),
                      covariance=made.tag_covariance[j])
        for j, tag in enumerate(block.ids) if np.any(kept.tag == j)
    }  # fmt: skip
    lost = {name: block.seen.tag[~keep.seen & (block.seen.station == n)] for n, name in enumerate(block.names)}
    return VisitPlaces(
        poses=poses, residual_px=residual, used=used, tags=tags,
        not_used={name: tuple(block.ids[tag] for tag in which) for name, which in lost.items() if len(which)},
        moved_m=_moved_tags(block, tags, keep.known), poses_off_m=_poses_off(block, poses, keep.known),
        linked_to=_linked_to(block, keep.between),
    )  # fmt: skip


def _linked_to(block: _Block, keep: BoolArray) -> dict[str, tuple[str, ...]]:
    """Return by station which others points link it to."""
    found: dict[str, set[str]] = {}
    for link, kept in zip(block.between, keep, strict=True):
        if kept:
            one, other = block.names[link.first], block.names[link.second]
            found.setdefault(one, set()).add(other)
            found.setdefault(other, set()).add(one)
    return {name: tuple(sorted(others)) for name, others in found.items()}


def _moved_tags(block: _Block, tags: Mapping[int, TagPlace], keep_known: BoolArray) -> dict[int, FloatArray]:
    moved = {}
    for one, keep in zip(block.known, keep_known, strict=True):
        tag = block.ids[one.index] if one.of_tag else -1
        if not keep and one.name == f"tag {tag}" and tag in tags:
            moved[tag] = tags[tag].centre_m - _corners(block.sources)[tag].mean(axis=0)
    return moved


def _poses_off(
    block: _Block, poses: Mapping[str, tuple[FloatArray, FloatArray]], keep_known: BoolArray
) -> dict[str, FloatArray]:
    off = {}
    for one, keep in zip(block.known, keep_known, strict=True):
        name = "" if one.of_tag else block.names[one.index]
        if not keep and one.name == f"station {name}":
            off[name] = poses[name][0][:3, 3] - block.sources.poses[name][0][:3, 3]
    return off
