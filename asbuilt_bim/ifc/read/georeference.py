"""Where a file's world lies on the map: its IfcMapConversion, in metres."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.ifc.units import Units, unit_scale

_SCALES = (0.9, 1.1)
"""A map's scale is 0.9996 or so. What is outside comes of exporters that leave out the step from mm to m: then 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Georeference:
    """A map conversion: the map coordinates in metres of the file's origin, the turn of its x axis, and the scale."""

    crs: str  # "EPSG:25832", as the file names it
    eastings_m: float
    northings_m: float
    height_m: float
    turn_rad: float  # from east to the file's x axis, counter-clockwise
    scale: float

    def map_from_world(self) -> FloatArray:
        """Return the rigid part (4, 4) that takes world metres to the map's; the map's scale is left out.

        Models are built at the true scale, and so are photos of them.
        """
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return np.array(
            [
                [c, -s, 0.0, self.eastings_m],
                [s, c, 0.0, self.northings_m],
                [0.0, 0.0, 1.0, self.height_m],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )


def read_georeference(file: Any, units: Units) -> Georeference | None:
    """Return the first map conversion or rigid operation of a file, None where it has none (IFC2X3 never has)."""
    for name in ("IfcMapConversion", "IfcRigidOperation"):
        try:
            found = file.by_type(name)
        except RuntimeError:  # the schema doesn't know it
            continue
        for operation in found:
            return _georeference(operation, units)
    return None


def _georeference(operation: Any, units: Units) -> Georeference:
    crs = operation.TargetCRS
    own = getattr(crs, "MapUnit", None)
    metres = unit_scale(own) if own is not None else units.length_scale
    if operation.is_a("IfcMapConversion"):
        east, north, up = operation.Eastings, operation.Northings, operation.OrthogonalHeight
        x, y = operation.XAxisAbscissa, operation.XAxisOrdinate
        turn = 0.0 if x is None or y is None else math.atan2(float(y), float(x))
        scale = float(operation.Scale or 1.0) * metres / units.length_scale
    else:
        east, north = (getattr(v, "wrappedValue", v) for v in (operation.FirstCoordinate, operation.SecondCoordinate))
        up, turn, scale = operation.Height, 0.0, 1.0
    return Georeference(
        crs=str(getattr(crs, "Name", None) or "(no name)"),
        eastings_m=float(east) * metres,
        northings_m=float(north) * metres,
        height_m=float(up or 0.0) * metres,
        turn_rad=turn,
        scale=scale if _SCALES[0] <= scale <= _SCALES[1] else 1.0,
    )
