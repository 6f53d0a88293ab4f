"""The workbook's columns, and what each one means (the sheet `Notes` is written from here)."""

from dataclasses import dataclass

_BEST = (
    "The height that what was seen makes likeliest, of several elements their mean (not seen now: as when last seen); "
    "unknown where less than half was seen."
)
_LOWER = "What is certain: what nobody saw counts as not built, unless seen concrete stands on it."
_UPPER = "What is possible: what nobody saw counts as built, unless it was seen open below it."
_COVERAGE = "Share that was seen, from one side or more, and decided."


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column: its heading, what it means, its width in characters and the kind of its cells."""

    heading: str
    meaning: str
    kind: str
    width: float


def _column(heading: str, kind: str, width: float, meaning: str) -> Column:
    """Make a column."""
    return Column(heading=heading, meaning=meaning, kind=kind, width=width)


STOREYS = (
    _column("Storey", "text", 30, "Building storey, from below; the last line is the whole building."),
    _column("Elements", "count", 10, "Walls and columns."),
    _column("Complete", "count", 10, "Elements seen complete."),
    _column("Complete as far as seen", "count", 10, "Nothing of them is seen open, and less than 90 % is certain."),
    _column("Part", "count", 8, "Elements seen built in part."),
    _column("Not started", "count", 10, "Elements seen not started."),
    _column("Displaced", "count", 10, "Elements built beside their design: nothing of them counts until accepted."),
    _column("Unknown", "count", 10, "Elements of which too little was seen."),
    _column("Design area [m²]", "area", 13, "Exposed lateral surface of the design."),
    _column(
        "Design area [m²], of the sides photographed",
        "area",
        13,
        "Design area of the sides that were measured: the as-built area stands beside it.",
    ),
    _column("As-built area [m²], of the sides photographed", "area", 13, "Measured area; only what photos show."),
    _column("Sigma [m²]", "quantity", 10, "Standard deviation of the as-built area (about 2 in 3 lie within)."),
    _column("At least", "percent", 12, _LOWER),
    _column("Possibly", "percent", 12, _UPPER),
    _column("Best estimate", "percent", 12, "Best estimate; unknown where less than half was seen."),
    _column("Seen", "percent", 11, _COVERAGE),
)

ELEMENTS = (
    _column("Storey", "text", 16, "Building storey."),
    _column("Name", "text", 26, "The element's name in the IFC file."),
    _column("State", "text", 22, "complete, complete as far as seen, part, not started, displaced, or unknown."),
    _column("Design area [m²]", "area", 10, "Exposed lateral surface of the design: openings and contact taken off."),
    _column(
        "Design area [m²], of the sides photographed",
        "area",
        13,
        "Design area of the sides that were measured: the as-built area stands beside it.",
    ),
    _column(
        "As-built area [m²], of the sides photographed",
        "area",
        13,
        "Area of the union of all measured outlines; only what photos show.",
    ),
    _column("Sigma [m²]", "quantity", 9, "Standard deviation of the as-built area."),
    _column("At least", "percent", 11, _LOWER),
    _column("Possibly", "percent", 11, _UPPER),
    _column("Best estimate", "percent", 11, _BEST),
    _column("Seen", "percent", 10, _COVERAGE),
    _column(
        "Offset [mm]",
        "millimetres",
        9,
        "Measured face minus design face, along the design's outward normal; the largest.",
    ),
    _column("Offset sigma [mm]", "sigma", 9, "One standard deviation of the offset."),
    _column("Tolerance", "text", 11, "in, out or undecided, by two sigma; empty where the project names no tolerance."),
    _column("Last seen", "date", 12, "Last visit that decided something on this element; empty where none did."),
    _column("Notes", "wrap", 46, "Remarks."),
    _column("GlobalId", "text", 25, "The element's GlobalId in the IFC file."),
    _column("Class", "text", 13, "The element's class in the IFC file."),
    _column("Visit", "date", 12, "Date of this visit."),
    _column("Stations", "text", 14, "Stations that saw it."),
)

TASKS = (
    _column("Task", "text", 34, "Task of the work schedule."),
    _column("Planned start", "date", 12, "Planned start."),
    _column("Planned finish", "date", 12, "Planned finish."),
    _column("Seen begun", "date", 12, "First visit that saw something built."),
    _column("Seen complete", "date", 12, "Visit that saw all its elements complete."),
    _column(
        "Known",
        "text",
        14,
        "measured; part measured (the lower bound counts); measured 0 (seen, and nothing is there); unknown.",
    ),
    _column("At least", "percent", 12, _LOWER),
    _column("Possibly", "percent", 12, _UPPER),
    _column("Best estimate", "percent", 12, _BEST),
    _column("Seen", "percent", 10, _COVERAGE),
    _column(
        "Planned by now",
        "percent",
        11,
        "Share that the schedule wants by the end of the visit's day; empty without planned dates.",
    ),
    _column(
        "Days behind schedule",
        "count",
        8,
        "By the best estimate: how long ago the schedule wanted as much as stands now, so it can be more than the days "
        "late; negative: ahead; empty without planned dates.",
    ),
    _column("Days behind schedule, best case", "count", 9, "Best case: what was not seen counts as built."),
    _column("Days behind schedule, worst case", "count", 9, "Worst case: what was not seen counts as not built."),
    _column(
        "Late",
        "text",
        10,
        "late: the day of the planned finish has passed and the task is not complete; unknown where the photos don't "
        "show it.",
    ),
    _column("Days late", "count", 8, "Days from the planned finish to the visit, 0 where it isn't late; as on Late."),
    _column(
        "Forecast finish",
        "date",
        12,
        "By what is certain: the rest takes its share of the planned time from the visit on. "
        "Of a task seen complete the day of that visit.",
    ),
    _column("Forecast finish, best case", "date", 12, "The same if all that may be built is built."),
    _column("Elements", "count", 10, "Walls and columns of the task."),
    _column("Complete", "count", 10, "Elements seen complete."),
)

UNCLEAR = "unclear, too little seen"
"""What an element is called that should stand, where photos don't say whether it does."""

