"""Says in words what changed from one result to the next."""

from collections.abc import Iterator
from datetime import date
from pathlib import Path

from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.globalid_remap import named_again
from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    ElementProgress,
    GroupProgress,
    ProgressReport,
    TaskProgress,
)
from asbuilt_bim.progress.revision import assignment_changes, design_changes, element_label
from asbuilt_bim.report.tables import station_rows, storey_names
from asbuilt_bim.report.wording.completion import AT_LEAST, BEST, SEEN, best_words, seen_words
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_workbook.decisions import decision_changes
from asbuilt_bim.report.wording.of_workbook.valuation_notes import kept_words
from asbuilt_bim.report.wording.values import area, number, percent_certain, plain, rate, share_of_money, unit_sign

COUNTED = {Reason.DESIGN_OTHER_STOREY: "storey", Reason.DESIGN_OTHER_TASK: "task", Reason.DESIGN_RENAMED: "name"}


def changes(before: ProgressReport, after: ProgressReport) -> tuple[str, ...]:
    """Return one line a change: visits and what they rest on, stations, storeys, tasks, decisions, costs, elements."""
    before = named_again(before, after)
    return (
        *_visits(before, after),
        *_schedule(before, after),
        *_stations(before, after),
        *_storeys(before, after),
        *_tasks(before, after),
        *_terms(before, after),
        *decision_changes(before, after),
        *cost_changes(before, after),
        *_elements(before, after),
    )


def write_changes(before: ProgressReport, after: ProgressReport, path: Path) -> None:
    """Write all that changed from an earlier run's result to a later one's, one line a change; no name breaks a line.

    Before that stands that another program made the earlier one.

    Raises:
        OSError: it can't be written.
    """
    made = before.provenance.created if before.provenance else "a time unknown"
    head = f"Against the earlier run in this folder, of {made}, visit of {before.visit_date.isoformat()}:"
    others = [f"{note_words(note)}." for note in after.notes if note.code is Reason.OTHER_PROGRAM]
    lines = (*others, *(changes(before, after) or ("Nothing has changed.",)))
    text = "".join(f"{plain(line)}\n" for line in (head, *(" ".join(line.split()) for line in lines)))
    path.write_bytes(text.encode("utf-8", "backslashreplace"))


