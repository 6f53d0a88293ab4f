"""Published networks by preset: each runs with a small file of its published shape, or is refused in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from onnx import TensorProto, helper, numpy_helper

from asbuilt_bim.cli import app
from asbuilt_bim.storage.schemas import first_fault
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkMatcher, NetworkSegmenter, load
from asbuilt_bim.vision.networks.presets import PRESETS
from tests.vision.networks.graphs import OPSET

QUERIES = 100
DEPTH, DETR, SEGFORMER = "depth-anything-v2-small", "rf-detr-seg-small", "segformer-b0-ade20k"
THREE_MAPS = np.zeros((1, 3, 8, 8), np.float32)


def published(preset: str, **changed: object) -> bytes:
    """A file with a preset's published names and shapes, its answers constant; `changed`: by name, None: left out."""
    person = np.full((1, QUERIES, 91), -9.0, np.float32)
    person[0, 3, 1] = 4.0
    masks = np.full((1, QUERIES, 96, 96), -9.0, np.float32)
    masks[0, 3, 20:80, 30:50] = 5.0
    logits = np.zeros((1, 150, 128, 128), np.float32)
    logits[:, 0, :, :60], logits[:, 12, :, 100:] = 5.0, 5.0
    ramp = np.tile(np.arange(518, dtype=np.float32), (1, 518, 1))
    pair: dict[str, list[object]] = {"left": [1, 3, "h", "w"], "right": [1, 3, "h", "w"]}
    detr = {"dets": np.zeros((1, QUERIES, 4), np.float32), "labels": person, "masks": masks}
    shapes: dict[str, tuple[dict[str, list[object]], dict[str, np.ndarray]]] = {
        "depth-anything-v2-small": ({"pixel_values": [1, 3, 518, 518]}, {"predicted_depth": ramp}),
        "lite-any-stereo": (pair, {"disparity": np.full((1, 1, 480, 640), 20.0, np.float32)}),
        "rf-detr-seg-small": ({"input": [1, 3, 384, 384]}, detr),
        "segformer-b0-ade20k": ({"pixel_values": [1, 3, 512, 512]}, {"logits": logits}),
    }
    inputs, outputs = shapes[preset]
    inputs = {name: shape for name, shape in ({**inputs, **changed}).items() if name in inputs and shape is not None}
    answers = {name: array for name, array in ({**outputs, **changed}).items() if name in outputs and array is not None}
    initial = [numpy_helper.from_array(array, f"{name}_value") for name, array in answers.items()]
    nodes = [helper.make_node("Identity", [f"{name}_value"], [name]) for name in answers]
    infos = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, list(array.shape)) for name, array in answers.items()
    ]
    given = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in inputs.items()]
    graph = helper.make_graph(nodes, preset, given, infos, initial)
    made: bytes = helper.make_model(graph, opset_imports=[OPSET], ir_version=8).SerializeToString()
    return made


def add(folder: Path, preset: str, data: bytes, *more: str) -> Result:
    (folder / "net.onnx").write_bytes(data)
    return CliRunner().invoke(app, ["networks", "add", preset, str(folder / "net.onnx"), *more])


@pytest.mark.parametrize("preset", PRESETS)
def test_each_preset_writes_a_card_that_runs_with_a_file_of_its_published_shape(tmp_path: Path, preset: str) -> None:
    free = [] if PRESETS[preset].commercial else ["--non-commercial"]
    done = add(tmp_path, preset, published(preset), *free)
    assert done.exit_code == 0, done.output
    assert "works" in done.output and PRESETS[preset].licence.split()[0] in done.output
    card = tmp_path / f"{preset}.yaml"
    assert first_fault("network-1", yaml.safe_load(card.read_text(encoding="utf-8"))) == ""
    photo = np.random.default_rng(1).integers(0, 255, (300, 400, 3), dtype=np.uint8)
    task = load_task(card)
    if task == "depth":
        estimated = NetworkDepth(loaded=load(card, "depth")).estimate(photo)
        assert estimated.shape == (300, 400) and np.diff(estimated[150]).min() >= 0.0
    elif task == "stereo":
        assert NetworkMatcher(loaded=load(card, "stereo")).raw(photo, photo) == pytest.approx(20.0 * 400 / 640)
    else:
        network = NetworkSegmenter(loaded=load(card, "segment"))
        meanings = {meaning for meaning, _ in network.sightings(photo)}
        assert meanings == ({"other"} if preset.startswith("rf-detr") else {"wall", "other"})
        people = network.people(photo)
        assert people is not None and people.any() and network.finds_concrete == (not preset.startswith("rf-detr"))


def load_task(card: Path) -> str:
    return {"inverse-depth": "depth", "disparity": "stereo"}.get(
        yaml.safe_load(card.read_text(encoding="utf-8"))["layout"], "segment"
    )


@pytest.mark.parametrize(
    ("preset", "data", "says"),
    [
        (SEGFORMER, published(SEGFORMER), "not for paid work. If yours is none, pass --non-commercial"),
        (DETR, published(DETR, masks=None), "has the outputs labels, masks, this file has dets, labels"),
        (DETR, published(DEPTH), "has the inputs input, this file has pixel_values"),
        (DEPTH, published(DEPTH, pixel_values=[1, 1, 518, 518]), "takes (1, 3, h, w)"),
        (DEPTH, published(DEPTH, predicted_depth=THREE_MAPS), "wants one map (1, h, w), got (1, 3, 8, 8)"),
        (DETR, published(DETR, labels=np.zeros((1, 7, 91), np.float32)), "wants logits (1, Q, C)"),
        ("lite-any-stereo", b"no network at all, that is sure", "is no ONNX file"),
        ("mobile-sam", published(DEPTH), "this network wants clicks or boxes"),
        ("yolov99", published(DEPTH), "no such preset; known are depth-anything-v2-small"),
    ],
)
def test_what_is_not_the_published_network_is_refused_and_leaves_no_card(
    tmp_path: Path, preset: str, data: bytes, says: str
) -> None:
    refused = add(tmp_path, preset, data)
    assert refused.exit_code == 1 and says in " ".join(refused.output.split()), refused.output
    assert [path.name for path in tmp_path.iterdir()] == ["net.onnx"]


def test_a_card_that_is_there_is_kept_unless_asked_and_when_the_new_one_fails(tmp_path: Path) -> None:
    preset = "depth-anything-v2-small"
    card = tmp_path / f"{preset}.yaml"
    card.write_text("mine", encoding="utf-8")
    kept = add(tmp_path, preset, published(preset))
    assert kept.exit_code == 1 and "--replace" in kept.output
    wrong = published(preset, predicted_depth=np.zeros((1, 3, 8, 8), np.float32))
    assert add(tmp_path, preset, wrong, "--replace").exit_code == 1 and card.read_text(encoding="utf-8") == "mine"
    assert add(tmp_path, preset, published(preset), "--replace").exit_code == 0
    assert "predicted_depth" in card.read_text(encoding="utf-8")
