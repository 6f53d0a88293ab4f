"""Numbers and states as people read them: the one place that says how the report writes a value."""

import math
import re
from datetime import date, datetime

from asbuilt_bim.progress.money import rounded

UNKNOWN = "unknown"
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
_MOST_DECIMALS = 12
_EVEN = 1e-6  # of a tenth of a percent: what a sum of shares errs by
LEAST_CHANCE = 1e-6
"""Of a chance: what is less likely is told as less than that."""
_THIN = "\u202f"  # narrow no-break space: groups digits without being read as a decimal mark


def percent(share: float | None) -> str:
    """Write a share in 0..1 as whole percents; nearly all is never `100 %`, nearly nothing never `0 %`."""
    if share is None:
        return UNKNOWN
    if 0.0 < share < 0.005:
        return "<1 %"
    if 0.995 <= share < 1.0 - 1e-9:
        return ">99 %"
    return f"{share * 100:.0f} %"


def percent_to_a_tenth(share: float) -> str:
    """Write a share that a person gave, to a tenth of a percent where it has one: `62.5 %`."""
    return f"{round(share * 100.0, 1):g} %"


def share_of_money(share: float) -> str:
    """Write retention or tax, to a hundredth of a percent where it has one: `7.75 %`."""
    return f"{round(share * 100.0, 2):g} %"


def percent_certain(share: float) -> str:
    """Write a lower bound as whole percents, rounded down: a certificate may rest on it."""
    return f"{math.floor(share * 100 + 1e-9)} %"


def day_and_month(day: date) -> str:
    """Write a day of a year that is known as `9 Mar`: 03-09 is another day in another country."""
    return f"{day.day} {_MONTHS[day.month - 1]}"


def odds(chance: float) -> str:
    """Write how likely something is as people say it: `12 %`, `one in 500,000`, `under one in a million`."""
    if chance >= 0.01:
        return percent(chance)
    if chance < LEAST_CHANCE:
        return "under one in a million"
    return f"one in {float(f'{1.0 / chance:.1g}'):,.0f}"


def percent_seen(share: float) -> str:
    """Write what share was seen as whole percents, rounded down: under half never reads as half."""
    return percent(share) if share < 0.01 else percent_certain(share)


def cut_down(share: float) -> float:
    """Return a lower bound in 0..1 to a tenth of a percent, never more than it is; of what was seen, too."""
    return math.floor(share * 1000.0 + _EVEN) / 1000.0


def cut_up(share: float) -> float:
    """Return an upper bound in 0..1 to a tenth of a percent, never less than it is."""
    return math.ceil(share * 1000.0 - _EVEN) / 1000.0


def percent_down(share: float) -> str:
    """Write a lower bound in percent, to a tenth, never more than it is."""
    return f"{cut_down(share) * 100.0:.1f}"


def percent_up(share: float) -> str:
    """Write an upper bound in percent, to a tenth, never less than it is."""
    return f"{cut_up(share) * 100.0:.1f}"


def number(value: float | None, decimals: int = 2) -> str:
    """Write a number with its digits in groups of three, halves away from 0 as in a spreadsheet; None is `unknown`."""
    return UNKNOWN if value is None else f"{rounded(value, decimals):,.{decimals}f}".replace(",", _THIN)


def share_bounds(lower: float, upper: float) -> tuple[str, str]:
    """Write two bounds in 0..1 with four decimals for a table, rounded outwards."""
    return f"{math.floor(lower * 1e4 + 1e-7) / 1e4:.4f}", f"{math.ceil(upper * 1e4 - 1e-7) / 1e4:.4f}"


def rate(value: float) -> str:
    """Write the price of one unit: two decimals, or as many as it has, so that amounts can be checked by it."""
    decimals = 2
    while decimals < _MOST_DECIMALS and abs(value - round(value, decimals)) > 1e-7 * abs(value):
        decimals += 1
    return number(value, decimals)


def quantity(value: float, measure: str) -> str:
    """Write a cost line's quantity with all its digits, so that amounts can be checked by it; pieces as whole ones."""
    return number(value, 0) if measure == "count" and value == round(value) else rate(value)


def area(area_m2: float | None, sigma_m2: float | None = None) -> str:
    """Write an area as `1.35 ± 0.02 m²`, with a third decimal where sigma is below 5 cm²."""
    if area_m2 is None:
        return UNKNOWN
    if sigma_m2 is None:
        return f"{number(area_m2)} m²"
    decimals = 3 if 0.0 < sigma_m2 < 0.005 else 2
    sigma = number(sigma_m2, decimals) if sigma_m2 >= 0.0005 or sigma_m2 == 0.0 else "<0.001"
    return f"{number(area_m2, decimals)} ± {sigma} m²"


def area_of(area_m2: float | None, sigma_m2: float | None, design_m2: float) -> str:
    """Write a measured area beside the design's of the same sides: `1.35 ± 0.02 of 1.40 m²`."""
    return UNKNOWN if area_m2 is None else f"{area(area_m2, sigma_m2).removesuffix(' m²')} of {number(design_m2)} m²"


def length(length_m: float | None, sigma_m: float | None = None) -> str:
    """Write a length as `4.213 ± 0.011 m`."""
    if length_m is None:
        return UNKNOWN
    return f"{number(length_m, 3)} m" if sigma_m is None else f"{number(length_m, 3)} ± {number(sigma_m, 3)} m"


def millimetres(length_m: float | None, sigma_m: float | None = None) -> str:
    """Write a signed length as `+13 ± 4 mm`."""
    if length_m is None:
        return UNKNOWN
    sigma = "" if sigma_m is None else f" ± {sigma_m * 1000:.0f}"
    whole_mm = round(length_m * 1000)
    return f"{'−' if whole_mm < 0 else '+'}{abs(whole_mm)}{sigma} mm"


def millimetres_per_metre(angle_rad: float | None) -> str:
    """Write an angle from plumb as `2.0 mm/m`."""
    return UNKNOWN if angle_rad is None else f"{math.tan(angle_rad) * 1000:.1f} mm/m".replace("-", "−")


def day(moment: date | datetime | None) -> str:
    """Write a date as year-month-day; None is a dash."""
    if moment is None:
        return "–"
    return (moment.date() if isinstance(moment, datetime) else moment).isoformat()


def unit_sign(unit: str) -> str:
    """Write m2 and m3 with their signs."""
    return {"m2": "m²", "m3": "m³"}.get(unit, unit)


def plain(text: str) -> str:
    """Return text without the control characters that XML and spreadsheets refuse."""
    return _CONTROL.sub("", text)


def shown(value: object) -> object:
    """Return what a page shows of a value: text without control characters, all else as it is."""
    return plain(value) if isinstance(value, str) and _CONTROL.search(value) else value
