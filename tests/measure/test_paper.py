"""`method: paper`: what was published, with its traps, and never silently."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array
from asbuilt_bim.measure.depth_source import missing_network
from asbuilt_bim.measure.paper import paper_faces
from asbuilt_bim.measure.station import (
    MeasureOptions,
    Models,
    RejectedStation,
    StationDetail,
    measure_in_detail,
    measure_station,
)
from asbuilt_bim.measure.station_faces import FaceOptions
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.stereo.depth import DepthMap
from tests.measure.box_world import make_camera, site
from tests.measure.published import paper_area
from tests.measure.test_faces import rig_of
from tests.measure.test_station import FREE, photos

CAMERA = make_camera(640, 480)


@dataclass(frozen=True)
class Fake:
    """A network that answers with a map that was given."""

    answer: np.ndarray
    name: str = "fake"

    def estimate(self, image: ByteImage) -> Float32Array:
        return self.answer


def facing(turn_rad: float) -> tuple[RectifiedPair, DepthMap, Instance]:
    """Return a plate of 1 x 2 m, 4 m off, turned about the vertical, its exact depth and its mask."""
    x, y = np.meshgrid(np.arange(640.0), np.arange(480.0))
    rx, ry = (x - CAMERA.cx_px) / CAMERA.f_px, (y - CAMERA.cy_px) / CAMERA.f_px
    normal = np.array([np.sin(turn_rad), 0.0, np.cos(turn_rad)])
    z = 4.0 * np.cos(turn_rad) / (rx * normal[0] + normal[2])
    along = (rx * z) / np.cos(turn_rad)
    mask = (np.abs(along) <= 0.5) & (np.abs(ry * z) <= 1.0)
    valid = np.ones(mask.shape, dtype=bool)
    disparity = (CAMERA.f_px * CAMERA.baseline_m / z).astype(np.float32)
    depth = DepthMap(
        disparity_px=disparity, sigma_px=np.full_like(disparity, 0.1), valid=valid, f_px=CAMERA.f_px,
        baseline_m=CAMERA.baseline_m, method="paper",
    )  # fmt: skip
    blank = np.zeros((480, 640, 3), dtype=np.uint8)
    pair = RectifiedPair(name="T", left=blank, right=blank, valid_left=valid, valid_right=valid, camera=CAMERA)
    return (
        pair,
        depth,
        Instance(label="wall", score=1.0, mask=mask, box_px=(0, 0, 640, 480), source=InstanceSource.GIVEN),
    )


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 55.0])
def test_the_area_is_that_of_the_shadow_on_the_image_plane(turn_deg: float) -> None:
    pair, depth, instance = facing(np.radians(turn_deg))
    (face,) = paper_faces(pair, depth, [instance], FaceOptions()).faces
    assert face.area_m2 == pytest.approx(2.0 * np.cos(np.radians(turn_deg)), rel=0.03)
    assert face.area_m2 < 2.0 * np.cos(np.radians(turn_deg))  # a contour through pixel centres loses its half pixel
    assert face.area_sigma_m2 == face.area_m2  # the method states none: nothing may rest on it
    assert face.frame.normal @ [0.0, 0.0, 1.0] == pytest.approx(-1.0)


def test_a_boundary_without_depth_is_named_not_left_out() -> None:
    pair, depth, instance = facing(0.0)
    blind = replace(depth, valid=np.zeros_like(depth.valid))
    found = paper_faces(pair, blind, [instance], FaceOptions())
    assert found.faces == ()
    (lost,) = found.rejections
    assert lost.code is Reason.INSTANCE_WITHOUT_DEPTH and lost.values["pixels_without"] == lost.values["pixels"]


def test_a_mask_at_the_photos_border_is_said_to_be_cut() -> None:
    pair, depth, instance = facing(0.0)
    everywhere = replace(instance, mask=np.ones_like(instance.mask))
    (face,) = paper_faces(pair, depth, [everywhere], FaceOptions()).faces
    assert face.cut_by_frame


def test_without_a_network_the_published_method_says_what_to_do() -> None:
    found = measure_station(photos(), rig_of(site()[1]), replace(FREE, method="paper"))
    assert isinstance(found, RejectedStation)
    assert "networks: {depth: card.yaml}, --depth-network" in str(words_of(found.rejections[-1]))
    said = missing_network("paper", None, None)
    assert "method: paper needs a network" in said
    assert "depth: stereo" in said
    assert missing_network("paper", "stereo", None) == ""
    assert missing_network("default", None, None) == ""
    assert missing_network("default", "fused", None).startswith("depth: fused needs a network")


def test_the_default_method_does_not_take_a_map_without_sigma() -> None:
    with pytest.raises(ValueError, match="method: paper only"):
        MeasureOptions(depth="paper")


def test_the_published_map_needs_the_target() -> None:
    options = replace(FREE, method="paper")
    network = Models(relative_depth=Fake(np.ones((600, 800), np.float32)))
    found = measure_station(photos(), rig_of(site()[1]), options, models=network)
    assert isinstance(found, RejectedStation)
    assert found.rejections[-1].code is Reason.DEPTH_WITHOUT_TARGET


def test_what_follows_the_depth_map_can_be_run_on_stereo_and_a_given_mask() -> None:
    pair = site()[1]
    mask = np.zeros(pair.valid_left.shape, dtype=bool)
    mask[250:400, 480:620] = True  # well inside the wall
    given = Instance(label="wall", score=1.0, mask=mask, box_px=(480, 250, 620, 400), source=InstanceSource.GIVEN)

    class Given:
        name = "given"

        def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
            return [given]

    options = replace(FREE, method="paper", depth="stereo")
    found = measure_in_detail(photos(), rig_of(pair), options, models=Models(segmenter=Given()))
    assert isinstance(found, StationDetail)
    assert found.depth.method == "stereo"
    assert found.instances == (given,)
    (face,) = found.measurement.faces
    published = paper_area(mask, found.depth.depth_m, pair.camera.K)
    assert face.area_m2 == pytest.approx(published, rel=1e-6)
