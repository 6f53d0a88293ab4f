"""Since when money is due, and what is kept back of it: words that page and workbook share."""

from asbuilt_bim.progress.valuation.inputs import Certificate, Terms
from asbuilt_bim.report.by_persons import ByPersons
from asbuilt_bim.report.wording.values import day, number, plain

NOT_SET = "not set"
WHERE_SET = "write them on the sheet Valuation of quantities.xlsx"
MOST_NAMED = 6
"""So many elements stand by name beside a person."""
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
    missing = f"{' and '.join(unset)} {NOT_SET} ({WHERE_SET})" if unset else ""
    return ", ".join(part for part in (" and ".join(part for part in (kept, taxed) if part), missing) if part)


def rests_words(one: ByPersons, variations: float, currency: str) -> str:
    """Say how much of what is certified rests on photos, and how much on what which person saw or wrote; "" if none."""
    if not (one.is_theirs or variations):
        return ""
    who = " and ".join(f"{plain(name)} saw ({names_words(elements)})" for name, elements in one.seen_by.items())
    told = [f"{number(one.seen)} on what {who}"] if who else []
    others = (one.overridden, "on overrides"), (one.rates, "on changed rates"), (variations, "on variations")
    told += [f"{number(amount)} {what}" for amount, what in others if amount]
    return f"{number(one.photos)} {plain(currency)}".rstrip() + f" rest on photos, {', '.join(told)}"


def names_words(names: tuple[str, ...]) -> str:
    """Name the first few of several things."""
    more = len(names) - MOST_NAMED
    return ", ".join(map(plain, names[:MOST_NAMED])) + (f" and {more} more" if more > 0 else "")
