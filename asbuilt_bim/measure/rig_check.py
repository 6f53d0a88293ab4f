"""Before a station is measured: do its photos belong together, and does the rig still stand as calibrated?"""

from __future__ import annotations

from dataclasses import dataclass

from asbuilt_bim.camera.photo.overlap import check_pair, match_pair
from asbuilt_bim.camera.photo.swapped import swapped_rejection
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.vision.stereo.rig_health import StationHealth, judge, station_health
from asbuilt_bim.vision.stereo.rig_rejection import rig_rejection

BEYOND_DOUBT = 5.0
"""In sigmas: one station alone says that the rig was knocked; below, its visit decides."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigCheck:
    """What a pair says of its rig, and why it can't be measured with it; no rejections where it can."""

    health: StationHealth | None
    rejections: tuple[Rejection, ...]


def check_rig(pair: RectifiedPair, rig: StereoRig) -> RigCheck:
    """Check a pair and its rig from features that both photos show.

    A knocked rig is named as such before its rows are held against the pair: matches that one turned camera explains
    do belong together. Exchanged photos look like a knock, and say nothing of the rig.
    """
    coarse = match_pair(pair)
    health = station_health(pair, coarse, rig)
    if health is not None:
        verdict = judge([health], rig, significant=BEYOND_DOUBT)
        if verdict.state == "knocked":
            swapped = swapped_rejection(pair.name, coarse, rig, pair.camera)
            if swapped is not None:
                return RigCheck(health=None, rejections=(swapped,))
            station = Subject(kind=SubjectKind.STATION, name=pair.name)
            return RigCheck(health=health, rejections=(rig_rejection(Reason.RIG_KNOCKED, station, verdict),))
    rejections = check_pair(pair, coarse)
    return RigCheck(health=None if rejections else health, rejections=rejections)
