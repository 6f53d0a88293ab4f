"""The valuation in LibreOffice: every formula, three periods in a row, costs from three sources, and how it grows.

python benchmarks/valuation/valuation.py --check

Needs `soffice` on the PATH for what is recalculated; without it those lines are missing.
"""

from __future__ import annotations

import csv
import math
import random
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

import openpyxl
from hypothesis import given, settings

from asbuilt_bim.bim.model import BimModel, CostLine
from asbuilt_bim.codes import Reason
from asbuilt_bim.flow.design_source import with_costs_table
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.progress.completion.earned_value import cost_progress
from asbuilt_bim.progress.money import total
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, bills
from asbuilt_bim.progress.valuation.inputs import Terms, ValuationInputs
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.workbook.read import read_last_workbook
from asbuilt_bim.report.workbook.write import write_workbook
from asbuilt_bim.scale.cache import Cache
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told, unjudged
from benchmarks.valuation.made import FIRST, UNITS, Seen, cost_line, element, made_report, some_seen
from benchmarks.valuation.office import SOFFICE, compared, converted, recalculated
from benchmarks.valuation.sequences import LINES, PERIODS, check_sequence

WALL = "wall-000000"
START = ValuationInputs(terms=Terms(retention=0.05, tax=0.19))
GROWTH = 1.15
"""The exponent of the time against the size; 1 is linear."""


def made_lines(dice: random.Random, keys: Sequence[str], count: int) -> list[CostLine]:
    """Make lines that share the elements out among them, some with slabs; the fourth takes money off."""
    lines = []
    for index in range(count):
        own = keys[index::count] or keys[:1]
        quantity = round(dice.uniform(0.4, 400.0), dice.choice((0, 2, 3, 4)))
        rate = round(dice.uniform(0.5, 900.0), dice.choice((2, 2, 3)))
        made = cost_line(f"{index + 1:02d}", index % len(UNITS), quantity, rate, own, others=int(index % 7 == 6))
        lines.append(replace(made, rate=-made.rate) if index == 3 else made)
    return lines


def period_edits(number: int, day: date) -> dict[tuple[str, str, int], object]:
    """Return what a surveyor writes into the workbook of a period: an override, a rate, a variation, the signature."""
    edits: dict[tuple[str, str, int], object] = {
        ("", "signed_by", -1): "A. Surveyor",
        ("", "signed_on", -1): day + timedelta(days=3),
    }
    if number == 1:
        row = {"Override": 0.355, "Reason": "Measured by tape", "By": "A. Surveyor", "Date": day}
        edits |= {("Cost by element", key, 2): value for key, value in row.items()}
        edits |= {("Bill", "Rate", 1): 77.77, ("Bill", "Rate: why, by whom", 1): "agreed on site, A. Surveyor"}
    if number == 2:
        row = {"No.": "V1", "Text": "Opening closed", "Unit": "m3", "Quantity": 3.5, "Rate": 100.01, "Done": 0.5}
        edits |= {("Variations", key, 0): value for key, value in row.items()}
    if number == 3:
        edits[("Variations", "Done", 0)] = 1.0
    return edits


