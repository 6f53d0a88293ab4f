"""Does a photo belong to the rig? Size, orientation, camera and zoom, before any pixel is trusted."""

from __future__ import annotations

from typing import Literal

from asbuilt_bim.camera.photo.read import Photo
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import Rejection

Side = Literal["left", "right"]

FOCAL_TOLERANCE = 0.005
"""EXIF rounds focal lengths to a tenth of a millimetre or so; half a per cent of zoom is 1 % of area."""


def check_photo_against_rig(photo: Photo, image_size: tuple[int, int], rig: StereoRig, side: Side) -> list[Rejection]:
    """Return why the photo, decoded to `image_size` (width, height), can't be one of the rig's `side` camera.

    What EXIF doesn't say is not held against a photo. An empty list means that nothing speaks against it.
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
        Rejection(
            what=f"photo {photo.name}",
            reason="the photo is rotated against the rig" if turned else "its size is not that of the rig's photos",
            value=f"{image_size[0]} x {image_size[1]} px",
            limit=f"{expected[0]} x {expected[1]} px",
            remedy="use the photo as the camera stored it: not turned, not resized, not cropped",
        )
    ]


def _orientation(photo: Photo, rig: StereoRig) -> list[Rejection]:
    upright = rig.exif_orientation or 1
    found = photo.exif.orientation or upright
    if found == upright:
        return []
    return [
        Rejection(
            what=f"photo {photo.name}",
            reason="the camera was held rotated against the photos of the boards",
            value=f"EXIF orientation {found}",
            limit=f"EXIF orientation {upright}",
            remedy="take the station again with the rig level, or remove a wrong EXIF orientation",
        )
    ]


def _camera(photo: Photo, rig: StereoRig, side: Side) -> list[Rejection]:
    own, other = rig.camera_serial, rig.camera_serial_right or rig.camera_serial
    if side == "right":
        own, other = other, own
    found, model = photo.exif.serial, photo.exif.model
    if rig.camera_model and model and model != rig.camera_model:
        return [_other_camera(photo, model, rig.camera_model)]
    if not (own and found) or found == own:
        return []
    if found == other:
        return [
            Rejection(
                what=f"photo {photo.name}",
                reason="left and right are swapped: it was taken by the rig's other camera "
                f"(the {side} one's serial is {own})",
                value=f"serial {found}",
                remedy="exchange the left and the right photo",
            )
        ]
    return [_other_camera(photo, f"serial {found}", f"serial {own}")]


def _other_camera(photo: Photo, value: str, limit: str) -> Rejection:
    return Rejection(
        what=f"photo {photo.name}",
        reason="photo of another camera than the rig's",
        value=value,
        limit=limit,
        remedy="use the photos of the calibrated rig, or calibrate this one",
    )


def _zoom(photo: Photo, rig: StereoRig) -> list[Rejection]:
    expected, found = rig.focal_length_mm, photo.exif.focal_length_mm
    if not expected or not found or abs(found - expected) <= FOCAL_TOLERANCE * expected:
        return []
    return [
        Rejection(
            what=f"photo {photo.name}",
            reason="zoomed or refocused against the rig",
            value=f"focal length {found:g} mm",
            limit=f"{expected:g} mm as on the boards",
            remedy="take the station again at the boards' zoom, or calibrate at this one",
        )
    ]
