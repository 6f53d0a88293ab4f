"""Random sequences of periods, and what has to hold of each: persons and photos say what they like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date, timedelta

from hypothesis import strategies as st

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.money import total
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import (
    BillTotals,
    Certificate,
    Observation,
    Override,
    Paid,
    RateChange,
    Terms,
    ValuationInputs,
    Variation,
)
from benchmarks.valuation.made import FIRST, UNSEEN, Seen, cost_line, made_report

WHOLE = Seen(lower=1.0, best=1.0, upper=1.0)
NONE = Seen(lower=0.0, best=0.0, upper=0.0)
FALLS = {Reason.CERTIFIED_FALLS, Reason.CERTIFIED_LINE_GONE}


def signed(report: ProgressReport) -> ValuationInputs:
    """Return what the next valuation begins with after this one was signed: what reading the workbook gives."""
    inputs, made = report.valuation or ValuationInputs(), bills(report)
    sums = tuple(
        BillTotals(
            bill=bill.number, currency=bill.currency, work=bill.cumulative.work, variations=bill.cumulative.variations,
            retention=bill.cumulative.retention, tax=bill.cumulative.tax,
        )
        for bill in made
    )  # fmt: skip
    one = Certificate(
        number=inputs.number, visit=report.visit_date, signed_by="A", signed_on=report.visit_date, totals=sums
    )
    paid = tuple(
        Paid(
            line=line.line.global_id, identification=line.line.identification, text=line.line.name,
            unit=line.line.unit, rate=line.rate, quantity=line.quantity, amount=line.amount, bill=bill.number,
            contract=0.0 if line.gone else line.line.planned_quantity, per_design=line.per_design,
            elements={row.global_id: row.element.name for row in line.rows if row.element},
            quantities={row.global_id: row.quantity for row in line.rows if row.element},
        )
        for bill in made
        for line in bill.lines
        if line.quantity or line.amount or any(row.element for row in line.rows)
    )  # fmt: skip
    variations = {one.variation.number: one.certified for bill in made for one in bill.variations}
    certificates = (*inputs.certificates, one)
    return replace(
        inputs,
        certificates=certificates,
        before=sums,
        paid=paid,
        paid_variations=variations,
        signed_terms=inputs.terms,
    )


SHARES = st.integers(0, 10**9).map(lambda n: n / 1e9)
SEENS = st.one_of(
    st.sampled_from([UNSEEN, WHOLE, NONE]),
    st.tuples(SHARES, SHARES, SHARES).map(sorted).map(lambda s: Seen(lower=s[0], best=s[1], upper=s[2])),
)
KEYS = ("a", "b", "c", "d")
LINES = st.lists(
    st.tuples(
        st.integers(0, 4),
        st.integers(0, 10**7).map(lambda n: n / 1e4),
        st.integers(-(10**6), 10**8).map(lambda n: n / 1e3),
        st.lists(st.sampled_from(KEYS), unique=True, max_size=4),
        st.integers(0, 2),
    ),
    min_size=1,
    max_size=4,
)
PERIODS = st.lists(
    st.tuples(
        st.lists(SEENS, min_size=4, max_size=4),
        st.lists(st.tuples(st.integers(0, 3), st.sampled_from(("", *KEYS)), SHARES), max_size=2),  # overrides
        st.lists(st.tuples(st.integers(0, 3), st.integers(-(10**5), 10**6).map(lambda n: n / 1e2)), max_size=1),
        st.lists(st.tuples(st.sampled_from(KEYS), SHARES, st.integers(-9, 3)), max_size=2),  # observations
        st.lists(st.tuples(st.integers(-500, 500).map(lambda n: n / 10), SHARES), max_size=2),  # variations
        st.booleans(),
        st.integers(0, 3),
    ),
    min_size=2,
    max_size=5,
)


def made_lines(drawn: Sequence[tuple[int, float, float, list[str], int]]) -> list[CostLine]:
    """Make the cost lines that were drawn."""
    return [cost_line(str(n), unit, qty, rate, keys, others) for n, (unit, qty, rate, keys, others) in enumerate(drawn)]


def with_persons(
    inputs: ValuationInputs, period: tuple[object, ...], lines: Sequence[CostLine]
) -> tuple[ValuationInputs, list[Observation]]:
    """Return what persons add in a period."""
    _, overrides, rates, looks, variations, counts, _ = period
    keys = [line.global_id for line in lines]
    more = tuple(
        Override(line=keys[n % len(keys)], element=element, share=share, reason="r", by="B", day=FIRST)
        for n, element, share in overrides  # type: ignore[attr-defined]
    )
    changed = tuple(RateChange(line=keys[n % len(keys)], rate=rate, why="w") for n, rate in rates)  # type: ignore[attr-defined]
    known = {one.number: one for one in inputs.variations}
    for n, (quantity, share) in enumerate(variations):  # type: ignore[arg-type,var-annotated]
        known[f"V{n}"] = Variation(
            number=f"V{n}", text="", order="", unit="m3", quantity=quantity, rate=10.01, share=share, by="B"
        )
    days = [FIRST + timedelta(days=days) for _, _, days in looks]  # type: ignore[attr-defined]
    seen = [
        Observation(element=key, day=day, share=share, by="B", why="")
        for (key, share, _), day in zip(looks, days, strict=True)  # type: ignore[call-overload]
    ]
    kept = replace(
        inputs, overrides=(*inputs.overrides, *more), rates=(*changed, *inputs.rates),
        variations=tuple(known.values()), count_observations=bool(counts), terms=Terms(retention=0.05, tax=0.19),
    )  # fmt: skip
    return kept, seen


def check_sequence(drawn: list[tuple[int, float, float, list[str], int]], periods: list[tuple[object, ...]]) -> None:
    """Value one period after the other; periods add up, nothing exceeds the contract, nobody pays what nobody saw."""
    inputs, sums = ValuationInputs(), dict[str, list[float]]()
    day: date = FIRST
    for number, period in enumerate(periods):
        lines = made_lines(drawn)[int(str(period[6])) % len(drawn) :]  # lines come and go
        inputs, looks = with_persons(inputs, period, lines)
        seen = dict(zip(KEYS, period[0], strict=True))  # type: ignore[call-overload]
        report = made_report(seen, lines, day + timedelta(days=number), inputs, looks)
        for bill in bills(report):
            for line in bill.lines:
                sums.setdefault(line.line.identification, []).append(line.period)
                assert total(sums[line.line.identification]) == line.amount
                assert abs(line.quantity) <= abs(line.line.planned_quantity)
                assert abs(line.amount) <= abs(line.contract)
                for row in line.rows:
                    person = row.override is not None or (inputs.count_observations and row.observed is not None)
                    certain = row.element is not None and row.element.completion.coverage > 0.0
                    assert row.share == 0.0 or person or certain or line.line.planned_quantity * line.rate < 0.0
                named = {note.subject.name for note in report.notes if note.code in FALLS}
                assert not line.falls or line.line.global_id in named
            for what in ("work", "variations", "retention", "tax", "gross", "net", "payable"):
                sums.setdefault(what, []).append(float(getattr(bill.period, what)))
                assert total(sums[what]) == float(getattr(bill.cumulative, what)), what
        inputs = signed(report)
