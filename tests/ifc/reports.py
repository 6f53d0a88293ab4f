"""A small report on the elements of a model, as the pipeline would hand it over."""

from __future__ import annotations

from datetime import date, datetime

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    ElementProgress,
    GroupProgress,
    ProgressReport,
    State,
    TaskProgress,
)

VISIT = date(2026, 3, 2)


def completion(best: float | None, coverage: float = 0.9) -> Completion:
    if best is None:
        return Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)
    return Completion(best=best, lower=best * coverage, upper=best * coverage + 1.0 - coverage, coverage=coverage)


def state_of(best: float | None) -> State:
    if best is None:
        return "unknown"
    return "complete" if best >= 0.97 else "not started" if best <= 0.02 else "part"


def report_on(design: BimModel, best: dict[str, float | None]) -> ProgressReport:
    """A report in which the elements of these NAMES have these completions; the others were not seen."""
    elements = tuple(
        ElementProgress(
            global_id=element.global_id,
            ifc_class=element.ifc_class,
            kind=element.kind,
            name=element.name,
            storey=element.storey,
            state=state_of(best.get(element.name)),
            completion=completion(best.get(element.name)),
            cells_built=0,
            cells_open=0,
            cells_unknown=0,
            cells_conflict=0,
            surface_coverage=0.5,
            design_area_m2=element.exposed_area_m2,
            design_volume_m3=element.volume_m3,
            built_area_m2=1.0,
            as_built_area_m2=1.25 if best.get(element.name) else None,
            as_built_sigma_m2=0.02 if best.get(element.name) else None,
            offset_m=0.012 if best.get(element.name) else None,
            offset_sigma_m=0.004 if best.get(element.name) else None,
            tilt_rad=0.01 if best.get(element.name) else None,
            stations=("A1", "A2") if best.get(element.name) is not None else (),
            last_seen=VISIT if best.get(element.name) is not None else None,
            notes=(),
            complete_on=VISIT if state_of(best.get(element.name)) == "complete" else None,
        )
        for element in design.elements
    )
    by_id = {element.global_id: element for element in elements}

    def group(key: str, name: str, ids: tuple[str, ...]) -> GroupProgress:
        chosen = [by_id[i] for i in ids]
        states = [element.state for element in chosen]
        known = [element.completion.best for element in chosen if element.completion.best is not None]
        mean = sum(known) / len(known) if known else None
        return GroupProgress(
            key=key,
            name=name,
            elements=ids,
            completion=completion(mean),
            complete=states.count("complete"),
            part=states.count("part"),
            not_started=states.count("not started"),
            unknown=states.count("unknown"),
            design_area_m2=sum(element.design_area_m2 for element in chosen),
            as_built_area_m2=1.0,
            as_built_sigma_m2=0.1,
        )

    def task(one_id: str, name: str, ids: tuple[str, ...], finish: datetime | None) -> TaskProgress:
        progress = group(one_id, name, ids)
        started = VISIT if progress.complete + progress.part else None
        done = VISIT if progress.complete == len(ids) else None
        return TaskProgress(
            progress=progress,
            schedule_start=None,
            schedule_finish=finish,
            actual_start=started,
            actual_finish=done,
            late=None,
        )

    costs = tuple(
        CostProgress(
            global_id=line.global_id,
            name=line.name,
            identification=line.identification,
            elements=line.elements,
            unit=line.unit,
            measure=line.measure,
            planned_quantity=line.planned_quantity,
            rate=line.rate,
            currency=line.currency,
            completion=completion(0.5),
            as_built_best=0.5 * line.planned_quantity,
            as_built_lower=0.4 * line.planned_quantity,
            earned_best=0.5 * line.planned_quantity * line.rate,
            earned_lower=0.4 * line.planned_quantity * line.rate,
            schedule=line.schedule,
        )
        for line in design.cost_lines
    )
    everything = tuple(by_id)
    return ProgressReport(
        project_name=design.project_name,
        visit_date=VISIT,
        earlier_visits=(),
        elements=elements,
        storeys=tuple(
            group(s.global_id, s.name, tuple(e.global_id for e in elements if e.storey == s.global_id))
            for s in design.storeys
        ),
        whole=group("", "whole", everything),
        tasks=tuple(task(t.global_id, t.name, t.elements, t.schedule_finish) for t in design.tasks),
        cost_lines=costs,
        faces=(),
        stations=(),
        rejections=(),
        unmatched=(),
        unobserved=(),
        notes=(),
    )
