"""Which stations hang on a single print: were that one moved, or its number read twice, nothing would tell."""

from collections.abc import Collection, Iterable, Mapping

Sees = Mapping[str, Collection[int]]
"""Prints by the station that sees them."""


def hanging(sees: Sees, known_tags: Collection[int], known_stations: Collection[str]) -> dict[str, int]:
    """Return the stations that one print alone links to what is known, with that print.

    `known_tags` have a known place, and `known_stations` a pose that needs no print.
    """
    seen_by: dict[int, list[str]] = {}
    for station, tags in sees.items():
        for tag in tags:
            seen_by.setdefault(tag, []).append(station)
    found: dict[str, int] = {}
    whole = _reached(sees, seen_by, known_tags, known_stations, None)
    for tag in sorted(seen_by):
        for station in whole - _reached(sees, seen_by, known_tags, known_stations, tag):
            found.setdefault(station, tag)
    return found


def _reached(
    sees: Sees,
    seen_by: Mapping[int, Iterable[str]],
    known_tags: Collection[int],
    known_stations: Collection[str],
    without: int | None,
) -> set[str]:
    """Return the stations that links lead to from what is known, with one print taken away."""
    stations = {station for station in known_stations if station in sees}
    tags = {tag for tag in known_tags if tag != without and tag in seen_by}
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
