"""State, completion and as-built areas of elements, storeys and tasks: our sets, and standard ones where they fit."""

import math
from collections.abc import Mapping
from typing import Any

from asbuilt_bim.codes import WHY_STATE, Note, Reason, SubjectKind, about, noted
from asbuilt_bim.ifc.names import PROGRAM, Value
from asbuilt_bim.ifc.write.entities import Marker
from asbuilt_bim.ifc.write.tasks import write_task
from asbuilt_bim.progress.completion.forecast import forecast_of
from asbuilt_bim.progress.completion.moments import late_days
from asbuilt_bim.progress.report import Completion, ElementProgress, GroupProgress, ProgressReport, TaskProgress
from asbuilt_bim.version import __version__

OCCURRENCE_SET = "Pset_ConstructionOccurence"  # buildingSMART spells it so
UNCERTAINTY_SET = "Pset_Uncertainty"


def photographed_areas(report: ProgressReport) -> dict[str, float]:
    """Return by GlobalId the design area (m2) of the faces that as-built areas were measured on."""
    found: dict[str, float] = {}
    for face in report.faces:
        if face.surface.as_built_area_m2 is not None:
            found[face.element] = found.get(face.element, 0.0) + face.exposed_area_m2
    return found


def mark_element(
    marker: Marker, element: Any, progress: ElementProgress, report: ProgressReport, photographed_m2: float | None
) -> None:
    """Give an element its sets: one of which nothing is known too, with the reason."""
    marker.properties(
        element,
        {
            "State": progress.shown_state,
            "Reason": _why(progress),
            **_completion_values(progress.completion, progress.global_id),
            "DeviationFromDesign": progress.offset_m,
            "DeviationSigma": progress.offset_sigma_m,
            "TiltMmPerM": None if progress.tilt_rad is None else 1000.0 * math.tan(progress.tilt_rad),
            "TiltSigmaMmPerM": None if progress.tilt_sigma_rad is None else 1000.0 * progress.tilt_sigma_rad,
            "Tolerance": progress.tolerance.verdict if progress.tolerance is not None else None,
            "ToleranceName": (report.tolerance.name or None) if report.tolerance is not None else None,
            "Zones": "; ".join(progress.zones) or None,
            "VisitDate": progress.last_seen,
            "Stations": ", ".join(progress.stations) or None,
            "ProgramVersion": _version(report),
        },
    )
    marker.areas(
        element,
        {
            "AsBuiltArea": progress.as_built_area_m2,
            "AsBuiltAreaSigma": progress.as_built_sigma_m2,
            "PhotographedDesignArea": photographed_m2,
            "DesignExposedArea": progress.design_area_m2,
        },
    )
    if marker.schema == "IFC4X3":
        _standard_sets(marker, element, progress)


def mark_storey(
    marker: Marker,
    storey: Any,
    group: GroupProgress,
    report: ProgressReport,
    photographed_m2: Mapping[str, float],
    files: str,
) -> None:
    """Give a storey its sets; the areas are sums over its walls and columns, absent where none was measured.

    `files` names those that hold them where it isn't this one alone, "" otherwise.
    """
    inside = set(group.elements)
    measured = any(e.as_built_area_m2 is not None for e in report.elements if e.global_id in inside)
    photographed = [area for key, area in photographed_m2.items() if key in inside]
    marker.properties(storey, _group_values(group, report) | {"Files": files or None})
    marker.areas(
        storey,
        {
            "AsBuiltArea": group.as_built_area_m2 if measured else None,
            "AsBuiltAreaSigma": group.as_built_sigma_m2 if measured else None,
            "PhotographedDesignArea": sum(photographed) if photographed else None,
            "DesignExposedArea": group.design_area_m2,
        },
    )


def mark_task(marker: Marker, thing: Any, task: TaskProgress, report: ProgressReport, files: str) -> None:
    """Write a task's measured time, and our set with what was overwritten; `files` as of a storey."""
    kept = write_task(marker, thing, task, report.visit_date)
    values = _group_values(task.progress, report) | {"Files": files or None} | _dates(task, report) | kept.values
    marker.properties(thing, values, kept.dates)


