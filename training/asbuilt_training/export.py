"""The command `export`: writes both ONNX files and their cards, and checks them against the network."""

from __future__ import annotations

import argparse
import csv
import json
import logging
import warnings
from pathlib import Path

import numpy as np
import torch
import yaml
from asbuilt_bim.vision.networks.runtime import onnxruntime  # its telemetry off
from torch import nn

from asbuilt_training.folded import RelativeDepth, Segmenter, folded, rounded
from asbuilt_training.half_size import store_in_half
from asbuilt_training.model import MEAN, STD, ConcreteNet
from asbuilt_training.model_card import model_card
from asbuilt_training.samples import OFFSET_UNIT_PX

LOG = logging.getLogger(__name__)
WIDTH_PX, HEIGHT_PX = 512, 384
"""The segmenter's input: a third wider than the pictures it learns from, of which crops are made larger. Thin and far
things gain by it; depth gains nothing."""
DEPTH_SIZE_PX = (384, 288)
OPSET = 17
TOLERANCE = 1e-3
"""Most that an exported network's answers may differ from the trained one's; of answers over 1, as a share."""
LICENCE = "Apache-2.0"
SOURCE = "trained by this project on generated pictures only; see MODEL_CARD.md"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--run", type=Path, required=True, help="folder of a run: its weights and records")
    parser.add_argument("--weights", default="best.pt", help="which of the run's weights")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for the networks, their cards and MODEL_CARD.md"
    )
    parser.add_argument("--no-depth", action="store_true", help="leave the depth network that is there as it is")


def run(given: argparse.Namespace) -> int:
    """Write the networks; 0 when they answer as the trained one does."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    net = ConcreteNet()
    net.load_state_dict(torch.load(given.run / given.weights, weights_only=True))
    given.out.mkdir(parents=True, exist_ok=True)
    whole = folded(net)
    write_segmenter(Segmenter(whole), given.out, "concrete", CLASSES)
    if not given.no_depth:
        write_depth(RelativeDepth(whole), given.out)
    evaluated, before, depth = (given.run / name for name in ("figures.json", "before.txt", "depth.txt"))
    text = model_card(
        plan=json.loads((given.run / "plan.json").read_text(encoding="utf-8")),
        figures=json.loads(evaluated.read_text(encoding="utf-8")) if evaluated.is_file() else None,
        curves=list(csv.DictReader((given.run / "curves.csv").open(encoding="utf-8"))),
        parameters=sum(p.numel() for p in net.parameters()),
        before=before.read_text(encoding="utf-8") if before.is_file() else "",
        depth=depth.read_text(encoding="utf-8") if given.no_depth and depth.is_file() else "",
    )
    (given.out / "MODEL_CARD.md").write_text(text, encoding="utf-8")
    LOG.info("wrote %s", given.out)
    return 0


CLASSES: tuple[tuple[int, str, str], ...] = (
    (1, "concrete wall", "wall"),
    (2, "concrete column", "column"),
    (3, "slab, beam or stair", "other"),
    (4, "formwork", "other"),
    (5, "other things in front", "other"),
)
"""What the shipped segmenter's classes mean; 0, the background, is left aside."""


def write_segmenter(net: Segmenter, out: Path, name: str, classes: tuple[tuple[int, str, str], ...]) -> None:
    """Write NAME.onnx and NAME.yaml.

    Raises:
        ValueError: the written network answers otherwise than the one that was given.
    """
    image, geometry = torch.randn(1, 3, HEIGHT_PX, WIDTH_PX), torch.randn(1, 5, HEIGHT_PX, WIDTH_PX)
    write_onnx(net, out / f"{name}.onnx", {"image": image, "geometry": geometry}, ["logits", "offsets"])
    card = _card(name, "centres", ["logits", "offsets"]) | {
        "geometry": {"input": "geometry"},
        "offset_px": OFFSET_UNIT_PX,
        "classes": [{"id": number, "name": what, "label": label} for number, what, label in classes],
        "least_score": 0.5,
    }
    _write_card(out / f"{name}.yaml", card)


def write_depth(net: RelativeDepth, out: Path) -> None:
    """Write depth.onnx and depth.yaml; see `write_segmenter`."""
    width, height = DEPTH_SIZE_PX
    write_onnx(net, out / "depth.onnx", {"image": torch.randn(1, 3, height, width)}, ["depth"])
    _write_card(out / "depth.yaml", _card("depth", "inverse-depth", ["depth"], DEPTH_SIZE_PX))


def write_onnx(net: nn.Module, path: Path, inputs: dict[str, torch.Tensor], outputs: list[str]) -> None:
    """Write a network with fixed shapes and weights of 16 bits, and check that ONNX Runtime answers as PyTorch does.

    Raises:
        ValueError: it doesn't, by more than `TOLERANCE`.
    """
    net = rounded(net).eval().to(memory_format=torch.contiguous_format)  # type: ignore[call-overload]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the newer exporter can't write this opset
        torch.onnx.export(
            net, tuple(inputs.values()), str(path), opset_version=OPSET, dynamo=False,
            input_names=list(inputs), output_names=outputs,
        )  # fmt: skip
    store_in_half(path)
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    answers = session.run(outputs, {name: value.numpy() for name, value in inputs.items()})
    with torch.no_grad():
        expected = net(*inputs.values())
    for name, one, other in zip(outputs, answers, expected if len(outputs) > 1 else [expected], strict=True):
        apart = float((np.abs(one - other.numpy()) / np.maximum(np.abs(other.numpy()), 1.0)).max())
        if not apart <= TOLERANCE:
            raise ValueError(f"{path}: {name} differs from the trained network's by {apart:.2g}, limit {TOLERANCE:g}")
        LOG.info("%s: %s within %.1e of the trained network", path.name, name, apart)


def _card(
    name: str, layout: str, outputs: list[str], size_px: tuple[int, int] = (WIDTH_PX, HEIGHT_PX)
) -> dict[str, object]:
    return {
        "format": "asbuilt-bim/network", "version": 1, "name": name, "file": f"{name}.onnx", "layout": layout,
        "input": {
            "width_px": size_px[0], "height_px": size_px[1], "resize": "letterbox", "pad_value": 115, "colour": "rgb",
            "order": "nchw", "divide": 255, "mean": [MEAN] * 3, "std": [STD] * 3,
        },
        "outputs": {role: role for role in outputs}, "licence": LICENCE, "source": SOURCE,
    }  # fmt: skip


def _write_card(path: Path, card: dict[str, object]) -> None:
    path.write_text(yaml.safe_dump(card, sort_keys=False, width=120), encoding="utf-8")