LATE = (
    _column("Storey", "text", 18, "Building storey."),
    _column(
        "Element",
        "text",
        30,
        "Name of the wall or column: unfinished, or seen too little to say, after the planned finish of its last task.",
    ),
    _column("GlobalId", "text", 25, "The element's GlobalId in the IFC file."),
    _column("State", "text", 22, "part or not started; of unclear ones unknown, or complete as far as seen."),
    _column("At least", "percent", 12, _LOWER),
    _column("Best estimate", "percent", 12, _BEST),
    _column("Task", "text", 34, "The task that should have finished it."),
    _column("Due", "date", 12, "Planned finish of that task."),
    _column("Days late", "count", 10, "Days from then to the visit, as on Tasks; unknown where it is unclear."),
    _column("Late", "text", 26, f"late: seen unfinished. {UNCLEAR}: nobody can say."),
)

STATIONS = (
    _column("Station", "text", 16, "Photo pair."),
    _column("Status", "text", 12, "placed: counts; not placed or rejected: counts for nothing."),
    _column("Target range [m]", "metres", 11, "Distance from the left camera to the target: what a tape shows."),
    _column("Target depth [m]", "metres", 11, "Distance along the camera's axis, by triangulation."),
    _column("Sigma [m]", "metres", 9, "Standard deviation of the target depth."),
    _column("Residual [px]", "area", 10, "Reprojection error of the surveyed markers."),
    _column("Markers", "text", 18, "Surveyed markers that placed it."),
    _column("Faces", "count", 8, "Faces measured."),
    _column("Matched", "count", 9, "Faces that belong to a design face."),
    _column("Reasons", "wrap", 90, "Why it, or something at it, was left out; with value, limit and remedy."),
)

NOTES = (
    _column("Sheet", "text", 12, ""),
    _column("Column", "text", 26, ""),
    _column("Meaning", "wrap", 100, ""),
)
