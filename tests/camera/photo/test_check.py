from __future__ import annotations

import pytest

from asbuilt_bim.camera.photo.check import Side, check_photo_against_rig
from asbuilt_bim.camera.photo.read import Photo, PhotoExif
from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.reasons import words_of
from tests.camera.virtual import rig

OWN = {"model": "Maker One", "serial": "L-1", "focal_length_mm": 8.0, "orientation": 1}


def photo(**exif: object) -> Photo:
    return Photo(name="G1_left.jpg", data=b"", digest="", exif=PhotoExif(**{**OWN, **exif}))  # type: ignore[arg-type]


def test_a_photo_of_the_rig_passes() -> None:
    assert check_photo_against_rig(photo(), (1280, 960), rig(), "left") == []


def test_a_photo_that_says_nothing_of_its_camera_passes() -> None:
    silent = photo(model="", serial="", focal_length_mm=0.0, orientation=0)
    assert check_photo_against_rig(silent, (1280, 960), rig(), "right") == []


@pytest.mark.parametrize(
    ("exif", "size", "side", "code", "value"),
    [
        ({}, (960, 1280), "left", Reason.PHOTO_TURNED, "960 x 1280 px"),
        ({}, (640, 480), "left", Reason.PHOTO_SIZE, "640 x 480 px"),
        ({"orientation": 6}, (1280, 960), "left", Reason.PHOTO_HELD_TURNED, "EXIF orientation 6"),
        ({"model": "Other Two"}, (1280, 960), "left", Reason.PHOTO_OF_OTHER_MODEL, "Other Two"),
        ({"serial": "X-9"}, (1280, 960), "left", Reason.PHOTO_OF_OTHER_CAMERA, "serial X-9"),
        ({}, (1280, 960), "right", Reason.PHOTO_OF_OTHER_SIDE, "serial L-1"),
        ({"focal_length_mm": 12.0}, (1280, 960), "left", Reason.PHOTO_ZOOMED, "focal length 12 mm"),
    ],
)
def test_what_cannot_be_of_the_rig_is_named(
    exif: dict[str, object], size: tuple[int, int], side: Side, code: Reason, value: str
) -> None:
    (rejection,) = check_photo_against_rig(photo(**exif), size, rig(), side)
    words = words_of(rejection)
    assert rejection.code is code and words.value == value
    assert words.what == "photo G1_left.jpg" and words.remedy


def test_a_focal_length_within_rounding_is_no_zoom() -> None:
    assert check_photo_against_rig(photo(focal_length_mm=8.03), (1280, 960), rig(), "left") == []
