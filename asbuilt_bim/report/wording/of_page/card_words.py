"""What an element's card says of its photos and its money."""

from asbuilt_bim.progress.report import ElementProgress, StationRecord
from asbuilt_bim.progress.valuation.bill import BillLine, BillRow
from asbuilt_bim.report.wording.completion import seen_words
from asbuilt_bim.report.wording.values import day, number, percent_seen, plain


def worth_words(line: BillLine, row: BillRow, worth: float, amount: float) -> str:
    """Say what an element is worth in a cost line when it is finished, how much of that counts, and by whom."""
    given = line.line
    name = " ".join(part for part in (plain(given.identification), plain(given.name)) if part) or given.global_id
    money = " ".join(part for part in (number(worth), plain(given.currency)) if part)
    counts = "certain"
    if row.override is not None:
        counts = f"certified, by the override of {plain(row.override.by) or 'a person'}"
    elif row.rests_on_a_person and row.observed is not None:
        counts = f"certified, by what {plain(row.observed.observation.by)} saw"
    return f"{name}: {money} when it is finished, {number(amount)} of it {counts}"


def why_words(element: ElementProgress) -> str:
    """Say what a state rests on where no note does; "" where the state says it."""
    seen = f"{seen_words(element.completion)} of it was seen"
    if element.completion.coverage <= 0.0:
        return ""
    if element.shown_state == "not started":
        return f"{seen}, and {'next to nothing' if element.cells_built > 0.0 else 'nothing'} of that is built"
    if element.shown_state != "complete as far as seen":
        return ""
    best = element.completion.best
    return f"{seen}, {'all' if best is not None and best >= 1.0 - 1e-9 else 'nearly all'} of that built"


def unmeasured_words(element: ElementProgress) -> str:
    """Say why something seen built has no measured area; "" where it has one, or nothing was seen built."""
    if element.as_built_area_m2 is not None or not element.cells_built > 0.0:
        return ""
    return (
        "No area was measured: no side was outlined well enough. Built is what photos show in its place, point by "
        "point, and for that no outline is needed"
    )


def sides_words(element: ElementProgress) -> str:
    """Say that a part counts by one side, and how much of all sides was seen; "" where that is as much as counts."""
    if element.completion.coverage - element.surface_coverage < 0.005:
        return ""
    sides = f"of the area of all its sides {percent_seen(element.surface_coverage)} was seen"
    if element.state == "complete":
        return f"Complete by the sides that were seen, for one side is enough; {sides}"
    return f"A part counts as seen by one of its sides; {sides}"


def cut_title(element: ElementProgress, station: StationRecord | None, *, should_stand: bool) -> str:
    """Say what a piece of a photo shows: an element, or the place where the design has it."""
    name = plain(element.name) or element.global_id
    photo = f" in photo {station.name} of {day(station.day)}" if station is not None else ""
    return f"Where {name} should stand,{photo}" if should_stand else f"{name}{photo}"