def _dates(task: TaskProgress, report: ProgressReport) -> dict[str, Value | None]:
    """Return how a task stands against its plan, as every other file has it."""
    finish, planned = forecast_of(task, report).finish, task.schedule_finish if task.finish_from else None
    return {
        "DaysBehind": task.behind_days_shown,
        "DaysLate": late_days(task.schedule_finish, task.late, report.visit_date),
        "PlannedFinish": None if planned is None else planned.date(),
        "PlannedFinishFrom": task.finish_from or None,
        "ForecastFinish": None if finish is None else finish.date(),
    }


def _standard_sets(marker: Marker, element: Any, progress: ElementProgress) -> None:
    """Add the two standard sets of IFC4X3 that fit, unless the design has them already."""
    taken = {
        getattr(relation.RelatingPropertyDefinition, "Name", None)
        for relation in getattr(element, "IsDefinedBy", None) or ()
    }
    if progress.complete_on is not None and OCCURRENCE_SET not in taken:
        installed = marker.single("InstallationDate", marker.measure("date", progress.complete_on))
        marker.add_set(element, OCCURRENCE_SET, [installed], PROGRAM)
    sigma = progress.offset_sigma_m
    if sigma is not None and sigma > 0.0 and UNCERTAINTY_SET not in taken:
        make = marker.file.create_entity
        basis = make(
            "IfcPropertyEnumeratedValue", Name="UncertaintyBasis", EnumerationValues=[make("IfcLabel", "MEASUREMENT")]
        )
        description = "one standard deviation of AsBuilt_Progress.DeviationFromDesign, across the measured face"
        size = make("IfcPositiveLengthMeasure", sigma / marker.units.length_scale)
        marker.add_set(
            element,
            UNCERTAINTY_SET,
            [
                basis,
                marker.single("UncertaintyDescription", make("IfcText", description)),
                marker.single("OrthogonalUncertainty", size),
            ],
            PROGRAM,
        )


def _group_values(group: GroupProgress, report: ProgressReport) -> dict[str, Value | None]:
    return {
        "State": _group_state(group),
        **_completion_values(group.completion, group.key),
        "VisitDate": report.visit_date,
        "ProgramVersion": _version(report),
        "ElementsComplete": group.surely_complete,
        "ElementsCompleteAsFarAsSeen": group.as_far_as_seen,
        "ElementsPart": group.part,
        "ElementsNotStarted": group.not_started,
        "ElementsDisplaced": group.displaced,
        "ElementsUnknown": group.unknown,
    }


def _why(progress: ElementProgress) -> Note | None:
    """Return the note that says why an element has its state; what is unknown always has one."""
    found = next((note for note in progress.notes if note.code in WHY_STATE), None)
    if found is not None or progress.state != "unknown":
        return found
    seen = progress.completion.coverage
    subject = about(SubjectKind.ELEMENT, progress.global_id)
    return noted(Reason.SEEN_LITTLE if seen > 0.0 else Reason.NOT_SEEN, subject, coverage=seen)


def _group_state(group: GroupProgress) -> str:
    """Return a group's state; what has no best estimate, as where some of it isn't measured here, is no whole."""
    done = group.completion
    if done.best is not None and group.complete == len(group.elements):
        return "complete as far as seen" if group.as_far_as_seen else "complete"
    if done.best is not None and group.not_started == len(group.elements):
        return "not started"
    return "part" if (done.best or done.lower) > 0.0 or (group.part and done.best is not None) else "unknown"


def _completion_values(completion: Completion, key: str) -> dict[str, Value | None]:
    subject = about(SubjectKind.ELEMENT, key)
    return {
        "Summary": noted(Reason.BOUNDS, subject, lower=completion.lower, upper=completion.upper),
        "CompletionBest": completion.best_shown,
        "CompletionLower": completion.lower,
        "CompletionUpper": completion.upper,
        "Coverage": completion.coverage,
    }


def _version(report: ProgressReport) -> str:
    return report.provenance.program_version if report.provenance is not None else __version__
