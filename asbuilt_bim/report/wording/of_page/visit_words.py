"""The list to walk by: where to stand, where to look, what that shows, and where a tag would help."""

import json
import math
from collections.abc import Sequence

from asbuilt_bim.report.wording.values import percent

OUTSIDE = "No place on a floor shows these from 3 to 8 m. Try from outside, from a scaffold, or from nearer:"
NOT_WORTH = "These would need a station each for less than a square metre:"
LIMITED = "More stations than were allowed, or others that see too few tags, would also show these:"
BY_HULL = "has no slab at its height in the IFC file: the floor is taken to reach as far as its walls and columns."
NOTHING_DUE = "Nothing is due by then that isn't known to be built."
NO_DATES = "The schedule has no dates, so everything counts as due."
NOTHING_KNOWN = "What earlier visits saw isn't counted here: name their results with --result."
_SPACE = "\N{NO-BREAK SPACE}"
_MOST_NAMED = 6


def list_words(*, less_today: bool) -> str:
    """Say why a list isn't the report's, which asks for something else: a place for each element."""
    less = ", less what today's photos show" if less_today else ""
    return (
        "The report's list is another: a place for each element, from outside and from a scaffold, too. "
        f"This one has the fewest places on the floors for all that is due{less}."
    )


def metres(value: float) -> str:
    """Write a distance as a tape is read in a hurry."""
    return f"{value:.1f}{_SPACE}m"


def square_metres(value: float) -> str:
    """Write an area of a plan: its patches are half a metre wide."""
    return f"{value:.0f}{_SPACE}m²" if value >= 10.0 else f"{value:.1f}{_SPACE}m²"


def place_words(nearest: Sequence[tuple[str, float]]) -> str:
    """Say how to find a place: how far it is from the faces of what stands next to it."""
    if not nearest:
        return ""
    return "Stand " + " and ".join(f"{metres(away)} from {name}" for name, away in nearest) + "."


def near_words(storey: str, place_m: tuple[float, float], bearing_deg: float) -> str:
    """Say a place in the IFC's coordinates as a project file takes it: to copy there, where no tag is surveyed."""
    on = f"storey: {json.dumps(storey, ensure_ascii=False)}, " if storey else ""
    return f"near: {{{on}x_m: {place_m[0]:.1f}, y_m: {place_m[1]:.1f}, bearing_deg: {bearing_deg:.0f}}}"


def look_words(name: str, away_m: float, towards: str) -> str:
    """Say where to point the rig."""
    where = f" towards {towards}" if towards else ""
    return f"Look{where}, at {name} {metres(away_m)} away."


def shown_words(shown: Sequence[tuple[str, float]]) -> str:
    """Say what a station shows that those before it don't."""
    named = [f"{name} ({square_metres(m2)})" for name, m2 in shown[:_MOST_NAMED]]
    more = len(shown) - _MOST_NAMED
    return ", ".join(named) + (f" and {more} more" if more > 0 else "")


def sigma_words(sigma: float, away_m: float) -> str:
    """Say how well an area is known from there."""
    return "" if math.isnan(sigma) else f"± {100.0 * sigma:.1f} % at {away_m:.0f}{_SPACE}m"


def tag_words(tags: Sequence[int], needed: int) -> str:
    """Say which surveyed tags a station will see, and whether they are enough."""
    numbers = ", ".join(map(str, tags))
    if len(tags) >= needed:
        return numbers or "none"
    return f"{numbers or 'none'}: {needed} are needed"


def helpful_words(element: str, over_floor_m: float, at_m: Sequence[float], needy: Sequence[int]) -> str:
    """Say where to put up a tag, and which stations it helps."""
    x, y, z = at_m
    which = ", ".join(map(str, needy))
    one = "station" if len(needy) == 1 else "stations"
    return (
        f"On {element}, {metres(over_floor_m)} over the floor (x {x:.1f}, y {y:.1f}, z {z:.1f}). "
        f"It helps {one} {which}, which would see too few."
    )


def promise_words(
    stations: int,
    seen_m2: float,
    wanted_m2: float,
    day: str,
    unplaced: Sequence[int] = (),
    more_m2: float = 0.0,
    unhelped: Sequence[int] = (),
) -> str:
    """Say what a plan promises: by the stations that will be placed, and what the `unplaced` would add."""
    if not wanted_m2:
        return NOTHING_DUE
    if unplaced:
        sure = _sure_words(stations - len(unplaced), seen_m2, wanted_m2, day)
        return f"{sure} {unplaced_words(unplaced, more_m2, unhelped)}"
    return _sure_words(stations, seen_m2, wanted_m2, day)


def unplaced_words(unplaced: Sequence[int], more_m2: float, unhelped: Sequence[int] = ()) -> str:
    """Say which stations see too few tags to be placed, what that costs, and what to do; no T helps the `unhelped`."""
    one = len(unplaced) == 1
    which = f"Station{'s' * (not one)} {', '.join(map(str, unplaced))}"
    rest = f"Station{'s' * (len(unhelped) > 1)} {', '.join(map(str, unhelped))}"
    alone = "note where you stand (`near`), or survey tags in its view"
    remedy = "put up the tags T1, T2 ... of the list and survey them, or note where you stand (`near`)."
    if unhelped:
        some = f"{remedy} {rest}: no tag of the list helps there; {alone}."
        remedy = f"{alone}." if len(unhelped) == len(unplaced) else some
    adds = f"would add {square_metres(more_m2)}" if more_m2 >= 0.05 else "would add nothing"
    see = "sees" if one else "see"
    return (
        f"{which} {adds}, but {see} fewer than 2 surveyed tags. A photo that can't be placed counts for nothing: "
        f"{remedy}"
    )


def _sure_words(stations: int, seen_m2: float, wanted_m2: float, day: str) -> str:
    count = "One station shows" if stations == 1 else f"{stations} stations show"
    if not stations:
        return f"No station on a floor shows any of the {square_metres(wanted_m2)} that are due by {day}."
    return f"{count} {square_metres(seen_m2)} of the {square_metres(wanted_m2)} that are due by {day}."


def still_words(
    asked_m2: float,
    left_m2: float,
    stations: int,
    more_m2: float,
    unplaced: Sequence[int] = (),
    placed_m2: float = 0.0,
    unhelped: Sequence[int] = (),
) -> str:
    """Say what today's stations leave unseen, and what more of them would show; `placed_m2` by those with tags.

    What the `unplaced` ones would add to that is said by itself, as a plan says it.
    """
    if not asked_m2:
        return NOTHING_DUE
    seen = asked_m2 - left_m2
    share = f"Today's stations show {square_metres(seen)} ({percent(seen / asked_m2)}) of what is due."
    if not stations:
        return f"{share} No other station on a floor is worth the walk."
    sure = stations - len(unplaced)
    count = "One more station" if sure == 1 else f"{sure} more stations"
    shown = f"{share} {count} would show another {square_metres(placed_m2 if unplaced else more_m2)}"
    if unplaced:
        return f"{f'{shown}.' if sure else share} {unplaced_words(unplaced, more_m2 - placed_m2, unhelped)}"
    return f"{shown}:"


def element_list(areas: Sequence[tuple[str, float]]) -> str:
    """Name elements with the area that is meant of each, the largest first."""
    return shown_words(sorted(areas, key=lambda one: (-one[1], one[0])))
