"""A RealSense's own calibration as `rs-enumerate-devices -c` lists it: the two infrared eyes and how they stand."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.zed import chosen_size
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_EYES = (("Infrared 1", "Infrared 2"), ("Fisheye 1", "Fisheye 2"))
_BLOCK = re.compile(r"^\s*(Intrinsic of|Extrinsic from)\s+(.*)$", re.MULTILINE)
_NAME = re.compile(r'"?((?:Infrared|Fisheye) [12])"?')
_SIZE = re.compile(r"\b(\d{2,5})x(\d{2,5})\b")
_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_LENSES = {
    "brown conrady": "five", "none": "five", "inverse brown conrady": "straight", "modified brown conrady": "straight",
    "kannala brandt4": "fisheye",
}  # fmt: skip
"""RealSense's names. The inverse and the modified models work otherwise: they are read where all numbers are 0."""


def is_realsense(document: Plain) -> TypeGuard[Mapping[str, str]]:
    """Say whether a document is the listing."""
    return isinstance(document, Mapping) and isinstance(document.get("listing"), str)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Block:
    head: str
    body: str


def realsense_rig(document: Mapping[str, str], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of the eyes at the photos' size; the pose is that from the first eye to the second, in metres.

    Raises: RigError where the eyes, their pose or the size aren't listed.
    Reference: librealsense, tools/enumerate-devices.
    """
    blocks = _blocks(document["listing"])
    for left, right in _EYES:
        sizes = _sizes(blocks, left, right)
        if not sizes:
            continue
        name = chosen_size(sizes, where, foreign)
        eyes = [_camera(_intrinsics(blocks, eye)[name], sizes[name], f"{where}: {eye} {name}") for eye in (left, right)]
        return rig_of_unknown_sigma(eyes[0], eyes[1], _pose(blocks, left, right, where))
    raise RigError(
        f"{where}: lists no Infrared 1 and 2 (or Fisheye 1 and 2) of one size; write it with rs-enumerate-devices -c"
    )


def _blocks(text: str) -> list[_Block]:
    heads = list(_BLOCK.finditer(text))
    ends = [head.start() for head in heads[1:]] + [len(text)]
    return [_Block(head=head[0].strip(), body=text[head.end() : end]) for head, end in zip(heads, ends, strict=True)]


def _intrinsics(blocks: list[_Block], eye: str) -> dict[str, str]:
    """Return an eye's blocks by size: one size may be listed for several formats, all the same numbers."""
    found: dict[str, str] = {}
    for block in blocks:
        if (
            block.head.startswith("Intrinsic")
            and _NAME.findall(block.head) == [eye]
            and (size := _SIZE.search(block.head))
        ):
            found.setdefault(size[0], block.body)
    return found


def _sizes(blocks: list[_Block], left: str, right: str) -> dict[str, tuple[int, int]]:
    both = _intrinsics(blocks, left).keys() & _intrinsics(blocks, right).keys()
    return {name: (int(name.split("x")[0]), int(name.split("x")[1])) for name in both}


def _camera(body: str, size: tuple[int, int], where: str) -> Intrinsics:
    def numbers_of(key: str, count: int) -> list[float]:
        line = re.search(rf"^\s*{key}:?\s+(.*)$", body, re.MULTILINE | re.IGNORECASE)
        found = [float(word) for word in re.findall(_NUMBER, line[1])] if line else []
        if len(found) < count:
            raise RigError(f"{where}: {key} is missing; list it again")
        return found[:count]

    (fx,), (fy,), (cx,), (cy,) = (numbers_of(key, 1) for key in ("Fx", "Fy", "PPX", "PPY"))
    k1, k2, p1, p2, k3 = numbers_of("Coeffs", 5)
    line = re.search(r"^\s*Distortion:?\s+(.*)$", body, re.MULTILINE | re.IGNORECASE)
    lens = _LENSES.get(line[1].strip().lower() if line else "")
    if lens is None or (lens == "straight" and any((k1, k2, p1, p2, k3))):
        raise RigError(f"{where}: the distortion {line[1].strip()[:40] if line else ''!r} isn't read; calibrate here")
    distortion = [k1, k2, p1, p2] if lens == "fisheye" else [k1, k2, p1, p2, k3]
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(distortion), width_px=size[0], height_px=size[1])


def _pose(blocks: list[_Block], left: str, right: str, where: str) -> FloatArray:
    for block in blocks:
        if block.head.startswith("Extrinsic") and _NAME.findall(block.head) == [left, right]:
            parts = re.split(r"Translation Vector", block.body, maxsplit=1)
            turn, shift = ([float(word) for word in re.findall(_NUMBER, part)] for part in (*parts, "")[:2])
            if len(turn) >= 9 and len(shift) >= 3:
                return nearest_rigid(rigid(np.reshape(turn[:9], (3, 3)), shift[:3]))
    raise RigError(f"{where}: no extrinsic from {left} to {right}; write it with rs-enumerate-devices -c")
