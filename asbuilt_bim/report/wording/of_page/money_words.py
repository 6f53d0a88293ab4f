"""Since when money is due, and what is kept back of it: words that page and workbook share."""

from asbuilt_bim.progress.valuation.inputs import Certificate, Terms
from asbuilt_bim.report.wording.values import day

NOT_SET = "not set"
FIRST = "none: this period is everything since the start"


def period_words(last: Certificate | None, *, paid_before: bool) -> str:
    """Say since when a period runs: since what was signed last, else since the start."""
    if last is not None:
        return f"since valuation {last.number}, signed {day(last.signed_on)}"
    if paid_before:
        return "since what was certified before; no valuation was signed here yet"
    return "everything since the start, as no valuation was signed yet"


def terms_words(terms: Terms) -> str:
    """Say what retention and tax are in what is due; an unset one is named, and is never a silent 0."""
    kept = f"after {100 * terms.retention:g} % retention" if terms.retention else ""
    taxed = f"with {100 * terms.tax:g} % tax" if terms.tax else ""
    unset = [name for name, share in (("retention", terms.retention), ("tax", terms.tax)) if not share]
    missing = f"{' and '.join(unset)} {NOT_SET}" if unset else ""
    return ", ".join(part for part in (" and ".join(part for part in (kept, taxed) if part), missing) if part)
