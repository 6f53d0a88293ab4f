"""The command `quantise`: tries both networks with 8-bit integers, and says what that costs and saves.

Nothing is replaced by it: whether smaller is worth it is decided by its figures.
"""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from asbuilt_bim.vision.networks.runtime import onnxruntime  # its telemetry off; before all else of it
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from onnxruntime.quantization.shape_inference import quant_pre_process
from torch.nn import functional

from asbuilt_training.export import HEIGHT_PX, WIDTH_PX
from asbuilt_training.figures import figures
from asbuilt_training.fit import validation
from asbuilt_training.loader import collate
from asbuilt_training.model import network_inputs
from asbuilt_training.samples import Sample

LOG = logging.getLogger(__name__)
CALIBRATED_ON = 40
"""Pictures whose activations set the steps; half of them with stereo."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--networks", type=Path, required=True, help="folder with concrete.onnx and depth.onnx")
    parser.add_argument("--valid", type=Path, required=True, help="folder of shards; the first pictures set the steps")
    parser.add_argument("--out", type=Path, required=True, help="folder for the networks in 8 bits")
    parser.add_argument("--most", type=int, default=120, help="pictures to judge on")


def run(given: argparse.Namespace) -> int:
    """Quantise, and show figures and time of both kinds."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    given.out.mkdir(parents=True, exist_ok=True)
    with_geometry, without = validation(given.valid, CALIBRATED_ON + given.most)
    half = CALIBRATED_ON // 2
    steps_from = with_geometry[:half] + without[half:CALIBRATED_ON]
    for name in ("concrete", "depth"):
        prepared = given.out / f"{name}.prepared.onnx"
        quant_pre_process(str(given.networks / f"{name}.onnx"), str(prepared))
        quantize_static(
            str(prepared), str(given.out / f"{name}.onnx"), _Steps(steps_from, depth=name == "depth"),
            quant_format=QuantFormat.QDQ, per_channel=True, activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
        )  # fmt: skip
        prepared.unlink()
    for folder in (given.networks, given.out):
        net = Exported(folder)
        seen, blind = figures(net, with_geometry[CALIBRATED_ON:]), figures(net, without[CALIBRATED_ON:])
        LOG.info(
            "%s: concrete IoU %.4f with geometry, %.4f without; wall %.4f, column %.4f; AbsRel %.4f; %.1f ms both",
            folder, seen.concrete_iou, blind.concrete_iou, seen.iou["wall"], seen.iou["column"], blind.abs_rel,
            net.milliseconds / max(net.runs, 1),
        )  # fmt: skip
    return 0


class Exported:
    """Two exported networks, run as the trained one is; processor time is kept."""

    def __init__(self, folder: Path) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self._segment, self._depth = (
            onnxruntime.InferenceSession(str(folder / f"{name}.onnx"), options, providers=["CPUExecutionProvider"])
            for name in ("concrete", "depth")
        )
        self.milliseconds, self.runs = 0.0, 0

    def eval(self) -> None:
        """Do nothing: an exported network can't learn."""

    def __call__(self, image: torch.Tensor, geometry: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return logits, offsets and the logarithm of relative inverse depth."""
        picture = {"image": np.ascontiguousarray(image.numpy())}
        given = segmenter_inputs(image, geometry)
        begun = time.process_time()
        logits, offsets = self._segment.run(None, given)
        (depth,) = self._depth.run(None, picture)
        self.milliseconds += 1000.0 * (time.process_time() - begun)
        self.runs += 1
        return torch.from_numpy(logits), torch.from_numpy(offsets), torch.from_numpy(np.log(np.maximum(depth, 1e-6)))


def segmenter_inputs(image: torch.Tensor, geometry: torch.Tensor) -> dict[str, Any]:
    """Return an example's tensors at the size that the exported segmenter takes."""
    size = (HEIGHT_PX, WIDTH_PX)
    picture = functional.interpolate(image, size, mode="bilinear", align_corners=False)
    nearest = functional.interpolate(geometry, size)
    return {"image": np.ascontiguousarray(picture.numpy()), "geometry": np.ascontiguousarray(nearest.numpy())}


class _Steps(CalibrationDataReader):  # type: ignore[misc]
    """The inputs by which the quantiser sets its steps."""

    def __init__(self, samples: list[Sample], *, depth: bool) -> None:
        self._rows = self._inputs(samples, depth)

    def get_next(self) -> dict[str, Any] | None:
        """Return the next input, None at the end."""
        return next(self._rows, None)

    @staticmethod
    def _inputs(samples: list[Sample], depth: bool) -> Iterator[dict[str, Any]]:
        for sample in samples:
            batch = collate([sample])
            image, geometry = network_inputs(batch["image"], batch["geometry"])
            yield {"image": np.ascontiguousarray(image.numpy())} if depth else segmenter_inputs(image, geometry)
