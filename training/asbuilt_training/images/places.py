"""Chooses the places of a seed: sites, yards and real IFC files, mixed within every shard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from asbuilt_training.images.real_ifc import ifc_files, ifc_place
from asbuilt_training.images.sites import site_place
from asbuilt_training.images.things import Place
from asbuilt_training.images.yards import yard_place

PLACES_A_SEED = ("site", "yard", "ifc", "yard", "site")


def places(seed: int, ifc_folder: Path | None) -> Iterator[Place]:
    """Yield the places of a seed; without real IFC files a yard is drawn in their stead."""
    files = ifc_files(ifc_folder) if ifc_folder is not None else ()
    for number, source in enumerate(PLACES_A_SEED):
        rng = np.random.default_rng([seed, 53, number])
        if source == "site":
            yield site_place(10 * seed + number, rng)
        elif source == "ifc" and files:
            yield ifc_place(files[int(rng.integers(len(files)))], rng)
        else:
            yield yard_place(rng)
