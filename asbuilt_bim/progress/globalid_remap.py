"""Elements that an export gave other GlobalIds, known again by where they stand: what was seen of them counts."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.history import STILL_M, frame_of
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, FaceRecord, ProgressReport, TaskProgress
from asbuilt_bim.progress.valuation.inputs import ValuationInputs


def remapped_ids(report: ProgressReport, design: BimModel) -> dict[str, str]:
    """Return old GlobalId -> new one of the elements that a design holds under another GlobalId than a result.

    Both have to be of one kind, with one box round their exposed faces in the world (to `STILL_M`). Neither may have a
    second match: two solids don't stand in one place, and where a file says so neither is taken for the other.
    """
    there, known = {e.global_id for e in design.elements}, {e.global_id for e in report.elements}
    fresh = {e.global_id: e.kind for e in design.elements if e.global_id not in known}
    lost = {e.global_id: e.kind for e in report.elements if e.global_id not in there}
    if not fresh or not lost:
        return {}
    old = _boxes((f.element, frame_of(f), f.exposed_uv_m) for f in report.faces if f.element in lost)
    own = [element for element in design.elements if element.global_id in fresh]
    new = _boxes((face.element, face.frame, face.exposed_uv_m) for element in own for face in element.faces)
    if not old:
        return {}
    keys, boxes = list(old), np.array(list(old.values()))
    kinds = np.array([lost[key] for key in keys])
    pairs = [
        (keys[index], key)
        for key, box in new.items()
        for index in np.flatnonzero((np.abs(boxes - box).max(axis=1) < STILL_M) & (kinds == fresh[key]))
    ]
    was, now = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    return {a: b for a, b in pairs if was.count(a) == 1 and now.count(b) == 1}


def former_ids(report: ProgressReport, design: BimModel) -> dict[str, str]:
    """Return the GlobalIds that elements of a design had in a result and in those before it -> those that they have."""
    ids, here = remapped_ids(report, design), {element.global_id for element in design.elements}
    found: dict[str, str] = {}
    for element in report.elements:
        today = ids.get(element.global_id, element.global_id)
        if today in here:
            found |= {old: today for old in (*element.former_ids, element.global_id) if old not in here}
    return found


def with_former_ids(report: ProgressReport, ids: Mapping[str, str]) -> ProgressReport:
    """Return a result whose elements know the GlobalIds that they had before, so that the next run knows them, too."""
    if not ids:
        return report
    had: dict[str, list[str]] = {}
    for old, today in ids.items():
        had.setdefault(today, []).append(old)
    elements = (replace(one, former_ids=tuple(had.get(one.global_id, ()))) for one in report.elements)
    return replace(report, elements=tuple(elements))


def known_again(report: ProgressReport, design: BimModel) -> ProgressReport:
    """Return a result as a design names its elements now: what an export gave another GlobalId is no other element."""
    return with_new_ids(report, remapped_ids(report, design))


def with_new_ids(report: ProgressReport, ids: Mapping[str, str]) -> ProgressReport:
    """Return a result whose elements, and the faces and tasks of them, bear the GlobalIds that they have now."""
    if not ids:
        return report
    return replace(
        report,
        elements=tuple(_element(one, ids) for one in report.elements),
        tasks=tuple(_task(one, ids) for one in report.tasks),
        faces=tuple(_face(one, ids) for one in report.faces),
        stations=tuple(replace(s, faces=tuple(_measured(f, ids) for f in s.faces)) for s in report.stations),
        unobserved=tuple(_renamed(face, ids) for face in report.unobserved),
    )


def named_again(before: ProgressReport, after: ProgressReport) -> ProgressReport:
    """Return a result whose storeys, tasks and cost lines bear the keys of those of one name in a later result.

    Only what has no key in common is asked for its name, and a name that two of either bear says nothing.
    """
    storeys = _by_name({g.key: g.name for g in before.storeys}, {g.key: g.name for g in after.storeys})
    tasks = _by_name(*({t.progress.key: t.progress.name for t in one.tasks} for one in (before, after)))
    lines = _lines(before, after)
    return replace(
        before,
        storeys=tuple(replace(g, key=storeys.get(g.key, g.key)) for g in before.storeys),
        tasks=tuple(
            replace(t, progress=replace(t.progress, key=tasks.get(t.progress.key, t.progress.key)))
            for t in before.tasks
        ),
        cost_lines=tuple(replace(c, global_id=lines.get(c.global_id, c.global_id)) for c in before.cost_lines),
    )


def inputs_again(
    inputs: ValuationInputs, before: ProgressReport, after: ProgressReport, ids: Mapping[str, str]
) -> ValuationInputs:
    """Return what persons bring to a valuation under the keys that a later result has.

    `ids` are the elements' by `remapped_ids`; cost lines are known again by name. What isn't known again stays as it
    is: then it is told as unused.
    """
    lines = _lines(before, after)
    return replace(
        inputs,
        overrides=tuple(
            replace(one, element=ids.get(one.element, one.element), line=lines.get(one.line, one.line))
            for one in inputs.overrides
        ),
        rates=tuple(replace(one, line=lines.get(one.line, one.line)) for one in inputs.rates),
        paid=tuple(
            replace(
                one,
                elements={ids.get(key, key): name for key, name in one.elements.items()},
                quantities={ids.get(key, key): part for key, part in one.quantities.items()},
            )
            for one in inputs.paid
        ),
    )


def _lines(before: ProgressReport, after: ProgressReport) -> dict[str, str]:
    return _by_name(*({c.global_id: f"{c.identification} {c.name}" for c in r.cost_lines} for r in (before, after)))


def _by_name(old: Mapping[str, str], new: Mapping[str, str]) -> dict[str, str]:
    """Return old key -> new key of what has a name alone in common."""
    lost = {key: name for key, name in old.items() if key not in new}
    fresh = {key: name for key, name in new.items() if key not in old}
    often = Counter(lost.values()), Counter(fresh.values())
    there = {name: key for key, name in fresh.items() if name.strip() and often[1][name] == 1}
    return {key: there[name] for key, name in lost.items() if name in there and often[0][name] == 1}


def _element(element: ElementProgress, ids: Mapping[str, str]) -> ElementProgress:
    return replace(element, global_id=ids.get(element.global_id, element.global_id))


def _task(task: TaskProgress, ids: Mapping[str, str]) -> TaskProgress:
    elements = tuple(ids.get(one, one) for one in task.progress.elements)
    return replace(task, progress=replace(task.progress, elements=elements))


def _face(face: DesignFaceRecord, ids: Mapping[str, str]) -> DesignFaceRecord:
    element, face_id = ids.get(face.element, face.element), _renamed(face.face_id, ids)
    surface = replace(face.surface, element=element, face_id=face_id)
    return replace(face, element=element, face_id=face_id, surface=surface)


def _measured(face: FaceRecord, ids: Mapping[str, str]) -> FaceRecord:
    return replace(
        face,
        elements=tuple(ids.get(one, one) for one in face.elements),
        design_faces=tuple(_renamed(one, ids) for one in face.design_faces),
    )


def _renamed(face_id: str, ids: Mapping[str, str]) -> str:
    """Return a face's id, which begins with its element's GlobalId, under the new one."""
    element, dash, digest = face_id.rpartition("-")
    return f"{ids.get(element, element)}{dash}{digest}"


def _boxes(faces: Iterable[tuple[str, PlaneFrame | CylinderFrame, Region]]) -> dict[str, FloatArray]:
    """Return each element's box (6,) in the world, low and high, round its exposed faces; none where it has none."""
    points: dict[str, list[FloatArray]] = {}
    for element, frame, region in faces:
        for rings in region:
            points.setdefault(element, []).append(_corners(frame, rings[0]))
    return {key: np.r_[np.vstack(found).min(axis=0), np.vstack(found).max(axis=0)] for key, found in points.items()}


def _corners(frame: PlaneFrame | CylinderFrame, ring: FloatArray) -> FloatArray:
    """Return points (N, 3) that a ring reaches to; a lateral surface, wherever its seam is, reaches all round."""
    if isinstance(frame, PlaneFrame):
        return frame.from_uv(ring)
    ends = frame.origin_m + np.array([ring[:, 1].min(), ring[:, 1].max()])[:, None] * frame.axis
    around = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]) * frame.radius_m
    corners: FloatArray = (ends[:, None] + around[None]).reshape(-1, 3)
    return corners
