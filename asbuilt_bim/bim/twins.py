"""Two elements in one place: a wall that stands in the file twice, under two GlobalIds. It counts once."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted

SAME_PLACE_M = 0.005
"""Two exports of one element differ by rounding; two layers of concrete by more."""
SAME_VOLUME = 0.01
"""Two walls may share their box and not their shape: one has a door."""


def once_each(design: BimModel) -> BimModel:
    """Return the design with one element of those that fill the same place, the first; the others have a note.

    Tasks and cost lines that name another one are given the first.
    """
    twins = _twins(design.elements)
    if not twins:
        return design

    def named(elements: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(twins[key].global_id if key in twins else key for key in elements))

    notes = [_note(element, twins[element.global_id]) for element in design.elements if element.global_id in twins]
    return replace(
        design,
        elements=tuple(element for element in design.elements if element.global_id not in twins),
        tasks=tuple(replace(task, elements=named(task.elements)) for task in design.tasks),
        cost_lines=tuple(replace(line, elements=named(line.elements)) for line in design.cost_lines),
        notes=(*design.notes, *notes),
    )


def _note(twin: BimElement, first: BimElement) -> Note:
    subject = about(SubjectKind.ELEMENT, twin.global_id)
    names = {"element": twin.name, "name": first.name, "first": first.global_id}
    return noted(Reason.ELEMENT_TWICE, subject, ifc_class=twin.ifc_class, **names)


def _twins(elements: Sequence[BimElement]) -> dict[str, BimElement]:
    """Return GlobalId -> the first element of the file that fills the same place."""
    if not elements:
        return {}
    ends_m = np.array([np.concatenate([e.vertices_m.min(axis=0), e.vertices_m.max(axis=0)]) for e in elements])
    order = np.argsort(ends_m[:, 0], kind="stable")
    last = np.searchsorted(ends_m[order, 0], ends_m[order, 0] + SAME_PLACE_M, side="right")
    found: dict[str, BimElement] = {}
    for start, stop in enumerate(last):
        own = int(order[start])
        others = order[start + 1 : stop]
        for other in others[np.all(np.abs(ends_m[others] - ends_m[own]) <= SAME_PLACE_M, axis=1)]:
            first, second = (elements[index] for index in sorted((own, int(other))))
            if first.kind == second.kind and _alike(first.volume_m3, second.volume_m3):
                found.setdefault(second.global_id, found.get(first.global_id, first))
    return found


def _alike(volume_m3: float, other_m3: float) -> bool:
    return abs(volume_m3 - other_m3) <= SAME_VOLUME * max(volume_m3, other_m3)
