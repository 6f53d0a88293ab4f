"""The columns of the flat tables: names that stay, what kind of value they hold, and what it means."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["string", "number", "integer", "boolean", "date", "datetime"]
Table = Literal["elements", "faces", "storeys", "tasks", "cost_lines", "stations"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column of a table; a cell without a value is unknown, or has none."""

    name: str
    kind: Kind
    meaning: str
    always: bool = False  # no cell of it is empty


def _column(name: str, kind: Kind, meaning: str, *, always: bool = False) -> Column:
    return Column(name=name, kind=kind, meaning=meaning, always=always)


_VISIT = (
    _column("project", "string", "Name of the project.", always=True),
    _column("visit_date", "date", "Day of the visit that this row is the state of.", always=True),
    _column(
        "newest", "boolean", "Whether no later visit is in the table: filter by it, or sums count twice.", always=True
    ),
)
_COMPLETION = (
    _column("completion_best", "number", "Best estimate, 0 to 1; only where at least half was seen."),
    _column("completion_lower", "number", "Certain, 0 to 1: what was not seen counts as not built.", always=True),
    _column("completion_upper", "number", "Possible, 0 to 1: what was not seen counts as built.", always=True),
    _column("coverage", "number", "Share of the cells that photos decide, 0 to 1.", always=True),
)
_COUNTS = tuple(
    _column(f"elements{state}", "integer", meaning, always=True)
    for state, meaning in (
        ("", "Walls and columns of it."),
        ("_complete", "Of these, in the state complete."),
        ("_part", "Of these, built in part."),
        ("_not_started", "Of these, not started."),
        ("_displaced", "Of these, beside their design."),
        ("_unknown", "Of these, unknown."),
        ("_as_far_as_seen", "Of these, complete as far as seen: none of them is among the complete ones."),
    )
)
_AREAS = (
    _column("design_area_m2", "number", "Exposed lateral surface of the design.", always=True),
    _column("as_built_area_m2", "number", "Union of the measured outlines, of the sides that were photographed."),
    _column("as_built_sigma_m2", "number", "One standard deviation of the as-built area."),
)

