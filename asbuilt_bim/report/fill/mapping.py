"""`map.yaml`: which column of which sheet holds the key of a row, and which columns get which quantity."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from asbuilt_bim.errors import FillError, ProjectError
from asbuilt_bim.report.fill.quantities import OF_BILL_LINES, OF_COST_LINES, OF_ELEMENTS, OF_GROUPS
from asbuilt_bim.report.fill.references import MAX_ROW, column_number
from asbuilt_bim.storage.strict_yaml import read_yaml
from asbuilt_bim.storage.structure import Problems, structure

REMEDY = "schemas/map-1.json and docs/fill.md say what a map holds"


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyColumns:
    """The columns that say what a row is about: a GlobalId, or a cost code, or class and storey (and type)."""

    global_id: str = ""
    cost_code: str = ""
    ifc_class: str = ""
    storey: str = ""
    type_name: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the columns that are named, in this order."""
        named = (self.global_id, self.cost_code, self.ifc_class, self.storey, self.type_name)
        return tuple(column for column in named if column)


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMap:
    """Rows of one sheet that have the same kind of key."""

    sheet: str
    key: KeyColumns
    columns: dict[str, str]  # column -> quantity
    first_row: int = 2
    last_row: int = MAX_ROW
    schedule: str = ""  # of the cost schedules that have the same codes, the one that counts
    unit: str = ""  # the column that says a cost line's unit, to be held against the result's


@dataclass(frozen=True, slots=True, kw_only=True)
class FillMap:
    """A map as it is written."""

    format: Literal["asbuilt-bim/map"]
    version: Literal[1]
    tables: tuple[TableMap, ...]
    unknown: Literal["empty", "word"] = "empty"  # what a cell gets of which nothing is known

    @property
    def of_valuation(self) -> bool:
        """Say whether a column gets what only the valuation says, with overrides and changed rates."""
        return any(name in OF_BILL_LINES for table in self.tables for name in table.columns.values())


def read_map(path: Path) -> FillMap:
    """Read and check a map.

    Raises:
        FillError: with every mistake in it, each with its line.
    """
    try:
        document = read_yaml(path)
    except ProjectError as problem:
        raise FillError(str(problem)) from problem
    problems = Problems()
    found: FillMap | None = structure(document.value, FillMap, problems)
    if found is not None and not problems.found:
        if not found.tables:
            problems.add("tables", "name at least one table")
        for number, table in enumerate(found.tables):
            _check(table, f"tables[{number}]", problems)
    if found is None or problems.found:
        lines = [_line(one.path, document.lines) + f"{one.path or 'the file'}: {one.text}" for one in problems.found]
        raise FillError(f"{path}:\n" + "\n".join(f"  {line}" for line in lines) + f"\n  ({REMEDY})")
    return found


def quantities_of(key: KeyColumns) -> tuple[str, ...]:
    """Return what rows of a kind of key can get."""
    if key.cost_code:
        return (*OF_COST_LINES, *OF_BILL_LINES)
    return tuple(OF_ELEMENTS if key.global_id else OF_GROUPS)


def _check(table: TableMap, where: str, problems: Problems) -> None:
    key = table.key
    group = bool(key.ifc_class and key.storey)
    kinds = [bool(key.global_id), bool(key.cost_code), group]
    if kinds.count(True) != 1 or (not group and (key.ifc_class or key.storey or key.type_name)):
        problems.add(f"{where}.key", "give global_id, or cost_code, or ifc_class and storey (and type_name)")
        return
    for column in (*key.columns, *table.columns, *filter(None, (table.unit,))):
        try:
            column_number(column)
        except ValueError as problem:
            problems.add(where, str(problem))
    if not table.columns:
        problems.add(f"{where}.columns", "name at least one column to fill")
    numbers = {name.upper() for name in table.columns}
    if numbers & {name.upper() for name in (*key.columns, table.unit)} or len(numbers) < len(table.columns):
        problems.add(f"{where}.columns", "a column that is filled can't be a key or the unit, or be named twice")
    known = quantities_of(key)
    for column, quantity in table.columns.items():
        if quantity not in known:
            problems.add(f"{where}.columns.{column}", f"'{quantity:.40}' is none; known here: {', '.join(known)}")
    if not 1 <= table.first_row <= table.last_row <= MAX_ROW:
        problems.add(where, f"rows {table.first_row} to {table.last_row} are none; rows go from 1 to {MAX_ROW}")
    if (table.unit or table.schedule) and not key.cost_code:
        problems.add(where, "unit and schedule go with the key cost_code alone")


def _line(path: str, lines: dict[str, int]) -> str:
    while path and path not in lines:
        path = path.rpartition(".")[0]
    return f"line {lines[path]}, " if path in lines else ""
