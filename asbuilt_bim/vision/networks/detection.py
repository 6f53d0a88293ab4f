"""What a segmenter's answer comes to, whatever its family: one instance, its class number, how sure, and where."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.vision.networks.card import NetworkCard

Outputs = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sighting:
    """One instance that a network saw: its class number, its score 0..1, its mask bool (H, W) over the photo."""

    number: int
    score: float
    mask: BoolArray


def wrong_shapes(card: NetworkCard, outputs: Outputs, wanted: str) -> NetworkError:
    """Return what to raise where outputs haven't the shapes of their layout."""
    there = ", ".join(f"{role} {array.shape}" for role, array in outputs.items())
    return NetworkError(f"network {card.name}: the layout {card.layout} wants {wanted}; the file gives {there}")


def refuse_unknown_ids(card: NetworkCard, count: int) -> None:
    """Refuse a card with classes that a network of `count` classes can't answer with.

    Raises:
        NetworkError: a class's number is `count` or more.
    """
    wrong = [f"{one.id} ({one.name[:40]})" for one in card.classes if one.id >= count]
    if wrong:
        raise NetworkError(
            f"network {card.name}: its card names class {', '.join(wrong[:5])}, the file tells {count} classes apart "
            f"(ids 0 to {count - 1}); correct the ids in the card, or take these classes out"
        )
