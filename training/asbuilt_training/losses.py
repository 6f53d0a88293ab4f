"""What is asked of the network while it learns: the right class, the way to each centre, the order of depths."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from asbuilt_training.classes import COLUMN, IGNORED, WALL

DICE_WEIGHT = 0.7
OFFSET_WEIGHT = 0.3
DEPTH_WEIGHT = 0.5
SCALES = 4
"""Depth's slopes are compared at this many sizes, each half the one before."""
FAR_PER_M = 1.0 / 150.0
"""What is farther is as good as sky."""


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


def depth_loss(log_nearness: Tensor, inverse_depth: Tensor) -> Tensor:
    """Return how far relative depth is from the true one, whatever its scale, as a share of it.

    `log_nearness` (N, h, w) is the logarithm of relative inverse depth: an error there is a share of the distance, near
    as far, which linear inverse depth has no precision for. Errors and their slopes at several sizes count; what is
    beyond `FAR_PER_M`, and the sky, only has to be farther than that.

    Reference: Eigen et al. 2014, Depth Map Prediction, equation 1 (scale-invariant error of logarithms); Ranftl et al.
    2022, equation 11 (slopes).
    """
    known = inverse_depth > FAR_PER_M
    enough = known.float().mean((1, 2)) > 0.1
    if not enough.any():
        return log_nearness.sum() * 0.0
    given, known, true = log_nearness[enough].float(), known[enough], inverse_depth[enough]
    apart = given - true.clamp(min=FAR_PER_M).log()
    middle = torch.where(known, apart.detach(), float("nan")).flatten(1).nanmedian(dim=1).values
    left = apart - middle[:, None, None]
    too_near = (torch.relu(left) * ~known).sum() / (~known).sum().clamp(min=1)
    # The scale is free, so something has to hold it: what only has to be farther would push it down for ever.
    held = 0.01 * given.mean((1, 2)).square().mean()
    return (left.abs() * known).sum() / known.sum() + 0.3 * too_near + 0.3 * _slopes(left, known) + held


def _slopes(left: Tensor, known: Tensor) -> Tensor:
    """Return the mean slope of what is left between neighbours that are known, over several sizes."""
    total = left.new_zeros(())
    for scale in range(SCALES):
        step = 2**scale
        part, sure = left[:, ::step, ::step], known[:, ::step, ::step]
        across, down = sure[:, :, 1:] & sure[:, :, :-1], sure[:, 1:] & sure[:, :-1]
        slopes = ((part[:, :, 1:] - part[:, :, :-1]).abs() * across).sum()
        slopes = slopes + ((part[:, 1:] - part[:, :-1]).abs() * down).sum()
        total = total + slopes / (across.sum() + down.sum()).clamp(min=1)
    return total / SCALES
