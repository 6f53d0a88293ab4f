"""The layout `centres`: things told apart by where their pixels vote, and by the surface that they lie on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.centres import grouped
from asbuilt_bim.vision.networks.kinds import NetworkSegmenter, answers, load
from asbuilt_bim.vision.stereo.depth import DepthMap
from tests.vision.networks import graphs

W, H = 64, 48  # the input; answers are at half of it
PHOTO = np.zeros((96, 128, 3), np.uint8)
WALL, COLUMN = 1, 2
Box = tuple[slice, slice]


def answer(things: list[tuple[int, list[Box]]], sure: float = 4.0, unit_px: float = 8.0) -> dict[str, np.ndarray]:
    """What a perfect network says of things given as (class, boxes in input pixels), later ones in front."""
    kind, owner = np.zeros((H // 2, W // 2), int), np.full((H // 2, W // 2), -1)
    for number, (label, boxes) in enumerate(things):
        for rows, columns in boxes:
            at = (slice(rows.start // 2, rows.stop // 2), slice(columns.start // 2, columns.stop // 2))
            kind[at], owner[at] = label, number
    offsets = np.zeros((1, 2, H // 2, W // 2), np.float32)
    for number in range(len(things)):
        rows, columns = np.nonzero(owner == number)
        offsets[0, 0, rows, columns] = (columns.mean() - columns) * 2 / unit_px
        offsets[0, 1, rows, columns] = (rows.mean() - rows) * 2 / unit_px
    logits = np.stack([np.where(kind == k, sure, 0.0) for k in range(3)])[None].astype(np.float32)
    return {"logits": logits, "offsets": offsets}


def found(folder: Path, said: dict[str, np.ndarray], **keys: Any) -> list[tuple[str, float, np.ndarray]]:
    classes = [{"id": 1, "name": "wall", "label": "wall"}, {"id": 2, "name": "column", "label": "column"}]
    path = graphs.card(folder, graphs.constant(said), "centres", offset_px=8.0, classes=classes, **keys)
    seen = NetworkSegmenter(loaded=load(path, "segment")).sightings(PHOTO)
    return [(meaning, one.score, one.mask) for meaning, one in seen]


def photo_mask(*boxes: Box) -> np.ndarray:
    mask = np.zeros(PHOTO.shape[:2], bool)
    for rows, columns in boxes:
        mask[2 * rows.start : 2 * rows.stop, 2 * columns.start : 2 * columns.stop] = True
    return mask


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.count_nonzero(one & other) / np.count_nonzero(one | other))


LEFT, RIGHT = (slice(8, 40), slice(4, 28)), (slice(8, 40), slice(28, 60))


def test_two_walls_that_touch_are_two_and_meet_where_their_votes_part(tmp_path: Path) -> None:
    seen = sorted(found(tmp_path, answer([(WALL, [LEFT]), (WALL, [RIGHT])])), key=lambda one: int(one[2].argmax()))
    assert [meaning for meaning, _, _ in seen] == ["wall", "wall"]
    for (_, score, mask), box in zip(seen, (LEFT, RIGHT), strict=True):
        assert overlap(mask, photo_mask(box)) > 0.93
        assert score > 0.9
    seam = [int(np.flatnonzero(mask[48])[index]) for (_, _, mask), index in zip(seen, (-1, 0), strict=True)]
    assert seam == [55, 56], "neither a gap nor an overlap between them"


def test_pieces_of_a_wall_on_both_sides_of_something_else_stay_one(tmp_path: Path) -> None:
    pieces = [(slice(8, 40), slice(4, 24)), (slice(8, 40), slice(36, 60))]
    ((_, _, mask),) = found(tmp_path, answer([(WALL, pieces)]))
    assert overlap(mask, photo_mask(*pieces)) > 0.9


def test_a_thing_of_which_a_part_looks_like_a_column_is_one_wall_unless_pixels_decide(tmp_path: Path) -> None:
    said = answer([(WALL, [(slice(8, 40), slice(8, 56))])])
    said["logits"][0, :, 4:20, 22:28] = np.array([0.0, 3.5, 4.0], np.float32)[:, None, None]
    ((meaning, _, mask),) = found(tmp_path, said)
    assert meaning == "wall"
    assert overlap(mask, photo_mask((slice(8, 40), slice(8, 56)))) > 0.93
    by_pixel = {meaning: mask for meaning, _, mask in found(tmp_path, said, class_by="pixel", name="by pixel")}
    assert overlap(by_pixel["wall"], photo_mask((slice(8, 40), slice(8, 44)))) > 0.9
    assert overlap(by_pixel["column"], photo_mask((slice(8, 40), slice(44, 56)))) > 0.85


def test_a_crumb_is_nothing_and_an_empty_picture_gives_nothing(tmp_path: Path) -> None:
    assert found(tmp_path, answer([(WALL, [(slice(8, 10), slice(8, 10))])])) == []
    assert found(tmp_path, answer([]), name="empty") == []


def test_noisy_votes_of_a_large_wall_make_one_thing() -> None:
    rng = np.random.default_rng(4)
    concrete = np.zeros((144, 192), bool)
    concrete[30:120, 20:170] = True
    rows, columns = np.mgrid[:144, :192]
    offsets = np.stack([94.5 - columns, 74.5 - rows]).astype(np.float32)
    offsets *= 0.85 + 0.1 * rng.standard_normal(offsets.shape).astype(np.float32)
    assert len(grouped(concrete, offsets).misfit) == 1
    assert len(grouped(concrete, 0.6 * offsets).misfit) == 1, "votes that fall short are passed on"


def test_mirrored_a_network_that_sees_the_same_in_both_is_contradicted_by_itself(tmp_path: Path) -> None:
    """A constant answer, looked at mirrored, puts the wall on the other side too: half as sure on both."""
    path = graphs.card(
        tmp_path, graphs.constant(answer([(WALL, [LEFT])], sure=3.0)), "centres", offset_px=8.0, mirror=True
    )
    loaded = load(path, "segment")
    picture = np.zeros((1, 3, H, W), np.float32)
    said = answers(loaded.network, loaded.card, (picture,))
    once = loaded.network.run((picture,))
    np.testing.assert_allclose(said["logits"], said["logits"][..., ::-1])
    np.testing.assert_allclose(said["offsets"][:, 0], -said["offsets"][:, 0, :, ::-1])
    np.testing.assert_allclose(
        said["offsets"][:, 1, :, :16] * 2.0, once["offsets"][:, 1, :, :16] + once["offsets"][:, 1, :, :15:-1]
    )


def geometry_network(said: dict[str, np.ndarray]) -> bytes:
    """A network that says this, if the geometry's last channel holds anything; else that all is background."""
    arrays = {f"{name}_value": array for name, array in said.items()} | {"last": np.array([4], np.int64)}
    nodes = [
        helper.make_node("Gather", ["geometry", "last"], ["there"], axis=1),
        helper.make_node("ReduceMax", ["there"], ["any"], keepdims=0),
        *(helper.make_node("Mul", [f"{name}_value", "any"], [name]) for name in said),
    ]
    inputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, channels, H, W])
        for name, channels in (("geometry", 5), ("image", 3))
    ]
    outputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, list(array.shape)) for name, array in said.items()
    ]
    initial = [numpy_helper.from_array(array, name) for name, array in arrays.items()]
    graph = helper.make_graph(nodes, "tiny", inputs, outputs, initial)
    data: bytes = helper.make_model(graph, opset_imports=[graphs.OPSET], ir_version=8).SerializeToString()
    return data


