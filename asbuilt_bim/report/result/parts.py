"""A `result.json` read in parts: the sums alone, or one storey's elements, without parsing the rest."""

from collections.abc import Collection
from dataclasses import dataclass, fields
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

from asbuilt_bim.codes import Note
from asbuilt_bim.errors import Rejection, ResultError
from asbuilt_bim.progress.report import CostProgress, ElementProgress, GroupProgress, Provenance, TaskProgress
from asbuilt_bim.report.result.convert import part_from_plain
from asbuilt_bim.report.result.document import REMEDY, check_head, loaded
from asbuilt_bim.report.result.lines import LAST, Wanted, all_of, from_lines
from asbuilt_bim.storage.regular_file import open_regular, path_of

T = TypeVar("T")
_HEAD = ("format", "version", "minor")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResultSummary:
    """What a visit's report says in sum: all but the elements, faces and stations, of which it says nothing."""

    project_name: str
    visit_date: date
    earlier_visits: tuple[date, ...]
    storeys: tuple[GroupProgress, ...]
    whole: GroupProgress
    tasks: tuple[TaskProgress, ...]
    cost_lines: tuple[CostProgress, ...]
    rejections: tuple[Rejection, ...]
    notes: tuple[Note, ...]
    provenance: Provenance | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Elements:
    elements: tuple[ElementProgress, ...]


def read_summary(path: Path | str) -> ResultSummary:
    """Read the sums of a `result.json`; what it holds of each element, face and station isn't read.

    It isn't held against the schema: `read_result` does that, of the whole.

    Raises:
        ResultError: as `read_result`, of what is read.
    """
    names = [*(field.name for field in fields(ResultSummary)), "note_codes"]
    return _structured(path_of(path, "path"), dict.fromkeys((*_HEAD, *names), all_of), LAST, ResultSummary)


def read_elements(path: Path | str, storey: str) -> tuple[ElementProgress, ...]:
    """Read the elements of one storey, by its GlobalId as `GroupProgress.key` has it, of a `result.json`.

    Raises:
        ResultError: as `read_result`, of what is read; or no storey has that GlobalId.
    """
    of_storey = next((one for one in read_summary(path).storeys if one.key == storey), None)
    if of_storey is None:
        raise ResultError(f"{path}: holds no storey {storey!r}; its storeys are the `key`s under `storeys`")
    ids = frozenset(of_storey.elements)
    for is_wanted in (lambda text: _global_id(text) in ids, all_of):  # all of them where one isn't known by its text
        wanted: dict[str, Wanted] = dict.fromkeys(_HEAD, all_of) | {"elements": is_wanted}
        found = _structured(path_of(path, "path"), wanted, LAST[1:], _Elements).elements
        if {one.global_id for one in found} >= ids:
            break
    return tuple(one for one in found if one.global_id in ids)


def _global_id(text: str) -> str:
    """Return an entry's GlobalId: its first value, and without escapes, since those are of 22 plain letters."""
    return text.partition(":")[2].partition(",")[0].strip('"')


def _structured(path: Path, wanted: dict[str, Wanted], until: Collection[str], kind: type[T]) -> T:
    try:
        with open_regular(path) as file:
            found = from_lines((line.decode("utf-8") for line in file), wanted, until)
    except OSError as error:
        raise ResultError(f"{path}: can't be read: {error.strerror or error}; {REMEDY}") from error
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{path}: damaged: {error}; {REMEDY}") from error
    document: Any = loaded(path) if found is None else found
    check_head(document, path)
    try:
        return part_from_plain({key: value for key, value in document.items() if key not in _HEAD}, kind)
    except ValueError as error:
        raise ResultError(f"{path}: damaged: {error}; {REMEDY}") from error
