"""What is asked of the network while it learns: classes, the way to each centre, what is one thing, depths' order."""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional

from asbuilt_training.classes import BOND_STEPS, COLUMN, IGNORED, WALL

DICE_WEIGHT = 0.7
OFFSET_WEIGHT = 0.3
BOND_WEIGHT = 0.5
THING_WEIGHT = 0.2
LEAST_LIKELY = 1e-3
"""A likelihood counts as no less when a thing's class is decided: as in the program's vision/networks/things.py."""
LEAST_THING = 20
"""Half-size pixels of a thing whose class is asked for as a whole."""
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


def bond_loss(bonds: Tensor, thing: Tensor) -> Tensor:
    """Return the cross entropy of bonds (N, 2 S, h, w) between pixels of walls and columns.

    `thing` (N, h, w) is each pixel's, 0 none: asked is only between two that are of some. The two answers weigh the
    same, by half: pixels of one thing are many more.
    """
    total = bonds.new_zeros((), dtype=torch.float32)
    for k, step in enumerate(BOND_STEPS):
        for dim in (2, 1):
            size = thing.shape[dim] - step
            if size <= 0:
                continue
            one, other = thing.narrow(dim, 0, size), thing.narrow(dim, step, size)
            said = bonds[:, 2 * k + (dim == 1)].narrow(dim, 0, size).float()
            asked, same = (one > 0) & (other > 0), one == other
            bound, apart = (asked & same).sum().clamp(min=1), (asked & ~same).sum().clamp(min=1)
            weight = torch.where(same, 1.0, (bound / apart).clamp(0.1, 100.0).sqrt()) * asked
            missed = functional.binary_cross_entropy_with_logits(said, same.float(), reduction="none")
            total = total + (missed * weight).sum() / weight.sum().clamp(min=1.0)
    return total / (2 * len(BOND_STEPS))


def thing_loss(logits: Tensor, kind: Tensor, thing: Tensor) -> Tensor:
    """Return the cross entropy of whole things' classes, wall against column, each thing counting once.

    A thing's class is what the mean of its pixels' log-odds says; `logits` (N, C, h, w), `kind` (N, 2h, 2w) and `thing`
    (N, h, w), 0 none.
    """
    share = functional.log_softmax(logits.float(), dim=1)[:, [WALL, COLUMN]].clamp(min=math.log(LEAST_LIKELY))
    there = thing > 0
    picture = torch.arange(len(thing))[:, None, None].expand_as(thing)[there]
    _, number = torch.unique(picture * (int(thing.max()) + 1) + thing[there], return_inverse=True)
    if not len(number):
        return logits.sum() * 0.0
    count = torch.bincount(number).float()
    odds = torch.zeros_like(count).index_add(0, number, (share[:, 1] - share[:, 0])[there]) / count
    column = torch.bincount(number, (kind[:, ::2, ::2][there] == COLUMN).float()) / count
    asked = (count >= LEAST_THING).float()
    missed = functional.binary_cross_entropy_with_logits(odds, (column > 0.5).float(), reduction="none")
    return (missed * asked).sum() / asked.sum().clamp(min=1.0)


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
