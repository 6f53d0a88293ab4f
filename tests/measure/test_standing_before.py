"""What stands before a measured face is found by its depth: a body, and no bar."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.depth_reference import DepthReference, pack
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.standing_before import standing_before
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.completion import records
from asbuilt_bim.progress.completion.records import station_record
from asbuilt_bim.scale.codec import from_bytes, to_bytes
from asbuilt_bim.vision.stereo.depth import DepthMap
from tests.register.linked_scene import stations

WALL_M = 5.0


def seen(before_m: float, wide_px: int) -> tuple[StationMeasurement, np.ndarray]:
    """Return a station before a wall 5 m off, something `before_m` nearer in the middle, and where that is (H, W)."""
    station = stations()[1]
    camera = station.camera
    height, width = camera.height_px, camera.width_px
    depth = np.full((height, width), WALL_M)
    body = np.zeros((height, width), dtype=bool)
    body[height // 4 : 3 * height // 4, width // 2 - wide_px // 2 : width // 2 + wide_px // 2] = True
    depth[body] = WALL_M - before_m
    disparity = (camera.f_px * camera.baseline_m / depth).astype(np.float32)
    sigma = np.full_like(disparity, 0.1)
    valid = np.ones_like(body)
    made = DepthMap(
        disparity_px=disparity, sigma_px=sigma, valid=valid, f_px=camera.f_px, baseline_m=camera.baseline_m,
        method="stereo",
    )  # fmt: skip
    reference: DepthReference = pack(made, np.zeros_like(body))
    turn = camera.rectified_from_left
    frame = PlaneFrame(origin_m=frozen(WALL_M * turn[2]), u=frozen(turn[0]), v=frozen(-turn[1]))
    ring = frozen(np.array([[50.0, 50.0], [width - 50.0, 50.0], [width - 50.0, height - 50.0], [50.0, height - 50.0]]))
    face = MeasuredFace(
        face_id="A1/1", label="wall", score=1.0, frame=frame, outline_uv_m=(), outline_px=(ring,), area_m2=1.0,
        area_sigma_calibration_m2=0.01, area_sigma_image_m2=0.01, covariance=np.eye(3), width_m=1.0, height_m=1.0,
        width_px=100.0, distance_m=WALL_M, cut_by_frame=False, occluded=False, flatness_rms_m=0.0, instance=0,
    )  # fmt: skip
    return replace(station, depth_ref=reference, faces=(face,)), body


def test_a_body_before_a_wall_lies_within_its_rings_and_the_wall_outside() -> None:
    station, body = seen(0.4, 120)
    drawn = np.zeros(body.shape, np.uint8)
    for ring in standing_before(station):
        cv2.fillPoly(drawn, [np.round(ring).astype(np.int32)], 1)
    assert (drawn[body] > 0).mean() > 0.99
    assert drawn[~body].mean() < 0.1


def test_the_walls_own_roughness_and_a_bar_before_it_are_no_body() -> None:
    assert standing_before(seen(0.03, 120)[0]) == ()
    assert standing_before(seen(0.4, 8)[0]) == ()


def test_what_was_looked_for_when_a_station_was_measured_is_kept_and_not_looked_for_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station, _ = seen(0.4, 120)
    looked = station_record(station, None, date(2026, 3, 2), {}).before_px
    kept = from_bytes(
        to_bytes(replace(station, before_px=standing_before(station)), StationMeasurement), StationMeasurement
    )
    monkeypatch.setattr(records, "standing_before", lambda _: pytest.fail("it was looked for before"))
    again = station_record(kept, None, date(2026, 3, 2), {}).before_px
    assert len(looked) == len(again) > 0
    for one, other in zip(looked, again, strict=True):
        np.testing.assert_array_equal(one, other)
