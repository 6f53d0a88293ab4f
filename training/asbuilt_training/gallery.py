"""Pictures of what a network says, to be looked at: photo, truth, answer with and without geometry, depth."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import torch
from torch.nn import functional

from asbuilt_training.classes import IGNORED
from asbuilt_training.loader import collate
from asbuilt_training.model import ConcreteNet, network_inputs
from asbuilt_training.samples import Sample

# RGB: background stays as photographed.
PAINT = np.array(
    [(0, 0, 0), (220, 60, 40), (40, 110, 230), (60, 180, 90), (230, 170, 40), (150, 90, 190)], dtype=np.float32
)


def write_gallery(path: Path, net: ConcreteNet, with_geometry: list[Sample], without: list[Sample]) -> None:
    """Write a PNG, one row a picture."""
    rows = [_row(net, seen, blind) for seen, blind in zip(with_geometry, without, strict=True)]
    cv2.imwrite(str(path), cv2.cvtColor(np.vstack(rows), cv2.COLOR_RGB2BGR))


@torch.no_grad()
def _row(net: ConcreteNet, seen: Sample, blind: Sample) -> np.ndarray:
    net.eval()
    pictures = [blind.image, painted(blind.image, blind.kind)]
    depth = np.zeros(blind.kind.shape, dtype=np.float32)
    for sample in (seen, blind):
        batch = collate([sample])
        logits, _, relative, *_ = net(*network_inputs(batch["image"], batch["geometry"]))
        raised = functional.interpolate(logits.float(), size=sample.kind.shape, mode="bilinear", align_corners=False)
        pictures.append(painted(sample.image, raised[0].argmax(0).numpy().astype(np.uint8)))
        depth = (relative[0] - relative[0].mean()).float().exp().numpy()
    pictures += [_shaded(seen.geometry[0].astype(np.float32)), _shaded(depth), _shaded(blind.inverse_depth)]
    size = (blind.kind.shape[1] * 2 // 3, blind.kind.shape[0] * 2 // 3)
    return np.hstack([cv2.resize(p, size, interpolation=cv2.INTER_AREA) for p in pictures])


def painted(rgb: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Return a picture with each class in its colour."""
    colour = PAINT[np.where(kind == IGNORED, 0, kind)]
    share = np.where((kind == 0) | (kind == IGNORED), 0.0, 0.55)[..., None]
    return np.asarray(rgb * (1.0 - share) + colour * share, dtype=np.uint8)


def _shaded(values: np.ndarray) -> np.ndarray:
    low, high = np.percentile(values, (1.0, 99.0))
    grey = np.clip((values - low) / max(high - low, 1e-6) * 255.0, 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.cvtColor(cv2.applyColorMap(grey, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB))
