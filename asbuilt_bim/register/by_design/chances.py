"""How likely each place is where stations of one visit may stand, all of them judged together.

They have two things in common that no station knows alone: whether the design is of this site at all, and how much of
what is seen there is designed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.register.by_design.fitting import MISTAKEN, SHARES, SHARES_WEIGHT

OF_SITE = 0.5
"""How likely the design is of this site and not mirrored, before anything is seen: nobody knows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Possible:
    """What one station, or several that are tied, may be: of each place odds by share (Q,). It saw so many `faces`."""

    by_share: Sequence[FloatArray]
    faces: int


def chances(found: Sequence[Possible]) -> list[FloatArray]:
    """Return of each station how likely each of its places is (H,); what lacks to one is that it is none of them.

    Either the design is of this site. Then each station is at one of its places, or sees nothing that is designed, or
    somebody was wrong about it. Or it isn't, and no station stands anywhere in it. Then what each saw is as likely as
    what its places are compared with.
    """
    parts = [_parts(one) for one in found]
    terms = [np.logaddexp.reduce(one, axis=0) for one in parts]
    of_site = np.log(OF_SITE) + np.log(SHARES_WEIGHT) + np.sum(terms, axis=0)
    total = np.logaddexp(np.logaddexp.reduce(of_site), np.log(1.0 - OF_SITE))
    return [
        np.exp(np.logaddexp.reduce(of_site + own[: len(one.by_share)] - term, axis=1) - total)
        for one, own, term in zip(found, parts, terms, strict=True)
    ]


def _parts(one: Possible) -> FloatArray:
    """Return the logarithm of the odds (H + 2, Q) of each place, of seeing nothing designed, and of a mistake."""
    places = np.reshape(np.array(one.by_share), (-1, len(SHARES)))
    nothing = one.faces * np.log(1.0 - SHARES)
    right = np.log(1.0 - MISTAKEN) + np.concatenate([places, nothing[None]])
    return np.concatenate([right, np.full((1, len(SHARES)), np.log(MISTAKEN))])
