"""Whether a surface of another colour is concrete: its colour is weighed against where it lies. No veto.

What stands at a design's place and is no concrete is formwork: a sheet of ply before the face, or a framed panel.
Concrete lies on the design, as well as building can. How well the offset is known says which of the two it is.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.colour import OF_ANOTHER, ConcreteColour
from asbuilt_bim.progress.states.outlines import may_be_concrete

FORMWORK_M = 0.018, 0.12
"""How far before the design formwork shows its back: the thinnest sheet of ply, the thickest framed panel."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OtherColour:
    """The tints (2,) of one element's faces whose colour speaks against concrete, and the log-odds that they are it."""

    faces: Mapping[str, FloatArray]
    log_odds: float

    @property
    def tints(self) -> FloatArray:
        """Return the faces' tints (k, 2)."""
        return np.array(list(self.faces.values()))

    @property
    def believed(self) -> bool:
        """Say whether they count as concrete all the same."""
        return self.log_odds > 0.0


def weigh_colour(
    matches: Sequence[FaceMatch], colours: Mapping[str, ConcreteColour], options: ProgressOptions
) -> OtherColour | None:
    """Weigh the colour of one element's matched faces; None where none is of another colour than concrete.

    Colour speaks once: the faces share it. Each station's best-known offset speaks for itself, by the share of the face
    that lies on the design face.
    """
    against: dict[str, FloatArray] = {}
    odds: list[float] = []
    best: dict[str, FaceMatch] = {}
    for match in sorted(matches, key=lambda one: one.offset_sigma_m):
        colour = colours.get(match.station)
        seen = colour.faces.get(match.face_id) if colour is not None else None
        if colour is None or seen is None or not may_be_concrete(match, options):
            continue
        own = float(colour.palette.log_odds(seen[None, :])[0])
        if own < 0.0:
            against[match.face_id] = seen
            odds.append(own)
            best.setdefault(match.station, match)
    if not against:
        return None
    place = [match.overlap * place_log_odds(match.offset_m, match.offset_sigma_m, options) for match in best.values()]
    return OtherColour(faces=against, log_odds=sum(place) + float(np.median(odds)))


def place_log_odds(offset_m: float, sigma_m: float, options: ProgressOptions) -> float:
    """Return log p(offset | concrete) / p(offset | formwork, or now and then anything) of a face before its design."""
    spread = math.hypot(options.building_tolerance_m / options.sigmas, sigma_m)
    concrete = math.exp(-0.5 * (offset_m / spread) ** 2) / (spread * math.sqrt(2.0 * math.pi))
    least, most = FORMWORK_M
    formwork = (_below(offset_m, least, sigma_m) - _below(offset_m, most, sigma_m)) / (most - least)
    other = (1.0 - OF_ANOTHER) * formwork + OF_ANOTHER / (2.0 * most)
    return math.log(max(concrete, 1e-300) / other)


def _below(offset_m: float, edge_m: float, sigma_m: float) -> float:
    """Return the probability that an edge lies nearer the design than an offset that errs by so much."""
    return 0.5 * math.erfc((edge_m - offset_m) / (math.sqrt(2.0) * max(sigma_m, 1e-6)))
