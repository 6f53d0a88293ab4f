"""What moves a whole side of a face beyond what its own fit leaves open: blur, tone and shade.

The numbers are fitted on rendered sides whose true place is known (benchmarks/faces/fit_sides.py writes sides.json).
"""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

DATA = Path(__file__).with_name("sides.json")


@dataclass(frozen=True, slots=True, kw_only=True)
class SideSigmas:
    """Standard deviations in px: of every edge, and of a level one beside: shade at a foot, a top's upper side."""

    edge: float
    level: float


@lru_cache(maxsize=1)
def side_sigmas() -> SideSigmas:
    """Read the fitted numbers that lie in the package."""
    held = json.loads(DATA.read_text(encoding="utf-8"))
    return SideSigmas(**{name: held[f"{name}_px"] for name in ("edge", "level")})
