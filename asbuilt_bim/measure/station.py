"""One station measured: two photos in; faces, sightings and a small depth map out. Knows nothing of the design."""

import time
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.photo.quality import StationQuality, clipped
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import NetworkError, Rejection
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.measure.clipped import ends_clipped, unclipped
from asbuilt_bim.measure.depth_reference import DepthReference, pack
from asbuilt_bim.measure.depth_source import area_depth, depth_method
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.options import MeasureOptions
from asbuilt_bim.measure.paper import paper_faces
from asbuilt_bim.measure.sighting import Sighted, sight_station
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.measure.station_faces import measure_faces, thumbnail
from asbuilt_bim.measure.station_photos import RejectedStation, StationPhotos
from asbuilt_bim.measure.step_timer import Clock, StepTimer
from asbuilt_bim.measure.workbench import marks_mask, without_boards
from asbuilt_bim.vision.markers.find import MarkerSighting
from asbuilt_bim.vision.masks.fusion import Agreed, agree
from asbuilt_bim.vision.masks.people import without_people
from asbuilt_bim.vision.masks.segment import Instance, Segmenter
from asbuilt_bim.vision.masks.split_by_depth import split_by_depth
from asbuilt_bim.vision.scene.bars import without_bars
from asbuilt_bim.vision.scene.far_surface import far_surface
from asbuilt_bim.vision.scene.geometric import of_concretes_colour, upright_instances
from asbuilt_bim.vision.scene.read import Scene, read_scene
from asbuilt_bim.vision.scene.sky import find_sky, without_sky
from asbuilt_bim.vision.stereo.depth import DepthMap, RelativeDepth
from asbuilt_bim.vision.stereo.matching import StereoMatcher, depth_map
from asbuilt_bim.vision.stereo.occluder_free import occluder_free_disparity
from asbuilt_bim.vision.stereo.rig_health import StationHealth
from asbuilt_bim.vision.target.find import TargetSighting

