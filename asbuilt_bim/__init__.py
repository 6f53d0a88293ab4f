"""Know from photographs what has been built: as-built areas and progress of concrete walls and columns, in BIM/IFC."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from asbuilt_bim.version import __version__

if TYPE_CHECKING:
    from asbuilt_bim.api import Run, remake, run
    from asbuilt_bim.bim.model import BimModel
    from asbuilt_bim.camera.rig_reader import read_rig
    from asbuilt_bim.errors import AsBuiltError
    from asbuilt_bim.ifc.reader import read_design
    from asbuilt_bim.ifc.writer import strip_asbuilt, write_asbuilt
    from asbuilt_bim.measure.pair import PairMeasurement
    from asbuilt_bim.output.measurement import save_measurement
    from asbuilt_bim.pair import measure_pair
    from asbuilt_bim.progress.report import ProgressReport
    from asbuilt_bim.project.read import Project, read_project
    from asbuilt_bim.report.document import read_result
    from asbuilt_bim.report.figures import Figure, figures
    from asbuilt_bim.report.measure_document import measure_document
    from asbuilt_bim.schedule.read import read_schedule

_HOMES = {
    "AsBuiltError": "asbuilt_bim.errors",
    "BimModel": "asbuilt_bim.bim.model",
    "Figure": "asbuilt_bim.report.figures",
    "PairMeasurement": "asbuilt_bim.measure.pair",
    "ProgressReport": "asbuilt_bim.progress.report",
    "Project": "asbuilt_bim.project.read",
    "Run": "asbuilt_bim.api",
    "figures": "asbuilt_bim.report.figures",
    "measure_document": "asbuilt_bim.report.measure_document",
    "measure_pair": "asbuilt_bim.pair",
    "read_design": "asbuilt_bim.ifc.reader",
    "read_project": "asbuilt_bim.project.read",
    "read_result": "asbuilt_bim.report.document",
    "read_rig": "asbuilt_bim.camera.rig_reader",
    "read_schedule": "asbuilt_bim.schedule.read",
    "remake": "asbuilt_bim.api",
    "run": "asbuilt_bim.api",
    "save_measurement": "asbuilt_bim.output.measurement",
    "strip_asbuilt": "asbuilt_bim.ifc.writer",
    "write_asbuilt": "asbuilt_bim.ifc.writer",
}
"""Where each public name lives; it is imported when it is first asked for, so that `import asbuilt_bim` stays light."""

__all__ = [
    "AsBuiltError",
    "BimModel",
    "Figure",
    "PairMeasurement",
    "ProgressReport",
    "Project",
    "Run",
    "__version__",
    "figures",
    "measure_document",
    "measure_pair",
    "read_design",
    "read_project",
    "read_result",
    "read_rig",
    "read_schedule",
    "remake",
    "run",
    "save_measurement",
    "strip_asbuilt",
    "write_asbuilt",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Return the public names, for completion in a notebook."""
    return sorted({*globals(), *__all__})
