"""Whether a file's unit of length can be meant, before its geometry is made: walls of kilometres never end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.geometry.bodies import read_bodies

MAX_SIZE_M = 1000.0
"""A longer wall is a wrong unit; its cells and samples would fill the memory."""
_UNITS_M = (1e-6, 1e4)
"""From a micrometre to beyond a mile: what programs offer as a unit of length."""
_SAMPLE = 8


def check_unit(file: Any, products: Sequence[Any], length_scale: float, where: str) -> None:
    """Refuse a file whose walls and columns are mostly longer than any is, by a few of them drawn uncut.

    Raises:
        DesignError: the unit of length is none, or most of the few are longer than `MAX_SIZE_M`.
    """
    if not _UNITS_M[0] <= length_scale <= _UNITS_M[1]:
        raise DesignError(
            f"{where}: its unit of length is {length_scale:g} m (limits {_UNITS_M[0]:g} and {_UNITS_M[1]:g} m); "
            "export it in millimetres or metres"
        )
    few = products[:: max(1, len(products) // _SAMPLE)]
    bodies = read_bodies(file, few, length_scale, uncut=True)
    sizes = sorted(float(np.diff(body.mesh.bounds_m, axis=0).max()) for body in bodies.values())
    if sizes and (half := sizes[(len(sizes) - 1) // 2]) > MAX_SIZE_M:
        raise DesignError(
            f"{where}: its walls and columns are mostly {half:.0f} m long or more (limit {MAX_SIZE_M:.0f} m), and "
            f"its unit of length is {length_scale:g} m; export it in the unit that it is drawn in"
        )
