"""The flat tables, read back by programs of others: ifccsv, ifc5d's csv2ifc, pandas and DuckDB.

python benchmarks/valuation/tables.py --check

pandas, DuckDB and pyarrow (`pip install pandas duckdb pyarrow`) are asked where they are installed.
"""

from __future__ import annotations

import importlib.util
import io
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.flat.columns import KEYS, TABLES, Table
from asbuilt_bim.report.flat.exchange import certain_quantity
from asbuilt_bim.report.flat.rows import Cell, flat_tables
from asbuilt_bim.report.flat.write import write_tables
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told
from benchmarks.valuation.books import saved_report

Rows = dict[Table, list[tuple[Cell, ...]]]


def main() -> int:
    """Write the tables, have each program read them, print the table."""
    args = options(__doc__ or "").parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        result = saved_report(folder)
        write_tables([result], folder / "csv")
        rows = flat_tables([result])
        lines = [keys_line(rows), ifccsv_line(result, folder), *csv2ifc_lines(result, folder)]
        lines += [*pandas_lines(rows, folder, result), *duckdb_lines(rows, folder)]
    return report("Flat tables, as other programs read them", lines, args)


def installed(*names: str) -> bool:
    """Say whether this Python has some packages."""
    return all(importlib.util.find_spec(name) is not None for name in names)


def keys_line(rows: Rows) -> Line:
    """Look whether each table's key is one of a row alone."""
    double = []
    for name, columns in TABLES.items():
        places = [[one.name for one in columns].index(key) for key in KEYS[name]]
        keys = [tuple(row[place] for place in places) for row in rows[name]]
        double += [name] * (len(keys) - len(set(keys)))
    count = sum(map(len, rows.values()))
    return line("rows that have another's key", f"{len(double)}", "0", count, not double)


def ifccsv_line(result: ProgressReport, folder: Path) -> Line:
    """Have ifccsv write our CSV into the design, and read the properties there."""
    if not installed("ifccsv"):
        return told("ifccsv", "not installed", 0)
    from ifccsv import IfcCsv

    file = ifcopenshell.open(str(SAMPLE / "design.ifc"))
    with redirect_stdout(io.StringIO()):
        IfcCsv().Import(file, str(folder / "csv" / "ifccsv.csv"), null="-")
    right = 0
    for element in result.elements:
        found = ifcopenshell.util.element.get_pset(file.by_guid(element.global_id), "AsBuilt_Progress") or {}
        done = element.completion
        wanted = {"State": element.shown_state, "CompletionBest": done.best_shown, "CompletionLower": done.lower,
                  "CompletionUpper": done.upper, "Coverage": done.coverage}  # fmt: skip
        right += all(_same(found.get(name), value) for name, value in wanted.items())
    n = len(result.elements)
    return line("ifccsv: elements with our properties in the IFC", f"{right} of {n}", "all", n, right == n)


def _same(found: object, wanted: object) -> bool:
    """Compare a value that another program read: ifccsv keeps numbers as they are written."""
    if wanted is None or found is None:
        return found is None and wanted is None
    if isinstance(wanted, int | float) and not isinstance(wanted, bool):
        try:
            return abs(float(str(found)) - wanted) <= 1e-9 * max(1.0, abs(wanted))
        except ValueError:
            return False
    return str(found) == str(wanted)


def csv2ifc_lines(result: ProgressReport, folder: Path) -> Iterator[Line]:
    """Have csv2ifc make a cost schedule of our CSV; its items are our lines, and so is their sum."""
    if not installed("ifc5d"):
        yield told("ifc5d's csv2ifc", "not installed", 0)
        return
    from ifc5d.csv2ifc import Csv2Ifc

    with redirect_stdout(io.StringIO()):
        maker = Csv2Ifc(str(folder / "csv" / "csv2ifc.csv"))
        maker.execute()
    assert maker.file is not None
    items = {item.Identification: item for item in maker.file.by_type("IfcCostItem")}
    right, total = 0, 0.0
    for cost in result.cost_lines:
        item = items.get(cost.identification)
        if item is None or not item.CostQuantities or not item.CostValues:
            continue
        quantity, rate = float(item.CostQuantities[0][3]), float(item.CostValues[0].AppliedValue.wrappedValue)
        right += item.Name == cost.name and _same(quantity, certain_quantity(cost)) and _same(rate, cost.rate)
        total += round(quantity * rate, 2)
    n = len(result.cost_lines)
    yield line("csv2ifc: cost items with our quantity and rate", f"{right} of {n}", "all", n, right == n, 6)
    wanted = sum(round(certain_quantity(cost) * cost.rate, 2) for cost in result.cost_lines)
    yield line("csv2ifc: sum of quantity x rate", f"{total:.2f}", f"{wanted:.2f}", n, abs(total - wanted) < 0.005, 6)


