from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.photo.read import Photo, photo_from_bytes
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import EYES_SWAPPED, PHOTO_FAULTS, Reason
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage
from asbuilt_bim.measure.depth_reference import unpack, unpack_occluder_free
from asbuilt_bim.measure.station import (
    MeasureOptions,
    Models,
    RejectedStation,
    StationMeasurement,
    StationPhotos,
    measure_station,
)
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.target.find import TargetOptions
from tests.measure.box_world import site
from tests.measure.test_faces import rig_of

FREE = MeasureOptions(target=TargetOptions(required=False), least_markers_without_target=0)


def photo(name: str, image: np.ndarray) -> Photo:
    done, data = cv2.imencode(".png", image)
    assert done
    return photo_from_bytes(name, bytes(data))


def photos() -> StationPhotos:
    pair = site()[1]
    return StationPhotos(name="S1", left=photo("S1_left.png", pair.left), right=photo("S1_right.png", pair.right))


@pytest.fixture(scope="module")
def station() -> StationMeasurement:
    ticks = iter(range(1000))
    found = measure_station(photos(), rig_of(site()[1]), FREE, clock=lambda: float(next(ticks)))
    assert isinstance(found, StationMeasurement)
    return found


def test_a_station_is_measured_from_its_photos_alone(station: StationMeasurement) -> None:
    assert len(station.faces) >= 4
    assert all(face.face_id == f"S1/{i}" for i, face in enumerate(station.faces, start=1))
    assert station.left_digest != station.right_digest
    assert station.target is None
    assert station.thumbnail_jpeg[:2] == b"\xff\xd8"


def test_seconds_are_told_by_step_by_the_clock_that_was_given(station: StationMeasurement) -> None:
    assert set(station.seconds.values()) == {1.0}
    assert {"read", "stereo", "faces"} <= set(station.seconds)


def test_up_is_known_to_a_fraction_of_a_degree_in_the_physical_left_frame(station: StationMeasurement) -> None:
    assert station.vertical is not None
    up = site()[2].T @ np.array([0.0, -1.0, 0.0])  # the rig's rectification turns nothing here
    assert np.degrees(np.arccos(min(1.0, float(station.vertical @ up)))) < 0.7


