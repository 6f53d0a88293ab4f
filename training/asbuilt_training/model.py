"""The network: one small trunk, and read off it classes, offsets to each thing's centre, bonds, and relative depth.

Plain 3x3 convolutions rather than depthwise ones: at this size they are faster, on the processors that train it and
on those that run it, for the same number of multiplications. Its form is that of U-Net (Ronneberger et al. 2015) on a
residual trunk (He et al. 2016), with self-attention where the map is smallest (Vaswani et al. 2017) and each pixel
told where in the picture it stands (Liu et al. 2018); the offsets are Panoptic-DeepLab's (Cheng et al. 2020). Bonds
say whether two pixels some way apart are one thing's, for several ways (Wolf et al. 2018, The mutex watershed).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from asbuilt_training.classes import BOND_STEPS, CLASSES

STRIDE = 2
"""The outputs are at half the input's size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """How wide and deep the network is: channels at 1/2, 1/4, 1/8, 1/16, 1/32, and residual blocks at 1/4 to 1/32."""

    channels: tuple[int, int, int, int, int] = (16, 32, 64, 128, 160)
    blocks: tuple[int, int, int, int] = (1, 2, 4, 2)
    decoder: tuple[int, int, int, int] = (32, 32, 64, 96)  # at 1/2, 1/4, 1/8, 1/16
    head: int = 16


