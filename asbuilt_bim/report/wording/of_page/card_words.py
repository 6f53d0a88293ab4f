"""What an element's card says of its photos and its money."""

from asbuilt_bim.progress.report import CostProgress, ElementProgress, StationRecord
from asbuilt_bim.report.wording.values import day, number, plain


def worth_words(line: CostProgress, worth: float, certain: float) -> str:
    """Say what an element is worth in a cost line when it is finished, and how much of that is certain."""
    name = " ".join(part for part in (plain(line.identification), plain(line.name)) if part) or line.global_id
    money = " ".join(part for part in (number(worth), plain(line.currency)) if part)
    return f"{name}: {money} when it is finished, {number(certain)} of it certain"


def cut_title(element: ElementProgress, station: StationRecord | None, *, should_stand: bool) -> str:
    """Say what a piece of a photo shows: an element, or the place where the design has it."""
    name = plain(element.name) or element.global_id
    photo = f" in photo {station.name} of {day(station.day)}" if station is not None else ""
    return f"Where {name} should stand,{photo}" if should_stand else f"{name}{photo}"
