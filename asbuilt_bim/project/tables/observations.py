"""The observations table: what persons saw of elements, on which day, and why they say so."""

from collections import Counter
from difflib import get_close_matches
from pathlib import Path

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import CostError
from asbuilt_bim.progress.valuation.inputs import Observation
from asbuilt_bim.storage.table_file import TableFile, TableRow, day_in, read_table, refused_rows, share_in, words_in

COLUMNS = {
    "element": ("globalid", "ifcglobalid"),
    "date": ("day", "datum"),
    "state": ("status",),
    "percent": ("percentage", "done", "share"),
    "by": ("person", "observer"),
    "why": ("reason", "note", "remark"),
}
"""What a column may be called."""
NEEDED = ("element", "date", "by")
STATES = {"complete": 1.0, "not started": 0.0}
"""States that say a percentage by themselves."""
MAX_TEXT = 300
_ALIKE = 0.8
"""How much alike a misspelt state is: one letter in five is wrong at most."""


def read_observations(path: Path, design: BimModel) -> tuple[tuple[Observation, ...], tuple[Note, ...]]:
    """Read what persons saw; an element is named by its GlobalId, or by a name that is its own.

    Raises:
        CostError: it can't be read; or a row has no day, no person, or neither a state nor a percentage. Every such
            row is named, up to eight.
    """
    table = read_table(path, COLUMNS, NEEDED, CostError)
    names = Counter(element.name for element in design.elements if element.name)
    known = {element.name: element.global_id for element in design.elements if names[element.name] == 1}
    known |= {element.global_id: element.global_id for element in design.elements} | dict(design.former_ids)
    faults: list[str] = []
    found: list[Observation] = []
    unknown: list[str] = []
    for row in table.rows:
        if not any(row.text(column) for column in ("date", "state", "percent")):
            continue  # a row of the template that nobody filled in
        one = _observation(row, table, faults)
        if one is None:
            continue
        name = row.text("element").strip()
        if name in known:
            found.append(Observation(element=known[name], day=one.day, share=one.share, by=one.by, why=one.why))
        else:
            unknown.append(name[:60])
    refused_rows(path, faults, CostError)
    subject = about(SubjectKind.FILE, path.name)
    notes = [noted(Reason.OBSERVATION_UNKNOWN, subject, elements=tuple(unknown[:8]), count=len(unknown))]
    return tuple(found), tuple(notes) if unknown else ()


def _observation(row: TableRow, table: TableFile, faults: list[str]) -> Observation | None:
    """Return a row's observation, whoever its element is; None with a fault where the row can't be used."""
    try:
        day, share = day_in(row, "date"), share_in(row, "percent", table)
        state = " ".join(row.text("state").casefold().split())
        if share is None and state in STATES:
            share = STATES[state]
        by = words_in(row, "by")[:MAX_TEXT]
        if day is None:
            raise ValueError("has no date; write 2026-03-16")
        meant = "" if state in STATES else _meant(state)
        if meant or (state and share is None):
            advice = f"did you mean {meant}?" if meant else f"write {' or '.join(STATES)}, or a percent"
            raise ValueError(f"its state '{row.text('state').strip()[:40]}' is unknown; {advice}")
        if share is None:
            raise ValueError("has neither a percent nor the state complete or not started")
        if state in STATES and share != STATES[state]:
            raise ValueError(f"says {state} and {100.0 * share:g} %; keep one of them")
        if not by:
            raise ValueError("doesn't say by whom; an observation is a person's")
    except ValueError as problem:
        faults.append(f"row {row.number}: {problem}")
        return None
    return Observation(element="", day=day, share=share, by=by, why=row.text("why").strip()[:MAX_TEXT])


def _meant(state: str) -> str:
    """Return the state that is nearly spelt so, "" where there is none: `incomplete` is its contrary."""
    found = get_close_matches(state, STATES, n=1, cutoff=_ALIKE)
    return found[0] if found and (found[0] not in state or state.startswith(found[0])) else ""