def convolution(inside: int, outside: int, *, stride: int = 1, kernel: int = 3, dilation: int = 1) -> nn.Sequential:
    """Return a convolution with its batch norm, no activation."""
    return nn.Sequential(
        nn.Conv2d(inside, outside, kernel, stride, dilation * (kernel // 2), dilation=dilation, bias=False),
        nn.BatchNorm2d(outside),
    )


class Residual(nn.Module):
    """Two convolutions and a way around them."""

    def __init__(self, channels: int, dilation: int = 1) -> None:
        super().__init__()
        self.first = convolution(channels, channels)
        self.second = convolution(channels, channels, dilation=dilation)

    def forward(self, x: Tensor) -> Tensor:
        """Return the same shape (N, C, h, w)."""
        return functional.relu(x + self.second(functional.relu(self.first(x))))


class Attention(nn.Module):
    """Every place of a small map asks every other one, in several ways at once.

    Made of 1x1 convolutions, so that its batch norm folds away and its weights keep their names when exported.
    """

    def __init__(self, channels: int, ways: int = 5) -> None:
        super().__init__()
        self.ways = ways
        self.ask = convolution(channels, 3 * channels, kernel=1)
        self.tell = nn.Conv2d(channels, channels, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return the same shape (N, C, h, w)."""
        count, channels, height, width = x.shape
        parts = self.ask(x).reshape(count, 3, self.ways, channels // self.ways, height * width)
        query, key, value = parts[:, 0], parts[:, 1], parts[:, 2]
        heed = (query.transpose(2, 3) @ key * (channels // self.ways) ** -0.5).softmax(dim=3)
        heard = value @ heed.transpose(2, 3)
        return x + self.tell(heard.reshape(count, channels, height, width))


def places(x: Tensor) -> Tensor:
    """Return where each pixel of pictures (N, C, h, w) stands, (1, 2, h, w): right and down, from -1 to 1."""
    ones = torch.ones_like(x[:1, :1])  # counted up rather than spread over a size: that can be traced
    across, down = ones.cumsum(3) - 1.0, ones.cumsum(2) - 1.0
    return torch.cat([across / across.max() * 2.0 - 1.0, down / down.max() * 2.0 - 1.0], dim=1)


class Trunk(nn.Module):
    """From the picture, and the stereo geometry where there is some, to features at half size."""

    def __init__(self, size: Size) -> None:
        super().__init__()
        c, d = size.channels, size.decoder
        self.stem = convolution(3, c[0], stride=2)
        # No bias and no batch norm: absent geometry is all zeros, and adds nothing.
        self.geometry_stem = nn.Conv2d(5, c[0], 3, 2, 1, bias=False)
        self.place_stem = nn.Conv2d(2, c[0], 3, 2, 1, bias=False)
        self.down = nn.ModuleList(convolution(c[i], c[i + 1], stride=2) for i in range(4))
        self.stages = nn.ModuleList(
            nn.Sequential(*(Residual(c[i + 1], dilation=1 if i < 3 else 1 + k) for k in range(size.blocks[i])))
            for i in range(4)
        )
        self.attention = nn.Sequential(*(Attention(c[4]) for _ in range(2)))
        self.context = nn.Conv2d(c[4], c[4], 1)
        self.narrow = nn.ModuleList(convolution(c[i], d[i], kernel=1) for i in range(4))
        self.reduce = nn.ModuleList(convolution(above, d[i], kernel=1) for i, above in enumerate((*d[1:], c[4])))
        self.merge = nn.ModuleList(convolution(d[i], d[i]) for i in range(4))

    def forward(self, image: Tensor, geometry: Tensor | None) -> Tensor:
        """Return features (N, C, h/2, w/2) of an image (N, 3, h, w) and its geometry (N, 5, h, w)."""
        x = self.stem(image) + self.place_stem(places(image))
        x = functional.relu(x if geometry is None else x + self.geometry_stem(geometry))
        levels = [x]
        for down, stage in zip(self.down, self.stages, strict=True):
            x = stage(functional.relu(down(x)))
            levels.append(x)
        x = self.attention(x)
        x = x + self.context(x.mean((2, 3), keepdim=True))  # what kind of picture it is, told to every pixel
        for level in (3, 2, 1, 0):
            raised = functional.interpolate(
                self.reduce[level](x), scale_factor=2.0, mode="bilinear", align_corners=False
            )
            x = functional.relu(self.merge[level](functional.relu(raised + self.narrow[level](levels[level]))))
        return x


class Head(nn.Module):
    """One more convolution over the features, and a map off it."""

    def __init__(self, inside: int, width: int, outside: int) -> None:
        super().__init__()
        self.hidden = convolution(inside, width)
        self.out = nn.Conv2d(width, outside, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return (N, outside, h, w)."""
        return self.out(functional.relu(self.hidden(x)))


class ConcreteNet(nn.Module):
    """Trunk and heads together, as they are trained."""

    def __init__(self, size: Size | None = None, classes: int = len(CLASSES)) -> None:
        super().__init__()
        self.size = size or Size()
        self.trunk = Trunk(self.size)
        inside = self.size.decoder[0]
        self.logits = Head(inside, self.size.head, classes)
        self.offsets = Head(inside, self.size.head, 2)
        self.depth = Head(inside, self.size.head, 1)
        self.bonds = Head(inside, self.size.head, 2 * len(BOND_STEPS))
        self._begin()

    def _begin(self) -> None:
        """Draw the first weights: so that gradients neither fade nor grow (He et al. 2015).

        PyTorch's own are smaller by half or more. Batch norms hide that from the answers, not from how far a step goes.
        """
        smooth = (self.offsets.out, self.depth.out)  # these begin near 0
        for module in self.modules():
            if isinstance(module, nn.Conv2d) and module not in smooth:
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")
        for told in (self.trunk.place_stem, *(layer.tell for layer in self.trunk.attention)):
            for parameter in told.parameters():
                nn.init.normal_(parameter, std=1e-4)  # next to nothing: weights without them are a start, too

    def forward(self, image: Tensor, geometry: Tensor | None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return logits (N, 6, h/2, w/2), offsets (N, 2, h/2, w/2), log of relative inverse depth (N, h/2, w/2), bonds.

        Bonds (N, 2 S, h/2, w/2) are logits: is a pixel of one thing with that a step to the right, and that below.
        """
        x = self.trunk(image, geometry)
        return self.logits(x), self.offsets(x), self.depth(x)[:, 0], self.bonds(x)


MEAN, STD = 0.45, 0.25


def network_inputs(image: Tensor, geometry: Tensor) -> tuple[Tensor, Tensor]:
    """Return uint8 RGB (N, h, w, 3) and geometry (N, 5, h, w) as the network takes them, float32."""
    picture = (image.permute(0, 3, 1, 2).float() * (1.0 / 255.0) - MEAN) * (1.0 / STD)
    return picture, geometry.float().contiguous(memory_format=torch.channels_last)
