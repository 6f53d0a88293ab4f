"""How long each step of a station takes, by a clock that is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

Clock = Callable[[], float]


@dataclass(slots=True, kw_only=True)
class Laps:
    """Seconds by step, in the order of the steps."""

    clock: Clock
    last: float
    seconds: dict[str, float] = field(default_factory=dict)

    def lap(self, step: str) -> None:
        """Note what has passed since the last lap as the seconds of `step`."""
        now = self.clock()
        self.seconds[step] = now - self.last
        self.last = now