__all__ = [
    "DepthReference",
    "MeasureOptions",
    "Models",
    "RejectedStation",
    "StationDetail",
    "StationMeasurement",
    "StationPhotos",
    "measure_in_detail",
    "measure_station",
    "sighted_alone",
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Models:
    """What stands in the place of, or beside, this package's own means; None: there is none.

    `segmenter` replaces geometry. `opinion` is used beside it: its instances and the geometry's are brought together.
    `relative_depth` is for `depth: paper` and `depth: fused`. `matcher` replaces semi-global matching.
    """

    segmenter: Segmenter | None = None
    opinion: Segmenter | None = None
    relative_depth: RelativeDepth | None = None
    matcher: StereoMatcher | None = None


OWN = Models()


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
    health: StationHealth | None = None  # of the rig; None where too few matches say anything of it
    scale: ScaleEvidence | None = None  # what target and markers show of the rig's scale
    quality: StationQuality | None = None  # of its photos; what is wrong with them stands in `rejections`, first
    before_px: tuple[FloatArray, ...] | None = (
        None  # rings round what stands before its faces; None: not looked for yet
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationDetail:
    """A measurement with what it was made from, for pictures; all in the rectified left frame.

    `depth` is the map that the areas come from; `instances` are those that `MeasuredFace.instance` counts.
    """

    measurement: StationMeasurement
    pair: RectifiedPair
    shown: RectifiedPair  # for pictures: as `pair`, people made unrecognisable where a network finds them
    depth: DepthMap
    instances: tuple[Instance, ...]


def measure_station(
    photos: StationPhotos,
    rig: StereoRig,
    options: MeasureOptions,
    clock: Clock = time.perf_counter,
    models: Models = OWN,
) -> StationMeasurement | RejectedStation:
    """Measure one station; what can't be measured is a `RejectedStation` with its reasons, never an exception.

    A pure function of its arguments but for the seconds that `clock` counts.
    """
    found = measure_in_detail(photos, rig, options, clock, models)
    if isinstance(found, RejectedStation) and found.picture is not None:
        return replace(found, picture=_shown(found.picture, models))
    return found.measurement if isinstance(found, StationDetail) else found


def _shown(picture: ByteImage, models: Models) -> ByteImage | None:
    """Return a rejected station's picture without people; none where the network that finds them fails on it."""
    try:
        return without_people(picture, models.opinion)
    except NetworkError:
        return None


def measure_in_detail(
    photos: StationPhotos,
    rig: StereoRig,
    options: MeasureOptions,
    clock: Clock = time.perf_counter,
    models: Models = OWN,
) -> StationDetail | RejectedStation:
    """Measure one station and keep what its pictures are drawn from; else as `measure_station`."""
    timer = StepTimer(clock)
    seen = sight_station(photos, rig, options, timer)
    return seen if isinstance(seen, RejectedStation) else _measure(seen, options, models, timer)


def _measure(
    seen: Sighted, options: MeasureOptions, models: Models, timer: StepTimer
) -> StationDetail | RejectedStation:
    pair, target = seen.pair, seen.target
    stereo = depth_map(pair, models.matcher or options.matcher)
    sky, blind = find_sky(pair, stereo), clipped(pair.left)
    timer.done("stereo")
    wanted = depth_method(options.method, options.depth)
    depth = area_depth(pair, stereo, target, models.relative_depth, wanted, options.inversion)
    if isinstance(depth, Rejection):
        reasons = (*seen.reasons, depth)
        return RejectedStation(station=seen.photos.name, rejections=reasons, picture=pair.left, health=seen.health)
    if depth is not stereo:
        timer.done("depth network")
    scene = read_scene(pair, stereo if options.method == "paper" else depth, options.geometric.scene)
    far = far_surface(scene, sky, options.geometric.scene.grow, pair.name)
    marks = marks_mask(pair.valid_left.shape, seen.markers, target)
    if options.method != "paper":
        scene = without_bars(scene, pair, marks)
    bars = scene.labels == scene.bars_label
    agreed = _instances(pair, scene, stereo, options, models)
    instances = without_boards([without_sky(one, sky | blind | bars) for one in agreed.instances], marks)
    timer.done("instances")
    if options.method == "paper":
        found = paper_faces(pair, depth, instances, options.faces)
    else:
        found = measure_faces(pair, scene, instances, seen.rig, options.faces, marks, sky)
    faces = ends_clipped(found.faces, blind)
    timer.done("faces")
    reference = pack(unclipped(stereo, blind), sky, np.where(blind, np.nan, occluder_free_disparity(pair, sky)))
    shown = replace(pair, left=without_people(pair.left, models.opinion))
    picture = thumbnail(shown)
    timer.done("pack")
    measurement = replace(
        sighted_alone(seen, picture, timer),
        faces=faces,
        depth_ref=reference,
        vertical=found.up,
        rejections=(*seen.reasons, *agreed.notes, *far, *found.rejections),
    )
    return StationDetail(measurement=measurement, pair=pair, shown=shown, depth=depth, instances=tuple(instances))


def sighted_alone(seen: Sighted, picture: bytes, timer: StepTimer) -> StationMeasurement:
    """Return what a pair says before stereo: target, markers, rig and photos. No face, and no depth to unpack."""
    return StationMeasurement(
        station=seen.photos.name,
        camera=seen.pair.camera,
        faces=(),
        target=seen.target,
        markers=seen.markers,
        depth_ref=DepthReference(png=b"", sigma_png=b"", scale=1),
        vertical=None,
        rejections=seen.reasons,
        seconds=timer.seconds,
        left_digest=seen.photos.left.digest,
        right_digest=seen.photos.right.digest,
        thumbnail_jpeg=picture,
        health=seen.health,
        scale=seen.scale,
        quality=seen.quality,
    )


def _instances(pair: RectifiedPair, scene: Scene, stereo: DepthMap, options: MeasureOptions, models: Models) -> Agreed:
    """Return the instances: those of the segmenter that stands in for geometry, of both opinions, or of geometry."""
    chosen = models.segmenter
    if chosen is None and models.opinion is not None:
        if options.method == "default":
            return agree(pair, scene, stereo, models.opinion, options.geometric)
        chosen = models.opinion  # as published: the network's masks as they are
    if chosen is None:
        grey, notes = of_concretes_colour(upright_instances(pair, scene, options.geometric), pair.name)
        return Agreed(instances=tuple(grey), notes=notes)
    found = chosen.segment(pair, stereo)
    if options.method == "default":
        found = [split_by_depth(instance, pair, scene, options.geometric) for instance in found]
    return Agreed(instances=tuple(found), notes=())
