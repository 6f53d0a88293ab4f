"""What is said above the faults of a visit, and of earlier ones: words that pages and workbook share."""

from collections.abc import Sequence
from datetime import date

from asbuilt_bim.report.wording.values import day as written
from asbuilt_bim.report.wording.words import Words

NOT_CLEAR = "Nobody should be paid by these numbers before this is clear"
WRONG_BEFORE = "An earlier visit is known to be wrong: clear this before anybody is paid"


def before_words(faults: Sequence[tuple[date, Words]]) -> list[str]:
    """Say what is wrong with earlier visits, each with its day."""
    return [f"Visit of {written(day)}: {words}" for day, words in faults]
