"""`result.json`: the one file that every other output is made from."""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from asbuilt_bim.errors import ResultError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.result.convert import report_from_document, report_to_document
from asbuilt_bim.report.result.lines import to_lines
from asbuilt_bim.storage.atomic_write import writing
from asbuilt_bim.storage.regular_file import open_regular, path_of
from asbuilt_bim.storage.schemas import first_fault
from asbuilt_bim.storage.strict_json import parse_json

FORMAT = "asbuilt-bim/result"
VERSION = 1  # raised when an older program could no longer read the file
MINOR = 18  # raised when keys are added
MAX_BYTES = 500_000_000  # some thousand stations; a larger file is no result, or would fill the memory
VISITS, CARRIED = "visits", "history"
"""Folders of a run: a result for each visit that it measured, and for each that it took over from an earlier run."""
REMEDY = "run the visit again, or take the file of another run folder"


def write_result(report: ProgressReport, path: Path) -> None:
    """Write `report` to `path` as JSON, after holding it against the schema.

    Raises:
        ResultError: the report itself is not right (a number that isn't finite, a key the schema doesn't know).
        OutputError: the file can't be written.
    """
    lines = "".join(to_lines(result_document(report)))
    with writing(path):
        path.write_bytes(lines.encode("utf-8", "backslashreplace"))  # a lone surrogate becomes JSON's own escape


def result_document(report: ProgressReport) -> dict[str, Any]:
    """Return the report as plain JSON values, schema-checked.

    Raises:
        ResultError: a number isn't finite, or the report doesn't fit the schema; this is an error of the program.
    """
    document = {"format": FORMAT, "version": VERSION, "minor": MINOR, **report_to_document(report)}
    faults = (f"{where}: {value} is not a finite number" for where, value in _not_finite(document))
    if fault := next(faults, "") or first_fault("result-1", document):
        raise ResultError(f"the result is not fit to be written: {fault}")
    return document


def read_result(path: Path | str) -> ProgressReport:
    """Read a `result.json`, written by this version or a newer minor one.

    Raises:
        ResultError: missing, too large, no JSON, another format or a newer version, or damaged; says where.
    """
    path = path_of(path, "path")
    document = loaded(path)
    minor = check_head(document, path)
    _without_memory(document)
    if fault := first_fault("result-1", document, newer=minor > MINOR):
        raise ResultError(f"{path}: damaged: {fault}; {REMEDY}")
    values = {key: value for key, value in document.items() if key not in ("format", "version", "minor")}
    try:
        return report_from_document(values)
    except ValueError as error:
        raise ResultError(f"{path}: damaged: {error}; {REMEDY}") from error


def _without_memory(document: dict[str, Any]) -> None:
    """Take out what results of before minor 16 remember of open places: no program reads it any more."""
    faces = document.get("faces")
    for face in faces if isinstance(faces, list) else ():
        if isinstance(face, dict) and isinstance(surface := face.get("surface"), dict):
            surface.pop("was_open_uv_m", None)


def check_head(document: Any, path: Path) -> int:
    """Return the minor version of a result.

    Raises:
        ResultError: it is another format, or of another version.
    """
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ResultError(f'{path}: not a result: "format" is not "{FORMAT}"; give the result.json of a run folder')
    version, minor = document.get("version"), document.get("minor", 0)
    if not isinstance(version, int) or not isinstance(minor, int):
        raise ResultError(f'{path}: "version" and "minor" must be whole numbers; {REMEDY}')
    if version != VERSION:
        remedy = "update asbuilt-bim" if version > VERSION else "run the visit again"
        raise ResultError(f"{path}: result version {version}, this program reads version {VERSION}; {remedy}")
    return minor


def read_past(paths: Sequence[Path], until: date) -> tuple[ProgressReport, ...]:
    """Read results of earlier runs in the order of their visits, all of them before the day `until`.

    Raises:
        ResultError: one can't be read, is of that day or later, or two are of one visit. Or one was made without the
            one before it: what only that one saw would be lost.
    """
    past = sorted(((read_result(path), path) for path in paths), key=lambda pair: pair[0].visit_date)
    for number, (report, path) in enumerate(past):
        day = report.visit_date.isoformat()
        if report.visit_date >= until:
            raise ResultError(
                f"{path}: is of {day}, and the first visit of {until.isoformat()}; a history comes before all visits"
            )
        if number and past[number - 1][0].visit_date == report.visit_date:
            raise ResultError(f"{path}: is of {day} like {past[number - 1][1]}; name one result a visit")
        if number and past[number - 1][0].visit_date not in report.earlier_visits:
            raise ResultError(
                f"{path}: was made without the visit of {past[number - 1][0].visit_date.isoformat()}, and says nothing "
                f"of what only that one saw; make it again with history: [{past[number - 1][1].name}], or name one only"
            )
    return tuple(report for report, _ in past)


def read_before(folder: Path, day: date) -> tuple[ProgressReport, ...]:
    """Read what a run folder holds of the visits before a day: carried over from earlier runs, then the run's own.

    Raises:
        ResultError: one can't be read.
    """
    paths = [path for name in (CARRIED, VISITS) for path in sorted((folder / name).glob("*.json"))]
    before = [report for report in map(read_result, paths) if report.visit_date < day]
    return tuple(sorted(before, key=lambda report: report.visit_date))


def loaded(path: Path) -> Any:
    """Read the bytes of a whole result within bounds and parse them strictly.

    Raises:
        ResultError: it can't be read, or is no JSON.
    """
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            sizes = f"{size / 1e6:.0f} MB exceeds {MAX_BYTES / 1e6:.0f} MB"
            raise ResultError(f"{path}: {sizes}; not a result of this program")
        with open_regular(path) as file:
            return parse_json(file.read().decode("utf-8"))
    except OSError as error:
        raise ResultError(f"{path}: can't be read: {error.strerror or error}; {REMEDY}") from error
    except RecursionError as error:
        raise ResultError(f"{path}: damaged: nested too deeply; {REMEDY}") from error
    except ValueError as error:  # JSONDecodeError and UnicodeDecodeError among them
        raise ResultError(f"{path}: damaged: {error}; {REMEDY}") from error


def _not_finite(value: Any, where: str = "result") -> Iterator[tuple[str, float]]:
    """Yield the places of numbers that JSON can't hold."""
    if isinstance(value, float):
        if not math.isfinite(value):
            yield where, value
    elif isinstance(value, Mapping):
        for key, part in value.items():
            yield from _not_finite(part, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for index, part in enumerate(value):
            yield from _not_finite(part, f"{where}[{index}]")
