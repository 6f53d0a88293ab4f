"""Every option of the flow, step by step; the project file's `options` sets them by name."""

from dataclasses import dataclass, field

from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.measure.station import MeasureOptions
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.register.options import RegisterOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """The options of each step; the target and the markers of the project go into `measure` when the flow starts."""

    measure: MeasureOptions = field(default_factory=MeasureOptions)
    register: RegisterOptions = field(default_factory=RegisterOptions)
    match: MatchOptions = field(default_factory=MatchOptions)
    progress: ProgressOptions = field(default_factory=ProgressOptions)
