"""Reads any rig file, whichever program or maker it is of, recognised by its content."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.basalt import basalt_rig, is_basalt
from asbuilt_bim.camera.rig_formats.camera_types import serial_of, type_of
from asbuilt_bim.camera.rig_formats.contradictions import Doubts, against_other, against_type, refuse_size
from asbuilt_bim.camera.rig_formats.factory import with_doubt, with_factory_width
from asbuilt_bim.camera.rig_formats.kalibr import camchain_rig, camchain_text, euroc_rig, is_camchain, is_euroc
from asbuilt_bim.camera.rig_formats.matlab import (
    bouguet_rig,
    is_bouguet,
    is_stereo_parameters,
    stereo_parameters_rig,
    zed_listing_rig,
    zed_listings,
)
from asbuilt_bim.camera.rig_formats.metashape import is_metashape, metashape_rig
from asbuilt_bim.camera.rig_formats.middlebury import is_middlebury, middlebury_rig
from asbuilt_bim.camera.rig_formats.oak import is_oak, oak_rig
from asbuilt_bim.camera.rig_formats.opencv import Foreign, is_opencv, opencv_rig, opencv_text
from asbuilt_bim.camera.rig_formats.parts import is_camera, is_pose, named_cameras, rig_of_parts
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.realsense import is_realsense, realsense_rig
from asbuilt_bim.camera.rig_formats.rig_file import FORMAT, own_rig, rig_problems, rig_text
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.ros import is_camera_info, ros_rig, ros_texts
from asbuilt_bim.camera.rig_formats.text import read_document
from asbuilt_bim.camera.rig_formats.zed import is_zed, zed_rig
from asbuilt_bim.errors import Rejection, RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.storage.atomic_write import replace_all, writing
from asbuilt_bim.storage.regular_file import path_of

RigFormat = Literal["rig", "opencv", "kalibr", "ros"]
_PLAIN = Foreign()
_MOST_FILES = 3
_OWN_KEYS = {"format", "left", "right", "right_from_left"}
_MOST_BESIDE, _MOST_LISTED = 8, 2000
_KINDS = (
    "this program's rig, OpenCV, Kalibr, ROS camera_info, EuRoC sensor.yaml, Stereolabs SN*.conf, an OAK's calibration "
    "JSON, rs-enumerate-devices -c, Basalt, VINS, MATLAB as JSON, Metashape's exported cameras, Middlebury calib.txt"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigReading:
    """A rig out of files, and what contradicts it though it is used; `is_factory`: its width is such cameras'."""

    rig: StereoRig
    warnings: tuple[Rejection, ...] = ()
    is_factory: bool = False


def read_rig(
    path: Path | str, second: Path | str | None = None, foreign: Foreign = _PLAIN, third: Path | str | None = None
) -> StereoRig:
    """Read a rig, whichever program wrote it.

    One file: this program's, Kalibr's camchain, OpenCV's matrices, or what a bought camera has in its memory. Two:
    OpenCV's intrinsics and extrinsics in either order, or ROS's camera_info or EuRoC's sensor files, LEFT first. Three:
    a file each of the left and the right camera, and one of how they stand. None but this program's have a
    covariance: `width` says what they are trusted to.

    Raises: RigError with every bad key, where the kind isn't known, or where the rig can't be right.
    """
    return read_rig_files([path, *(one for one in (second, third) if one is not None)], foreign).rig


