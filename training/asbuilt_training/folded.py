"""A trained network with its batch norms folded in: what is exported, and what a shipped file gives back."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from asbuilt_training.model import ConcreteNet


def folded(net: ConcreteNet) -> ConcreteNet:
    """Return a copy whose every convolution has its batch norm within it; it answers the same in evaluation mode."""
    copied = copy.deepcopy(net).eval()
    for module in copied.modules():
        if isinstance(module, nn.Sequential) and len(module) == 2 and isinstance(module[1], nn.BatchNorm2d):
            module[0] = fuse_conv_bn_eval(module[0], module[1])
            module[1] = nn.Identity()
    return copied


def rounded(net: nn.Module) -> nn.Module:
    """Return a copy whose weights are numbers of 16 bits, in 32: what a file of half the size gives back."""
    copied = copy.deepcopy(net)
    for parameter in copied.parameters():
        parameter.data = parameter.data.half().float()
    return copied


class Segmenter(nn.Module):
    """The part of the network that tells things apart."""

    def __init__(self, net: ConcreteNet) -> None:
        super().__init__()
        self.trunk, self.logits, self.offsets = net.trunk, net.logits, net.offsets

    def forward(self, image: Tensor, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (N, C, h/2, w/2) and offsets (N, 2, h/2, w/2)."""
        x = self.trunk(image, geometry)
        return self.logits(x), self.offsets(x)


class RelativeDepth(nn.Module):
    """The part of the network that puts depths in order; it never sees stereo."""

    def __init__(self, net: ConcreteNet) -> None:
        super().__init__()
        self.trunk, self.depth = net.trunk, net.depth

    def forward(self, image: Tensor) -> Tensor:
        """Return relative inverse depth (N, h/2, w/2); its scale, which is free, makes the mean of its logarithm 0."""
        nearness = self.depth(self.trunk(image, None))[:, 0]
        return (nearness - nearness.mean((1, 2), keepdim=True)).exp()


def read_segmenter(path: Path) -> Segmenter:
    """Return the network of an exported segmenter, folded, ready to learn on.

    Raises:
        ValueError: the file isn't an export of this network.
    """
    given = {
        one.name: numpy_helper.to_array(one) for one in onnx.load(path, load_external_data=False).graph.initializer
    }
    head = given.get("logits.out.weight")
    net = Segmenter(folded(ConcreteNet(classes=len(head)) if head is not None else ConcreteNet()))
    own = net.state_dict()
    if wrong := [name for name in own if name not in given or given[name].shape != tuple(own[name].shape)]:
        raise ValueError(f"{path}: has no {wrong[0]} of shape {tuple(own[wrong[0]].shape)}; is it another network?")
    net.load_state_dict({name: torch.from_numpy(np.array(given[name], dtype=np.float32)) for name in own})
    return net
