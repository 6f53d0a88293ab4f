"""Reads any rig file: this program's, OpenCV's, Kalibr's, ROS's or EuRoC's, recognised by its content."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.kalibr import camchain_rig, camchain_text, euroc_rig, is_camchain, is_euroc
from asbuilt_bim.camera.rig_formats.opencv import Foreign, is_opencv, opencv_rig, opencv_text
from asbuilt_bim.camera.rig_formats.rig_file import FORMAT, own_rig, rig_problems, rig_text
from asbuilt_bim.camera.rig_formats.ros import is_camera_info, ros_rig, ros_texts
from asbuilt_bim.camera.rig_formats.text import Plain, read_document
from asbuilt_bim.errors import RigError
from asbuilt_bim.storage.atomic_write import replace_all, writing

RigFormat = Literal["rig", "opencv", "kalibr", "ros"]
RIG_FORMATS: tuple[RigFormat, ...] = get_args(RigFormat)
_PLAIN = Foreign()


def read_rig(path: Path | str, second: Path | str | None = None, foreign: Foreign = _PLAIN) -> StereoRig:
    """Read a rig, whichever program wrote it.

    One file: this program's, Kalibr's camchain, OpenCV's matrices. Two: OpenCV's intrinsics and extrinsics in either
    order, or ROS's camera_info or EuRoC's sensor files, LEFT first. Other programs' rigs have no covariance.

    Raises: RigError with every bad key, where the kind isn't known, or where the rig can't be right.
    """
    paths = [Path(path), *([] if second is None else [Path(second)])]
    documents = [read_document(one) for one in paths]
    where = "rig file " + " + ".join(str(one) for one in paths)
    rig = _rig(documents, where, foreign)
    if problems := rig_problems(rig):
        raise RigError(f"{where}:\n  " + "\n  ".join(problems))
    return rig


def _rig(documents: list[Plain], where: str, foreign: Foreign) -> StereoRig:
    first, second = documents[0], documents[1] if len(documents) > 1 else None
    kind = str(first.get("format", "")) if isinstance(first, Mapping) else ""
    if kind.startswith("asbuilt-bim/") and kind != FORMAT:
        raise RigError(f"{where}: this is no rig but a file of the kind {kind:.40}; name the rig that was calibrated")
    if is_camera_info(first) and is_camera_info(second):
        return ros_rig(first, second, where)
    if is_euroc(first) and is_euroc(second):
        return euroc_rig(first, second, where)
    if is_camera_info(first) or is_euroc(first):
        raise RigError(
            f"{where}: this is one camera; name the right one's file of the same kind too, as rig.file_right"
        )
    merged: dict[str, Plain] = {}
    for document in documents:
        merged |= dict(document) if isinstance(document, Mapping) else {}
    if is_camchain(first) and second is None:
        return camchain_rig(first, where)
    if is_opencv(merged) and "format" not in merged:
        return opencv_rig(merged, where, foreign)
    if second is not None:
        raise RigError(
            f"{where}: these two files are no rig in two parts; name one file, or left and right of one kind"
        )
    return own_rig(first, where)


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
