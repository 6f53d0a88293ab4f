"""What a revision did to the design: walls and columns gone, new, changed in shape, moved, counted elsewhere."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
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
    notes = [_note(code, [element_label(one) for one in elements], before) for code, elements in kinds if elements]
    named = {element.global_id: element_label(element) for element in after.elements}
    for code, told in assignment_changes(before, after).items():
        notes.append(_note(code, [f"{named[key]} ({change})" for key, change in told.items()], before))
    return tuple(notes)


def assignment_changes(before: ProgressReport, after: ProgressReport) -> dict[Reason, dict[str, str]]:
    """Return which elements have another storey, task or name, each with what was and is: sums and dates go by these.

    A storey or task of the same name with a new GlobalId is the same one, unless its GlobalId is one of another.
    """
    kinds = (Reason.DESIGN_OTHER_STOREY, _storeys), (Reason.DESIGN_OTHER_TASK, _tasks), (Reason.DESIGN_RENAMED, _names)
    kept = _groups(before) & _groups(after)
    found: dict[Reason, dict[str, str]] = {}
    for code, of in kinds:
        were = of(before)
        for key, now in of(after).items():
            was = were.get(key, now)
            if was.keys() == now.keys():
                continue
            if {*was.values()} != {*now.values()}:
                found.setdefault(code, {})[key] = f"{_all_of(was)} -> {_all_of(now)}"
            elif kept & (was.keys() ^ now.keys()):  # two of one name
                told = (_all_of({one: f"{name} {one}" for one, name in of_it.items()}) for of_it in (was, now))
                found.setdefault(code, {})[key] = " -> ".join(told)
    return found


def _groups(report: ProgressReport) -> set[str]:
    """Return the keys of all storeys and tasks."""
    return {storey.key for storey in report.storeys} | {task.progress.key for task in report.tasks}


def _names(report: ProgressReport) -> dict[str, dict[str, str]]:
    """Return by GlobalId the name of each element."""
    return {one.global_id: {one.name: one.name or one.global_id} for one in report.elements}


def _storeys(report: ProgressReport) -> dict[str, dict[str, str]]:
    """Return by GlobalId the storey of each element: its key and its name."""
    names = {storey.key: storey.name for storey in report.storeys}
    return {one.global_id: {one.storey: names.get(one.storey, "")} for one in report.elements}


def _tasks(report: ProgressReport) -> dict[str, dict[str, str]]:
    """Return by GlobalId the tasks of each element: their keys and names."""
    found: dict[str, dict[str, str]] = {one.global_id: {} for one in report.elements}
    for task in report.tasks:
        for key in task.progress.elements:
            found.get(key, {})[task.progress.key] = task.progress.name
    return found


def _all_of(names: Mapping[str, str]) -> str:
    return " + ".join(sorted(name or key for key, name in names.items())) or "none"


def remap_notes(before: ProgressReport, ids: Mapping[str, str]) -> tuple[Note, ...]:
    """Return the note on elements that have other GlobalIds now; `before` bears the new ones already."""
    found = [element for element in before.elements if element.global_id in set(ids.values())]
    return (_note(Reason.DESIGN_NEW_IDS, [element_label(one) for one in found], before),) if found else ()


def element_label(element: ElementProgress) -> str:
    """Return what people call an element."""
    return f"{element.kind} {element.name or element.global_id}"


def _note(code: Reason, elements: Sequence[str], before: ProgressReport) -> Note:
    named, since = tuple(elements[:_NAMED]), before.visit_date.isoformat()
    return noted(code, about(SubjectKind.DESIGN), elements=named, count=len(elements), since=since)