def pandas_lines(rows: Rows, folder: Path, result: ProgressReport) -> Iterator[Line]:
    """Have pandas read CSV and Parquet."""
    if not installed("pandas"):
        yield told("pandas", "not installed", 0)
        return
    import pandas

    def frame(name: Table, form: str) -> Any:
        path = folder / form / f"{name}.{form}"
        if form == "parquet":
            return pandas.read_parquet(path)
        return pandas.read_csv(path, keep_default_na=False, na_values=[""], encoding="utf-8-sig")

    yield _line("pandas, CSV", rows, lambda name: _cells(frame(name, "csv")))
    if not installed("pyarrow"):
        yield told("pandas, Parquet", "pyarrow isn't installed", 0)
        return
    write_tables([result], folder / "parquet", "parquet")
    yield _line("pandas, Parquet", rows, lambda name: _cells(frame(name, "parquet")))


def duckdb_lines(rows: Rows, folder: Path) -> Iterator[Line]:
    """Have DuckDB read CSV and Parquet; it says itself what kind each column has."""
    if not installed("duckdb"):
        yield told("DuckDB", "not installed", 0)
        return
    import duckdb

    def read(name: Table, form: str) -> tuple[list[str], list[tuple[Any, ...]]]:
        found = duckdb.sql(f"SELECT * FROM '{(folder / form / f'{name}.{form}').as_posix()}'")
        return list(found.columns), found.fetchall()

    yield _line("DuckDB, CSV", rows, lambda name: read(name, "csv"))
    if (folder / "parquet").is_dir():
        yield _line("DuckDB, Parquet", rows, lambda name: read(name, "parquet"))


def _cells(frame: Any) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Return a frame's columns and rows; what is missing is None, whatever pandas calls it."""
    filled = frame.astype(object).where(frame.notna(), None)
    return list(frame.columns), [tuple(row) for row in filled.itertuples(index=False)]


def _line(what: str, rows: Rows, read: Any) -> Line:
    """Compare every cell that a program reads with the one that was written."""
    cells, wrong = 0, []
    for name, columns in TABLES.items():
        heads, found = read(name)
        if heads != [one.name for one in columns] or len(found) != len(rows[name]):
            wrong.append(f"{name}: {len(found)} rows")
            continue
        for there, here in zip(found, rows[name], strict=True):
            for column, got, cell in zip(columns, there, here, strict=True):
                cells += 1
                if not _alike(got, cell):
                    wrong.append(f"{name}.{column.name}: {got!r} for {cell!r}")
    figure = f"{cells - len(wrong)} of {cells}" + "".join(f"; {one}" for one in wrong[:2])
    return line(f"{what}: cells as they were written", figure, "all", cells, not wrong)


def _alike(got: Any, cell: Cell) -> bool:
    """Compare a cell with what another program makes of it: a day may come back as text or as its midnight."""
    if cell is None:
        return got is None
    if isinstance(cell, bool):
        return bool(got == cell)
    if isinstance(cell, int | float):
        return got is not None and float(got) == float(cell)
    if hasattr(cell, "isoformat"):
        text = got.isoformat() if hasattr(got, "isoformat") else str(got)
        return text.replace(" ", "T").removesuffix("T00:00:00") == cell.isoformat().removesuffix("T00:00:00")
    return str(got) == str(cell)


if __name__ == "__main__":
    sys.exit(main())
