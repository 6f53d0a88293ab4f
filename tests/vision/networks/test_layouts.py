"""A tiny graph of each layout gives exactly the masks that were put into it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkMatcher, NetworkSegmenter, load
from tests.vision.networks import graphs

BOX = (slice(8, 40), slice(16, 32))  # rows, columns of a 48 x 64 picture
PHOTO = np.zeros((96, 128, 3), np.uint8)  # twice the input: a mask's pixel is 2 x 2 photo pixels


def plane(rows: slice, columns: slice, inside: float = 1.0, outside: float = 0.0, step: int = 1) -> np.ndarray:
    full = np.full((48 // step, 64 // step), outside, np.float32)
    full[rows.start // step : rows.stop // step, columns.start // step : columns.stop // step] = inside
    return full


def photo_mask(rows: slice, columns: slice) -> np.ndarray:
    mask = np.zeros(PHOTO.shape[:2], bool)
    mask[2 * rows.start : 2 * rows.stop, 2 * columns.start : 2 * columns.stop] = True
    return mask


def sightings(path: Path) -> list[tuple[str, float, np.ndarray]]:
    found = NetworkSegmenter(loaded=load(path, "segment")).sightings(PHOTO)
    return [(meaning, one.score, one.mask) for meaning, one in found]


def test_mask_rcnn_as_torchvision_exports_it_gives_its_pasted_masks(tmp_path: Path) -> None:
    other = (slice(8, 40), slice(40, 56))
    answer = {
        "boxes": np.array([[16, 8, 32, 40], [40, 8, 56, 40], [0, 0, 64, 48]], np.float32),
        "labels": np.array([1, 2, 1], np.int64),
        "scores": np.array([0.9, 0.8, 0.2], np.float32),
        "masks": np.stack([plane(*BOX), plane(*other), plane(slice(0, 48), slice(0, 64))])[:, None],
    }
    wall, column = sightings(graphs.card(tmp_path, graphs.constant(answer), "mask-rcnn"))
    assert (wall[0], column[0]) == ("wall", "column")
    assert wall[1] == pytest.approx(0.9)
    np.testing.assert_array_equal(wall[2], photo_mask(*BOX))
    np.testing.assert_array_equal(column[2], photo_mask(*other))


def test_mask_rcnn_as_detectron_exports_it_lays_each_mask_into_its_box(tmp_path: Path) -> None:
    answer = {
        "boxes": np.array([[16, 8, 32, 40]], np.float32),
        "labels": np.array([1], np.int64),
        "scores": np.array([0.9], np.float32),
        "masks": np.ones((1, 1, 28, 28), np.float32),
    }
    (wall,) = sightings(graphs.card(tmp_path, graphs.constant(answer), "mask-rcnn"))
    np.testing.assert_array_equal(wall[2], photo_mask(*BOX))


def test_yolo_seg_mixes_its_prototypes_and_cuts_at_the_box(tmp_path: Path) -> None:
    prototypes = np.stack([np.ones((12, 16)), np.linspace(-1.0, 1.0, 16)[None, :].repeat(12, 0)]).astype(np.float32)
    predictions = np.zeros((1, 4 + 3 + 2, 20), np.float32)
    predictions[0, :4, 0], predictions[0, 4:7, 0], predictions[0, 7:, 0] = (24, 24, 16, 32), (0.1, 0.9, 0.1), (1, 0)
    predictions[0, :4, 1], predictions[0, 4:7, 1], predictions[0, 7:, 1] = (25, 24, 16, 32), (0.1, 0.7, 0.1), (1, 0)
    predictions[0, :4, 2], predictions[0, 4:7, 2], predictions[0, 7:, 2] = (48, 24, 32, 48), (0.1, 0.1, 0.8), (0, 1)
    answer = {"output0": predictions, "output1": prototypes[None]}
    found = sightings(graphs.card(tmp_path, graphs.constant(answer), "yolo-seg"))
    assert [f[0] for f in found] == ["wall", "column"], "the second box lies on the first and goes"
    np.testing.assert_array_equal(found[0][2], photo_mask(*BOX))
    np.testing.assert_array_equal(found[1][2], photo_mask(slice(0, 48), slice(32, 64)))


@pytest.mark.parametrize("activation", ["sigmoid", "softmax"])
def test_queries_give_one_mask_each_and_nothing_is_nothing(tmp_path: Path, activation: str) -> None:
    logits = np.full((1, 3, 4), -6.0, np.float32)
    logits[0, 0, 1], logits[0, 1, 2], logits[0, 2, 3] = 6.0, 6.0, 6.0  # wall, column, nothing
    other = (slice(8, 40), slice(40, 56))
    whole = (slice(0, 48), slice(0, 64))
    masks = np.stack([plane(*one, 5.0, -5.0) for one in (BOX, other, whole)])[None]
    answer = {"masks": masks, "logits": logits}
    path = graphs.card(tmp_path, graphs.constant(answer), "query", activation=activation)
    found = sightings(path)
    assert [f[0] for f in found] == ["wall", "column"]
    np.testing.assert_array_equal(found[0][2], photo_mask(*BOX))
    np.testing.assert_array_equal(found[1][2], photo_mask(*other))


def test_a_semantic_map_gives_a_mask_for_each_class_that_the_card_names(tmp_path: Path) -> None:
    wall = plane(*BOX, 4.0, -4.0)
    logits = np.stack([-wall, wall, np.full((48, 64), -9.0, np.float32), np.full((48, 64), -9.0, np.float32)])[None]
    found = sightings(graphs.card(tmp_path, graphs.constant({"logits": logits}), "semantic", activation="softmax"))
    assert not NetworkSegmenter(loaded=load(tmp_path / "card.yaml", "segment")).finds_things
    named = {meaning: mask for meaning, _, mask in found}
    assert set(named) == {"wall", "other"}
    np.testing.assert_array_equal(named["wall"], photo_mask(*BOX))
    np.testing.assert_array_equal(named["other"], ~photo_mask(*BOX))


def test_masks_never_overlap_the_surer_one_has_the_pixel(tmp_path: Path) -> None:
    answer = {
        "boxes": np.array([[16, 8, 32, 40], [16, 8, 48, 40]], np.float32),
        "labels": np.array([1, 2], np.int64),
        "scores": np.array([0.7, 0.9], np.float32),
        "masks": np.ones((2, 1, 28, 28), np.float32),
    }
    found = sightings(graphs.card(tmp_path, graphs.constant(answer), "mask-rcnn"))
    assert [f[0] for f in found] == ["column"], "the wall lies wholly under the column"


def test_letterboxed_photos_get_their_masks_back_in_place(tmp_path: Path) -> None:
    tall = np.zeros((96, 64, 3), np.uint8)  # half size: 32 x 48 inside 64 x 48, 16 px of padding on each side
    answer = {
        "boxes": np.array([[16, 0, 32, 48]], np.float32), "labels": np.array([1], np.int64),
        "scores": np.array([0.9], np.float32), "masks": plane(slice(0, 48), slice(16, 32))[None, None],
    }  # fmt: skip
    keys = {"input": graphs.INPUT | {"resize": "letterbox", "pad_value": 114}}
    path = graphs.card(tmp_path, graphs.constant(answer), "mask-rcnn", **keys)
    ((_, one),) = NetworkSegmenter(loaded=load(path, "segment")).sightings(tall)
    expected = np.zeros((96, 64), bool)
    expected[:, :32] = True
    np.testing.assert_array_equal(one.mask, expected)


def test_inputs_are_normalised_in_the_order_of_the_cards_colours(tmp_path: Path) -> None:
    blue_first = np.zeros((48, 64, 3), np.uint8)
    blue_first[:] = (10, 20, 200)
    for colour, value in (("rgb", 200), ("bgr", 10)):
        keys = graphs.INPUT | {"colour": colour, "mean": [0.5, 0.0, 0.0], "std": [0.25, 1.0, 1.0]}
        path = graphs.card(tmp_path, graphs.echo(), "inverse-depth", input=keys)
        seen = NetworkDepth(loaded=load(path, "depth")).estimate(blue_first)
        np.testing.assert_allclose(seen, (value / 255.0 - 0.5) / 0.25, rtol=1e-5)


def test_metric_depth_becomes_inverse_and_refuses_what_is_not_positive(tmp_path: Path) -> None:
    ramp = np.linspace(2.0, 8.0, 64, dtype=np.float32)[None, None, :].repeat(48, 1)
    path = graphs.card(tmp_path, graphs.constant({"d": ramp}), "metric-depth")
    inverse = NetworkDepth(loaded=load(path, "depth")).estimate(np.zeros((48, 64, 3), np.uint8))
    np.testing.assert_allclose(1.0 / inverse[10], ramp[0, 0], rtol=1e-5)
    bad = graphs.card(tmp_path, graphs.constant({"d": ramp - 4.0}), "metric-depth", name="other")
    with pytest.raises(NetworkError, match="positive"):
        NetworkDepth(loaded=load(bad, "depth")).estimate(np.zeros((48, 64, 3), np.uint8))


def test_a_stereo_networks_disparity_is_scaled_to_the_photo_and_polished_on_it(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).integers(0, 255, (96, 160), dtype=np.uint8)
    left, right = np.repeat(noise[:, :128, None], 3, 2), np.repeat(noise[:, 8:136, None], 3, 2)
    camera = RectifiedCamera(
        f_px=100.0, cx_px=64.0, cy_px=48.0, baseline_m=0.2, width_px=128, height_px=96, rectified_from_left=np.eye(3)
    )
    everywhere = np.ones((96, 128), bool)
    pair = RectifiedPair(name="A", left=left, right=right, valid_left=everywhere, valid_right=everywhere, camera=camera)
    answer = np.full((1, 1, 48, 64), 4.2, np.float32)  # 8.4 px at the photo's size; the truth is 8
    path = graphs.card(tmp_path, graphs.constant({"d": answer}, ("left", "right")), "disparity")
    disparity, sigma = NetworkMatcher(loaded=load(path, "stereo")).match(pair)
    known = np.isfinite(disparity)
    assert known.mean() > 0.5
    assert np.median(np.abs(disparity[known] - 8.0)) < 0.05
    assert np.isfinite(sigma[known]).all()
    assert not known[:, :7].any(), "what would lie left of the right photo isn't measured"
