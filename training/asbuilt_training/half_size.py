"""An exported network's weights stored as numbers of 16 bits: half the file, and the same calculation.

The weights are brought to 32 bits by the graph itself, which ONNX Runtime does once, when it opens the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

FEWEST = 64
"""Numbers of a weight that is worth a node of its own."""


def store_in_half(path: Path) -> None:
    """Rewrite an ONNX file so that its weights of 32 bits are stored in 16; weights keep their names.

    Raises:
        ValueError: a weight isn't a number of 16 bits (`folded.rounded`), so that something would be lost.
    """
    model = onnx.load(path, load_external_data=False)
    graph, raised = model.graph, {}
    for one in graph.initializer:
        weight = numpy_helper.to_array(one)
        if one.data_type != TensorProto.FLOAT or weight.size < FEWEST:
            continue
        half = weight.astype(np.float16)
        if not np.array_equal(half.astype(np.float32), weight):
            raise ValueError(f"{path}: {one.name} holds numbers that 16 bits can't; round the network before")
        one.CopyFrom(numpy_helper.from_array(half, one.name))
        raised[one.name] = f"{one.name}.whole"
    for node in graph.node:
        for place, name in enumerate(node.input):
            node.input[place] = raised.get(name, name)
    casts = [helper.make_node("Cast", [name], [whole], to=TensorProto.FLOAT) for name, whole in raised.items()]
    rest = list(graph.node)
    del graph.node[:]
    graph.node.extend([*casts, *rest])
    onnx.checker.check_model(model)
    onnx.save(model, path)
