"""Where things stand in the workbook: what writes it and what reads it back agree here."""

from collections.abc import Sequence

from asbuilt_bim.report.wording.of_workbook.columns import Column

VALUATION, BILL, PARTS = "Valuation", "Bill", "Cost by element"
VARIATIONS, CERTIFICATES, OBSERVATIONS = "Variations", "Certificates", "Observations"
PER_DESIGN = "Contract per design"
"""The column of Bill that the next valuation is held to."""
HEAD = 3
"""The row of the headings (from 0) of every sheet of the valuation; its title stands above."""
SPARE_VARIATIONS = 12
"""Empty rows for new variations; whoever needs more types below them, or copies one there."""
FORMAT_NAME, FORMAT = "asbuilt_bim_valuation", 1
"""The named cell that says that a workbook is ours, and of which version."""
COLUMNS = ("previous", "this_period", "cumulative")
"""`net_this_period_1` is the named cell of bill 1's net of this period; and so on for all sums and columns."""


def letter(columns: Sequence[Column], heading: str) -> str:
    """Return the letter of a column by its heading."""
    return letter_of(next(index for index, column in enumerate(columns) if column.heading == heading))


def letter_of(index: int) -> str:
    """Return the letters of a column from its number (from 0)."""
    text = ""
    index += 1
    while index:
        index, rest = divmod(index - 1, 26)
        text = chr(65 + rest) + text
    return text


def sum_name(what: str, column: str, bill: int) -> str:
    """Return the name of a cell of a bill's summary."""
    return f"{what}_{column}_{bill}"