def test_the_depth_reference_shows_sky_wall_and_nothing_else_between(station: StationMeasurement) -> None:
    disparity, sigma, scale = unpack(station.depth_ref)
    assert np.nanmedian(disparity[20 // scale : 80 // scale, 40 // scale : 180 // scale]) == 0.0
    wall = disparity[300 // scale, 570 // scale]
    assert 640.0 * 0.25 / wall == pytest.approx(5.1, abs=0.4)
    assert sigma[300 // scale, 570 // scale] < 0.5


def test_the_same_photos_give_the_same_numbers(station: StationMeasurement) -> None:
    again = measure_station(photos(), rig_of(site()[1]), FREE)
    assert isinstance(again, StationMeasurement)
    assert [face.area_m2 for face in again.faces] == [face.area_m2 for face in station.faces]


def test_without_its_target_a_station_is_rejected_where_one_is_required() -> None:
    found = measure_station(photos(), rig_of(site()[1]), MeasureOptions())
    assert isinstance(found, RejectedStation)
    assert any(one.code is Reason.TARGET_ABSENT for one in found.rejections)
    assert found.picture is not None


def test_without_target_and_markers_there_is_no_scale_to_trust() -> None:
    options = replace(FREE, least_markers_without_target=2)
    found = measure_station(photos(), rig_of(site()[1]), options)
    assert isinstance(found, RejectedStation)
    assert found.rejections[-1].code is Reason.SCALE_UNCHECKED
    assert found.rejections[-1].values == {"found": 0, "needed": 2}


def test_a_photo_of_another_size_rejects_the_station_by_name() -> None:
    pair = site()[1]
    small = StationPhotos(
        name="S1", left=photo("S1_left.png", pair.left), right=photo("S1_right.png", pair.right[:500])
    )
    found = measure_station(small, rig_of(pair), FREE)
    assert isinstance(found, RejectedStation)
    assert any(one.subject.at_station == "S1" and "800 x 500" in words_of(one).value for one in found.rejections)


def test_a_photo_larger_than_the_rigs_is_refused_by_its_header_and_never_inflated() -> None:
    pair = site()[1]
    done, data = cv2.imencode(".png", np.zeros((2, 2, 3), np.uint8))
    huge = bytes(data)[:16] + struct.pack(">II", 11000, 9000) + bytes(data)[24:]  # decodes to nothing
    seen = StationPhotos(name="S1", left=photo_from_bytes("huge.png", huge), right=photo("S1_right.png", pair.right))
    found = measure_station(seen, rig_of(pair), FREE)
    assert isinstance(found, RejectedStation) and done
    assert [one.code for one in found.rejections] == [Reason.PHOTO_SIZE]
    assert "11000 x 9000" in words_of(found.rejections[0]).value


def test_swapped_photos_reject_the_station() -> None:
    pair = site()[1]
    swapped = StationPhotos(name="S1", left=photo("a.png", pair.right), right=photo("b.png", pair.left))
    found = measure_station(swapped, rig_of(pair), FREE)
    assert isinstance(found, RejectedStation)
    assert any(one.code in (Reason.PHOTOS_SWAPPED, Reason.PHOTOS_LOOK_SWAPPED) for one in found.rejections)


def test_photos_whose_serials_are_exchanged_are_said_to_be_swapped_once() -> None:
    rig, both = replace(rig_of(site()[1]), camera_serial="L-1", camera_serial_right="R-1"), photos()
    left, right = (
        replace(one, exif=replace(one.exif, serial=serial)) for one, serial in ((both.left, "R-1"), (both.right, "L-1"))
    )
    found = measure_station(StationPhotos(name="S1", left=left, right=right), rig, FREE)
    assert isinstance(found, RejectedStation)
    (told,) = found.rejections
    assert told.code is Reason.PHOTOS_OF_OTHER_SIDES and told.subject.at_station == "S1"
    assert words_of(told).value == "serial R-1 left, L-1 right"


def test_two_photos_of_one_camera_are_said_to_be_that_and_not_exchanged() -> None:
    rig, both = replace(rig_of(site()[1]), camera_serial="L-1", camera_serial_right="R-1"), photos()
    for serial, side in (("L-1", "left"), ("R-1", "right")):
        left, right = (replace(one, exif=replace(one.exif, serial=serial)) for one in (both.left, both.right))
        found = measure_station(StationPhotos(name="S1", left=left, right=right), rig, FREE)
        assert isinstance(found, RejectedStation)
        (told,) = found.rejections
        assert told.code is Reason.PHOTOS_OF_ONE_CAMERA and told.code not in EYES_SWAPPED
        assert f"taken by the rig's {side} camera" in words_of(told).reason


def test_a_picture_that_does_not_decode_rejects_the_station() -> None:
    good = photos()
    broken = replace(good.left, data=good.left.data[: len(good.left.data) // 2])
    found = measure_station(StationPhotos(name="S1", left=broken, right=good.right), rig_of(site()[1]), FREE)
    assert isinstance(found, RejectedStation)
    assert found.rejections[0].subject.at_station == "S1"


def test_one_photo_given_twice_is_named_as_that_and_not_as_a_knocked_rig() -> None:
    left = site()[1].left
    done, again = cv2.imencode(".jpg", left, [cv2.IMWRITE_JPEG_QUALITY, 97])
    assert done
    twice = StationPhotos(name="S1", left=photo("a.png", left), right=photo_from_bytes("b.jpg", bytes(again)))
    found = measure_station(twice, rig_of(site()[1]), FREE)
    assert isinstance(found, RejectedStation)
    assert [one.code for one in found.rejections] == [Reason.PHOTO_TWICE]
    assert found.health is None


def spoilt(how: Callable[[np.ndarray], np.ndarray]) -> StationPhotos:
    pair = site()[1]
    return StationPhotos(name="S1", left=photo("a.png", how(pair.left)), right=photo("b.png", how(pair.right)))


def test_a_refused_station_names_the_state_of_its_photos_before_what_follows_from_it() -> None:
    blurred = spoilt(lambda image: cv2.GaussianBlur(image, (0, 0), 4.0))
    found = measure_station(blurred, rig_of(site()[1]), MeasureOptions())
    assert isinstance(found, RejectedStation)
    assert found.rejections[0].code is Reason.PHOTO_UNSHARP
    assert len(found.rejections) > 1


def test_a_station_that_counts_keeps_the_state_of_its_photos(station: StationMeasurement) -> None:
    assert station.quality is not None and not any(one.code in PHOTO_FAULTS for one in station.rejections)
    bleached = spoilt(lambda image: np.where(np.arange(image.shape[1])[:, None] < 200, 255, image).astype(np.uint8))
    found = measure_station(bleached, rig_of(site()[1]), FREE)
    assert isinstance(found, StationMeasurement)
    assert found.quality is not None and found.quality.left.white_share > 0.1
    assert found.rejections[0].code is Reason.PHOTO_CLIPPED


def test_clipped_white_is_neither_sky_nor_any_depth(station: StationMeasurement) -> None:
    before, _, scale = unpack(station.depth_ref)
    sky = np.repeat(np.repeat(before == 0.0, scale, axis=0), scale, axis=1)[:600, :800]
    assert sky.mean() > 0.02

    def overexposed(image: np.ndarray) -> np.ndarray:
        height, width = image.shape[:2]
        return np.where(sky[:height, :width, None], 255, image).astype(np.uint8)

    pair = site()[1]
    photos_ = StationPhotos(name="S1", left=photo("a.png", overexposed(pair.left)), right=photo("b.png", pair.right))
    found = measure_station(photos_, rig_of(pair), FREE)
    assert isinstance(found, StationMeasurement)
    after, _, _ = unpack(found.depth_ref)
    assert not (after == 0.0).any()
    assert np.isnan(after[before == 0.0]).mean() > 0.9
    past = unpack_occluder_free(found.depth_ref)
    assert past is not None and np.isnan(past[before == 0.0]).mean() > 0.9


def test_people_that_a_network_finds_are_in_no_picture_and_change_no_area(station: StationMeasurement) -> None:
    class Finder:
        name, finds_concrete = "finder", False

        def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
            return []

        def people(self, image: ByteImage) -> BoolArray:
            found = np.zeros(image.shape[:2], dtype=bool)
            found[220:420, 510:640] = True
            return found

    finder = Models(opinion=Finder())
    found = measure_station(photos(), rig_of(site()[1]), FREE, models=finder)
    assert isinstance(found, StationMeasurement)
    assert [face.area_m2 for face in found.faces] == [face.area_m2 for face in station.faces]
    before, after = (
        cv2.imdecode(np.frombuffer(one.thumbnail_jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
        for one in (station, found)
    )
    scale = before.shape[1] / 800.0
    inside = tuple(slice(round(low * scale), round(high * scale)) for low, high in ((230, 410), (520, 630)))
    detail = [np.abs(np.diff(picture[inside], axis=1)).mean() for picture in (before, after)]
    assert detail[1] < 0.5 * detail[0]
    refused = measure_station(photos(), rig_of(site()[1]), MeasureOptions(), models=finder)  # no target: refused
    assert isinstance(refused, RejectedStation) and refused.picture is not None
    assert not np.array_equal(refused.picture[220:420, 510:640], site()[1].left[220:420, 510:640])
