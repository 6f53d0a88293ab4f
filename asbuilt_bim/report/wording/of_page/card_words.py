"""What an element's card says of its money."""

from asbuilt_bim.progress.report import CostProgress
from asbuilt_bim.report.wording.values import number, plain


def worth_words(line: CostProgress, worth: float, certain: float) -> str:
    """Say what an element is worth in a cost line when it is finished, and how much of that is certain."""
    name = " ".join(part for part in (plain(line.identification), plain(line.name)) if part) or line.global_id
    money = " ".join(part for part in (number(worth), plain(line.currency)) if part)
    return f"{name}: {money} when it is finished, {number(certain)} of it certain"
