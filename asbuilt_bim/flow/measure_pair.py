"""Measuring one photo pair from files, in a few lines: the Python face of `asbuilt-bim measure`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Integral, Real
from pathlib import Path
from typing import get_args

from asbuilt_bim.camera.photo.read import Photo, read_photo, side_by_side
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import RigReading, read_rig_files
from asbuilt_bim.camera.rig_formats.rig_file import checked_rig
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import MaskError, MeasureError, OptionError, rejected
from asbuilt_bim.measure.pair import PairMeasurement, measure_photos
from asbuilt_bim.measure.station import MeasureOptions, StationPhotos
from asbuilt_bim.project.networks import NetworkChoice, load_models, try_networks
from asbuilt_bim.project.tables.outlines import outside_photo
from asbuilt_bim.report.wording.reasons import reason_lines
from asbuilt_bim.storage.plugins import PREFIX
from asbuilt_bim.storage.regular_file import path_of
from asbuilt_bim.vision.masks.file import MaskFile, read_masks
from asbuilt_bim.vision.masks.given import GivenMasks
from asbuilt_bim.vision.masks.segment import InstanceClass
from asbuilt_bim.vision.networks.bundled import BUNDLED

DIAMETERS_M = 0.05, 2.0  # of red discs, as project files and the command line have them


def measure_pair(
    left: Path | str,
    right: Path | str | None,
    rig: StereoRig | Path | str | Sequence[Path | str],
    *,
    rig_cameras: Sequence[str] = (),
    target_diameter_m: float | None = None,
    target: bool = True,
    masks: Path | str | None = None,
    mask_classes: Mapping[int, InstanceClass] | None = None,
    segment_network: Path | str = "",
    depth_network: Path | str = "",
    refine_rig: bool = False,
    options: MeasureOptions | None = None,
) -> PairMeasurement:
    """Measure the walls and columns of one photo pair; prints nothing, writes nothing.

    `right` None: `left` holds both eyes side by side. `rig`: a rig, or the files that it is in, left first;
    `rig_cameras` names the left and the right one where a file holds more.
    `target` False measures without the red disc: the scale is the rig's baseline, and nothing checks it.
    `masks` (PNG of labels, COCO JSON, clicked polygons; pixels of the ORIGINAL left photo) say what is measured;
    geometry finds it where there are none, together with `segment_network`. `mask_classes` says what a PNG's labels
    are. A network is named by the path of its card, as `bundled` (the one that is shipped), or as `plugin:NAME`.
    `refine_rig`: a rig that has moved is taken as the pair's own photos show it; `rig` of the answer is that one.

    Raises:
        RigError: the rig file can't be read, or the rig can't be one.
        PhotoError: a photo can't be read.
        MaskError: the masks can't be used.
        NetworkError, PluginError: a network can't be used.
        MeasureError: the pair can't be measured; the message holds every reason.
        OptionError: what is given is no path, no number, or no class of a mask.
    """
    _check_diameter(target_diameter_m)
    _check_classes(mask_classes)
    segment, depth = _network(segment_network, "segment_network"), _network(depth_network, "depth_network")
    made = RigReading(rig=checked_rig(rig)) if isinstance(rig, StereoRig) else None
    left = path_of(left, "left")
    photos = _photos(left, None if right is None else path_of(right, "right"))
    reading = made or _read(rig, tuple(rig_cameras), photos)
    rig = reading.rig
    choice = NetworkChoice(segment=segment, depth=depth)
    try_networks(choice)
    models = load_models(choice)
    left_out: tuple[str, ...] = ()
    if masks is not None:
        read = _masks(path_of(masks, "masks"), rig, left.name, mask_classes)
        given = GivenMasks(photo=rig.left, masks=read.masks)
        models, left_out = replace(models, segmenter=given, opinion=None), read.left_out
    chosen = options or MeasureOptions()
    asked = replace(chosen.target, required=target, diameter_m=target_diameter_m)
    try:
        found = measure_photos(photos, rig, replace(chosen, target=asked), models, refine=refine_rig)
    except MeasureError as problem:
        raise MeasureError(reason_lines(problem), problem.rejections) from problem
    file = about(SubjectKind.FILE, Path(str(masks)).name)
    unused = [rejected(Reason.MASK_UNUSED, file, detail=text) for text in left_out]
    return replace(found, rejections=(*reading.warnings, *found.rejections, *unused))


def _masks(path: Path, rig: StereoRig, photo_name: str, classes: Mapping[int, InstanceClass] | None) -> MaskFile:
    """Read masks; a polygon beside the photo was clicked on another picture.

    Raises:
        MaskError: they can't be used.
    """
    size = (rig.left.width_px, rig.left.height_px)
    read = read_masks(path, size, photo_name, classes)
    for name, ring in ((mask.name, rings[0]) for mask in read.masks for rings in mask.polygons):
        if outside_photo(ring, size):
            raise MaskError(
                f"masks {path}: {name} lies beside the photo of {size[0]} x {size[1]} px; masks are of the ORIGINAL one"
            )
    return read


def _check_diameter(diameter_m: object) -> None:
    if diameter_m is None:
        return
    if not isinstance(diameter_m, Real) or isinstance(diameter_m, bool):
        raise OptionError(f"target_diameter_m: {diameter_m!r:.60} is no number; give metres, such as 0.3")
    if not DIAMETERS_M[0] <= float(diameter_m) <= DIAMETERS_M[1]:  # nan is neither
        raise MeasureError(
            f"target_diameter_m: {float(diameter_m):g} m, limit {DIAMETERS_M[0]:g} to {DIAMETERS_M[1]:g} m; measure "
            "the red disc, or leave it out"
        )


def _check_classes(classes: object) -> None:
    given = {} if classes is None else classes
    if not isinstance(given, Mapping) or not all(
        isinstance(label, Integral) and name in get_args(InstanceClass) for label, name in given.items()
    ):
        raise OptionError(
            f"mask_classes: {classes!r:.60} doesn't give wall or column to label numbers; write it as "
            "{1: 'wall', 2: 'column'}"
        )


def _read(rig: object, cameras: tuple[str, ...], photos: StationPhotos) -> RigReading:
    """Read a rig's files: what they don't say of the photos' size, the photos do."""
    files = [rig] if isinstance(rig, Path | str) else list(rig) if isinstance(rig, Sequence) else []
    return read_rig_files(files, Foreign(cameras=cameras, photo_px=photos.left.size_px))


def _photos(left: Path, right: Path | None) -> StationPhotos:
    """Read a pair from two files, or from one that holds both eyes.

    Raises:
        MeasureError: one file is given twice.
    """
    if right is None:
        one, other = side_by_side(_photo(left))
        return StationPhotos(name=left.stem, left=one, right=other)
    if left.resolve() == right.resolve():
        raise MeasureError(
            f"{left}: is given as the left and as the right photo; name the pair's two, or --side-by-side"
        )
    return StationPhotos(name=left.stem, left=_photo(left), right=_photo(right))


def _photo(path: Path) -> Photo:
    """Read a photo that results name by its bare name: folders are nobody else's business."""
    return replace(read_photo(path), name=path.name)


def _network(named: Path | str, argument: str) -> str:
    """Return a card's absolute path, or `bundled` and `plugin:NAME` as they are."""
    card, text = path_of(named, argument), str(named)
    return text if text in ("", BUNDLED) or text.startswith(PREFIX) else str(card.absolute())
