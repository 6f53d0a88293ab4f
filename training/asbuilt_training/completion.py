"""Relative depth pinned to stereo: where stereo is trusted it counts, between and beyond it the network carries it on.

What the network's map lacks to stereo is spread from where it is known to where it isn't, over coarser and coarser
grids, and added: so the network gives the form, stereo the level. Without stereo nothing is added.

Reference: Gortler et al. 1996, The Lumigraph, section 3.4 (pull-push: scattered values spread over a pyramid).
"""

from __future__ import annotations

import torch
from asbuilt_bim.vision.networks.geometry_input import NEAR_M
from torch import Tensor
from torch.nn import functional

LEAST = 0.05
"""Weight of the coarser grid beside what is known on the finer one, of a trust from 0 to 1."""
COARSEST_PX = 3
LEAST_NEARNESS = 1e-3
"""Of `NEAR_M` / Z: 2 km off."""


def log_nearness_of(inverse_depth_per_m: Tensor) -> Tensor:
    """Return the logarithm of `NEAR_M` / Z: the unit of a pinned map."""
    return (inverse_depth_per_m * NEAR_M).clamp(min=LEAST_NEARNESS).log()


def log_nearness(relative: Tensor, trust: Tensor, geometry: Tensor) -> Tensor:
    """Return the logarithm of inverse depth (N, h, w) of both heads' answers (N, 1, h, w) and geometry (N, 5, 2h, 2w).

    `relative` is that logarithm with its level free, `trust` the logit of how much a measured pixel counts.
    """
    near, known = functional.avg_pool2d(geometry[:, 0::4].float(), 2).split(1, dim=1)
    weight = trust.float().sigmoid() * known
    lacking = (near / known.clamp(min=0.1)).clamp(min=LEAST_NEARNESS).log() - relative.float()
    return (relative.float() + _spread(torch.cat([lacking * weight, weight], dim=1)))[:, 0]


def _spread(weighted: Tensor) -> Tensor:
    """Return values (N, 1, h, w) everywhere of weighted values and their weights (N, 2, h, w); 0 without any."""
    height, width = int(weighted.shape[2]), int(weighted.shape[3])
    if min(height, width) <= COARSEST_PX:
        total = weighted.sum((2, 3), keepdim=True)
        coarse = total[:, :1] / (total[:, 1:] + 1e-6)
    else:
        coarse = _spread(functional.avg_pool2d(weighted, 3, 2, 1))
    raised = functional.interpolate(coarse, size=(height, width), mode="bilinear", align_corners=False)
    return (weighted[:, :1] + LEAST * raised) / (weighted[:, 1:] + LEAST)
