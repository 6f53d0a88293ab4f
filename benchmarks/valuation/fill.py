"""Filling workbooks of others: only mapped cells differ, LibreOffice calculates them, and no kill leaves half of one.

python benchmarks/valuation/fill.py --check

Four workbooks are filled: by xlsxwriter (macros, table, charts, sparklines), by openpyxl, by LibreOffice, and by hand.
Their XML is compared part by part and cell by cell. Others must be refused by name. A process that fills a workbook
again and again is killed at random moments: what lies there then must be one of the two workbooks, byte for byte.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import random
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import openpyxl

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.errors import FillError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.fill.references import cell_name
from asbuilt_bim.report.fill.write import Filled, fill_workbook, read_map, save_filled
from benchmarks.table import LEAST_N, Line, line, options, report, told, unjudged
from benchmarks.valuation.books import Book, four_books, libreoffice, saved_report
from benchmarks.valuation.refused import many, refused_books

KILLS = 100
WHEN = datetime(2026, 3, 17, 8, 30, tzinfo=UTC)


def main() -> int:
    """Fill, compare, calculate, refuse and kill; print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--kills", type=int, default=KILLS, help="how many processes are killed")
    parser.add_argument("--repeat", nargs=2, type=Path, metavar=("BOOK", "MAP"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        result = saved_report(folder)
        if args.repeat:
            return repeat(*args.repeat, result)
        lines: list[Line] = []
        office = shutil.which("soffice") is not None
        books = four_books(folder, result, office=office)
        for book in books:
            lines += filled_lines(book, result, folder, office)
        if not office:
            lines.append(told("LibreOffice", "not here: nothing was calculated, and three workbooks stand for four", 0))
        lines.append(refusal_line(folder, result))
        lines += kill_lines(books[0], result, folder, 3 if args.quick else args.kills)
        lines.append(large_line(folder, result))
    if args.quick:
        lines = unjudged(lines, LEAST_N)
    return report("Workbooks of others, filled", lines, args)


def filled_lines(book: Book, result: ProgressReport, folder: Path, office: bool) -> list[Line]:
    """Fill one workbook; judge what differs, and what LibreOffice makes of it."""
    filled = fill_workbook(book.path, read_map(book.map), result)
    before = book.path.read_bytes()
    save_filled(filled, WHEN)
    faults, compared = differences(before, book.path.read_bytes(), filled)
    what = f"{book.name}: cells that differ and aren't mapped"
    lines = [
        line(what, f"{len(faults)} of {compared}" + "".join(f"; {f}" for f in faults[:2]), "0", compared, not faults)
    ]
    again = fill_workbook(book.path, read_map(book.map), result)
    changed = len(filled.plan.changes)
    lines.append(line(f"{book.name}: changed again by a second time", f"{len(again.plan.changes)}", "0", changed,
                      again.data is None, 4))  # fmt: skip
    if office:
        lines.append(_calculated(book, filled, folder))
    return lines


def _calculated(book: Book, filled: Filled, folder: Path) -> Line:
    """Have LibreOffice calculate a filled workbook: no cell may be an error, and its total is that of the cells."""
    path = libreoffice(book.path, folder / "calculated" / book.path.stem, "xlsx")
    values = openpyxl.load_workbook(path, data_only=True)
    cells = [cell.value for sheet in values for row in sheet.iter_rows() for cell in row]
    errors = [cell for cell in cells if isinstance(cell, str) and cell.startswith(("#", "Err:"))]
    letters = {change.cell.rpartition("!")[2].rstrip("0123456789") for change in filled.plan.changes}
    wanted = book.factor * sum(
        float(change.new)
        for change in filled.plan.changes
        if cell_name(1, change.column) == f"{book.column}1" and isinstance(change.new, int | float)
    )
    found = values[book.total[0]][book.total[1]].value
    right = isinstance(found, int | float) and abs(found - wanted) < 1e-6 * max(1.0, abs(wanted))
    figure = (
        f"{len(errors)} errors, total {found:.6g} of {wanted:.6g}" if right else f"{errors[:2]}, {found} of {wanted}"
    )
    return line(f"{book.name}: LibreOffice calculates it ({'+'.join(sorted(letters))})", figure, "0 errors, the sum",
                len(cells), right and not errors)  # fmt: skip


def differences(before: bytes, after: bytes, filled: Filled) -> tuple[list[str], int]:
    """Return what differs between two workbooks and wasn't to, and how many cells and parts were compared."""
    old, new = parts_of(before), parts_of(after)
    faults = [] if list(old) == list(new) else ["other parts, or in another order"]
    count = len(old)
    sheets = {sheet.part: name for name, sheet in filled.plan.sheets.items()}
    for name in old.keys() & new.keys():
        if name in sheets:
            mapped = {cell_name(c.row, c.column) for c in filled.plan.changes if c.sheet == sheets[name]}
            found, cells = _sheet_differences(old[name], new[name], mapped)
            faults += [f"{name}: {one}" for one in found]
            count += cells
        elif old[name] != new[name] and not (name.endswith("book.xml") and _only_calculation(old[name], new[name])):
            faults.append(f"{name} differs")
    return faults, count


def parts_of(data: bytes) -> dict[str, bytes]:
    """Return the parts of an archive by name, in their order."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _only_calculation(old: bytes, new: bytes) -> bool:
    """Say whether a workbook's part differs by the wish to be calculated alone."""

    def without(data: bytes) -> str:
        root = ET.fromstring(data)
        for one in [one for one in root if one.tag.endswith("}calcPr")]:
            root.remove(one)
        return ET.canonicalize(ET.tostring(root))

    return without(old) == without(new) and b'fullCalcOnLoad="1"' in new


def _sheet_differences(old: bytes, new: bytes, mapped: set[str]) -> tuple[list[str], int]:
    """Compare two sheets: what stands around the cells byte by byte, the cells each by itself."""
    faults = []
    if around(old) != around(new):
        faults.append("what stands around the cells differs")
    first, second = cells_of(old), cells_of(new)
    for name in first.keys() | second.keys():
        one, other = first.get(name), second.get(name)
        if name in mapped:
            if one is not None and (other is None or one.get("s") != other.get("s")):
                faults.append(f"{name} lost its style")
        elif one is None or other is None or _told(one) != _told(other):
            faults.append(f"{name} differs")
    return faults, len(first)


def around(data: bytes) -> tuple[bytes, bytes, list[dict[str, str]]]:
    """Return what stands before and after a sheet's rows, and the rows' attributes."""
    begin, end = data.index(b"sheetData"), data.rindex(b"sheetData")
    return (
        data[:begin],
        data[end:],
        [dict(row.attrib) for row in ET.fromstring(data).iter() if row.tag.endswith("}row")],
    )


def cells_of(data: bytes) -> dict[str, ET.Element]:
    """Return a sheet's cells by name; one without a name stands after the one before it."""
    found: dict[str, ET.Element] = {}
    row = 0
    for element in ET.fromstring(data).iter():
        if element.tag.endswith("}row"):
            row, column = int(element.get("r", row + 1)), 0
            for cell in element:
                column += 1
                if name := cell.get("r"):
                    letters = name.rstrip("0123456789")
                    column = sum((ord(letter) - 64) * 26**power for power, letter in enumerate(reversed(letters)))
                found[cell_name(row, column)] = cell
    return found


def _told(cell: ET.Element) -> str:
    """Return a cell as text; the last value of a formula, and of what an array formula fills, is no part of it."""
    kept = ET.fromstring(ET.tostring(cell))
    if any(one.tag.endswith("}f") for one in kept) or cell.get("r") == "E3":  # E3: of the array formula by hand
        for one in [one for one in kept if one.tag.endswith("}v")]:
            kept.remove(one)
        kept.attrib.pop("t", None)
    return ET.canonicalize(ET.tostring(kept))


def refusal_line(folder: Path, result: ProgressReport) -> Line:
    """Try what must be refused; each must be named by a word of its own, and stay as it was."""
    wrong = []
    cases = list(refused_books(folder / "refused", result))
    for case in cases:
        before = case.path.read_bytes()
        try:
            fill_workbook(case.path, read_map(case.map), case.report)
            wrong.append(f"{case.name}: filled")
        except FillError as problem:
            if case.says not in str(problem):
                wrong.append(f"{case.name}: {problem!s:.80}")
        if case.path.read_bytes() != before:
            wrong.append(f"{case.name}: touched")
    figure = f"{len(cases) - len(wrong)} of {len(cases)}" + "".join(f"; {one}" for one in wrong[:3])
    return line("refused by name, and left alone", figure, "all", len(cases), not wrong, 20)


def other(result: ProgressReport) -> ProgressReport:
    """Return a result with other quantities: that of another visit."""
    changed = [replace(e, design_volume_m3=e.design_volume_m3 * 1.25) for e in result.elements]
    return replace(result, elements=tuple(changed))


def repeat(path: Path, mapping: Path, result: ProgressReport) -> int:
    """Fill a workbook with one result and another in turn, until somebody kills this process."""
    turn = [result, other(result)]
    print("ready", flush=True)
    while True:
        turn.reverse()
        for old in path.parent.glob("*.before-*"):
            old.unlink()
        filled = fill_workbook(path, read_map(mapping), turn[0])
        if filled.data is not None:
            save_filled(filled, WHEN)


def kill_lines(book: Book, result: ProgressReport, folder: Path, count: int) -> list[Line]:
    """Kill that process at random moments; look at what lies there."""
    place = folder / "killed"
    place.mkdir()
    path = Path(shutil.copy(book.path, place / book.path.name))
    dice, mapping = random.Random(20), read_map(book.map)
    whole = {hashlib.sha256(path.read_bytes()).hexdigest()}
    for turn in (other(result), result):  # what may lie there
        if (data := fill_workbook(path, mapping, turn).data) is not None:
            path.write_bytes(data)
            whole.add(hashlib.sha256(data).hexdigest())
    broken, seen, lost, parts = 0, set[str](), 0, 0
    for _ in range(count):
        command = [sys.executable, __file__, "--repeat", str(path), str(book.map)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None and process.stdout.readline().strip() == "ready"
        time.sleep(dice.uniform(0.0, 0.6))
        process.kill()
        process.communicate()
        halves = list(place.glob(".asbuilt-*.part"))
        parts += bool(halves)
        for half in halves:
            half.unlink()
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        seen.add(digest)
        broken += digest not in whole
        lost += not all(hashlib.sha256(one.read_bytes()).hexdigest() in whole for one in place.glob("*.before-*"))
    return [
        line("killed while filling: a workbook that is neither", f"{broken}", "0", count, broken == 0),
        line("killed while filling: a backup that isn't whole", f"{lost}", "0", count, lost == 0),
        told("killed while filling: in the midst of writing", f"{parts}", count),
        told("killed while filling: different workbooks that lay there", f"{len(seen)} of {len(whole)}", count),
    ]


def large_line(folder: Path, result: ProgressReport) -> Line:
    """Fill a bill of 20,000 rows with formulas."""
    path, mapping, large = many(folder / "many", result, 20_000)
    start = time.process_time()
    filled = fill_workbook(path, read_map(mapping), large)
    seconds = time.process_time() - start
    size = len(filled.before) / 1e6
    return told(
        f"20,000 rows with formulas ({size:.1f} MB)",
        f"{seconds:.1f} s of processor time, {filled.stale} formulas",
        20_000,
    )


if __name__ == "__main__":
    sys.exit(main())
