"""Examples by the batch, made in a process beside the one that learns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import Full
from typing import Any

import cv2
import numpy as np
import torch
import torch.multiprocessing as multiprocessing
from torch import Tensor

from asbuilt_training.samples import Recipe, Sample, training_sample
from asbuilt_training.shards import Pool

Batch = dict[str, Tensor]
AHEAD = 6
"""Batches that wait: enough for a slow one."""


def collate(samples: Sequence[Sample]) -> Batch:
    """Return examples as tensors with the batch first; the image still uint8 (N, h, w, 3)."""
    return {
        "image": torch.from_numpy(np.stack([s.image for s in samples])),
        "geometry": torch.from_numpy(np.stack([s.geometry for s in samples])),
        "kind": torch.from_numpy(np.stack([s.kind for s in samples])),
        "weight": torch.from_numpy(np.stack([s.weight for s in samples])),
        "offsets": torch.from_numpy(np.stack([s.offsets for s in samples])),
        "thing": torch.from_numpy(np.stack([s.thing for s in samples])),
        "inverse_depth": torch.from_numpy(np.stack([s.inverse_depth for s in samples])),
        "has_geometry": torch.tensor([s.has_geometry for s in samples]),
    }


class Loader:
    """Batches without end, in order of a seed; `recipe_of` may be changed for later batches by `set_recipe`."""

    def __init__(self, folder: Path, recipe: Recipe, batch: int, seed: int) -> None:
        context = multiprocessing.get_context("spawn")  # a fork inherits the locks of threads, not the threads
        self._batches: Any = context.Queue(AHEAD)
        self._recipes: Any = context.Queue()
        self._recipes.put((recipe, batch))
        self._process = context.Process(target=_fill, args=(folder, seed, self._recipes, self._batches), daemon=True)
        self._process.start()

    def set_recipe(self, recipe: Recipe, batch: int) -> None:
        """Make what comes after the batches that wait by another recipe."""
        self._recipes.put((recipe, batch))

    def __iter__(self) -> Iterator[Batch]:
        while True:
            found = self._batches.get(timeout=600)
            if isinstance(found, str):
                raise RuntimeError(f"the process that makes examples failed: {found}")
            yield found

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        self._process.join(10)


def _fill(folder: Path, seed: int, recipes: Any, batches: Any) -> None:
    """Make batches for ever: all pictures once, in a new order, with the shards that have come since; again."""
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    rng, pool = np.random.default_rng(seed), Pool(folder)
    recipe, batch = recipes.get()
    samples: list[Sample] = []
    try:
        while True:
            if not pool.refresh():
                raise ValueError(f"{folder}: no shards of training pictures (*.npz)")
            for picture in pool.pictures(rng):
                if not recipes.empty():
                    recipe, batch = recipes.get()
                    samples.clear()
                samples.append(training_sample(rng, picture, recipe))
                if len(samples) >= batch:
                    _put(batches, collate(samples))
                    samples = []
    except (ValueError, OSError) as problem:
        batches.put(str(problem))


def _put(batches: Any, batch: Batch) -> None:
    """Wait for room, and end with the process that learns."""
    while True:
        try:
            batches.put(batch, timeout=5)
            return
        except Full:
            if not multiprocessing.parent_process().is_alive():  # type: ignore[union-attr]
                raise SystemExit(0) from None
