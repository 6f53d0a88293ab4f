"""Know from photographs what has been built: as-built areas and progress of concrete walls and columns, in BIM/IFC."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from asbuilt_bim.version import __version__

if TYPE_CHECKING:
    from asbuilt_bim.camera.rig_file import read_rig
    from asbuilt_bim.measure.pair import PairMeasurement
    from asbuilt_bim.measure_folder import save_measurement
    from asbuilt_bim.pair import measure_pair
    from asbuilt_bim.report.figures import Figure, figures
    from asbuilt_bim.report.measure_document import measure_document

_HOMES = {
    "Figure": "asbuilt_bim.report.figures",
    "PairMeasurement": "asbuilt_bim.measure.pair",
    "figures": "asbuilt_bim.report.figures",
    "measure_document": "asbuilt_bim.report.measure_document",
    "measure_pair": "asbuilt_bim.pair",
    "read_rig": "asbuilt_bim.camera.rig_file",
    "save_measurement": "asbuilt_bim.measure_folder",
}
"""Where each public name lives; it is imported when it is first asked for, so that `import asbuilt_bim` stays light."""

__all__ = [
    "Figure",
    "PairMeasurement",
    "__version__",
    "figures",
    "measure_document",
    "measure_pair",
    "read_rig",
    "save_measurement",
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
