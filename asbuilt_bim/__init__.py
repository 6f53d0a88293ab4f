"""Know from photographs what has been built: as-built areas and progress of concrete walls and columns, in BIM/IFC."""

import importlib

from asbuilt_bim.version import __version__

_HOMES = {
    "AsBuiltError": "asbuilt_bim.errors",
    "BimElement": "asbuilt_bim.bim.model",
    "BimModel": "asbuilt_bim.bim.model",
    "ElementProgress": "asbuilt_bim.progress.report",
    "Figure": "asbuilt_bim.report.drawings.figures",
    "Foreign": "asbuilt_bim.camera.rig_formats.opencv",
    "Instance": "asbuilt_bim.vision.masks.segment",
    "MeasureOptions": "asbuilt_bim.measure.options",
    "MeasuredFace": "asbuilt_bim.measure.faces",
    "Note": "asbuilt_bim.codes",
    "PairMeasurement": "asbuilt_bim.measure.pair",
    "ProgressReport": "asbuilt_bim.progress.report",
    "Project": "asbuilt_bim.project.model",
    "Rejection": "asbuilt_bim.errors",
    "ResultSummary": "asbuilt_bim.report.result.parts",
    "Run": "asbuilt_bim.api",
    "ScheduleFile": "asbuilt_bim.schedule.rows",
    "StereoRig": "asbuilt_bim.camera.rig",
    "TargetSighting": "asbuilt_bim.vision.target.find",
    "Words": "asbuilt_bim.report.wording.words",
    "figures": "asbuilt_bim.report.drawings.figures",
    "measure_document": "asbuilt_bim.report.result.measure_document",
    "measure_pair": "asbuilt_bim.flow.measure_pair",
    "note_words": "asbuilt_bim.report.wording.notes",
    "read_design": "asbuilt_bim.ifc.apart",
    "read_elements": "asbuilt_bim.report.result.parts",
    "read_project": "asbuilt_bim.project.read",
    "read_result": "asbuilt_bim.report.result.document",
    "read_rig": "asbuilt_bim.camera.rig_formats.reader",
    "read_schedule": "asbuilt_bim.schedule.read",
    "read_summary": "asbuilt_bim.report.result.parts",
    "remake": "asbuilt_bim.api",
    "run": "asbuilt_bim.api",
    "save_measurement": "asbuilt_bim.flow.output.measurement",
    "strip_asbuilt": "asbuilt_bim.ifc.apart",
    "words_of": "asbuilt_bim.report.wording.reasons",
    "write_asbuilt": "asbuilt_bim.api",
}
"""Where each public name lives; it is imported when it is first asked for, so that `import asbuilt_bim` stays light."""

__all__ = ["__version__", *_HOMES]


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
