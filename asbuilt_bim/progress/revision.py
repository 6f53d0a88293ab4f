"""What a revision did to the design: walls and columns gone, new, changed in shape, moved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.progress.history import frame_of, stands_still
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, ProgressReport

_NAMED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignChanges:
    """Elements by what a revision did to them, in the order of the result that holds them."""

    gone: tuple[ElementProgress, ...]
    new: tuple[ElementProgress, ...]
    reshaped: tuple[ElementProgress, ...]  # other lateral geometry
    moved: tuple[ElementProgress, ...]  # the same geometry elsewhere in the world


def design_changes(before: ProgressReport, after: ProgressReport) -> DesignChanges:
    """Compare the designs that two results were made from, element by element."""
    old, new = {e.global_id: e for e in before.elements}, {e.global_id: e for e in after.elements}
    old_faces, new_faces = _faces(before), _faces(after)
    reshaped, moved = [], []
    for key in new.keys() & old.keys():
        was, now = old_faces.get(key, {}), new_faces.get(key, {})
        if was.keys() != now.keys():
            reshaped.append(key)
        elif not all(stands_still(frame_of(was[face]), frame_of(now[face])) for face in was):
            moved.append(key)
    return DesignChanges(
        gone=tuple(old[key] for key in old if key not in new),
        new=tuple(new[key] for key in new if key not in old),
        reshaped=tuple(new[key] for key in new if key in set(reshaped)),
        moved=tuple(new[key] for key in new if key in set(moved)),
    )


def _faces(report: ProgressReport) -> dict[str, dict[str, DesignFaceRecord]]:
    faces: dict[str, dict[str, DesignFaceRecord]] = {}
    for face in report.faces:
        faces.setdefault(face.element, {})[face.face_id] = face
    return faces


def revision_notes(before: ProgressReport, after: ProgressReport) -> tuple[Note, ...]:
    """Return one note a kind of change, naming the elements; nothing where the design is as it was."""
    changes = design_changes(before, after)
    kinds = (
        (Reason.DESIGN_REMOVED, changes.gone),
        (Reason.DESIGN_ADDED, changes.new),
        (Reason.DESIGN_RESHAPED, changes.reshaped),
        (Reason.DESIGN_MOVED, changes.moved),
    )
    return tuple(_note(code, elements, before) for code, elements in kinds if elements)


def remap_notes(before: ProgressReport, ids: Mapping[str, str]) -> tuple[Note, ...]:
    """Return the note on elements that have other GlobalIds now; `before` bears the new ones already."""
    found = [element for element in before.elements if element.global_id in set(ids.values())]
    return (_note(Reason.DESIGN_NEW_IDS, found, before),) if found else ()


def _note(code: Reason, elements: Sequence[ElementProgress], before: ProgressReport) -> Note:
    named = tuple(f"{e.kind} {e.name or e.global_id}" for e in elements[:_NAMED])
    values: Values = {"elements": named, "count": len(elements), "since": before.visit_date.isoformat()}
    return noted(code, about(SubjectKind.DESIGN), **values)