def three_periods(folder: Path, dice: random.Random) -> list[Line]:
    """Value three visits in a row, each workbook changed, recalculated and signed in LibreOffice and read back."""
    keys = [WALL, *(f"element-{index:06d}" for index in range(60))]
    lines = made_lines(dice, keys, 12)
    seen: dict[str, Seen] = {key: some_seen(dice) for key in keys} | {WALL: Seen(lower=1.0, best=1.0, upper=1.0)}
    inputs, formulas, errors, differ = START, 0, list[str](), list[str]()
    wrong: list[str] = []
    periods: dict[str, list[float]] = {}
    falls = 0
    made: ProgressReport | None = None
    for number in range(1, 4):
        day = FIRST + timedelta(days=14 * number)
        if number > 1:
            seen = {key: _grown(one, some_seen(dice)) for key, one in seen.items()}
        if number == 3:
            seen[WALL] = Seen(lower=0.0, best=0.0, upper=0.0)  # it was torn down
        made = made_report(seen, lines, day, inputs)
        falls += sum(note.code is Reason.CERTIFIED_FALLS for note in made.notes)
        path = folder / f"period{number}.xlsx"
        write_workbook(made, path)
        untouched = compared(path, recalculated(path, folder / f"bare{number}"))
        formulas += untouched.formulas
        errors += untouched.errors
        differ += untouched.differ
        signed = recalculated(path, folder / f"signed{number}", period_edits(number, day))
        last = read_last_workbook(signed)
        before = (inputs.certificates, inputs.before, inputs.paid, inputs.paid_variations)
        names = ("certificates", "before", "paid", "paid_variations")
        changed = replace(last.inputs, **dict(zip(names, before, strict=True)))  # type: ignore[arg-type]
        told_by_us = bills(made_report(seen, lines, day, changed))
        wrong += _compared_sums(told_by_us, last.inputs)
        for bill in told_by_us:
            for one in bill.lines:
                periods.setdefault(one.line.identification, []).append(one.period)
            for what in ("work", "variations", "retention", "tax"):
                periods.setdefault(what, []).append(float(getattr(bill.period, what)))
        inputs = last.inputs
    paid = {one.identification: one.amount for one in inputs.paid}
    sums = inputs.before[0]
    paid |= {what: float(getattr(sums, what)) for what in ("work", "variations", "retention", "tax")}
    unequal = [key for key, values in periods.items() if total(values) != paid.get(key, 0.0)]
    return [
        line("formulas that give an error", str(len(errors)), "0", formulas, not errors),
        line("formulas that give another value than ours", str(len(differ)), "0", formulas, not differ),
        line("sums that LibreOffice and we see otherwise", str(len(wrong)), "0", 12, not wrong, least_n=12),
        line(
            "lines and sums whose periods don't add up", str(len(unequal)), "0", len(periods), not unequal, least_n=12
        ),
        line("amounts that fell and were named", str(falls), "1 or more", 1, falls > 0, least_n=1),
        *[told(f"  {text}", "", 1) for text in (*errors[:5], *differ[:5], *wrong[:5], *unequal[:5])],
    ]


def _grown(before: Seen, now: Seen) -> Seen:
    """Return what is known after another visit: concrete stays, whatever a visit didn't see of it."""
    lower = max(before.lower, now.lower)
    best = None if now.best is None else max(now.best, lower)
    return Seen(lower=lower, best=best, upper=max(now.upper, lower, best or 0.0))


def _compared_sums(made: Sequence[Bill], read: ValuationInputs) -> list[str]:
    """Compare what we work out after a surveyor's changes with what LibreOffice did."""
    wrong = []
    for bill, sums in zip(made, read.before, strict=True):
        for what in ("work", "variations", "retention", "tax"):
            own, other = float(getattr(bill.cumulative, what)), float(getattr(sums, what))
            if own != other:
                wrong.append(f"{what}: {own} and {other}")
    return wrong


def three_sources(folder: Path) -> list[Line]:
    """Price the sample by its IFC cost items, and by the same lines as CSV and as .xlsx."""
    project = read_project(SAMPLE / "project.yaml")
    design = read_design(project.ifc)
    rows: list[list[object]] = [["item", "text", "unit", "quantity", "rate", "globalids"]]
    rows += [
        [one.identification, one.name, one.unit, one.planned_quantity, one.rate, " ".join(one.elements)]
        for one in design.cost_lines
    ]
    with (folder / "boq.csv").open("w", newline="", encoding="utf-8-sig") as file:
        csv.writer(file).writerows(rows)
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)  # type: ignore[union-attr]
    book.save(folder / "boq.xlsx")
    by_rule = folder / "rules.csv"
    by_rule.write_text(_by_rules(design), encoding="utf-8")
    dice = random.Random(7)
    seen = {one.global_id: element(one.global_id, some_seen(dice), FIRST, one.kind) for one in design.elements}
    bodies = {one.global_id: one for one in design.elements}

    def totals(priced: BimModel) -> tuple[float, float, float]:
        done = [cost_progress(one, bodies, seen, ProgressOptions()) for one in priced.cost_lines]
        best = total(one.earned_best or 0.0 for one in done)
        return total(one.planned_value for one in done), total(one.earned_lower for one in done), best

    own, lines = totals(design), []
    for name in ("boq.csv", "boq.xlsx", "rules.csv"):
        priced = with_costs_table(design, replace(project, costs=folder / name), Cache(folder=None))
        same = totals(priced) == own
        figure = f"{totals(priced)[1]:,.2f} of {own[1]:,.2f}"
        lines.append(line(f"certain total by {name}", figure, "the same", len(priced.cost_lines), same, least_n=4))
    return lines