def read_rig_files(files: Sequence[Path | str], foreign: Foreign = _PLAIN) -> RigReading:
    """Read a rig as `read_rig` does, and say what contradicts it: the camera's type, or another file of it beside.

    Raises: RigError as `read_rig` does.
    """
    paths = [path_of(one, "rig") for one in files]
    if not 1 <= len(paths) <= _MOST_FILES:
        raise RigError(f"rig: {len(paths)} files are given; a rig is one file, two or three")
    documents = [read_document(one) for one in paths]
    where = "rig file " + " + ".join(str(one) for one in paths)
    rig = _checked(_rig(documents, paths, where, foreign), where)
    refuse_size(rig, where)
    if rig.covariance.any() or _is_own(documents[0]):
        return RigReading(rig=rig)
    camera = type_of([*foreign.cameras, *(one.name for one in paths)], documents)
    doubts = [against_type(rig, camera, where) if camera is not None else Doubts(), *_beside(rig, paths, foreign)]
    in_memory = is_zed(documents[0]) or is_oak(documents[0]) or is_realsense(documents[0])
    is_factory = bool(in_memory or zed_listings(documents[0]) or (camera is not None and is_camera_info(documents[0])))
    share = max(one.baseline_share for one in doubts)
    rig = with_factory_width(rig, share) if is_factory else with_doubt(rig, share)
    warnings = tuple(warning for one in doubts for warning in one.warnings)
    return RigReading(rig=rig, warnings=warnings, is_factory=is_factory)


def _is_own(document: Plain) -> bool:
    return isinstance(document, Mapping) and document.get("format") == FORMAT


def _checked(rig: StereoRig, where: str) -> StereoRig:
    """Return a rig whose rotation is one to the last digit; what rounding can't explain is refused."""
    rig = replace(rig, right_from_left=frozen(nearest_rigid(rig.right_from_left)))
    if problems := rig_problems(rig):
        raise RigError(f"{where}:\n  " + "\n  ".join(problems))
    return rig


def _beside(rig: StereoRig, paths: Sequence[Path], foreign: Foreign) -> list[Doubts]:
    """Hold a rig against whole rigs in its folder with its serial number in their names, as far as they can be read."""
    serial = serial_of(paths[0].name)
    if not serial:
        return []
    try:
        listed = [one for _, one in zip(range(_MOST_LISTED), paths[0].parent.iterdir(), strict=False)]
    except OSError:
        return []
    others = sorted(one for one in listed if serial_of(one.name) == serial and one.name not in {p.name for p in paths})
    found: list[Doubts] = []
    for one in others[:_MOST_BESIDE]:
        right = one.with_name(one.name.replace("left", "right"))
        parts = [one, right] if right != one and right in others else [one]
        try:
            documents = [read_document(part) for part in parts]
            name = " + ".join(part.name for part in parts)
            other = _checked(_rig(documents, parts, name, foreign), name)
        except (RigError, ValueError):
            continue
        found.append(against_other(rig, other, name))
    return found


def _rig(documents: list[Plain], paths: Sequence[Path], where: str, foreign: Foreign) -> StereoRig:
    first = documents[0]
    kind = str(first.get("format", "")) if isinstance(first, Mapping) else ""
    if kind.startswith("asbuilt-bim/") and kind != FORMAT:
        raise RigError(f"{where}: this is no rig but a file of the kind {kind:.40}; name the rig that was calibrated")
    if len(documents) == 1:
        found = _of_one(first, where, foreign)
    else:
        found = _of_two(first, documents[1], where) if len(documents) == 2 else None
    if found is not None:
        return found
    poses, cameras = [one for one in documents if is_pose(one)], [one for one in documents if is_camera(one)]
    if len(documents) == 1 and poses and (beside := named_cameras(poses[0])):
        read = [read_document(paths[0].with_name(name)) for name in beside]
        cameras = [one for one in read if is_camera(one)]
    if len(poses) == 1 and len(cameras) == 2:
        return rig_of_parts(cameras, poses[0], where, foreign)
    merged: dict[str, Plain] = {}
    for document in documents:
        merged |= dict(document) if isinstance(document, Mapping) else {}
    if is_opencv(merged) and "format" not in merged:
        return opencv_rig(merged, where, foreign)
    return _unknown(documents, where)


