"""The command `mean`: the mean of two networks' weights, where the one went on from the other.

What a run learns anew from other pictures, and what it forgets of the ones before, need not both be kept: the mean of
both ends can be better than either.

Reference: Wortsman et al. 2022, Robust fine-tuning of zero-shot models.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from torch import Tensor


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--weights", type=Path, required=True, help="of the run that went on")
    parser.add_argument("--start", type=Path, required=True, help="that it started from")
    parser.add_argument("--share", type=_share, default=0.5, help="of the former, 0 to 1 (default 0.5)")
    parser.add_argument("--out", type=Path, required=True, help="file of weights to write")


def run(given: argparse.Namespace) -> int:
    """Write the mean."""
    one, other = (torch.load(path, weights_only=True) for path in (given.weights, given.start))
    torch.save(mean_of(one, other, given.share), given.out)
    return 0


def mean_of(one: dict[str, Tensor], other: dict[str, Tensor], share: float) -> dict[str, Tensor]:
    """Return `share` of the one's weights and the rest of the other's; what the other lacks is the one's alone."""
    return {
        name: torch.lerp(other[name], value, share) if name in other and value.dtype.is_floating_point else value
        for name, value in one.items()
    }


def _share(text: str) -> float:
    share = float(text)
    if not 0.0 <= share <= 1.0:
        raise argparse.ArgumentTypeError(f"{text} is no share from 0 to 1")
    return share
