"""A network of the user's own is tried once, in a process that can be ended: one that never answers is refused."""

from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.scale.apart import LIMITS_VARIABLE, Ended, Limits, run_apart
from asbuilt_bim.vision.networks.bundled import models_folder
from asbuilt_bim.vision.networks.card import model_path, read_card
from asbuilt_bim.vision.networks.files import Stamp, network_stamp
from asbuilt_bim.vision.networks.geometry_input import CHANNELS
from asbuilt_bim.vision.networks.session import RUN_S, open_network

_LIMITS = Limits(seconds=RUN_S, memory_bytes=3e9)
"""A network's own arena, and what Python and its libraries take."""


def try_network(card_path: Path) -> None:
    """Run a card's network on one grey picture, in a process of its own; the shipped ones are known to come to an end.

    What else is wrong with it is said where it is opened, or of the station that it fails on.

    Raises:
        NetworkError: the card or the file can't be used, or the network crashed, took too long or too much memory.
    """
    path = card_path.resolve()
    if path.parent == models_folder().resolve():
        return
    model = model_path(read_card(path), path)
    ended = _tried(path, network_stamp(path))
    if ended is None:
        return
    if ended.why == "died":
        raise NetworkError(f"network {model}: crashed onnxruntime ({ended.detail}); export it again")
    raise NetworkError(
        f"network {model}: took {ended.detail} for one picture; export it without loops, or take a smaller one. If it "
        f"is sound, set {LIMITS_VARIABLE}=4 for four times the time and memory"
    )


@lru_cache(maxsize=6)
def _tried(card_path: Path, stamp: Stamp) -> Ended | None:
    return run_apart(_run_once, card_path, limits=_LIMITS.raised())


def _run_once(card_path: Path) -> None:
    card = read_card(card_path)
    w, h = card.input.width_px, card.input.height_px
    sizes = {"nchw": (1, 3, h, w), "nhwc": (1, h, w, 3), "chw": (3, h, w)}
    with suppress(NetworkError):
        network = open_network(card, model_path(card, card_path))
        pictures = [np.full(sizes[card.input.order], 0.5, dtype=np.float32) for _ in network.inputs]
        if card.geometry is not None:
            pictures[-1] = np.zeros((1, CHANNELS, h, w), dtype=np.float32)
        network.run(tuple(pictures))
