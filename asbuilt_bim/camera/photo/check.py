"""Does a photo belong to the rig? Size, orientation, camera and zoom, before any pixel is trusted."""

from typing import Literal

from asbuilt_bim.camera.photo.read import Photo
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected

Side = Literal["left", "right"]

FOCAL_TOLERANCE = 0.005
"""EXIF rounds focal lengths to a tenth of a millimetre or so; half a per cent of zoom is 1 % of area."""


def check_photo_against_rig(photo: Photo, image_size: tuple[int, int], rig: StereoRig, side: Side) -> list[Rejection]:
    """Return why the photo, of `image_size` (width, height), can't be one of the rig's `side` camera.

    What EXIF doesn't say is not held against a photo. An empty list means that nothing is wrong.
    """
    return [
        *_size(photo, image_size, rig, side),
        *_orientation(photo, rig),
        *_camera(photo, rig, side),
        *_zoom(photo, rig),
    ]


def _size(photo: Photo, image_size: tuple[int, int], rig: StereoRig, side: Side) -> list[Rejection]:
    camera = rig.left if side == "left" else rig.right
    expected = (camera.width_px, camera.height_px)
    if image_size == expected:
        return []
    turned = image_size == expected[::-1]
    return [
        _rejection(Reason.PHOTO_TURNED if turned else Reason.PHOTO_SIZE, photo, size_px=image_size, rig_px=expected)
    ]


def _orientation(photo: Photo, rig: StereoRig) -> list[Rejection]:
    upright = rig.exif_orientation or 1
    found = photo.exif.orientation or upright
    if found == upright:
        return []
    return [_rejection(Reason.PHOTO_HELD_TURNED, photo, orientation=found, rig_orientation=upright)]


def _camera(photo: Photo, rig: StereoRig, side: Side) -> list[Rejection]:
    own, other = rig.camera_serial, rig.camera_serial_right or rig.camera_serial
    if side == "right":
        own, other = other, own
    found, model = photo.exif.serial, photo.exif.model
    if rig.camera_model and model and model != rig.camera_model:
        return [_rejection(Reason.PHOTO_OF_OTHER_MODEL, photo, model=model, rig_model=rig.camera_model)]
    if not (own and found) or found == own:
        return []
    code = Reason.PHOTO_OF_OTHER_SIDE if found == other else Reason.PHOTO_OF_OTHER_CAMERA
    return [_rejection(code, photo, serial=found, rig_serial=own, side=side)]


def _zoom(photo: Photo, rig: StereoRig) -> list[Rejection]:
    expected, found = rig.focal_length_mm, photo.exif.focal_length_mm
    if not expected or not found or abs(found - expected) <= FOCAL_TOLERANCE * expected:
        return []
    return [_rejection(Reason.PHOTO_ZOOMED, photo, focal_mm=found, rig_focal_mm=expected)]


def _rejection(code: Reason, photo: Photo, **values: Value) -> Rejection:
    return rejected(code, about(SubjectKind.PHOTO, photo.name), **values)
