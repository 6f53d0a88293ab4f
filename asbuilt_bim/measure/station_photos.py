"""The photos of one station: decoded, rectified, and held against the rig; or the station rejected by name."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.photo.check import check_photo_against_rig
from asbuilt_bim.camera.photo.overlap import check_pair, match_pair
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.camera.photo.swapped import swapped_rejection
from asbuilt_bim.camera.photo.working_size import at_working_size
from asbuilt_bim.camera.rectify import Rectification, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import PhotoError, Rejection, RigError
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.vision.stereo.rig_health import StationHealth, judge, station_health
from asbuilt_bim.vision.stereo.rig_words import knock_rejection

SAME_SHARE = 0.5
"""Of what a photo differs from itself moved by one pixel: two cameras, a decimetre apart, differ by more than all."""
BEYOND_DOUBT = 5.0
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
    health: StationHealth | None = None  # of the rig, where the photos said something of it
    scale: ScaleEvidence | None = None  # None where the station was refused before its target and markers were read


def read_station(
    photos: StationPhotos, rig: StereoRig, working: StereoRig | None = None
) -> RectifiedPair | RejectedStation:
    """Decode, check and rectify both photos; what can't be used rejects the station by name.

    `working`: the rig at its working size (`working_rig`), where that isn't the photos' own.
    """
    what = f"station {photos.name}"
    images: list[ByteImage] = []
    rejections: list[Rejection] = []
    for photo, side in ((photos.left, "left"), (photos.right, "right")):
        try:
            image = decode(photo)
        except PhotoError as error:
            rejections.append(Rejection(what=what, reason=str(error)))
            continue
        size = (int(image.shape[1]), int(image.shape[0]))
        rejections += check_photo_against_rig(photo, size, rig, "left" if side == "left" else "right")
        images.append(image)
    if len(images) == 2 and images[0].shape != images[1].shape and rig.left.width_px == rig.right.width_px:
        rejections.append(_sizes(what, images))
    if len(images) == 2 and not rejections:
        twice = _one_photo_twice(what, images)
        rejections += [twice] if twice is not None else []
    picture = images[0] if images else None
    if rejections or len(images) < 2:
        named = tuple(r if photos.name in r.what else _named(r, what) for r in rejections)
        return RejectedStation(station=photos.name, rejections=named, picture=picture)
    worked = working or rig
    left, right = at_working_size(images[0], worked.left), at_working_size(images[1], worked.right)
    try:
        return rectify(_prepared(worked), left, right, photos.name)
    except (PhotoError, RigError, cv2.error) as error:
        return RejectedStation(
            station=photos.name, rejections=(Rejection(what=what, reason=str(error)),), picture=picture
        )


def _named(rejection: Rejection, station: str) -> Rejection:
    return Rejection(
        what=f"{station}, {rejection.what}", reason=rejection.reason, value=rejection.value, limit=rejection.limit,
        remedy=rejection.remedy,
    )  # fmt: skip


def _sizes(what: str, images: list[ByteImage]) -> Rejection:
    left, right = (f"{image.shape[1]} x {image.shape[0]} px" for image in images)
    return Rejection(
        what=what, reason="left and right photo differ in size", value=f"left {left}, right {right}",
        remedy="use both photos as the rig stored them",
    )  # fmt: skip


def _one_photo_twice(what: str, images: list[ByteImage]) -> Rejection | None:
    """Say so where both are one photo, saved again maybe: nothing in it has moved by as much as a pixel."""
    left, right = images
    if left.shape != right.shape:
        return None
    differ, moved = float(cv2.absdiff(left, right).mean()), float(cv2.absdiff(left[:, 1:], left[:, :-1]).mean())
    if differ >= SAME_SHARE * moved:
        return None
    return Rejection(
        what=what, reason="left and right are the same photo", value=f"they differ by {differ:.1f} grey levels",
        limit=f"{SAME_SHARE * moved:.1f}, half of what one pixel's shift makes",
        remedy="name the photo that the other camera took at the same moment",
    )  # fmt: skip


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
            swapped = swapped_rejection(f"station {pair.name}", coarse, rig, pair.camera)
            if swapped is not None:
                return RigCheck(health=None, rejections=(swapped,))
            return RigCheck(health=health, rejections=(knock_rejection(f"station {pair.name}", verdict),))
    rejections = check_pair(pair, coarse)
    return RigCheck(health=None if rejections else health, rejections=rejections)
