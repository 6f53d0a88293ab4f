"""Tiny ONNX graphs for tests: networks that always give the same answer, and hostile ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from onnx import ModelProto, TensorProto, helper, numpy_helper

OPSET = helper.make_opsetid("", 17)
INPUT = {"width_px": 64, "height_px": 48}


def model(
    nodes: Sequence[Any], outputs: Sequence[Any], initial: Sequence[TensorProto], inputs: Sequence[str]
) -> ModelProto:
    given = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 3, 48, 64]) for name in inputs]
    graph = helper.make_graph(list(nodes), "tiny", given, list(outputs), list(initial))
    return helper.make_model(graph, opset_imports=[OPSET], ir_version=8)


def constant(outputs: Mapping[str, np.ndarray], inputs: Sequence[str] = ("image",)) -> ModelProto:
    """A network that gives these arrays whatever it sees."""
    initial = [numpy_helper.from_array(array, f"{name}_value") for name, array in outputs.items()]
    nodes = [helper.make_node("Identity", [f"{name}_value"], [name]) for name in outputs]
    infos = [
        helper.make_tensor_value_info(name, helper.np_dtype_to_tensor_dtype(array.dtype), list(array.shape))
        for name, array in outputs.items()
    ]
    return model(nodes, infos, initial, inputs)


def greedy(side: int) -> ModelProto:
    """A network that makes a (side, side) array of ones on its way."""
    shape = numpy_helper.from_array(np.array([side, side], np.int64), "shape")
    one = helper.make_tensor("one", TensorProto.FLOAT, [1], [1.0])
    nodes = [
        helper.make_node("ConstantOfShape", ["shape"], ["huge"], value=one),
        helper.make_node("ReduceSum", ["huge"], ["sum"], keepdims=0),
        helper.make_node("Add", ["image", "sum"], ["logits"]),
    ]
    info = helper.make_tensor_value_info("logits", TensorProto.FLOAT, [1, 3, 48, 64])
    return model(nodes, [info], [shape], ["image"])


def echo(channels: int = 1) -> ModelProto:
    """A network that gives its input's first channels back, times 1."""
    ends = [numpy_helper.from_array(np.array([v], np.int64), name) for name, v in (("a", 0), ("b", channels), ("c", 1))]
    node = helper.make_node("Slice", ["image", "a", "b", "c"], ["depth"])
    info = helper.make_tensor_value_info("depth", TensorProto.FLOAT, [1, channels, 48, 64])
    return model([node], [info], ends, ["image"])


def scaled_beside(folder: Path, data: str) -> ModelProto:
    """A network that gives its input's first channel times a number that lies in a file of its own."""
    (folder / data).write_bytes(np.float32(1.0).tobytes())
    factor = TensorProto(name="factor", data_type=TensorProto.FLOAT, dims=[1], data_location=TensorProto.EXTERNAL)
    factor.external_data.add(key="location", value=data)
    made = echo()
    made.graph.node[0].output[0] = "first"
    made.graph.node.append(helper.make_node("Mul", ["first", "factor"], ["depth"]))
    made.graph.initializer.append(factor)
    return made


def card(folder: Path, graph: ModelProto | bytes, layout: str, **keys: Any) -> Path:
    """Write a graph and its card; return the card's path."""
    data = graph if isinstance(graph, bytes) else graph.SerializeToString()
    (folder / "tiny.onnx").write_bytes(data)
    plain: dict[str, Any] = {
        "format": "asbuilt-bim/network", "version": 1, "name": "tiny", "file": "tiny.onnx", "layout": layout,
        "input": dict(INPUT),
    }  # fmt: skip
    if layout in ("mask-rcnn", "yolo-seg", "query", "semantic", "centres"):
        plain["classes"] = [
            {"id": 1, "name": "cast wall", "label": "wall"},
            {"id": 2, "name": "pillar", "label": "column"},
            {"id": 0, "name": "formwork", "label": "other"},
        ]
    plain |= keys
    path = folder / "card.yaml"
    path.write_text(yaml.safe_dump(plain), encoding="utf-8")
    return path


def endless(times: int = 2**62) -> ModelProto:
    """A network that turns its picture over so many times."""
    shape = [1, 3, 48, 64]
    picture = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name in ("before", "after")]
    going = [helper.make_tensor_value_info(name, TensorProto.BOOL, []) for name in ("go", "goes_on")]
    steps = [
        helper.make_node("Identity", ["go"], ["goes_on"]),
        helper.make_node("Mul", ["before", "before"], ["after"]),
    ]
    number = helper.make_tensor_value_info("number", TensorProto.INT64, [])
    body = helper.make_graph(steps, "turn", [number, going[0], picture[0]], [going[1], picture[1]])
    initial = [
        numpy_helper.from_array(np.array(times, np.int64), "times"),
        numpy_helper.from_array(np.array(True), "yes"),
    ]
    node = helper.make_node("Loop", ["times", "yes", "image"], ["logits"], body=body)
    return model([node], [helper.make_tensor_value_info("logits", TensorProto.FLOAT, shape)], initial, ["image"])
