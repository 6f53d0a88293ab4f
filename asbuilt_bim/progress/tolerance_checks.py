"""A report with each element held against the tolerance that its project asks for."""

from dataclasses import replace

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.tolerance import Tolerance, checked


def with_tolerance(report: ProgressReport, design: BimModel, tolerance: Tolerance | None) -> ProgressReport:
    """Return the report with a check an element, or as it is where the project names no tolerance."""
    if tolerance is None:
        return report
    heights = {element.global_id: element.height_m for element in design.elements}
    surfaces: dict[str, list[SurfaceState]] = {}
    for face in report.faces:
        surfaces.setdefault(face.element, []).append(face.surface)

    def held(element: ElementProgress) -> ElementProgress:
        key = element.global_id
        moved = None if element.move_m is None else float(np.linalg.norm(element.move_m))
        check = checked(tolerance, surfaces.get(key, ()), heights[key], moved)
        return replace(element, tolerance=check)

    return replace(report, tolerance=tolerance, elements=tuple(held(element) for element in report.elements))
