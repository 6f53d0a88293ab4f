"""Money to the cent, by decimal arithmetic on the digits that a spreadsheet counts: a sheet comes to the same cent.

A quantity is rounded once, to the decimals that are shown; an amount is that quantity x rate, rounded once; a sum is
the sum of the amounts that stand above it. Halves go away from 0, as a spreadsheet's ROUND does.
"""

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal

DIGITS = 15
"""What a spreadsheet counts of a number; beyond them 1.005 lies under the half cent that it was written as."""
LARGEST = 10.0 ** (DIGITS - 2)
"""An amount that has no cents left in so many digits stays as it is."""
QUANTITY_DECIMALS, SMALL_QUANTITY_DECIMALS = 3, 6
"""Decimals of a quantity, and of one whose whole line is less than 1 of its unit (a wall in kilometres)."""


def rounded(value: float, decimals: int) -> float:
    """Return a number to some decimals, halves away from 0, as a spreadsheet's ROUND does."""
    if not abs(value) < LARGEST:
        return value
    step = Decimal(1).scaleb(-decimals)
    return float(Decimal(f"{value:.{DIGITS}g}").quantize(step, ROUND_HALF_UP)) + 0.0  # no minus before 0


def cents(amount: float) -> float:
    """Return an amount of money to its second decimal, halves away from 0, as a spreadsheet's ROUND does."""
    return rounded(amount, 2)


def total(amounts: Iterable[float]) -> float:
    """Return the sum of amounts that are in cents, in cents."""
    return cents(math.fsum(amounts))


def quantity_decimals(planned: float) -> int:
    """Return to how many decimals the quantities of a line are rounded."""
    return SMALL_QUANTITY_DECIMALS if abs(planned) < 1.0 else QUANTITY_DECIMALS


def certified_quantity(parts: float, planned: float, *, pieces: bool, up: bool = False) -> float:
    """Return what counts of a line whose elements bring `parts`: rounded, whole pieces, never more than `planned`.

    Pieces that are begun don't count; `up`: they do, of what is taken off.
    """
    sign = -1.0 if planned < 0.0 else 1.0
    amount, most = abs(parts), abs(planned)
    if rounded(amount, 9) >= rounded(most, 9):
        return planned
    if pieces:
        return sign * min(most, float((math.ceil if up else math.floor)(rounded(amount, 6)))) + 0.0
    return sign * min(most, abs(rounded(amount, quantity_decimals(planned)))) + 0.0