TABLES: dict[Table, tuple[Column, ...]] = {
    "elements": (
        *_VISIT,
        _column("global_id", "string", "GlobalId of the wall or column.", always=True),
        _column("ifc_class", "string", "Class in the IFC file.", always=True),
        _column("type_name", "string", "Name of its type in the IFC file."),
        _column("name", "string", "Its name."),
        _column("storey_id", "string", "GlobalId of its storey."),
        _column("storey", "string", "Name of its storey."),
        _column(
            "state",
            "string",
            "complete, complete as far as seen, part, not started, displaced or unknown.",
            always=True,
        ),
        *_COMPLETION,
        *_AREAS,
        _column("design_volume_m3", "number", "Net volume of the design.", always=True),
        _column("offset_m", "number", "Measured face minus design face along the outward normal, the largest."),
        _column("offset_sigma_m", "number", "Standard deviation of the offset."),
        _column("tilt_rad", "number", "Angle from plumb."),
        _column("first_built_date", "date", "First visit that saw something of it built."),
        _column("complete_date", "date", "First visit since which it is complete, at least 97 % of it certain."),
        _column("last_seen_date", "date", "Last visit that decided something on it."),
        _column("doubtful", "boolean", "Whether a person should look at it before it is paid for.", always=True),
        _column("tilt_sigma_rad", "number", "Standard deviation of the tilt."),
        _column("tolerance", "string", "in, out or undecided; empty where the project names no tolerance."),
        _column("zones", "string", "Names of the zones that it lies in, with semicolons between."),
        _column("photographed_design_area_m2", "number", "Design area of the sides that the as-built area is of."),
    ),
    "faces": (
        *_VISIT,
        _column("face_id", "string", "Station and number.", always=True),
        _column("station", "string", "Photo pair.", always=True),
        _column("label", "string", "wall or column.", always=True),
        _column("kind", "string", "plane or cylinder.", always=True),
        _column("global_ids", "string", "GlobalIds of the elements that it belongs to, with spaces between."),
        _column("area_m2", "number", "Its area.", always=True),
        _column(
            "area_sigma_calibration_m2", "number", "The calibration's part of sigma, shared by all faces.", always=True
        ),
        _column("area_sigma_image_m2", "number", "The photo's part of sigma, its own.", always=True),
        _column("width_m", "number", "Its width.", always=True),
        _column("height_m", "number", "Its height.", always=True),
        _column(
            "whole", "boolean", "Whether all of the face was measured; if not, the area is a lower bound.", always=True
        ),
    ),
    "storeys": (
        *_VISIT,
        _column("storey_id", "string", "GlobalId of the storey."),
        _column("storey", "string", "Its name.", always=True),
        *_COMPLETION,
        *_AREAS,
        *_COUNTS,
    ),
    "tasks": (
        *_VISIT,
        _column("task_id", "string", "GlobalId of the task, or what the schedule file knows it by.", always=True),
        _column("identification", "string", "Its identification: WBS code, activity id."),
        _column("name", "string", "Its name."),
        _column("outline", "string", "Summary tasks above it, with slashes between."),
        _column("planned_start", "datetime", "Planned start."),
        _column("planned_finish", "datetime", "Planned finish."),
        _column("seen_begun_date", "date", "First visit that saw something built."),
        _column("seen_complete_date", "date", "Visit that saw all elements complete, at least 97 % of each certain."),
        _column("forecast_finish", "datetime", "Finish by what is certain, at the planned pace."),
        _column("forecast_earliest", "datetime", "Best case: the same if all that may be built is built."),
        _column("known", "string", "measured, part measured, measured 0 or unknown.", always=True),
        *_COMPLETION,
        _column("scheduled_share", "number", "Share that schedules get, 0 to 1: the lower bound."),
        _column("planned_share", "number", "Share that the plan wants by the visit, 0 to 1."),
        _column("late", "boolean", "Whether the day of the planned finish has passed and it isn't complete."),
        _column("late_days", "integer", "Days from the planned finish to the visit, 0 where it isn't late."),
        _column(
            "behind_days",
            "integer",
            "Days behind plan by the best estimate, negative: ahead; as completion_best.",
        ),
        _column("behind_least_days", "integer", "Best case: what was not seen counts as built."),
        _column("behind_most_days", "integer", "Worst case: what was not seen counts as not built."),
        *_COUNTS,
    ),
    "cost_lines": (
        *_VISIT,
        _column("line_id", "string", "GlobalId of the cost line.", always=True),
        _column("identification", "string", "Its code."),
        _column("name", "string", "Its text."),
        _column("schedule", "string", "Cost schedule that it stands in."),
        _column("measure", "string", "What its quantity measures: volume, area, length or count.", always=True),
        _column("unit", "string", "Its own unit, of each quantity in this table.", always=True),
        _column("currency", "string", "Currency of each value."),
        _column("rate", "number", "Rate per unit.", always=True),
        _column("planned_quantity", "number", "Planned quantity, in its own unit.", always=True),
        _column(
            "as_built_best",
            "number",
            "As-built quantity, best estimate, in its own unit; as completion_best.",
        ),
        _column("as_built_lower", "number", "As-built quantity, certain, in its own unit.", always=True),
        _column("planned_value", "number", "Planned quantity x rate, to the cent.", always=True),
        _column("earned_best", "number", "Earned value, best estimate, rounded to cents; as completion_best."),
        _column("earned_lower", "number", "Earned value, certain, rounded to cents.", always=True),
        *_COMPLETION,
        _column("certified_quantity", "number", "As the newest valuation has it, with a person's overrides."),
        _column("certified_amount", "number", "That x rate, as changed, to the cent; of the newest visit alone."),
        _column("previous_amount", "number", "What the last certificate held, to the cent; of the newest visit alone."),
    ),
    "stations": (
        *_VISIT,
        _column("station", "string", "Photo pair.", always=True),
        _column("status", "string", "placed: counts; not placed or rejected: counts for nothing.", always=True),
        _column("residual_px", "number", "Reprojection error of the surveyed markers."),
        _column("target_range_m", "number", "Distance from the left camera to the target."),
        _column("target_depth_m", "number", "Distance along the camera's axis."),
        _column("target_depth_sigma_m", "number", "Its standard deviation."),
        _column("faces", "integer", "Faces measured.", always=True),
        _column("faces_matched", "integer", "Of these, faces that belong to a design face.", always=True),
    ),
}
KEYS: dict[Table, tuple[str, ...]] = {
    "elements": ("visit_date", "global_id"),
    "faces": ("visit_date", "face_id"),
    "storeys": ("visit_date", "storey_id"),
    "tasks": ("visit_date", "task_id"),
    "cost_lines": ("visit_date", "line_id"),
    "stations": ("visit_date", "station"),
}
"""The columns by which a row is known; no two rows have the same."""
