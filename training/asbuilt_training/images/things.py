"""What a training scene is made of: meshes that each know their class and instance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from asbuilt_synthetic.meshes import Part
from asbuilt_synthetic.model import FloatArray

from asbuilt_training.classes import CONCRETE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thing:
    """A mesh (metres, z up) with its class; `instance` numbers walls and columns from 1, 0 for all else."""

    part: Part
    kind: int
    instance: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Place:
    """A scene before it is dressed and lit: its things, and which generator drew it."""

    source: str
    things: tuple[Thing, ...]

    @property
    def middle_m(self) -> FloatArray:
        """The middle (3,) of the walls and columns, or of everything near where there are none."""
        own = [t.part.vertices_m for t in self.things if t.kind in CONCRETE]
        points = np.concatenate(own or [t.part.vertices_m for t in self.things if np.ptp(t.part.vertices_m) < 60])
        return np.asarray((points.min(0) + points.max(0)) / 2)


def of_kind(parts: Iterable[Part], kind: int) -> list[Thing]:
    """Give parts a class that has no instances."""
    return [Thing(part=p, kind=kind) for p in parts]


def numbered(things: Sequence[Thing]) -> tuple[Thing, ...]:
    """Number the walls and columns afresh from 1; equal numbers stay equal."""
    fresh: dict[int, int] = {}
    out = []
    for t in things:
        number = fresh.setdefault(t.instance, len(fresh) + 1) if t.kind in CONCRETE else 0
        out.append(Thing(part=t.part, kind=t.kind, instance=number))
    return tuple(out)
