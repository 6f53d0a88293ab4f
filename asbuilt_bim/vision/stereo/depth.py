"""Depth per pixel of the rectified left photo, with its sigma, and which method gave it."""

from dataclasses import dataclass
from typing import Literal, Protocol

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array

DepthMethod = Literal["stereo", "paper", "fused"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DepthMap:
    """Disparity and its sigma in pixels, float32 (H, W), `valid` bool (H, W); `depth_m` follows by eq. 3.

    Disparity is the plain form: noise is even there, and a plane is linear in it.
    """

    disparity_px: Float32Array
    sigma_px: Float32Array
    valid: BoolArray
    f_px: float
    baseline_m: float
    method: DepthMethod

    @property
    def depth_m(self) -> Float32Array:
        """Return Z in metres along the rectified camera's axis, NaN where not valid."""
        import numpy as np

        with np.errstate(divide="ignore", invalid="ignore"):
            depth = self.f_px * self.baseline_m / self.disparity_px
        return np.where(self.valid & (self.disparity_px > 0), depth, np.nan).astype(np.float32)


class RelativeDepth(Protocol):
    """Estimates relative depth from one photo; version 1 of the interface."""

    @property
    def name(self) -> str:
        """Return the network's name, for reports."""
        ...

    def estimate(self, image: ByteImage) -> Float32Array:
        """Return float32 (H, W): larger is nearer, defined up to scale and shift."""
        ...
