"""What must not be missed after a run: what of the design, of the rig and of the stations doesn't count."""

from __future__ import annotations

from collections.abc import Sequence

from asbuilt_bim.codes import Note
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.read import Visit
from asbuilt_bim.report.tables import subject_of
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.values import plain
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.terminal.summary_table import left_out

MAX_NOTES = 4


def warn_of_design(names: str, notes: Sequence[Note], screen: Screen) -> None:
    """Say what of the design couldn't be used: it is missing from every number."""
    for note in notes[:MAX_NOTES]:
        screen.warn(f"{names}: {plain(note_words(note))}")
    if len(notes) > MAX_NOTES:
        screen.warn(f"{names}: and {len(notes) - MAX_NOTES} more notes; asbuilt-bim inspect shows them all")


def warn_of_visit(visit: Visit, report: ProgressReport, screen: Screen) -> bool:
    """Say what is wrong with the whole visit (its rig, its scale, the survey) and which stations were left out.

    Returns whether one was.
    """
    day = visit.date.isoformat()
    whole = [rejection for rejection in report.rejections if subject_of(rejection) == ("", "")]
    for rejection in whole[:MAX_NOTES]:
        screen.warn(f"visit {day}: {plain(str(rejection))}")
    if len(whole) > MAX_NOTES:
        screen.warn(f"visit {day}: and {len(whole) - MAX_NOTES} more of the kind; the report names them all")
    names = [station.name for station in visit.stations]
    rejected = left_out(names, report)
    for name, reasons in rejected.items():
        screen.warn(f"visit {day}: station {name} was LEFT OUT: {'; '.join(reasons)}")
    if names and len(rejected) == len(names):
        screen.warn(f"visit {day}: NOT ONE station could be used; nothing in this report was seen on that day")
    return bool(rejected)
