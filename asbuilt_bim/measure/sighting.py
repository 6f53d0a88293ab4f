"""A station as far as it takes no stereo: read, held against its rig, target and markers found; or refused by name.

The first part of measuring it, and all that a check on site needs.
"""

from dataclasses import dataclass

from asbuilt_bim.camera.photo.chroma import is_grey
from asbuilt_bim.camera.photo.quality import StationQuality, photo_faults
from asbuilt_bim.camera.photo.working_size import working_rig
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind, Values, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.measure.options import MeasureOptions
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence, scale_evidence, without_scale
from asbuilt_bim.measure.station_photos import RejectedStation, StationPhotos, check_rig, read_station
from asbuilt_bim.measure.step_timer import StepTimer
from asbuilt_bim.vision.markers.find import MarkerSighting, markers_and_twice, other_family
from asbuilt_bim.vision.stereo.rig_health import StationHealth
from asbuilt_bim.vision.target.find import TargetSighting, find_target


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sighted:
    """A rectified pair whose scale is known."""

    photos: StationPhotos
    pair: RectifiedPair
    rig: StereoRig
    health: StationHealth | None
    scale: ScaleEvidence
    target: TargetSighting | None
    markers: tuple[MarkerSighting, ...]
    reasons: tuple[Rejection, ...]
    quality: StationQuality


def sight_station(
    photos: StationPhotos, rig: StereoRig, options: MeasureOptions, timer: StepTimer
) -> Sighted | RejectedStation:
    """Read a pair and find its target and markers; what can't be measured is a `RejectedStation` with its reasons."""
    worked = working_rig(rig, options.most_width_px)
    read = read_station(photos, rig, worked)
    if isinstance(read, RejectedStation):
        return read
    pair, quality = read
    timer.done("read")
    faults = photo_faults(quality, photos.name)
    checked = check_rig(pair, worked)
    faults = (*faults, *checked.faults)
    if checked.rejections:
        return RejectedStation(
            station=photos.name, rejections=(*faults, *checked.rejections), picture=pair.left, health=checked.health,
            quality=quality,
        )  # fmt: skip
    timer.done("check")
    target, found = find_target(pair, options.target)
    reasons = (*faults, *found)
    if is_grey(pair.left) or is_grey(pair.right):
        grey = rejected(Reason.PHOTOS_GREY, about(SubjectKind.STATION, photos.name))
        reasons, found = (*reasons, grey), (grey, *found) if target is None else found
    markers, twice = markers_and_twice(pair, options.marker_family)
    lost = tuple(rejected(Reason.MARKER_TWICE, about(SubjectKind.MARKER, str(one), photos.name)) for one in twice)
    reasons = (*reasons, *lost)
    if not markers and (other := other_family(pair, options.marker_family)):
        station = about(SubjectKind.STATION, photos.name)
        values: Values = {"family": options.marker_family, "other": other[0], "found": other[1]}
        reasons = (*reasons, rejected(Reason.MARKERS_OF_OTHER_FAMILY, station, **values))
    scale = scale_evidence(pair, target, markers, options.target)
    timer.done("target and markers")
    least = options.least_markers_without_target
    refused = without_scale(photos.name, target, found, markers, required=options.target.required, least=least)
    if refused:
        return RejectedStation(
            station=photos.name, rejections=(*faults, *refused, *lost), picture=pair.left, health=checked.health,
            scale=scale, quality=quality,
        )  # fmt: skip
    return Sighted(
        photos=photos, pair=pair, rig=worked, health=checked.health, scale=scale, target=target, markers=markers,
        reasons=reasons, quality=quality,
    )  # fmt: skip
