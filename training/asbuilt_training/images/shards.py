"""Draws the pictures of one seed and writes them as one shard, whole or not at all."""

from __future__ import annotations

import logging
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_training.classes import CONCRETE, IGNORED, OTHER
from asbuilt_training.images.cameras import views
from asbuilt_training.images.develop import develop
from asbuilt_training.images.draw import Layers, View, draw
from asbuilt_training.images.looks import pool
from asbuilt_training.images.places import places
from asbuilt_training.images.stage import Stage

SEEDS_A_POOL = 8  # patterns are baked anew after so many seeds
_LEAST_PX = 24  # smaller instances can't be learned from
_BASELINES_M = (0.08, 0.5)
Renderer = Callable[[Stage, View, np.random.Generator], Layers]
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """One training picture with its truth; the fields of a shard, one row of each."""

    rgb: np.ndarray
    kind: np.ndarray
    instance: np.ndarray
    inverse_depth: np.ndarray
    fx_px: np.float32
    baseline_m: np.float32
    up: np.ndarray
    source: str


def shard_path(folder: Path, seed: int) -> Path:
    """Say where the shard of a seed lies."""
    return folder / f"{seed:06d}.npz"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What is drawn of every seed; without a folder of real IFC files yards stand in."""

    ifc_folder: Path | None = None
    pictures_a_place: int = 10
    renderer: Renderer = draw


def pictures(seed: int, job: Job) -> Iterator[Picture]:
    """Draw the pictures of a seed: some of each of its places."""
    tiles = pool(seed // SEEDS_A_POOL)
    for number, place in enumerate(places(seed, job.ifc_folder)):
        rng = np.random.default_rng([seed, 47, number])
        stage = Stage(place, tiles, rng)
        source = place.source if job.renderer is draw else f"{place.source} traced"
        for view in views(stage, job.pictures_a_place, rng):
            yield _picture(job.renderer(stage, view, rng), view, source, rng)


def write_shard(path: Path, made: list[Picture]) -> None:
    """Write pictures in one file, put in place when it is whole."""
    rows = {
        "rgb": np.stack([p.rgb for p in made]), "kind": np.stack([p.kind for p in made]),
        "instance": np.stack([p.instance for p in made]), "inverse_depth": np.stack([p.inverse_depth for p in made]),
        "fx_px": np.array([p.fx_px for p in made], np.float32),
        "baseline_m": np.array([p.baseline_m for p in made], np.float32),
        "up": np.stack([p.up for p in made]), "source": np.array([p.source for p in made]),
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        for name, row in rows.items():
            with file.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as out:
                np.lib.format.write_array(out, row, allow_pickle=False)
    part.replace(path)


def draw_shards(folder: Path, seeds: range, job: Job, resume: bool) -> int:
    """Draw the shards of seeds in a folder, and return how many were drawn; `resume` leaves those that are there."""
    drawn = 0
    for seed in seeds:
        path = shard_path(folder, seed)
        if resume and path.exists():
            continue
        made = list(pictures(seed, job))
        write_shard(path, made)
        drawn += 1
        _log.info("%s: %d pictures", path, len(made))
    return drawn


def _picture(layers: Layers, view: View, source: str, rng: np.random.Generator) -> Picture:
    kind, instance = _learnable(layers.kind, layers.instance)
    return Picture(
        rgb=develop(layers.radiance, rng),
        kind=kind,
        instance=instance,
        inverse_depth=layers.inverse_depth_per_m.astype(np.float16),
        fx_px=np.float32(view.fx_px),
        baseline_m=np.float32(np.exp(rng.uniform(*np.log(_BASELINES_M)))),
        up=view.world_from_camera[2, :3].astype(np.float32),
        source=source,
    )


def _learnable(kind: np.ndarray, instance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mark as ignored what nobody could outline: wires of a pixel's width, and specks of a wall or column."""
    kind, instance = kind.copy(), instance.copy()
    loose = (kind == OTHER).astype(np.float32)
    thin = (loose > 0) & (cv2.boxFilter(loose, -1, (3, 3), normalize=False) <= 3)
    small = np.flatnonzero(np.bincount(instance.ravel()) < _LEAST_PX)
    specks = np.isin(instance, small) & np.isin(kind, CONCRETE)
    kind[thin | specks] = IGNORED
    instance[specks] = 0
    return kind, instance
