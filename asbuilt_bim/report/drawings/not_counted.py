"""Measured faces that don't count as concrete, by the notes that say so: no picture gives them an element's name."""

from collections.abc import Mapping
from dataclasses import dataclass

from asbuilt_bim.codes import NOT_COUNTED, Reason, SubjectKind
from asbuilt_bim.progress.report import FaceRecord, ProgressReport


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdicts:
    """Of measured faces, by id: the elements in whose place they lie without counting for them, with the reason."""

    refused: Mapping[str, Mapping[str, Reason]]

    def elements_of(self, face: FaceRecord) -> tuple[str, ...]:
        """Return the elements that a face counts for."""
        refused = self.refused.get(face.face_id, {})
        return tuple(element for element in face.elements if element not in refused)

    def reason_of(self, face: FaceRecord) -> Reason | None:
        """Return why a face counts for no element; None where it does for one, or lies in the place of none."""
        refused = self.refused.get(face.face_id, {})
        return next(iter(refused.values())) if refused and not self.elements_of(face) else None


def verdicts_of(report: ProgressReport) -> Verdicts:
    """Return what the notes of a report say of its measured faces."""
    refused: dict[str, dict[str, Reason]] = {}
    for element in report.elements:
        for note in element.notes:
            counted = note.code not in NOT_COUNTED or note.values.get("counted") is True
            if note.subject.kind is SubjectKind.FACE and not counted:
                refused.setdefault(note.subject.name, {})[element.global_id] = note.code
    return Verdicts(refused=refused)
