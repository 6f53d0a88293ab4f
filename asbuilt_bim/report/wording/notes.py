"""The sentence of every note: the one place where a code becomes words."""

from collections.abc import Mapping

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.design_notes import DESIGN_NOTES
from asbuilt_bim.report.wording.of_workbook.valuation_notes import VALUATION_NOTES
from asbuilt_bim.report.wording.place_notes import PLACE_NOTES
from asbuilt_bim.report.wording.plan_notes import PLAN_NOTES
from asbuilt_bim.report.wording.rig_notes import RIG_NOTES
from asbuilt_bim.report.wording.surface_notes import SURFACE_NOTES
from asbuilt_bim.report.wording.task_notes import TASK_NOTES
from asbuilt_bim.report.wording.template import Template, filled

NOTES: Mapping[Reason, Template] = {
    Reason.UNSTATED: "{text}",
    **DESIGN_NOTES,
    **PLACE_NOTES,
    **PLAN_NOTES,
    **SURFACE_NOTES,
    **RIG_NOTES,
    **TASK_NOTES,
    **VALUATION_NOTES,
}


def note_words(note: Note) -> str:
    """Return a note as a person reads it, without a full stop at its end."""
    template = NOTES[note.code]
    return filled(template, note) if isinstance(template, str) else template(note)
