"""Works out what a map changes in a workbook: each cell with its old and new value, and all that stands in the way."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field

from asbuilt_bim.bim.cost_units import sign_of
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.fill.book import Book
from asbuilt_bim.report.fill.keys import KeyIndex, Known, index_of, key_of
from asbuilt_bim.report.fill.mapping import FillMap, TableMap
from asbuilt_bim.report.fill.quantities import Quantity
from asbuilt_bim.report.fill.references import Area, cell_name, column_number
from asbuilt_bim.report.fill.sheet import Sheet, Value, cell_value, without_value
from asbuilt_bim.report.fill.xml_places import readable

UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A cell that gets another value."""

    sheet: str
    row: int
    column: int
    old: Value
    new: Value
    quantity: str
    about: str  # the element, the cost line or the group

    @property
    def cell(self) -> str:
        """Return what the cell is called."""
        return f"{self.sheet}!{cell_name(self.row, self.column)}"


@dataclass(slots=True, kw_only=True)
class Plan:
    """What is to be changed, what forbids it, and what people should know."""

    changes: list[Change] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    same: int = 0  # cells that hold the value already
    unknown: list[str] = field(default_factory=list)  # cells of which nothing is known
    strangers: list[str] = field(default_factory=list)  # rows whose key the result hasn't
    missing: list[str] = field(default_factory=list)  # what the result has and no row
    sheets: dict[str, Sheet] = field(default_factory=dict)


def plan_fill(book: Book, mapping: FillMap, report: ProgressReport) -> Plan:
    """Return what a map comes to with a result.

    Raises:
        FillError: the workbook has no such sheet, or is damaged.
    """
    plan = Plan()
    taken: dict[tuple[str, int, int], str] = {}
    for table in mapping.tables:
        if table.sheet not in plan.sheets:
            plan.sheets[table.sheet] = book.sheet(table.sheet)
        index = index_of(table, report)
        if table.key.type_name and not any(one.type_name for one in report.elements):
            plan.faults.append(
                "the result holds no types of elements: it is older, or the IFC file has none; run again"
            )
            continue
        _Filler(book, table, index, plan, mapping.unknown, taken).fill()
    return plan


class _Filler:
    """Goes through the rows of one table."""

    def __init__(
        self,
        book: Book,
        table: TableMap,
        index: KeyIndex,
        plan: Plan,
        unknown: str,
        taken: dict[tuple[str, int, int], str],
    ) -> None:
        self.book, self.table, self.index, self.plan, self.unknown = book, table, index, plan, unknown
        self.sheet = plan.sheets[table.sheet]
        self.pivots: list[Area] = book.pivots(table.sheet)
        self.taken = taken

    def fill(self) -> None:
        """Add to the plan what this table changes."""
        rows: dict[Hashable, int] = {}
        for row, written in self._keys():
            key = self.index.former.get(written, written)
            if key in rows:
                self._fault(row, f"has the key of row {rows[key]} again ({_shown(key)}); only one row may have it")
            elif key in self.index.ambiguous:
                self._fault(row, self.index.ambiguous[key])
            elif key not in self.index.known:
                self.plan.strangers.append(f"{self.table.sheet}, row {row}: {_shown(key)}")
            elif self._unit_fits(row, self.index.known[key]):
                self._fill_row(row, self.index.known[key])
            rows.setdefault(key, row)
        known = (self.index.known[key].name for key in self.index.known if key not in rows)
        self.plan.missing += [f"{name} (sheet {self.table.sheet})" for name in known]

    def _keys(self) -> Iterator[tuple[int, Hashable]]:
        columns = [column_number(letters) for letters in self.table.key.columns]
        for row in sorted(self.sheet.rows):
            if self.table.first_row <= row <= self.table.last_row:
                try:
                    key = key_of(self.table, tuple(self._key_value(row, column) for column in columns))
                except ValueError as problem:
                    self._fault(row, f"{problem}")
                    continue
                if key is not None:
                    yield row, key

    def _key_value(self, row: int, column: int) -> Value:
        """Return a key's cell; of merged cells their first, and of a formula the value that it had last."""
        hidden_by = self.sheet.written(row, column)
        if hidden_by is not None:
            row, column = hidden_by.top, hidden_by.left
        cell = self.sheet.cells.get((row, column))
        if cell is not None and without_value(cell):
            raise ValueError(f"{cell_name(row, column)} is a formula without a value: open the workbook and save it")
        return cell_value(cell, self.book.shared)

    def _unit_fits(self, row: int, known: Known) -> bool:
        if not self.table.unit:
            return True
        there = str(self._key_value(row, column_number(self.table.unit)) or "")
        if _unit(there) == _unit(known.unit):
            return True
        self._fault(row, f"has the unit '{there}', and the cost line '{known.name}' counts in '{known.unit}'")
        return False

    def _fill_row(self, row: int, known: Known) -> None:
        for letters, quantity in self.table.columns.items():
            column = column_number(letters)
            value = known.quantities[quantity]
            if reason := self._in_the_way(row, column):
                self._fault(row, f"{cell_name(row, column)} {reason}")
                continue
            self.taken[self.table.sheet, row, column] = quantity
            if value is None:
                self.plan.unknown.append(f"{self.table.sheet}!{cell_name(row, column)} ({quantity} of {known.name})")
                value = UNKNOWN if self.unknown == "word" else None
            new = readable(value) if isinstance(value, str) else value
            self._change(row, column, new, quantity, known.name)

    def _change(self, row: int, column: int, value: Quantity, quantity: str, about: str) -> None:
        cell = self.sheet.cells.get((row, column))
        old = cell_value(cell, self.book.shared)
        shows_error = cell is not None and cell.place.attributes.get("t") == "e"
        if old == value and type(old) is type(_as_read(value)) and not shows_error:
            self.plan.same += 1
            return
        self.plan.changes.append(
            Change(
                sheet=self.table.sheet, row=row, column=column, old=old, new=value, quantity=quantity, about=about
            )
        )  # fmt: skip

    def _in_the_way(self, row: int, column: int) -> str:
        """Say what forbids to fill a cell, "" where nothing does."""
        cell = self.sheet.cells.get((row, column))
        if cell is not None and cell.formula is not None:
            return f"holds a formula (={cell.formula.text[:60]}), which would be lost; map another column"
        if any(area.holds(row, column) for area in self.sheet.arrays):
            return "belongs to an array formula, which would be lost; map another column"
        if self.sheet.written(row, column) is not None:
            return "is merged into another cell; map the column of the first of them, or unmerge it"
        if any(area.holds(row, column) for area in self.pivots):
            return "belongs to a pivot table, which would write over it; map another column"
        if self.book.locked(self.sheet, cell):
            return "is locked on a protected sheet; unprotect the sheet, or unlock the cell"
        if (self.table.sheet, row, column) in self.taken:
            return "is filled by two tables of the map"
        return ""

    def _fault(self, row: int, text: str) -> None:
        self.plan.faults.append(f"{self.table.sheet}, row {row}: {text}")


def _as_read(value: Quantity) -> Value:
    return float(value) if isinstance(value, int) else value


def _unit(text: str) -> str:
    """Return a unit as it is compared: m² and qm are m2, Stk and pcs are one."""
    return sign_of(text).strip().casefold().replace("²", "2").replace("³", "3").replace("^", "")


def _shown(key: Hashable) -> str:
    return " / ".join(map(str, key)) if isinstance(key, tuple) else str(key)
