"""One station measured: two photos in; faces, sightings and a small depth map out. Knows nothing of the design."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from asbuilt_bim.camera.overlap import check_pair
from asbuilt_bim.camera.photo import Photo, decode
from asbuilt_bim.camera.photo_check import check_photo_against_rig
from asbuilt_bim.camera.rectify import Rectification, RectifiedCamera, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import PhotoError, Rejection, RigError
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.measure.depth_reference import DepthReference, pack
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.marks import marks_mask, without_boards
from asbuilt_bim.measure.station_faces import FaceOptions, measure_faces, thumbnail
from asbuilt_bim.vision.geometric import GeometricOptions, segment_scene
from asbuilt_bim.vision.markers import MarkerSighting, find_markers
from asbuilt_bim.vision.scene import read_scene
from asbuilt_bim.vision.sky import find_sky
from asbuilt_bim.vision.stereo import SemiGlobalMatcher, depth_map
from asbuilt_bim.vision.target import TargetOptions, TargetSighting, find_target

__all__ = [
    "DepthReference",
    "MeasureOptions",
    "RejectedStation",
    "StationMeasurement",
    "StationPhotos",
    "measure_station",
]

Clock = Callable[[], float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationPhotos:
    """The two photos of one station."""

    name: str
    left: Photo
    right: Photo


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureOptions:
    """The options of each step of a station's measurement."""

    target: TargetOptions = field(default_factory=TargetOptions)
    marker_family: str = "apriltag_36h11"  # the one that surveyors print; its corners decode at 20 px
    matcher: SemiGlobalMatcher = field(default_factory=SemiGlobalMatcher)
    geometric: GeometricOptions = field(default_factory=GeometricOptions)
    faces: FaceOptions = field(default_factory=FaceOptions)
    least_markers_without_target: int = 2  # with `target.required: false`, two surveyed markers hold the scale


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationMeasurement:
    """All that one photo pair says, in its own left frame; knows nothing of the design."""

    station: str
    camera: RectifiedCamera
    faces: tuple[MeasuredFace, ...]
    target: TargetSighting | None
    markers: tuple[MarkerSighting, ...]
    depth_ref: DepthReference
    vertical: FloatArray | None  # (3,) up in the left frame, from the station's own faces; None where they don't say
    rejections: tuple[Rejection, ...]
    seconds: dict[str, float]  # by step
    left_digest: str
    right_digest: str
    thumbnail_jpeg: (
        bytes  # the rectified left photo without EXIF, for overlays when the photos are gone; at most 1280 px wide
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RejectedStation:
    """A station that could not be measured, with its reasons and, where one could be read, its picture."""

    station: str
    rejections: tuple[Rejection, ...]
    picture: ByteImage | None = None


@dataclass(slots=True, kw_only=True)
class _Stopwatch:
    """Seconds by step, in the order of the steps."""

    clock: Clock
    last: float
    seconds: dict[str, float] = field(default_factory=dict)

    def lap(self, step: str) -> None:
        now = self.clock()
        self.seconds[step] = now - self.last
        self.last = now


def measure_station(
    photos: StationPhotos, rig: StereoRig, options: MeasureOptions, clock: Clock = time.perf_counter
) -> StationMeasurement | RejectedStation:
    """Measure one station; what can't be measured is a `RejectedStation` with its reasons, never an exception.

    A pure function of its arguments but for the seconds that `clock` counts.
    """
    watch = _Stopwatch(clock=clock, last=clock())
    pair = _read(photos, rig)
    if isinstance(pair, RejectedStation):
        return pair
    watch.lap("read")
    rejections = list(check_pair(pair))
    if rejections:
        return RejectedStation(station=photos.name, rejections=tuple(rejections), picture=pair.left)
    watch.lap("check")
    target, reasons = find_target(pair, options.target)
    markers = find_markers(pair, options.marker_family)
    watch.lap("target and markers")
    refused = _without_scale(photos.name, target, reasons, markers, options)
    if refused:
        return RejectedStation(station=photos.name, rejections=refused, picture=pair.left)
    return _measure(photos, pair, rig, options, target, markers, reasons, watch)


def _measure(
    photos: StationPhotos,
    pair: RectifiedPair,
    rig: StereoRig,
    options: MeasureOptions,
    target: TargetSighting | None,
    markers: tuple[MarkerSighting, ...],
    reasons: tuple[Rejection, ...],
    watch: _Stopwatch,
) -> StationMeasurement:
    depth = depth_map(pair, options.matcher)
    sky = find_sky(pair, depth)
    watch.lap("stereo")
    scene = read_scene(pair, depth, options.geometric.scene)
    marks = marks_mask(pair.valid_left.shape, markers, target)
    instances = without_boards(segment_scene(pair, scene, options.geometric), marks)
    watch.lap("instances")
    found = measure_faces(pair, scene, instances, rig, options.faces, marks)
    watch.lap("faces")
    reference, picture = pack(depth, sky), thumbnail(pair)
    watch.lap("pack")
    return StationMeasurement(
        station=photos.name,
        camera=pair.camera,
        faces=found.faces,
        target=target,
        markers=markers,
        depth_ref=reference,
        vertical=found.up,
        rejections=(*reasons, *found.rejections),
        seconds=watch.seconds,
        left_digest=photos.left.digest,
        right_digest=photos.right.digest,
        thumbnail_jpeg=picture,
    )


def _read(photos: StationPhotos, rig: StereoRig) -> RectifiedPair | RejectedStation:
    """Decode, check and rectify both photos."""
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
    picture = images[0] if images else None
    if rejections or len(images) < 2:
        named = tuple(r if photos.name in r.what else _named(r, what) for r in rejections)
        return RejectedStation(station=photos.name, rejections=named, picture=picture)
    try:
        return rectify(_prepared(rig), images[0], images[1], photos.name)
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


def _without_scale(
    name: str,
    target: TargetSighting | None,
    reasons: tuple[Rejection, ...],
    markers: tuple[MarkerSighting, ...],
    options: MeasureOptions,
) -> tuple[Rejection, ...]:
    """Return why a station without a target can't be used; empty where it can."""
    if target is not None:
        return ()
    if options.target.required:
        return reasons or (Rejection(what=f"station {name}", reason="the target is not in view"),)
    both = sum(1 for marker in markers if marker.right_px is not None)
    if both >= options.least_markers_without_target:
        return ()
    few = Rejection(
        what=f"station {name}", reason="neither the target nor enough markers in view of both photos",
        value=f"{both} markers", limit=f"{options.least_markers_without_target} markers",
        remedy="place the red target, or move so that both photos show two surveyed markers",
    )  # fmt: skip
    return (*reasons, few)


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
