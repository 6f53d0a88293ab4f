"""Which stations hang on a single print: were that one moved, or its number read twice, nothing would tell."""

from collections.abc import Collection, Hashable, Iterable, Mapping
from types import MappingProxyType

Sees = Mapping[str, Collection[int]]
"""Prints by the station that sees them."""
_Holds = Mapping[str, Collection[Hashable]]
NO_LINKS: Mapping[str, Collection[str]] = MappingProxyType({})


def hanging(
    sees: Sees,
    known_tags: Collection[int],
    known_stations: Collection[str],
    linked_to: Mapping[str, Collection[str]] = NO_LINKS,
) -> dict[str, int]:
    """Return the stations that one print alone links to what is known, with that print.

    `known_tags` have a known place, and `known_stations` a pose that needs no print. What points link by their dozens
    needs no print (`linked_to`: stations by station).
    """
    holds: dict[str, set[Hashable]] = {name: {*tags, *_links(name, linked_to)} for name, tags in sees.items()}
    seen_by: dict[Hashable, list[str]] = {}
    for station, those in holds.items():
        for tag in those:
            seen_by.setdefault(tag, []).append(station)
    found: dict[str, int] = {}
    whole = _reached(holds, seen_by, known_tags, known_stations, None)
    for tag in sorted(tag for tag in seen_by if isinstance(tag, int)):
        for station in whole - _reached(holds, seen_by, known_tags, known_stations, tag):
            found.setdefault(station, tag)
    return found


def _links(name: str, linked_to: Mapping[str, Collection[str]]) -> set[Hashable]:
    """Return a name for each link of a station, the same at both of its ends."""
    return {frozenset((name, other)) for other in linked_to.get(name, ())}


def _reached(
    sees: _Holds,
    seen_by: Mapping[Hashable, Iterable[str]],
    known_tags: Collection[int],
    known_stations: Collection[str],
    without: int | None,
) -> set[str]:
    """Return the stations that links lead to from what is known, with one print taken away."""
    stations = {station for station in known_stations if station in sees}
    tags: set[Hashable] = {tag for tag in known_tags if tag != without and tag in seen_by}
    open_tags, open_stations = list(tags), list(stations)
    while open_tags or open_stations:
        if open_tags:
            new = set(seen_by[open_tags.pop()]) - stations
            stations |= new
            open_stations += new
        else:
            fresh = {tag for tag in sees[open_stations.pop()] if tag != without} - tags
            tags |= fresh
            open_tags += fresh
    return stations