def _by_rules(design: BimModel) -> str:
    """Return the sample's lines with what they cover by class and storey, and by a selector."""
    kinds = {one.global_id: one.kind for one in design.elements}
    names = {one.global_id: one.storey for one in design.elements}
    storeys = {one.global_id: one.name for one in design.storeys}
    text = "item,text,unit,quantity,rate,selector,class,storey\n"
    for one in design.cost_lines:
        storey = storeys[names[one.elements[0]]]
        columns = {kinds[key] for key in one.elements} == {"column"}
        rule = (
            f',IfcColumn,"{storey}"'
            if columns
            else f'"IfcWall, location=""{storey}"" + IfcColumn, location=""{storey}""",,'
        )
        text += f'{one.identification},"{one.name}",{one.unit},{one.planned_quantity!r},{one.rate!r},{rule}\n'
    return text


def growth(folder: Path, sizes: Sequence[tuple[int, int]], *, office: bool) -> list[Line]:
    """Write workbooks of more and more elements and lines; LibreOffice opens the largest and works it out."""
    dice = random.Random(3)
    seconds: list[float] = []
    for elements, count in sizes:
        keys = [f"element-{index:06d}" for index in range(elements)]
        made = made_report({key: some_seen(dice) for key in keys}, made_lines(dice, keys, count), FIRST, START)
        start = time.process_time()
        write_workbook(made, folder / "large.xlsx")
        seconds.append(time.process_time() - start)
    exponent = math.log(seconds[-1] / seconds[0]) / math.log(sizes[-1][0] / sizes[0][0])
    figure = ", ".join(f"{one:.1f} s" for one in seconds)
    n = sizes[-1][0]
    lines = [
        told(f"writing {' / '.join(str(one) for one, _ in sizes)} elements", figure, n),
        line("exponent of its time", f"{exponent:.2f}", f"at most {GROWTH}", n, exponent <= GROWTH),
    ]
    start = time.process_time()
    read_last_workbook(folder / "large.xlsx")
    lines.append(told("reading it back", f"{time.process_time() - start:.1f} s", n))
    if office and SOFFICE:
        start = time.perf_counter()
        opened = converted(folder / "large.xlsx", "ods", folder / "ods")
        seconds_open = time.perf_counter() - start
        start = time.perf_counter()
        again = recalculated(folder / "large.xlsx", folder / "again")
        found = compared(folder / "large.xlsx", again)
        bad = len(found.errors) + len(found.differ)
        lines += [
            line("LibreOffice opens and saves it", f"{seconds_open:.0f} s", "it does", n, opened.is_file()),
            line("its formulas worked out anew, wrong ones", str(bad), "0", found.formulas, not bad),
            told("  taking", f"{time.perf_counter() - start:.0f} s", n),
        ]
    return lines


def sequences(count: int) -> list[Line]:
    """Value random sequences of periods."""
    done = 0

    @settings(max_examples=count, deadline=None, database=None, derandomize=True)
    @given(LINES, PERIODS)
    def each(drawn: list[tuple[int, float, float, list[str], int]], periods: list[tuple[object, ...]]) -> None:
        nonlocal done
        check_sequence(drawn, periods)
        done += 1

    wrong = "0"
    try:
        each()
    except AssertionError as problem:
        wrong = f"1: {problem!s:.80}"
    return [line("random sequences of periods that don't add up", wrong, "0", done, wrong == "0")]


def main() -> int:
    """Print the table."""
    args = options((__doc__ or "").splitlines()[0]).parse_args()
    sizes = [(500, 75), (1000, 150)] if args.quick else [(2_500, 375), (5_000, 750), (10_000, 1_500), (20_000, 3_000)]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        lines = [*three_sources(folder), *sequences(100 if args.quick else 2000)]
        if SOFFICE:
            lines += three_periods(folder, random.Random(11))
        else:
            print("soffice isn't here: nothing is recalculated")
        grown = growth(folder, sizes, office=not args.quick)
        lines += unjudged(grown) if args.quick else grown
    return report("The valuation", lines, args)


if __name__ == "__main__":
    sys.exit(main())
