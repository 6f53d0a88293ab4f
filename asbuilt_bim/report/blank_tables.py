"""Tables to fill in, for costs, schedule and observations: every wall and column of a design in its row."""

from collections.abc import Callable
from dataclasses import dataclass

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.report.csv import CsvForm, number, safe_cell, table_text

COSTS, SCHEDULE, OBSERVATIONS = "costs.csv", "schedule.csv", "observations.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """An element as a table names it."""

    number: int
    element: BimElement
    storey: str


def blank_tables(design: BimModel, form: CsvForm = "comma") -> dict[str, bytes]:
    """Return by file name the three tables as CSV: UTF-8 with mark.

    Columns that begin with `info` are for the person alone; nothing reads them.
    """
    names = {storey.global_id: storey.name for storey in design.storeys}
    order = {storey.global_id: index for index, storey in enumerate(design.storeys)}
    elements = sorted(design.elements, key=lambda e: (order.get(e.storey, len(order)), e.ifc_class, e.name))
    rows = [_Row(number=n, element=e, storey=names.get(e.storey, "")) for n, e in enumerate(elements, 1)]
    return {name: table_text(columns, rows, form).encode("utf-8-sig") for name, columns in _TABLES.items()}


def _empty(row: _Row) -> str:
    return ""


_KNOWN: dict[str, Callable[[_Row], str]] = {
    "info name": lambda row: safe_cell(row.element.name),
    "info storey": lambda row: safe_cell(row.storey),
    "info class": lambda row: safe_cell(row.element.ifc_class),
}
_TABLES: dict[str, dict[str, Callable[[_Row], str]]] = {
    COSTS: {
        **dict.fromkeys(("item", "text", "unit", "quantity", "rate", "currency"), _empty),
        "globalids": lambda row: safe_cell(row.element.global_id),
        **dict.fromkeys(("selector", "class", "storey", "type"), _empty),
        **_KNOWN,
        "info volume m3": lambda row: number(row.element.volume_m3),
        "info exposed area m2": lambda row: number(row.element.exposed_area_m2),
        "info length m": lambda row: number(row.element.length_m),
        "info height m": lambda row: number(row.element.height_m),
    },
    SCHEDULE: {
        "id": lambda row: f"E{row.number}",
        "name": lambda row: safe_cell(row.element.name or row.element.global_id),
        "start": _empty,
        "finish": _empty,
        "globalids": lambda row: safe_cell(row.element.global_id),
        "info storey": _KNOWN["info storey"],
        "info class": _KNOWN["info class"],
    },
    OBSERVATIONS: {
        "element": lambda row: safe_cell(row.element.global_id),
        **dict.fromkeys(("date", "state", "percent", "by", "why"), _empty),
        **_KNOWN,
    },
}
