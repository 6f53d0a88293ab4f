"""Money to the cent: each line is rounded once, and a sum is the sum of the lines that stand above it."""

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal

DIGITS = 15
"""What a spreadsheet counts of a number; beyond them 1.005 lies under the half cent that it was written as."""
LARGEST = 10.0 ** (DIGITS - 2)
"""An amount that has no cents left in so many digits stays as it is."""


def cents(amount: float) -> float:
    """Return an amount of money to its second decimal, halves away from 0, as a spreadsheet's ROUND does."""
    if not abs(amount) < LARGEST:
        return amount
    return float(Decimal(f"{amount:.{DIGITS}g}").quantize(Decimal("0.01"), ROUND_HALF_UP)) + 0.0  # no minus before 0


def total(amounts: Iterable[float]) -> float:
    """Return the sum of amounts that are in cents, in cents."""
    return cents(math.fsum(amounts))
