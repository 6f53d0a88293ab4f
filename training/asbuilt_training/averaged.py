"""The running average of a network's weights: what is judged and shipped, steadier than any one step."""

from __future__ import annotations

import copy

import torch
from torch import nn

MOST = 0.9985
"""Share that stays at each step, once enough have been seen: an average over some seven hundred."""


class Averaged:
    """A copy of a network that follows it slowly."""

    def __init__(self, net: nn.Module) -> None:
        self.net = copy.deepcopy(net).eval()
        self.updates = 0
        for parameter in self.net.parameters():
            parameter.requires_grad_(False)

    @torch.no_grad()
    def update(self, net: nn.Module) -> None:
        """Move a little towards the network, statistics included; early on, more."""
        self.updates += 1
        share = 1.0 - min(MOST, (1 + self.updates) / (10 + self.updates))
        own = self.net.state_dict()
        for name, value in net.state_dict().items():
            if value.dtype.is_floating_point:
                own[name].lerp_(value, share)
            else:
                own[name].copy_(value)
