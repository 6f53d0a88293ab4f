"""Says in words what persons decided otherwise since an earlier result: certificates, overrides, rates, variations."""

from collections.abc import Iterator, Mapping

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.revision import element_label
from asbuilt_bim.progress.valuation.inputs import (
    NO_INPUTS,
    Certificate,
    Observation,
    Override,
    RateChange,
    ValuationInputs,
    Variation,
)
from asbuilt_bim.report.wording.values import number, percent, plain, rate, unit_sign


def decision_changes(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Yield a line for each decision of a person that came, went, or is another, with the name that stands there."""
    names = {one.global_id: element_label(one) for report in (before, after) for one in report.elements}
    items = {one.global_id: plain(one.identification or one.name) for r in (before, after) for one in r.cost_lines}
    for was, now in zip(_told(before, names, items), _told(after, names, items), strict=True):
        for what in (*was, *(key for key in now if key not in was)):
            if what not in was:
                yield f"{what}: new, {now[what]}"
            elif what not in now:
                yield f"{what}: no longer there, was {was[what]}"
            elif was[what] != now[what]:
                yield f"{what}: {was[what]} -> {now[what]}"


def _told(report: ProgressReport, names: Mapping[str, str], items: Mapping[str, str]) -> tuple[Mapping[str, str], ...]:
    """Return what each decision is of, and what it says; kind by kind."""
    known: ValuationInputs = report.valuation or NO_INPUTS
    return (
        {f"valuation {one.number}": _signed(one) for one in known.certificates},
        {
            f"override of {names.get(one.element, 'what is not measured')}, item {items.get(one.line, one.line)}": (
                _override(one)
            )
            for one in known.overrides
        },
        {f"rate of item {items.get(one.line, one.line)}, by hand": _rate(one) for one in known.rates},
        {f"variation {plain(one.number)}": _variation(one) for one in known.variations},
        {
            f"observation of {names.get(one.element, one.element)}, {one.day.isoformat()}": _observation(one)
            for one in report.observations
        },
        {"observations": "count where no photo shows anything" if known.count_observations else "are only shown"},
    )


def _signed(one: Certificate) -> str:
    return f"signed {one.signed_on.isoformat()} by {plain(one.signed_by)}"


def _override(one: Override) -> str:
    return f"{percent(one.share)} ({_by(one.by, one.day.isoformat() if one.day else '', one.reason)})"


def _rate(one: RateChange) -> str:
    return f"{rate(one.rate)} ({plain(one.why) or 'no reason'})"


def _variation(one: Variation) -> str:
    worth = f"{number(one.quantity, 3)} {unit_sign(one.unit)} x {rate(one.rate)}, {percent(one.share)} done"
    return f"{worth} ({_by(one.by, one.order, one.text)})"


def _observation(one: Observation) -> str:
    return f"{percent(one.share)} ({_by(one.by, one.why)})"


def _by(who: str, *more: str) -> str:
    return ", ".join(filter(None, (plain(who) or "nobody's name", *map(plain, more))))
