"""What the program itself says of a rig from pairs of photos, and what `--refine-rig` would make of it."""

from __future__ import annotations

from collections.abc import Sequence

from asbuilt_bim.camera.photo.overlap import match_pair
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.of_rig import effect_text, turn_text
from asbuilt_bim.vision.stereo.rig_health import RigVerdict, judge, station_health
from asbuilt_bim.vision.stereo.rig_rejection import RIG, rig_rejection
from benchmarks.table import Line, told


def verdict_of(pairs: Sequence[RectifiedPair], rig: StereoRig) -> RigVerdict | None:
    """Judge the rig from all pairs together, as a visit's stations are; None where no pair has matches enough."""
    found = [station_health(pair, match_pair(pair), rig) for pair in pairs]
    healths = [health for health in found if health is not None]
    return judge(healths, rig) if healths else None


def verdict_lines(verdict: RigVerdict) -> list[Line]:
    """Tell the verdict; only a rig that is doubtful or knocked is measured with refined by `--refine-rig`."""
    n = len(verdict.stations)
    values = rig_rejection(Reason.RIG_MOVED, RIG, verdict).values
    return [
        told("  the program on this rig, from the photos themselves", verdict.state, n),
        told(f"    {turn_text(values)}", "", n),
        told(f"    {effect_text(values)}", "", n),
    ]