def _unknown(documents: Sequence[Plain], where: str) -> StereoRig:
    """Refuse what is no rig, by what it is; a mapping on its own may be this program's, and says its mistakes."""
    if len(documents) > 1:
        raise RigError(
            f"{where}: these files are no rig in parts: name one file, or left and right of one kind, or both "
            "cameras and how they stand"
        )
    document = documents[0]
    if is_camera(document):
        raise RigError(
            f"{where}: this is one camera; name the right one's file too, and what says how they stand (R and T)"
        )
    if isinstance(document, list) and document and isinstance(document[0], Mapping) and "cameras" in document[0]:
        raise RigError(
            f"{where}: COLMAP's rig says how cameras stand, and nothing of their lenses; export its cameras as "
            "OpenCV's K1, D1, K2, D2, R, T"
        )
    if not isinstance(document, Mapping) or not _OWN_KEYS & document.keys():
        shown = " ".join(str(list(document) if isinstance(document, Mapping) else document).split())[:60]
        raise RigError(f"{where}: the file is no rig ({shown!r}); a failed download? Known are: {_KINDS}")
    return own_rig(document, where)


def _of_one(document: Plain, where: str, foreign: Foreign) -> StereoRig | None:
    """Return the rig of a file that holds both cameras, None where it is of none of these kinds."""
    if is_zed(document):
        return zed_rig(document, where, foreign)
    if is_oak(document):
        return oak_rig(document, where, foreign)
    if is_realsense(document):
        return realsense_rig(document, where, foreign)
    if is_basalt(document):
        return basalt_rig(document, where, foreign)
    if is_middlebury(document):
        return middlebury_rig(document, where)
    if is_camchain(document):
        return camchain_rig(document, where, foreign)
    if is_stereo_parameters(document):
        return stereo_parameters_rig(document, where, foreign)
    if is_bouguet(document):
        return bouguet_rig(document, where, foreign)
    if is_metashape(document):
        return metashape_rig(document, where, foreign)
    if listings := zed_listings(document):
        return zed_listing_rig(listings, where, foreign)
    if is_camera_info(document) or is_euroc(document):
        raise RigError(
            f"{where}: this is one camera; name the right one's file of the same kind too, as rig.file_right"
        )
    return None


def _of_two(first: Plain, second: Plain, where: str) -> StereoRig | None:
    """Return the rig of two files, left and right of one kind, None where they are of none of these kinds."""
    if is_camera_info(first) and is_camera_info(second):
        return ros_rig(first, second, where)
    if is_euroc(first) and is_euroc(second):
        return euroc_rig(first, second, where)
    if is_camera_info(first) or is_euroc(first):
        raise RigError(
            f"{where}: this is one camera; name the right one's file of the same kind too, as rig.file_right"
        )
    return None


def rig_files(path: Path, form: RigFormat) -> tuple[Path, ...]:
    """Return the files that a rig in this format is written to."""
    if form == "ros":
        return path.with_stem(f"{path.stem}_left"), path.with_stem(f"{path.stem}_right")
    return (path,)


def rig_contents(rig: StereoRig, path: Path, form: RigFormat) -> dict[Path, bytes]:
    """Return what the files of a rig in a format hold: two for ROS, named `_left` and `_right`.

    Raises: RigError where the format can't hold the rig.
    """
    texts: tuple[str, ...]
    if form == "ros":
        texts = ros_texts(rig)
    else:
        texts = ({"rig": rig_text, "opencv": opencv_text, "kalibr": camchain_text}[form](rig),)
    return {file: text.encode() for file, text in zip(rig_files(path, form), texts, strict=True)}


def write_rig_as(rig: StereoRig, path: Path, form: RigFormat) -> tuple[Path, ...]:
    """Write a rig in a format, all of its files whole or none, and return them.

    Raises: RigError where the format can't hold the rig; OutputError where a file can't be written.
    """
    contents = rig_contents(rig, path, form)
    with writing(path):
        replace_all(contents)
    return tuple(contents)
