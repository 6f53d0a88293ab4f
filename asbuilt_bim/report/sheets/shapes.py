"""What a sheet shows, as plain shapes in metres: x to the right and y down, from the drawing's upper left corner."""

from dataclasses import dataclass
from typing import Literal

Colour = Literal["black", "red", "grey"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A filled rectangle."""

    left_m: float
    top_m: float
    width_m: float
    height_m: float
    colour: Colour = "black"


@dataclass(frozen=True, slots=True, kw_only=True)
class Disc:
    """A filled circle."""

    x_m: float
    y_m: float
    radius_m: float
    colour: Colour = "red"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A thin grey line, to cut or to aim along; it says nothing to a camera."""

    start_m: tuple[float, float]
    end_m: tuple[float, float]


Shape = Box | Disc | Stroke


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """One thing to print: its size, its shapes, and the lines of text that stand below it."""

    width_m: float
    height_m: float
    shapes: tuple[Shape, ...]
    words: tuple[str, ...]
