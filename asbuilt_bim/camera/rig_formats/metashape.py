"""Agisoft Metashape's XML: exported cameras with two sensors, and the calibration of a single camera."""

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.chosen import chosen_pair
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.plain_text import Plain
from asbuilt_bim.camera.rig_formats.rigid_pose import nearest_rigid
from asbuilt_bim.camera.rig_formats.text import XmlNode, numbers
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, vector_from_rotation

APART_SHARE, TURNED_RAD = 0.002, np.deg2rad(0.01)
"""By how much pairs of one rigid rig may differ: a calibration as a rig leaves no difference, only digits."""
_SKEW_PX = 0.05
_MOST_PAIRS = 2000


def is_metashape(document: Plain) -> TypeGuard[Mapping[str, XmlNode]]:
    """Say whether a document is Metashape's export of cameras."""
    return isinstance(document, Mapping) and _name(document) == "document"


def is_calibration(document: Plain) -> TypeGuard[Mapping[str, XmlNode]]:
    """Say whether a document is Metashape's calibration of a single camera."""
    return isinstance(document, Mapping) and _name(document) == "calibration"


def _name(document: Mapping[str, Plain]) -> str:
    node = document.get("metashape")
    return node.name if isinstance(node, XmlNode) else ""


def calibration_camera(document: Mapping[str, Plain], where: str) -> Intrinsics:
    """Return the camera of a calibration's file.

    Raises: RigError as `metashape_rig` does.
    """
    node = document["metashape"]
    assert isinstance(node, XmlNode)  # `is_calibration` asked
    return _camera(node, node, where)


def metashape_rig(document: Mapping[str, XmlNode], where: str, foreign: Foreign) -> StereoRig:
    """Make a rig of two sensors, whose photos were aligned as one rigid rig; the slave's photos name their master.

    Raises: RigError for what isn't there, an unscaled chunk, or pairs that don't all stand alike.
    Reference: Agisoft Metashape manual, "Camera models"; File > Export > Export Cameras.
    """
    chunk = document["metashape"].first("chunk")
    sensors = {one.attributes.get("id", ""): one for one in (chunk.all("sensors", "sensor") if chunk else ())}
    if chunk is None or not sensors:
        raise RigError(f"{where}: holds no sensors; write it with File > Export > Export Cameras")
    sizes = {name: _size(one, f"{where}: sensor {name[:20]}") for name, one in sensors.items()}
    chosen = chosen_pair(sizes, where, foreign)
    cameras = []
    for name in chosen:
        calibration = sensors[name].first("calibration")
        if calibration is None:
            raise RigError(f"{where}: sensor {name[:20]} holds no calibration; align the photos and export again")
        cameras.append(_camera(calibration, sensors[name], f"{where}: sensor {name[:20]}"))
    return rig_of_unknown_sigma(cameras[0], cameras[1], _common_pose(chunk, chosen, where))


def _common_pose(chunk: XmlNode, chosen: tuple[str, str], where: str) -> FloatArray:
    """Return right_from_left of all pairs that were aligned: that of the first, where the others stand alike."""
    scale = _scale(chunk, where)
    photos = {photo.attributes.get("id", ""): photo for photo in chunk.all("cameras", "camera")}
    poses = []
    for photo in list(photos.values())[:_MOST_PAIRS]:
        master = photos.get(photo.attributes.get("master_id", ""))
        if master is None or {photo.attributes.get("sensor_id"), master.attributes.get("sensor_id")} != set(chosen):
            continue
        left, right = (master, photo) if master.attributes.get("sensor_id") == chosen[0] else (photo, master)
        world = [numbers(one.text) if (one := side.first("transform")) is not None else None for side in (left, right)]
        if all(one is not None and len(one) == 16 for one in world):
            world_from_left, world_from_right = (nearest_rigid(np.reshape(one or [], (4, 4))) for one in world)
            poses.append(inverse(world_from_right) @ world_from_left)
    if not poses:
        raise RigError(f"{where}: no pair of sensors {' and '.join(chosen)[:40]} is aligned as master and slave")
    first = poses[0]
    base = float(np.linalg.norm(first[:3, 3]))
    for pose in poses[1:]:
        turned = float(np.linalg.norm(vector_from_rotation(pose[:3, :3].T @ first[:3, :3])))
        apart = float(np.linalg.norm(pose[:3, 3] - first[:3, 3]))
        if not (apart <= APART_SHARE * base and turned <= TURNED_RAD):
            raise RigError(
                f"{where}: its pairs stand differently, by {apart / max(base, 1e-12):.2%} of the baseline and "
                f"{np.degrees(turned):.3f} degrees; align them as one rig (fixed offset of the slave sensor)"
            )
    pose = first.copy()
    pose[:3, 3] *= scale
    return pose


def _scale(chunk: XmlNode, where: str) -> float:
    """Return metres per unit of the chunk."""
    for place in (
        chunk.first("transform", "scale"),
        *(one.first("transform", "scale") for one in chunk.all("components", "component")),
    ):
        found = numbers(place.text) if place is not None else None
        if found and len(found) == 1 and found[0] > 0.0:
            return found[0]
    raise RigError(f"{where}: the chunk has no scale, so its baseline has no unit; set a scale bar and export again")


def _size(node: XmlNode, where: str) -> tuple[int, int]:
    at = node.first("resolution") or node
    sides = [at.attributes.get(key) or (one.text if (one := at.first(key)) else "") for key in ("width", "height")]
    found = [numbers(side) for side in sides]
    if any(one is None or len(one) != 1 for one in found):
        raise RigError(f"{where}: no width and height")
    width, height = (int(one[0]) for one in found if one)
    return width, height


def _camera(calibration: XmlNode, sized: XmlNode, where: str) -> Intrinsics:
    """Return a frame camera: cx and cy count from the picture's middle, p1 and p2 are exchanged against OpenCV's."""
    kind = calibration.attributes.get("type") or (one.text if (one := calibration.first("projection")) else "frame")
    if kind != "frame":
        raise RigError(f"{where}: the camera type {kind[:40]!r} isn't read; calibrate as frame")
    names = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2")
    values: dict[str, float] = dict.fromkeys(names, 0.0)
    for child in calibration.children:
        if child.name in values:
            found = numbers(child.text)
            if found is None or len(found) != 1:
                raise RigError(f"{where}: {child.name} is no number")
            values[child.name] = found[0]
    width, height = _size(
        calibration if calibration.first("resolution") or calibration.first("width") else sized, where
    )
    if values["k4"] != 0.0 or abs(values["b2"]) * 0.5 * height > _SKEW_PX * max(values["f"], 1.0):
        raise RigError(f"{where}: k4 and the skew b2 aren't read; optimize the cameras without them and export again")
    f = values["f"]
    middle = 0.5 * width - 0.5 + values["cx"], 0.5 * height - 0.5 + values["cy"]
    K = frozen([[f + values["b1"], 0.0, middle[0]], [0.0, f, middle[1]], [0.0, 0.0, 1.0]])
    lens = frozen([values["k1"], values["k2"], values["p2"], values["p1"], values["k3"]])
    return Intrinsics(K=K, distortion=lens, width_px=width, height_px=height)
