"""Cells and areas by their names, such as F7, $A:$C and A2:F40; rows and columns count from 1."""

import re
from dataclasses import dataclass

MAX_ROW, MAX_COLUMN = 1_048_576, 16_384
_CELL = re.compile(r"\$?([A-Za-z]{1,3})\$?([0-9]{1,7})")


@dataclass(frozen=True, slots=True, order=True)
class Area:
    """A rectangle of cells, both ends included."""

    top: int
    left: int
    bottom: int
    right: int

    def holds(self, row: int, column: int) -> bool:
        """Say whether a cell lies in it."""
        return self.top <= row <= self.bottom and self.left <= column <= self.right


def column_number(letters: str) -> int:
    """Return a column's number; A is 1.

    Raises:
        ValueError: no column is called so.
    """
    number = 0
    for letter in letters.upper():
        if not "A" <= letter <= "Z":
            raise ValueError(f"'{letters:.20}' is no column; columns are called A to XFD")
        number = number * 26 + ord(letter) - 64
    if not 1 <= number <= MAX_COLUMN:
        raise ValueError(f"'{letters:.20}' is no column; columns are called A to XFD")
    return number


def column_letters(number: int) -> str:
    """Return what a column is called."""
    letters = ""
    while number:
        number, rest = divmod(number - 1, 26)
        letters = chr(65 + rest) + letters
    return letters


def cell_name(row: int, column: int) -> str:
    """Return what a cell is called."""
    return f"{column_letters(column)}{row}"


def cell_of(name: str) -> tuple[int, int]:
    """Return the row and the column of a cell.

    Raises:
        ValueError: no cell is called so.
    """
    match = _CELL.fullmatch(name)
    if match is None or not 1 <= int(match[2]) <= MAX_ROW:
        raise ValueError(f"'{name:.20}' is no cell")
    return int(match[2]), column_number(match[1])


def area_of(name: str) -> Area:
    """Return the rectangle of a reference to one cell or to several.

    Raises:
        ValueError: no area is called so.
    """
    first, _, last = name.partition(":")
    (top, left), (bottom, right) = cell_of(first), cell_of(last or first)
    return Area(min(top, bottom), min(left, right), max(top, bottom), max(left, right))
