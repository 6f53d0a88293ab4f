"""Knows the lines of a bill again in the next: what of them was certified before."""

from collections.abc import Sequence

from asbuilt_bim.bim.cost_units import sign_of
from asbuilt_bim.progress.report import CostProgress
from asbuilt_bim.progress.valuation.inputs import Paid

_COMPARED = 400
"""Letters of a text that are compared: a workbook holds no longer ones whole."""


def paid_lines(lines: Sequence[CostProgress], paid: Sequence[Paid]) -> dict[str, Paid]:
    """Return by the key of a line what was certified of it: by its key, else by an identification that is its own.

    What was certified in another unit is of another line. Where an identification alone is alike, so must be the text:
    another table may number other work.
    """
    by_key = {one.line: one for one in paid}
    found = {
        line.global_id: by_key[line.global_id]
        for line in lines
        if line.global_id in by_key and _one_unit(line, by_key[line.global_id])
    }
    taken = {one.line for one in found.values()}
    left = [one for one in paid if one.line not in taken and one.identification]
    free = [line for line in lines if line.global_id not in found and line.identification]
    for line in free:
        same = [one for one in left if one.identification == line.identification]
        alike = [one for one in free if one.identification == line.identification]
        if len(same) == 1 == len(alike) and _one_unit(line, same[0]) and _alike(line.name, same[0].text):
            found[line.global_id] = same[0]
    return found


def _one_unit(line: CostProgress, paid: Paid) -> bool:
    return _alike(sign_of(line.unit), sign_of(paid.unit))


def _alike(one: str, other: str) -> bool:
    """Say whether two texts are the same but for blanks and capitals."""
    return "".join(one.split()).casefold()[:_COMPARED] == "".join(other.split()).casefold()[:_COMPARED]