def pair_with_depth(disparity: np.ndarray) -> tuple[RectifiedPair, DepthMap]:
    everywhere = np.ones(PHOTO.shape[:2], bool)
    camera = RectifiedCamera(
        f_px=100.0, cx_px=64.0, cy_px=48.0, baseline_m=0.25, width_px=128, height_px=96, rectified_from_left=np.eye(3)
    )
    pair = RectifiedPair(
        name="A", left=PHOTO, right=PHOTO, valid_left=everywhere, valid_right=everywhere, camera=camera
    )
    depth = DepthMap(
        disparity_px=disparity.astype(np.float32), sigma_px=np.full(disparity.shape, 0.1, np.float32),
        valid=disparity > 0, f_px=100.0, baseline_m=0.25, method="stereo",
    )  # fmt: skip
    return pair, depth


def test_geometry_is_fed_where_there_is_stereo_and_cuts_a_column_from_the_wall_behind_its_middle(
    tmp_path: Path,
) -> None:
    wall, column = (slice(8, 40), slice(4, 60)), (slice(8, 40), slice(28, 36))
    said = answer([(WALL, [wall])])  # all of it votes for one place
    said["logits"][0, :, 4:20, 14:18] = np.array([0.0, 3.0, 4.0], np.float32)[:, None, None]  # and is called either
    path = graphs.card(
        tmp_path, geometry_network(said), "centres", offset_px=8.0, geometry={"input": "geometry"}, least_score=0.6
    )
    segmenter = NetworkSegmenter(loaded=load(path, "segment"))
    disparity = np.full(PHOTO.shape[:2], 4.0)
    disparity[photo_mask(column)] = 8.0
    pair, depth = pair_with_depth(disparity)
    masks = sorted((one.mask for one in segmenter.segment(pair, depth)), key=lambda mask: int(mask.sum()))
    assert len(masks) == 2
    assert overlap(masks[0], photo_mask(column)) > 0.8
    assert overlap(masks[1], photo_mask(wall) & ~photo_mask(column)) > 0.85
    flat = pair_with_depth(np.full(PHOTO.shape[:2], 4.0))
    assert len(segmenter.segment(*flat)) == 1
    assert segmenter.segment(pair, None) == [], "without stereo the channels are 0"


def test_an_input_for_geometry_that_the_file_does_not_have_is_refused(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, geometry_network(answer([])), "centres", geometry={"input": "stereo"})
    with pytest.raises(NetworkError, match="has no input stereo for geometry, it has geometry, image"):
        load(path, "segment")
