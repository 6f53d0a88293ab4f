"""Figures of a network on pictures whose truth is known: overlap of classes, and how far depths are off."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from asbuilt_training.classes import CLASSES, COLUMN, IGNORED, WALL
from asbuilt_training.loader import collate
from asbuilt_training.model import network_inputs
from asbuilt_training.samples import Sample

FAR_M = 100.0
"""Depth is judged up to here; beyond, and in the sky, only the order near-far is asked for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """Semantic IoU by class, of wall and column as one, and relative depth after scale and shift."""

    pictures: int
    iou: dict[str, float]
    concrete_iou: float
    abs_rel: float
    delta: float  # share of pixels whose depth is within a factor of 1.25

    @property
    def score(self) -> float:
        """Return one number to steer by: larger is better."""
        return (self.iou["wall"] + self.iou["column"] + self.concrete_iou) / 3.0 - 0.5 * min(self.abs_rel, 1.0)


class Answering(Protocol):
    """A network, trained or exported."""

    def eval(self) -> object:
        """Make it answer as it will when it is used."""

    def __call__(self, image: Tensor, geometry: Tensor) -> tuple[Tensor, ...]:
        """Return logits, offsets and the logarithm of relative inverse depth; what follows isn't judged."""


@torch.no_grad()
def figures(net: Answering, samples: Iterable[Sample]) -> Figures:
    """Judge a network on examples, in evaluation mode."""
    net.eval()
    confusion = np.zeros((len(CLASSES), len(CLASSES)), dtype=np.int64)
    errors: list[float] = []
    within: list[float] = []
    count = 0
    for sample in samples:
        count += 1
        batch = collate([sample])
        logits, _, depth, *_ = net(*network_inputs(batch["image"], batch["geometry"]))
        raised = functional.interpolate(logits.float(), size=sample.kind.shape, mode="bilinear", align_corners=False)
        answer = raised[0].argmax(0).numpy()
        asked = sample.kind != IGNORED
        both = sample.kind[asked].astype(np.int64) * len(CLASSES) + answer[asked]
        confusion += np.bincount(both, minlength=len(CLASSES) ** 2).reshape(confusion.shape)
        judged = depth_errors((depth[0] - depth[0].mean()).float().exp().numpy(), sample.inverse_depth)
        if judged is not None:
            errors.append(judged[0])
            within.append(judged[1])
    return Figures(
        pictures=count,
        iou={name: _iou(confusion, [k]) for k, name in enumerate(CLASSES)},
        concrete_iou=_iou(confusion, [WALL, COLUMN]),
        abs_rel=float(np.mean(errors)) if errors else float("nan"),
        delta=float(np.mean(within)) if within else float("nan"),
    )


def depth_errors(depth: np.ndarray, inverse_depth_per_m: np.ndarray) -> tuple[float, float] | None:
    """Return the mean relative error of depth and the share within 1.25, after least squares of scale and shift in 1/Z.

    Only pixels up to `FAR_M` count; None where there are too few.
    """
    asked = inverse_depth_per_m > 1.0 / FAR_M
    if np.count_nonzero(asked) < 500:
        return None
    given, true = depth[asked].astype(np.float64), inverse_depth_per_m[asked].astype(np.float64)
    scale, shift = np.polyfit(given, true, 1)
    inverse = np.maximum(scale * given + shift, 1.0 / (2.0 * FAR_M))
    ratio = true / inverse  # estimated depth over true depth
    return float(np.mean(np.abs(ratio - 1.0))), float(np.mean(np.maximum(ratio, 1.0 / ratio) < 1.25))


def _iou(confusion: np.ndarray, classes: list[int]) -> float:
    """Return the overlap of some classes taken as one; NaN where there are none."""
    true, given = confusion[classes].sum(), confusion[:, classes].sum()
    both = confusion[np.ix_(classes, classes)].sum()
    return float(both / (true + given - both)) if true + given > 0 else float("nan")
