"""Where somebody says that a station stood, roughly."""

from collections.abc import Mapping
from dataclasses import dataclass

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.geometry.arrays import FloatArray

ABOUT_M, ABOUT_DEG = 1.5, 20.0
"""How near a rough place is: two standard deviations, as people mean it who say so."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoughPlace:
    """A storey, and a place on it or none.

    `level_m` (2,) is in the world, `bearing_rad` clockwise from its y as seen from above; None: anywhere, any way.
    `storeys` are the GlobalIds of those that it may be, all where there are none. `within_m` and `within_rad` are two
    standard deviations.
    """

    storeys: tuple[str, ...]
    level_m: FloatArray | None
    bearing_rad: float | None
    within_m: float
    within_rad: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoughPlaces:
    """A visit's rough places by station, and the design that they are places of."""

    places: Mapping[str, RoughPlace]
    design: BimModel
