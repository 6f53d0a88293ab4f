"""What is asked of the network while it learns: the right class, the way to each centre, the order of depths."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from asbuilt_training.model import COLUMN, WALL

IGNORED = 255
DICE_WEIGHT = 0.7
OFFSET_WEIGHT = 0.3
DEPTH_WEIGHT = 1.0
SCALES = 4
"""Depth's slopes are compared at this many sizes, each half the one before."""


def class_loss(logits: Tensor, kind: Tensor, weight: Tensor, class_weights: Tensor) -> Tensor:
    """Return cross entropy plus dice of wall and column.

    `logits` (N, C, h, w) stand at half the size of `kind` and `weight` (N, 2h, 2w): each answers for the four pixels
    that it covers, so that a border between them is learned where it runs, not where a grid puts it.
    """
    log_share = functional.log_softmax(logits.float(), dim=1)
    total = log_share.new_zeros(())
    counted = log_share.new_zeros(())
    soft = torch.zeros_like(log_share[:, :2])  # how much of each pixel is wall, and column
    known = torch.zeros_like(log_share[:, 0])
    for row in (0, 1):
        for column in (0, 1):
            part = kind[:, row::2, column::2]
            asked = part != IGNORED
            target = torch.where(asked, part, 0)
            factor = weight[:, row::2, column::2] * asked * class_weights[target]
            total = total + (-log_share.gather(1, target[:, None])[:, 0] * factor).sum()
            counted = counted + factor.sum()
            known += asked * 0.25
            soft += torch.stack([part == WALL, part == COLUMN], dim=1) * 0.25
    share = log_share[:, [WALL, COLUMN]].exp() * known[:, None]
    both = (share * soft).sum((0, 2, 3))
    dice = 1.0 - (2.0 * both + 200.0) / (share.sum((0, 2, 3)) + soft.sum((0, 2, 3)) + 200.0)
    return total / counted.clamp(min=1.0) + DICE_WEIGHT * dice.mean()


def offset_loss(offsets: Tensor, target: Tensor) -> Tensor:
    """Return the mean L1 distance of offsets (N, 2, h, w) where `target` isn't NaN: on walls and columns."""
    asked = torch.isfinite(target)
    missed = (offsets.float() - torch.where(asked, target, 0.0)).abs() * asked
    return missed.sum() / asked.sum().clamp(min=1)


def depth_loss(depth: Tensor, inverse_depth: Tensor) -> Tensor:
    """Return how far relative depth (N, h, w) is from true inverse depth, whatever its scale and shift.

    Both are brought to median 0 and mean deviation 1; what is left is judged against the true value, so that a metre
    counts near and ten count far away, and so are its slopes at several sizes. Pictures with hardly any depth (sky)
    teach nothing.

    Reference: Ranftl et al. 2022, Towards Robust Monocular Depth Estimation, equations 5, 7 and 11.
    """
    enough = (inverse_depth > 0).float().mean((1, 2)) > 0.3
    if not enough.any():
        return depth.sum() * 0.0
    given, true = depth[enough].float().flatten(1), inverse_depth[enough].flatten(1)
    middle, spread = _normal(true)
    own_middle, own_spread = _normal(given)
    left = (given - own_middle) / own_spread - (true - middle) / spread
    # Relative to the true value and a floor: what is beyond a few times the usual distance is as good as sky.
    floor = 0.3 * middle + 0.05 * spread
    left = left * (spread / (true + floor)).clamp(max=3.0)
    shape = (len(given), *depth.shape[1:])
    return left.abs().mean() + 0.5 * _slopes(left.view(shape))


def _normal(values: Tensor) -> tuple[Tensor, Tensor]:
    """Return the median and the mean deviation from it, (N, 1) each, of (N, n)."""
    middle = values.median(dim=1, keepdim=True).values
    return middle, (values - middle).abs().mean(dim=1, keepdim=True).clamp(min=1e-4)


def _slopes(left: Tensor) -> Tensor:
    """Return the mean slope of what is left, over several sizes."""
    total = left.new_zeros(())
    for scale in range(SCALES):
        step = 2**scale
        part = left[:, ::step, ::step]
        total = total + (part[:, :, 1:] - part[:, :, :-1]).abs().mean() + (part[:, 1:] - part[:, :-1]).abs().mean()
    return total / SCALES
