"""Rates that somebody typed as money: the number apart from its currency, and one currency in all of them."""

from collections.abc import Sequence

from asbuilt_bim.bim.cost_units import currency_of, currency_there, parted_money
from asbuilt_bim.storage.table_file import Cells, TableRow

_SAID = "currency of the rate"
"""Where a row keeps the currency that stood beside its rate; no heading is called so."""


def parted_rate(cells: Cells) -> Cells:
    """Return a row's cells with the rate as a number alone, and its currency in a cell of its own."""
    rate = cells.get("rate", "")
    if not isinstance(rate, str):
        return cells
    number, said = parted_money(rate)
    return {**cells, "rate": number, _SAID: said}


def currencies_in(rows: Sequence[TableRow], faults: list[str]) -> dict[int, str]:
    """Return the currency of each row as it is written, by the row's number; "" where nothing says one.

    A row's own cell says it, else what stands beside its rate, else what stands beside the others'. Two currencies
    beside rates are a fault, and one that the row's cell contradicts.
    """
    found: dict[int, str] = {}
    first: tuple[int, str] | None = None
    for row in rows:
        cell, said = row.text("currency").strip(), row.text(_SAID)
        found[row.number] = cell or said
        if said and cell and currency_there(said, currency_of(cell)) != currency_of(cell):
            faults.append(f"row {row.number}: its rate is in {said}, its currency is {cell:.10}; correct one of them")
        elif said:
            said = cell or said  # `$45` is 45 CAD where its cell says so
        if said and first is None:
            first = row.number, said
        if said and first is not None and currency_of(said) != currency_of(first[1]):
            faults.append(
                f"row {row.number}: its rate is in {said}, that of row {first[0]} in {first[1]}; write rates without, "
                "and the currency of each row into a column currency"
            )
    return {number: own or (first[1] if first else "") for number, own in found.items()}
