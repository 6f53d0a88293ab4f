"""Describes a building as plain data: elements with their openings, the grid, and where it lies in world."""

from __future__ import annotations

import uuid
from dataclasses import dataclass

import numpy as np

from asbuilt_synthetic.meshes import pose_2d
from asbuilt_synthetic.model import FloatArray

STOREY_M = 3.1
SLAB_M = 0.2
CLEAR_M = STOREY_M - SLAB_M
STOREYS = ("Ground floor", "First floor")


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A rectangular hole through a wall, along its length and height."""

    global_id: str
    kind: str  # "door" | "window"
    start_m: float
    width_m: float
    sill_m: float
    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Element:
    """A design element, in its own frame: x along the length, y across, z up from its base.

    A column or slab is centred on its origin; a wall starts at its origin and is centred across.
    """

    global_id: str
    ifc_class: str  # IfcColumn | IfcWall | IfcSlab
    shape: str  # "rect" | "round" | "wall" | "slab"
    name: str
    storey: int
    zone: int  # 0 or 1: the two pours of the building
    xy: tuple[float, float]
    z_m: float
    angle_rad: float
    length_m: float  # of a round column: its diameter
    width_m: float
    height_m: float
    openings: tuple[Opening, ...] = ()

    @property
    def local_from_element(self) -> FloatArray:
        """The 4x4 placement in the site's local frame."""
        return pose_2d(self.xy, self.z_m, self.angle_rad)

    @property
    def x_range_m(self) -> tuple[float, float]:
        """Low and high x of the body in the element's frame."""
        return (0.0, self.length_m) if self.shape == "wall" else (-self.length_m / 2, self.length_m / 2)

    @property
    def footprint_m(self) -> tuple[float, float, float, float]:
        """Low x, low y, high x, high y of the body in the site's local frame."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        pts = np.array([[x, y] for x in self.x_range_m for y in (-self.width_m / 2, self.width_m / 2)])
        turned = pts @ np.array([[c, s], [-s, c]]) + self.xy
        low, high = turned.min(0), turned.max(0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def is_near(self, other: Element, gap_m: float = 0.02) -> bool:
        """Tell whether the bounding boxes of two elements touch, within a gap."""
        (ax, ay, bx, by), (cx, cy, dx, dy) = self.footprint_m, other.footprint_m
        flat = ax - gap_m < dx and cx < bx + gap_m and ay - gap_m < dy and cy < by + gap_m
        return flat and self.z_m - gap_m < other.z_m + other.height_m and other.z_m < self.z_m + self.height_m + gap_m


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Building:
    """The design: its elements, its grid, and `world_from_local` (4, 4) that the IfcSite carries."""

    seed: int
    name: str
    world_from_local: FloatArray
    axes_x_m: tuple[float, ...]
    axes_y_m: tuple[float, ...]
    joint_x_m: float  # where the first-floor slab is cut in two pours
    elements: tuple[Element, ...]

    @property
    def vertical(self) -> tuple[Element, ...]:
        """The columns and walls."""
        return tuple(e for e in self.elements if e.ifc_class != "IfcSlab")


class Ids:
    """GlobalIds that depend on the seed only."""

    _ALPHABET = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"

    def __init__(self, seed: int, purpose: str) -> None:
        self._space = uuid.uuid5(uuid.NAMESPACE_URL, f"asbuilt-synthetic/{seed}/{purpose}")

    def of(self, name: str) -> str:
        """Return the 22-character IFC id of a name."""
        n, digits = uuid.uuid5(self._space, name).int, []
        for _ in range(22):
            n, d = divmod(n, 64)
            digits.append(self._ALPHABET[d])
        return "".join(reversed(digits))