def _visits(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say that it is another visit, or rests on other files."""
    if before.visit_date != after.visit_date:
        yield f"visit: {before.visit_date.isoformat()} -> {after.visit_date.isoformat()}"
    were, are = ({*one.earlier_visits, one.visit_date} for one in (before, after))
    yield from (f"visit {day}: new among the earlier visits" for day in sorted(are - were - {after.visit_date}))
    gone = sorted(day for day in were - are if day < after.visit_date)
    yield from (f"visit {day}: no longer among the earlier visits" for day in gone)
    if before.project_name != after.project_name:
        yield f"project: {before.project_name} -> {after.project_name}"
    old, new = before.provenance, after.provenance
    if old is None or new is None:
        return
    inputs = {
        "IFC file": (old.ifc_digest, new.ifc_digest),
        "rig": (old.rig_digest, new.rig_digest),
        "survey": (old.survey_digest, new.survey_digest),
        "scope, what is accepted, or options": (old.options_digest, new.options_digest),
    }
    yield from (f"{name}: another than before" for name, (a, b) in inputs.items() if a != b)


def _schedule(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say that planned dates come from another file beside the IFC, or from another state of it."""
    old, new = before.schedule, after.schedule
    if (old.digest if old else "") == (new.digest if new else ""):
        return
    was, now = (one.name if one else "the IFC's own dates" for one in (old, new))
    yield "schedule: another than before" if was == now else f"schedule: {was} -> {now}"


def _stations(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say which stations came, went, or changed their status or their photos; those of two visits share names only."""
    if before.visit_date != after.visit_date:
        return
    old = {row.name: row for row in station_rows(before)}
    new = {row.name: row for row in station_rows(after)}
    photos_old = {s.name: (s.left_digest, s.right_digest) for s in before.stations}
    photos_new = {s.name: (s.left_digest, s.right_digest) for s in after.stations}
    for name in sorted(old.keys() | new.keys()):
        if name not in old:
            yield f"station {name}: new, {_status(new[name].status, new[name].reasons)}"
        elif name not in new:
            yield f"station {name}: no longer there"
        elif old[name].status != new[name].status:
            yield f"station {name}: {old[name].status} -> {_status(new[name].status, new[name].reasons)}"
        elif photos_old.get(name, ()) != photos_new.get(name, ()):
            yield f"station {name}: other photos"
        elif new[name].status != "placed" and old[name].reasons != new[name].reasons:
            yield f"station {name}: {_status(new[name].status, new[name].reasons)} now"


def _status(status: str, reasons: tuple[object, ...]) -> str:
    """Write a status; one that loses the station gives its reasons."""
    return status if status == "placed" or not reasons else f"{status} ({'; '.join(map(str, reasons))})"


def _storeys(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say how storeys and the whole moved."""
    names = storey_names(before) | storey_names(after)
    old = {group.key: group for group in before.storeys}
    for group in after.storeys:
        if group.key in old:
            yield from _group(f"storey {names[group.key]}", old[group.key], group)
        else:
            yield f"storey {names[group.key]}: new"
    gone = old.keys() - {group.key for group in after.storeys}
    yield from (f"storey {names[key]}: no longer there" for key in sorted(gone))
    yield from _group("whole", before.whole, after.whole)


def _group(what: str, old: GroupProgress, new: GroupProgress) -> Iterator[str]:
    """Say how one group moved."""
    if text := ", ".join(_shares(old.completion, new.completion)):
        yield f"{what}: {text}"


def _tasks(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say which tasks came, went, or have other dates, planned or seen."""
    old = {task.progress.key: task for task in before.tasks}
    new = {task.progress.key: task for task in after.tasks}
    for key, task in new.items():
        name = f"task {task.progress.name or key}"
        if key not in old:
            yield f"{name}: new"
        elif text := ", ".join(_dates(old[key], task)):
            yield f"{name}: {text}"
    yield from (f"task {old[key].progress.name or key}: no longer there" for key in old if key not in new)


def _dates(old: TaskProgress, new: TaskProgress) -> Iterator[str]:
    """Yield what changed of a task's dates."""
    dates: dict[str, tuple[date | None, date | None]] = {
        "planned start": (old.schedule_start, new.schedule_start),
        "planned finish": (old.schedule_finish, new.schedule_finish),
        "seen begun": (old.actual_start, new.actual_start),
        "seen complete": (old.actual_finish, new.actual_finish),
    }
    for what, (was, now) in dates.items():
        if was != now:
            yield f"{what} {_moment(was)} -> {_moment(now)}"


def _moment(value: date | None) -> str:
    """Write a day, with its time to the minute where it has one."""
    return "none" if value is None else str(value)[:16]


def _elements(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say which elements came, went, or changed."""
    old = {element.global_id: element for element in before.elements}
    new = {element.global_id: element for element in after.elements}
    where = "the scope" if _rescoped(before, after) else "the design"
    revised = design_changes(before, after)
    designed = {e.global_id: ["other shape in the design"] for e in revised.reshaped}
    designed |= {e.global_id: ["moved in the design"] for e in revised.moved}
    for code, told in assignment_changes(before, after).items():
        for key, change in told.items():
            designed.setdefault(key, []).append(f"{COUNTED[code]} {change}")
    for key, element in new.items():
        if key not in old:
            yield f"{element_label(element)}: new in {where}, {element.shown_state}"
        elif parts := [*designed.get(key, ()), *_element(old[key], element)]:
            yield f"{element_label(element)}: {', '.join(parts)}"
    yield from (f"{element_label(old[key])}: no longer in {where}" for key in old if key not in new)


def _rescoped(before: ProgressReport, after: ProgressReport) -> bool:
    """Say whether both are of one state of one design, with other options: what comes or goes does so by the scope."""
    old, new = before.provenance, after.provenance
    if old is None or new is None:
        return False
    return old.ifc_digest == new.ifc_digest and old.options_digest != new.options_digest


def _element(old: ElementProgress, new: ElementProgress) -> Iterator[str]:
    """Yield what changed on one element."""
    if old.shown_state != new.shown_state:
        yield f"{old.shown_state} -> {new.shown_state}"
    yield from _shares(old.completion, new.completion)
    was, now = (area(one.as_built_area_m2, one.as_built_sigma_m2) for one in (old, new))
    if was != now:  # as it reads, and as the page compares it
        yield f"as-built area {was} -> {now}"


def _shares(old: Completion, new: Completion) -> Iterator[str]:
    """Yield what moved of a completion: what is certain first, since fewer photos may raise the estimate."""
    shown = {
        AT_LEAST: (percent_certain(old.lower), percent_certain(new.lower)),
        BEST: (best_words(old), best_words(new)),
        SEEN: (seen_words(old), seen_words(new)),
    }
    yield from (f"{what} {was} -> {now}" for what, (was, now) in shown.items() if was != now)


def _terms(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Say that retention or tax is another, and what that keeps back of what was certified before."""
    if before.valuation is None or after.valuation is None:
        return
    old, new = before.valuation.terms, after.valuation.terms
    kept = "; ".join(kept_words(note) for note in after.notes if note.code is Reason.RETENTION_CHANGED)
    for what, was, now, why in (("retention", old.retention, new.retention, kept), ("tax", old.tax, new.tax, "")):
        if was != now:
            yield f"{what} {share_of_money(was)} -> {share_of_money(now)}" + (f": {why}" if why else "")


def cost_changes(before: ProgressReport, after: ProgressReport) -> Iterator[str]:
    """Yield a line for each cost line that came, went, is planned otherwise, or whose certain value is another.

    What a line is paid by is the difference of two certain values: one that has fallen, or a rate that is another,
    has to be seen.
    """
    old = {line.global_id: line for line in before.cost_lines}
    new = {line.global_id: line for line in after.cost_lines}
    for key, line in new.items():
        if key not in old:
            yield f"{_line_named(line)}: new"
        elif text := ", ".join(_changed_of_line(old[key], line)):
            yield f"{_line_named(line)}: {text}"
    yield from (f"{_line_named(old[key])}: no longer there" for key in old if key not in new)


def _changed_of_line(old: CostProgress, new: CostProgress) -> Iterator[str]:
    """Yield what changed on one line, as it is shown."""
    shown = {
        "planned": (_quantity(old), _quantity(new)),
        "rate": (rate(old.rate), rate(new.rate)),
        "elements": (str(len(old.elements)), str(len(new.elements))),
        "not measured": (str(old.others), str(new.others)),
        "certain": (_money(old), _money(new)),
    }
    for what, (was, now) in shown.items():
        if was != now:
            yield f"{what} {was} -> {now}"


def _quantity(line: CostProgress) -> str:
    return f"{number(line.planned_quantity, 3)} {unit_sign(line.unit)}"


def _money(line: CostProgress) -> str:
    return f"{number(line.earned_lower)} {plain(line.currency)}".strip()


def _line_named(line: CostProgress) -> str:
    return f"cost line {plain(f'{line.identification} {line.name}').strip() or line.global_id}"
