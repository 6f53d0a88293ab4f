"""How long each step takes, by a clock that is given: of a station, or of a whole run."""

from collections.abc import Callable
from dataclasses import dataclass, field

Clock = Callable[[], float]


@dataclass(slots=True)
class StepTimer:
    """Adds up seconds by step, in the order of the steps."""

    clock: Clock
    seconds: dict[str, float] = field(default_factory=dict)
    last: float = field(init=False)

    def __post_init__(self) -> None:
        """Start the clock."""
        self.last = self.clock()

    def done(self, step: str) -> None:
        """Count what has passed since the step before as seconds of `step`."""
        now = self.clock()
        self.seconds[step] = self.seconds.get(step, 0.0) + now - self.last
        self.last = now
