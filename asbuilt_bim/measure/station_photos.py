"""The photos of one station: decoded, rectified, and held against the rig; or the station rejected by name."""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from asbuilt_bim.camera.photo.check import check_photo_against_rig
from asbuilt_bim.camera.photo.overlap import check_pair, match_pair
from asbuilt_bim.camera.photo.quality import StationQuality, quality_of
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.camera.photo.swapped import swapped_rejection
from asbuilt_bim.camera.photo.veil import veil_faults
from asbuilt_bim.camera.photo.working_size import at_working_size
from asbuilt_bim.camera.rectify import Rectification, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, Subject, SubjectKind, about
from asbuilt_bim.errors import PhotoError, Rejection, RigError, rejected
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.vision.stereo.rig_health import StationHealth, judge, station_health
from asbuilt_bim.vision.stereo.rig_rejection import rig_rejection

SAME_SHARE = 0.5
"""Of what a photo differs from itself moved by one pixel: two cameras, a decimetre apart, differ by more than all."""
CERTAIN_SIGMAS = 5.0
"""In sigmas: one station alone says that the rig was knocked; below, its visit decides."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationPhotos:
    """The two photos of one station."""

    name: str
    left: Photo
    right: Photo


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RejectedStation:
    """A station that could not be measured, with its reasons and, where one could be read, its picture."""

    station: str
    rejections: tuple[Rejection, ...]
    picture: ByteImage | None = None
    health: StationHealth | None = None  # of the rig, where the photos show something of it
    scale: ScaleEvidence | None = None  # None where the station was refused before its target and markers were read
    quality: StationQuality | None = None  # None where it was refused before its photos were looked at


def read_station(
    photos: StationPhotos, rig: StereoRig, working: StereoRig | None = None
) -> tuple[RectifiedPair, StationQuality] | RejectedStation:
    """Decode, check and rectify both photos, and measure their quality; what can't be used rejects the station by name.

    `working`: the rig at its working size (`working_rig`), where that isn't the photos' own.
    """
    station = about(SubjectKind.STATION, photos.name)
    images: list[ByteImage] = []
    rejections: list[Rejection] = []
    most = max(camera.width_px * camera.height_px for camera in (rig.left, rig.right))
    for photo, side in ((photos.left, "left"), (photos.right, "right")):
        foreign = check_photo_against_rig(photo, photo.size_px, rig, "left" if side == "left" else "right")
        found = [replace(one, subject=replace(one.subject, station=photos.name)) for one in foreign]
        try:
            images += [decode(photo)] if math.prod(photo.size_px) <= most else []  # of a larger one, none needs pixels
        except PhotoError as error:
            found = [rejected(Reason.PHOTO_UNUSABLE, station, photo=photo.name, detail=str(error))]
        rejections += found
    rejections = _both_sides(station, rejections, photos)
    if len(images) == 2 and images[0].shape != images[1].shape and rig.left.width_px == rig.right.width_px:
        rejections.append(_sizes(station, images))
    if len(images) == 2 and not rejections:
        twice = _one_photo_twice(station, images)
        rejections += [twice] if twice is not None else []
    picture = images[0] if images else None
    if rejections or len(images) < 2:
        return RejectedStation(station=photos.name, rejections=tuple(rejections), picture=picture)
    worked = working or rig
    left, right = at_working_size(images[0], worked.left), at_working_size(images[1], worked.right)
    try:
        prepared = _prepared(worked)
        pair = rectify(prepared, left, right, photos.name)
        return pair, quality_of(*prepared.taken(left, right), photos.left.data, photos.right.data)
    except (PhotoError, RigError, cv2.error) as error:
        unusable = rejected(Reason.PHOTOS_UNUSABLE, station, detail=str(error))
        return RejectedStation(station=photos.name, rejections=(unusable,), picture=picture)


def _both_sides(station: Subject, rejections: list[Rejection], photos: StationPhotos) -> list[Rejection]:
    """Say once, of the station, that its two photos are exchanged, where each says so of itself; or of one camera."""
    each = [one for one in rejections if one.code is Reason.PHOTO_OF_OTHER_SIDE]
    if len(each) == 1 and photos.left.exif.serial == photos.right.exif.serial:
        side = "right" if each[0].values["side"] == "left" else "left"
        alone = rejected(Reason.PHOTOS_OF_ONE_CAMERA, station, side=side, serial=each[0].values["serial"])
        return [alone, *(one for one in rejections if one not in each)]
    if len(each) != 2:
        return rejections
    left, right = (one.values["serial"] for one in each)
    swapped = rejected(Reason.PHOTOS_OF_OTHER_SIDES, station, left_serial=left, right_serial=right)
    return [swapped, *(one for one in rejections if one not in each)]


def _sizes(station: Subject, images: list[ByteImage]) -> Rejection:
    left, right = ((int(image.shape[1]), int(image.shape[0])) for image in images)
    return rejected(Reason.PHOTOS_DIFFER_IN_SIZE, station, left_px=left, right_px=right)


def _one_photo_twice(station: Subject, images: list[ByteImage]) -> Rejection | None:
    """Say so where both are one photo, saved again maybe: nothing in it has moved by as much as a pixel."""
    left, right = images
    if left.shape != right.shape:
        return None
    differ, moved = (cv2.norm(a, b, cv2.NORM_L1) / a.size for a, b in ((left, right), (left[:, 1:], left[:, :-1])))
    if differ >= SAME_SHARE * moved:
        return None
    return rejected(Reason.PHOTO_TWICE, station, differ_grey=differ, limit_grey=SAME_SHARE * moved)


_RIGS: dict[bytes, Rectification] = {}


def _prepared(rig: StereoRig) -> Rectification:
    """Return the rig's rectification, kept from station to station: the maps take half a second."""
    key = b"".join(
        np.ascontiguousarray(part).tobytes()
        for part in (
            rig.left.K, rig.left.distortion, rig.right.K, rig.right.distortion, rig.right_from_left,
            np.array([rig.left.width_px, rig.left.height_px, rig.right.width_px, rig.right.height_px]),
        )
    )  # fmt: skip
    if key not in _RIGS:
        _RIGS.clear()
        _RIGS[key] = rectification(rig)
    return _RIGS[key]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigCheck:
    """What a pair says of its rig, and why it can't be measured with it; no rejections where it can.

    `faults` are of its lenses: they may be why there are rejections.
    """

    health: StationHealth | None
    rejections: tuple[Rejection, ...]
    faults: tuple[Rejection, ...] = ()


def check_rig(pair: RectifiedPair, rig: StereoRig) -> RigCheck:
    """Check a pair and its rig from features that both photos show.

    A knocked rig is named as such before its rows are held against the pair: matches that one turned camera explains
    do belong together. Exchanged photos look like a knock, and say nothing of the rig.
    """
    coarse = match_pair(pair)
    faults = tuple(veil_faults(pair, coarse))
    health = station_health(pair, coarse, rig)
    if health is not None:
        verdict = judge([health], rig, significant=CERTAIN_SIGMAS)
        if verdict.state == "knocked":
            swapped = swapped_rejection(pair.name, coarse, rig, pair.camera)
            if swapped is not None:
                return RigCheck(health=None, rejections=(swapped,), faults=faults)
            station = about(SubjectKind.STATION, pair.name)
            return RigCheck(
                health=health,
                rejections=(rig_rejection(Reason.RIG_KNOCKED, station, verdict),),
                faults=faults,
            )
    rejections = check_pair(pair, coarse)
    return RigCheck(health=None if rejections else health, rejections=rejections, faults=faults)
