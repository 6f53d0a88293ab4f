"""Knows the lines of a bill again in the next: what of them was certified before."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from asbuilt_bim.bim.cost_units import currency_of, sign_of
from asbuilt_bim.bim.model import COSTS_KEY
from asbuilt_bim.progress.report import CostProgress
from asbuilt_bim.progress.valuation.inputs import Paid, ValuationInputs

_COMPARED = 400
"""Letters of a text that are compared: a workbook holds no longer ones whole."""


def paid_lines(lines: Sequence[CostProgress], paid: Sequence[Paid]) -> dict[str, Paid]:
    """Return by the key of a line what was certified of it: by its key, else by an identification that is its own.

    What was certified in another unit is of another line. Where an identification alone is alike, so must be the text:
    another table may number other work, and so may the same table later. There a text may be put right: no other line
    came to have the text of then, and the line still covers something that it covered.
    """
    by_key = {one.line: one for one in paid}
    pairs = [(line, by_key[line.global_id]) for line in lines if line.global_id in by_key]
    kept = {line.global_id for line, one in pairs if _alike(line.name, one.text)}
    moved = {_bare(line.name) for line in lines if line.global_id not in kept}
    found = {
        line.global_id: one
        for line, one in pairs
        if _one_unit(line, one)
        and (
            line.global_id in kept
            or not line.global_id.startswith(COSTS_KEY)
            or (_bare(one.text) not in moved and (line.parts.keys() & one.elements.keys() or not one.elements))
        )
    }
    taken = {one.line for one in found.values()}
    left = [one for one in paid if one.line not in taken and one.identification]
    free = [line for line in lines if line.global_id not in found and line.identification]
    for line in free:
        same = [one for one in left if one.identification == line.identification and _alike(line.name, one.text)]
        alike = [one for one in free if one.identification == line.identification]
        if len(same) == 1 == len(alike) and _one_unit(line, same[0]):
            found[line.global_id] = same[0]
    return found


def bill_places(
    groups: Sequence[tuple[str, str]],
    lines: Sequence[CostProgress],
    inputs: ValuationInputs,
    paid: Mapping[str, Paid],
) -> Callable[[int], int]:
    """Return what tells the place (from 1) of the schedule and currency that a bill of the last workbook goes on in.

    It is the one of its currency that most of its lines are in, else that of its number, else the last one.
    """
    at = {group: place for place, group in enumerate(groups, 1)}
    kept = Counter((paid[x.global_id].bill, at[x.schedule, x.currency]) for x in lines if x.global_id in paid)
    found: dict[int, int] = {}
    for one in inputs.before:
        own = [place for (_, currency), place in at.items() if currency_of(currency) == currency_of(one.currency)]
        usual, places = min(one.bill, len(groups)), own or list(at.values())
        found[one.bill] = max(places, key=lambda place: (kept[one.bill, place], place == usual), default=usual)
    return lambda bill: found.get(bill, min(bill, len(groups)))


def _one_unit(line: CostProgress, paid: Paid) -> bool:
    return _alike(sign_of(line.unit), sign_of(paid.unit))


def _alike(one: str, other: str) -> bool:
    """Say whether two texts are the same but for blanks and capitals."""
    return _bare(one) == _bare(other)


def _bare(text: str) -> str:
    return "".join(text.split()).casefold()[:_COMPARED]
