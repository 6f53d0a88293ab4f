"""A network asked twice, the second time about the photo's mirror image: what is noise in its answers is halved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.vision.networks.card import NetworkCard
from asbuilt_bim.vision.networks.session import Network


def answers(
    network: Network, card: NetworkCard, pictures: tuple[NDArray[np.float32], ...]
) -> dict[str, NDArray[np.float64]]:
    """Run a network on its inputs (1, c, h, w); with `mirror` in its card, return the mean of both ways to look.

    Raises:
        NetworkError: it failed, or answered with NaN.
    """
    seen = network.run(pictures)
    if not card.mirror:
        return seen
    other = network.run(tuple(np.ascontiguousarray(picture[..., ::-1]) for picture in pictures))
    for role, array in seen.items():
        back = other[role][..., ::-1]
        if role == "offsets" and array.ndim == 4:
            back = back * np.array([-1.0, 1.0])[: array.shape[1], None, None]  # what is right is left there
        array += back
        array *= 0.5
    return seen
