"""Holds what formulas gave when a workbook was saved against its own quantities, overrides, rates and sums."""

import math
from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.progress.money import cents, certified_quantity, total
from asbuilt_bim.progress.valuation.bill import whole_share
from asbuilt_bim.progress.valuation.inputs import ValuationInputs
from asbuilt_bim.report.workbook.layout import PARTS, VALUATION
from asbuilt_bim.report.workbook.read_cells import AGAIN, Row, number_of, plain_of, text_of
from asbuilt_bim.storage.xlsx_file import XlsxCell


def check_parts(lines: Sequence[Row], parts: Sequence[Row], path: Path) -> None:
    """Hold each line's certified quantity against its rows of Cost by element, and these against their overrides.

    Raises:
        WorkbookError: they differ: it was saved before it had calculated, or a formula was written over.
    """
    sums: dict[XlsxCell, float] = {}
    kinds = {row["No."]: _kind(row, path) for row in lines}
    for row in parts:
        item = f"{text_of(row, 'Item')} {text_of(row, 'Element')}".strip()
        counts, given = number_of(row, "Counts", path, item), plain_of(row.get("Override"))
        pieces, off = kinds.get(row["No."], (False, False))
        if given is not None and counts != whole_share(given, pieces=pieces, takes_off=off):
            raise WorkbookError(f"{path}: {item}: {counts:.1%} counts, and its override is {given:.1%}; {AGAIN}")
        sums[row["No."]] = sums.get(row["No."], 0.0) + number_of(row, "Quantity", path, item) * counts
    for row in lines:
        item, own = text_of(row, "Item") or text_of(row, "Key"), sums.get(row["No."], 0.0)
        planned = number_of(row, "Contract quantity", path, item)
        certified = number_of(row, "Certified quantity", path, item)
        pieces, off = kinds[row["No."]]
        if not math.isclose(certified, certified_quantity(own, planned, pieces=pieces, up=off), rel_tol=1e-9):
            raise WorkbookError(
                f"{path}: item {item}: {certified:g} is certified, and its rows of '{PARTS}' come to {own:g}; {AGAIN}"
                ". To certify another value, write an override there"
            )


def _kind(row: Row, path: Path) -> tuple[bool, bool]:
    """Say of a line whether only whole pieces count, and whether it takes money off."""
    item = text_of(row, "Item") or text_of(row, "Key")
    worth = number_of(row, "Contract quantity", path, item) * number_of(row, "Rate", path, item)
    return text_of(row, "In pieces") == "yes", worth < 0.0


def check_sums(inputs: ValuationInputs, path: Path, *, signed: bool) -> None:
    """Hold the sums that were certified against their lines, and what stands as previous against the certificate.

    Raises:
        WorkbookError: they differ: it was saved before it had calculated, or a row was taken out.
    """
    work = total(one.amount for one in inputs.paid)
    variations = total(inputs.paid_variations.values())
    sums = total(one.work for one in inputs.before), total(one.variations for one in inputs.before)
    for what, lines, summed in (("work", work, sums[0]), ("variations", variations, sums[1])):
        if lines != summed:
            raise WorkbookError(f"{path}: {what}: '{VALUATION}' says {summed:,.2f}, its lines {lines:,.2f}; {AGAIN}")
    last = inputs.certificates[-1] if inputs.certificates else None
    if last is None or signed:
        _check_variations(inputs, path, signed)
        return
    for what, lines, before in (
        ("work", work, total(one.work for one in last.totals)),
        ("variations", variations, total(one.variations for one in last.totals)),
    ):
        if lines != before:
            raise WorkbookError(
                f"{path}: {what}: the previous amounts add up to {lines:,.2f}, and valuation {last.number} certified "
                f"{before:,.2f}; put back the rows that were taken out (set what isn't done to 0 %)"
            )


def _check_variations(inputs: ValuationInputs, path: Path, signed: bool) -> None:
    for one in inputs.variations if signed else ():
        amount = cents(cents(one.quantity * one.rate) * one.share)
        if amount != inputs.paid_variations.get(one.number, 0.0):
            raise WorkbookError(f"{path}: variation {one.number} isn't quantity x rate x done; {AGAIN}")
