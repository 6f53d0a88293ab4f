"""Training pictures read back from their shards, and handed out as examples by a process of their own."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray

KEYS = ("rgb", "kind", "instance", "inverse_depth", "fx_px", "baseline_m", "up", "source")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """A picture with its truth: `rgb` uint8 (h, w, 3), `kind` uint8 and `instance` uint16 (h, w), 1/Z (sky: 0).

    `left_px` (w,) says how far each column is from the left edge of the whole photo; `up` (3,) is in the camera frame.
    """

    rgb: ByteImage
    kind: np.ndarray
    instance: np.ndarray
    inverse_depth_per_m: Float32Array
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    left_px: Float32Array
    baseline_m: float
    up: FloatArray

    def mirrored(self) -> Picture:
        """Return a whole picture as a mirror shows it: another place, seen by a left camera again."""
        width = self.kind.shape[1]
        return dataclasses.replace(
            self,
            rgb=self.rgb[:, ::-1],
            kind=self.kind[:, ::-1],
            instance=self.instance[:, ::-1],
            inverse_depth_per_m=self.inverse_depth_per_m[:, ::-1],
            cx_px=width - 1 - self.cx_px,
            up=self.up * (-1.0, 1.0, 1.0),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shard:
    """The arrays of one file, as they were written."""

    name: str
    arrays: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.arrays["rgb"])

    def picture(self, index: int) -> Picture:
        """Return one picture."""
        a = self.arrays
        height, width = a["kind"].shape[1:]
        fx = float(a["fx_px"][index])
        return Picture(
            rgb=a["rgb"][index],
            kind=a["kind"][index],
            instance=a["instance"][index],
            inverse_depth_per_m=a["inverse_depth"][index].astype(np.float32),
            fx_px=fx,
            fy_px=fx,
            cx_px=(width - 1) / 2,
            cy_px=(height - 1) / 2,
            left_px=np.arange(width, dtype=np.float32) + 0.5,
            baseline_m=float(a["baseline_m"][index]),
            up=a["up"][index].astype(np.float64),
        )


def read_shard(path: Path) -> Shard:
    """Read one shard into memory.

    Raises:
        ValueError: arrays are missing or don't belong together.
    """
    with np.load(path, allow_pickle=False) as file:
        if missing := [key for key in KEYS if key not in file]:
            raise ValueError(f"{path}: has no {', '.join(missing)}; is it a shard of training pictures?")
        arrays = {key: file[key] for key in KEYS}
    shapes = {key: arrays[key].shape[:3] for key in ("rgb", "kind", "instance", "inverse_depth")}
    if len(set(shapes.values())) != 1:
        raise ValueError(f"{path}: pictures and their truth differ in size: {shapes}")
    return Shard(name=path.name, arrays=arrays)


def sources_of(folder: Path) -> dict[str, int]:
    """Return how many pictures of a folder each generator drew, without reading the pictures."""
    names: list[str] = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path, allow_pickle=False) as file:
            names += [str(name) for name in file["source"]]
    return {name: names.count(name) for name in sorted(set(names))}


class Pool:
    """All pictures of a folder, in memory; shards that are written later are found by `refresh`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._shards: dict[str, Shard] = {}

    def refresh(self) -> int:
        """Read the shards that have come since; return how many pictures there are."""
        for path in sorted(self.folder.glob("*.npz")):
            if path.name not in self._shards:
                self._shards[path.name] = read_shard(path)
        return sum(len(shard) for shard in self._shards.values())

    def pictures(self, rng: np.random.Generator | None = None) -> Iterator[Picture]:
        """Yield each picture once: in order of the files, or shuffled."""
        places = [(name, index) for name in sorted(self._shards) for index in range(len(self._shards[name]))]
        if rng is not None:
            rng.shuffle(places)
        for name, index in places:
            yield self._shards[name].picture(index)
