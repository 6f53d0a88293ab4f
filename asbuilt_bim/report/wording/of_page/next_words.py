"""What to photograph next, in words that a person can walk by: on the plan, not in coordinates."""

TOWARDS = (
    "the right of the plan",
    "the upper right of the plan",
    "the top of the plan",
    "the upper left of the plan",
    "the left of the plan",
    "the lower left of the plan",
    "the bottom of the plan",
    "the lower right of the plan",
)
"""Directions on the plan, every eighth of a turn from the right, anticlockwise."""
COMPASS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")
"""The same on a compass, from the east."""
ON_FLOOR = "on the floor"
FROM_OUTSIDE = "outside the building"
FROM_SCAFFOLD = "outside, from a scaffold or from the ground"
ONE_FOR_EACH = (
    "Often one place shows several of them. So the list of asbuilt-bim plan is another: the fewest places on the "
    "floors for all that is due. That of asbuilt-bim check has those for what the photos of a day left unseen."
)
"""Why this list isn't that of `plan` or of `check`, which ask for something else."""
COMES_UP = "Photograph what stands under What to photograph next first. Then this one comes up there."
"""What a card says of an element that comes after those that the page lists."""
NO_ROOM = "The design leaves no 3 m free before it: go near, or look along it."


def towards_words(on_plan: int, on_compass: int | None) -> str:
    """Name a direction by the plan, and by the compass where a file says where north is; both as eighths of a turn."""
    words = TOWARDS[on_plan % len(TOWARDS)]
    return words if on_compass is None else f"{words} ({COMPASS[on_compass % len(COMPASS)]})"


def side_words(role: str, towards: str) -> str:
    """Name a side: `the side towards the top of the plan`."""
    what = {"end": "the end", "lateral surface": "the round side"}.get(role, "the side")
    return f"{what} towards {towards}" if towards else what


def stand_words(number: int, side: str, away_m: float, where: str) -> str:
    """Say where to stand for a view; its number stands on the plan."""
    return f"Stand at {number} on the plan, {where}, {away_m:.0f}\N{NO-BREAK SPACE}m before {side}."


def near_words(station: str, away_m: float | None, towards: str) -> str:
    """Say how far and which way that is from a station of the visit; "" where none stood on that floor."""
    if away_m is None:
        return ""
    if away_m < 0.5:
        return f"It is where {station} stood: turn that way."
    way = f" towards {towards}" if towards else ""
    return f"From where {station} stood it is {away_m:.0f}\N{NO-BREAK SPACE}m{way}."
