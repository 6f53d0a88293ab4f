"""Hostile and wrong networks and cards are refused by name, with what to do; nothing crashes and nothing is guessed."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.storage.schemas import schema
from asbuilt_bim.vision.networks.card import ROLES, ClassCard, GeometryCard, InputCard, NetworkCard
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkSegmenter, load
from asbuilt_bim.vision.networks.onnx_file import check_onnx_file
from tests.vision.networks import graphs

PHOTO = np.zeros((48, 64, 3), np.uint8)
LOGITS = np.zeros((1, 3, 48, 64), np.float32)


def refused(path: Path, task: Any = "segment") -> str:
    with pytest.raises(NetworkError) as caught:
        loaded = load(path, task)
        if task == "segment":
            NetworkSegmenter(loaded=loaded).sightings(PHOTO)
        else:
            NetworkDepth(loaded=loaded).estimate(PHOTO)
    return str(caught.value)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"layout": "yolov99"}, "layout: expected 'mask-rcnn'"),
        ({"clases": []}, "did you mean classes"),
        ({"classes": []}, "none is named"),
        (
            {"classes": [{"id": 3, "name": "cat", "label": "other"}], "layout": "centres"},
            "not one is a wall or a column",
        ),
        (
            {"classes": [{"id": 3, "name": "a", "label": "wall", "blur": True}]},
            "only classes with label other are blurred",
        ),
        ({"classes": [{"id": 3, "name": n, "label": "wall"} for n in "ab"]}, "id 3 stands twice"),
        ({"input": {"width_px": 64}}, "input.height_px: is missing"),
        ({"input": graphs.INPUT | {"std": [1.0, 0.0, 1.0]}}, "must be positive"),
        ({"input": graphs.INPUT | {"width_px": 100000}}, "expected 16 to 4096 px"),
        ({"outputs": {"prototypes": "x"}}, "the layout semantic has logits"),
        ({"file": "../tiny.onnx"}, "leaves the card's folder"),
        ({"file": "/etc/passwd"}, "leaves the card's folder"),
        ({"file": "x" * 5000}, "can't be looked for"),
        ({"file": "gone.onnx"}, "is not there"),
        ({"least_score": 2.0}, "expected 0 to 1"),
        ({"offset_px": 0.0}, "expected 0.01 to 10000 px"),
        ({"mirror": True, "input": graphs.INPUT | {"order": "nhwc"}}, "mirror: only the layouts"),
        ({"class_by": "vote"}, "expected 'instance' or 'pixel'"),
        ({"geometry": {"input": "g"}, "input": graphs.INPUT | {"order": "chw"}}, "only a segmenter of order nchw"),
    ],
)
def test_a_wrong_card_is_refused_by_its_key(tmp_path: Path, keys: dict[str, Any], says: str) -> None:
    path = graphs.card(tmp_path, graphs.constant({"logits": LOGITS}), **({"layout": "semantic"} | keys))
    message = refused(path)
    assert says in message
    assert "card.yaml" in message


def test_the_schema_knows_the_cards_keys() -> None:
    whole = schema("network-1")
    for part, kind in (
        (whole, NetworkCard),
        (whole["properties"]["input"], InputCard),
        (whole["properties"]["classes"]["items"], ClassCard),
        (whole["properties"]["geometry"], GeometryCard),
    ):
        assert set(part["properties"]) == {f.name for f in fields(kind)}
        assert part["additionalProperties"] is False
    assert set(whole["properties"]["layout"]["enum"]) == set(ROLES)


def test_a_missing_card_is_refused(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "nothing.yaml")
    assert "it is a folder; name the file in it" in refused(tmp_path)


def test_a_depth_network_is_no_segmenter(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, graphs.echo(), "inverse-depth")
    assert "is for depth, it is named for segment" in refused(path)


@pytest.mark.parametrize("data", [b"", b"hello, this is a text file and no network", os.urandom(4096), b"\xff" * 400])
def test_what_is_no_onnx_file_is_refused(tmp_path: Path, data: bytes) -> None:
    message = refused(graphs.card(tmp_path, data, "semantic"))
    assert "tiny.onnx" in message


def test_half_an_onnx_file_is_refused(tmp_path: Path) -> None:
    data = graphs.constant({"logits": LOGITS}).SerializeToString()
    assert "damaged" in refused(graphs.card(tmp_path, data[: len(data) // 2], "semantic"))


def test_every_cut_of_a_file_is_refused_or_loads_but_never_crashes(tmp_path: Path) -> None:
    data = graphs.echo().SerializeToString()
    path = tmp_path / "cut.onnx"
    for end in range(0, len(data), 7):
        path.write_bytes(data[:end])
        try:
            check_onnx_file(path)
        except NetworkError as problem:
            assert "cut.onnx" in str(problem)


@pytest.mark.parametrize("place", ["../secret.bin", "/etc/hostname", "a/../../secret.bin", "C:\\secret.bin", ""])
def test_data_outside_the_networks_folder_are_refused(tmp_path: Path, place: str) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\0" * 64)
    inside = tmp_path / "net"
    inside.mkdir()
    network = graphs.constant({"logits": LOGITS})
    tensor = network.graph.initializer[0]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", place
    message = refused(graphs.card(inside, network, "semantic"))
    assert "outside its folder" in message


def test_data_beside_the_network_are_read(tmp_path: Path) -> None:
    logits = np.stack([np.full((48, 64), v, np.float32) for v in (-5.0, 5.0, -5.0)])[None]
    network = graphs.constant({"logits": logits})
    tensor = network.graph.initializer[0]
    (tmp_path / "weights.bin").write_bytes(tensor.raw_data)
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", "weights.bin"
    path = graphs.card(tmp_path, network, "semantic")
    ((meaning, one),) = NetworkSegmenter(loaded=load(path, "segment")).sightings(PHOTO)
    assert meaning == "wall"
    assert one.mask.all()


def test_a_network_that_wants_too_much_memory_is_refused_before_it_gets_it(tmp_path: Path) -> None:
    assert "GB of memory" in refused(graphs.card(tmp_path, graphs.greedy(60_000), "semantic"))  # 14 GB


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nan_and_infinity_are_refused(tmp_path: Path, value: float) -> None:
    logits = LOGITS.copy()
    logits[0, 1, 5, 5] = value
    assert "NaN or infinity" in refused(graphs.card(tmp_path, graphs.constant({"logits": logits}), "semantic"))


def test_an_operator_that_onnx_does_not_have_is_refused(tmp_path: Path) -> None:
    node = helper.make_node("RunShell", ["image"], ["logits"], domain="evil")
    info = helper.make_tensor_value_info("logits", TensorProto.FLOAT, [1, 3, 48, 64])
    network = graphs.model([node], [info], [], ["image"])
    network.opset_import.append(helper.make_opsetid("evil", 1))
    assert "operators that plain ONNX doesn't have" in refused(graphs.card(tmp_path, network, "semantic"))


def test_an_input_of_another_size_than_the_cards_is_refused(tmp_path: Path) -> None:
    path = graphs.card(
        tmp_path, graphs.constant({"logits": LOGITS}), "semantic", input={"width_px": 320, "height_px": 320}
    )
    assert "has shape [1, 3, 48, 64], the card says [1, 3, 320, 320]" in refused(path)


@pytest.mark.parametrize("keys", [{}, {"divide": 255.0}, {"divide": 1.0, "mean": [128.0, 128.0, 128.0]}])
def test_whole_numbers_divided_are_refused_for_all_of_the_photo_would_be_black(
    tmp_path: Path, keys: dict[str, Any]
) -> None:
    network = graphs.constant({"logits": LOGITS})
    network.graph.input[0].type.tensor_type.elem_type = TensorProto.UINT8
    path = graphs.card(tmp_path, network, "semantic", input=graphs.INPUT | keys)
    assert "set input.divide: 1 in the card" in refused(path)
    load(graphs.card(tmp_path, network, "semantic", input=graphs.INPUT | {"divide": 1.0}), "segment")


@pytest.mark.parametrize(
    ("layout", "answer"),
    [
        ("semantic", {"logits": np.zeros((3, 48, 64), np.float32)}),
        ("centres", {"logits": np.zeros((1, 3, 24, 32), np.float32), "offsets": np.zeros((1, 2, 12, 16), np.float32)}),
        ("centres", {"logits": np.zeros((1, 3, 24, 32), np.float32), "offsets": np.zeros((1, 3, 24, 32), np.float32)}),
        ("query", {"logits": np.zeros((1, 5, 4), np.float32), "masks": np.zeros((1, 4, 12, 16), np.float32)}),
        ("yolo-seg", {"p": np.zeros((1, 34, 9), np.float32), "q": np.zeros((1, 32, 12, 16), np.float32)}),
        (
            "mask-rcnn",
            {
                "boxes": np.zeros((2, 4), np.float32), "labels": np.zeros(3, np.int64),
                "scores": np.zeros(2, np.float32), "masks": np.zeros((2, 1, 28, 28), np.float32),
            },
        ),
    ],
)  # fmt: skip
def test_answers_of_another_shape_than_the_layouts_are_refused(
    tmp_path: Path, layout: str, answer: dict[str, np.ndarray]
) -> None:
    message = refused(graphs.card(tmp_path, graphs.constant(answer), layout))
    assert f"the layout {layout} wants" in message


@pytest.mark.parametrize("layout", ["mask-rcnn", "yolo-seg"])
def test_scores_that_are_no_likelihoods_are_refused(tmp_path: Path, layout: str) -> None:
    answers = {
        "mask-rcnn": {
            "boxes": np.array([[16, 8, 32, 40]], np.float32), "labels": np.array([1], np.int64),
            "scores": np.array([4.2], np.float32), "masks": np.ones((1, 1, 28, 28), np.float32),
        },
        "yolo-seg": {"p": np.full((1, 39, 80), 4.2, np.float32), "q": np.ones((1, 32, 12, 16), np.float32)},
    }  # fmt: skip
    message = refused(graphs.card(tmp_path, graphs.constant(answers[layout]), layout))
    assert "its scores run from 4.2 to 4.2, and a score is 0 to 1" in message


def test_offsets_beyond_all_bounds_are_refused(tmp_path: Path) -> None:
    logits = np.zeros((1, 3, 24, 32), np.float32)
    logits[0, 1, 4:20, 4:20] = 9.0
    answer = {"logits": logits, "offsets": np.full((1, 2, 24, 32), 1e9, np.float32)}
    assert "an offset points 5e+08 cells away" in refused(graphs.card(tmp_path, graphs.constant(answer), "centres"))


@pytest.mark.parametrize(
    ("layout", "answer", "count"),
    [
        ("semantic", {"logits": LOGITS}, 3),
        ("centres", {"logits": LOGITS[..., ::2, ::2], "offsets": np.zeros((1, 2, 24, 32), np.float32)}, 3),
        ("query", {"logits": np.zeros((1, 5, 4), np.float32), "masks": np.zeros((1, 5, 12, 16), np.float32)}, 4),
        ("yolo-seg", {"p": np.zeros((1, 39, 80), np.float32), "q": np.zeros((1, 32, 12, 16), np.float32)}, 3),
    ],
)
def test_a_class_that_the_network_has_no_output_for_is_refused_with_both_numbers(
    tmp_path: Path, layout: str, answer: dict[str, np.ndarray], count: int
) -> None:
    wall = {"id": 1, "name": "cast wall", "label": "wall"}
    classes = [wall, {"id": count, "name": "pillar", "label": "column"}]
    message = refused(graphs.card(tmp_path, graphs.constant(answer), layout, classes=classes))
    assert f"names class {count} (pillar), the file tells {count} classes apart (ids 0 to {count - 1})" in message
    assert "correct the ids in the card" in message
    classes[1] |= {"id": count - 1}
    path = graphs.card(tmp_path, graphs.constant(answer), layout, classes=classes)
    NetworkSegmenter(loaded=load(path, "segment")).sightings(PHOTO)


def test_the_class_nothing_of_a_softmax_is_none_to_name(tmp_path: Path) -> None:
    answer = {"logits": np.zeros((1, 5, 3), np.float32), "masks": np.zeros((1, 5, 12, 16), np.float32)}
    path = graphs.card(tmp_path, graphs.constant(answer), "query", activation="softmax")
    assert "names class 2 (pillar), the file tells 2 classes apart" in refused(path)


def test_a_card_with_geometry_wants_a_second_input(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, graphs.constant({"logits": LOGITS}), "semantic", geometry={"input": "g"})
    assert "has 1 inputs, its card wants 2" in refused(path)


def test_too_few_outputs_are_refused_with_those_that_there_are(tmp_path: Path) -> None:
    message = refused(graphs.card(tmp_path, graphs.constant({"p": LOGITS}), "query"))
    assert "the layout query wants logits, masks, the file gives p" in message


def test_an_output_named_in_the_card_must_be_there(tmp_path: Path) -> None:
    path = graphs.card(tmp_path, graphs.constant({"p": LOGITS}), "semantic", outputs={"logits": "q"})
    assert "the card names the outputs q, the file has p; correct outputs in the card" in refused(path)


def _yolo(boxes: np.ndarray) -> dict[str, np.ndarray]:
    """Return a wall of full score in each box (N, 4: middle and size), among twenty places."""
    predictions = np.zeros((1, 4 + 3 + 2, 20), np.float32)
    predictions[0, :4, : len(boxes)], predictions[0, 5, : len(boxes)], predictions[0, 7, : len(boxes)] = boxes.T, 0.9, 1
    return {"predictions": predictions, "prototypes": np.ones((1, 2, 12, 16), np.float32)}


def test_predictions_that_lie_turned_or_went_through_nms_are_refused(tmp_path: Path) -> None:
    answer = _yolo(np.array([[24.0, 24.0, 16.0, 32.0]]))
    turned = answer | {"predictions": np.ascontiguousarray(answer["predictions"].transpose(0, 2, 1))}
    message = refused(graphs.card(tmp_path, graphs.constant(turned), "yolo-seg"))
    assert "predictions (1, 20, 9)" in message and "without NMS" in message


def test_boxes_in_shares_of_the_picture_are_refused_for_no_mask_would_be_left(tmp_path: Path) -> None:
    answer = _yolo(np.array([[0.4, 0.5, 0.25, 0.7]]))
    assert "export them in pixels" in refused(graphs.card(tmp_path, graphs.constant(answer), "yolo-seg"))
    answer = {
        "boxes": np.array([[0.25, 0.1, 0.5, 0.8]], np.float32), "labels": np.array([1], np.int64),
        "scores": np.array([0.9], np.float32), "masks": np.ones((1, 1, 28, 28), np.float32),
    }  # fmt: skip
    assert "export them in pixels" in refused(graphs.card(tmp_path, graphs.constant(answer), "mask-rcnn"))


def test_a_map_with_its_classes_last_is_refused(tmp_path: Path) -> None:
    answer = {"logits": np.zeros((1, 48, 64, 3), np.float32)}
    message = refused(graphs.card(tmp_path, graphs.constant(answer), "semantic"))
    assert "logits (1, 48, 64, 3)" in message and "(1, C, h, w)" in message


def test_a_network_in_the_place_of_its_card_is_told_to_name_the_card(tmp_path: Path) -> None:
    graphs.card(tmp_path, graphs.constant({"logits": LOGITS}), "semantic")
    assert "is a network, not its card; name the YAML file that describes it" in refused(tmp_path / "tiny.onnx")
