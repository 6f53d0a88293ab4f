"""What stereo says of the pixels of a network's small map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import Float32Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Relief:
    """Inverse depth 1/Z (h, w) in 1/m, 0 where not measured, and the focal length in pixels of the same map.

    `surface` (h, w), where the photo's surfaces are known: the number of the upright one, -1 none.
    """

    inverse_depth_per_m: Float32Array
    f_px: float
    surface: NDArray[np.int16] | None = None

    def shrunk(self, shape: tuple[int, ...]) -> Relief:
        """Return it at a coarser grid, by its nearest values: means would lie between two surfaces."""
        whole = self.inverse_depth_per_m
        spots = np.ix_(*((np.arange(n) * size) // n for n, size in zip(shape, whole.shape, strict=True)))
        return Relief(
            inverse_depth_per_m=np.ascontiguousarray(whole[spots]),
            f_px=self.f_px * shape[1] / whole.shape[1],
            surface=np.ascontiguousarray(self.surface[spots]) if self.surface is not None else None,
        )
