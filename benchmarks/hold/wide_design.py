"""The sample's building many times side by side: designs of 28 to 16,000 elements of which stations see the first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from asbuilt_synthetic.building import Element, Ids
from asbuilt_synthetic.ifc_file import write_ifc
from asbuilt_synthetic.layout import design

SAMPLE_SEED = 7
APART_M = 60.0
"""From one building to the next: twice as wide as they are, and further than any station sees."""


def write_copies(path: Path, copies: int) -> None:
    """Write an IFC file with so many copies of the sample's building, the first one where the sample has it."""
    building = design(SAMPLE_SEED)
    side = int(copies**0.5 + 0.999)
    elements = list(building.elements)
    for number in range(1, copies):
        ids = Ids(SAMPLE_SEED, f"copy {number}")
        shift = APART_M * (number % side), APART_M * (number // side)
        elements += [_moved(one, ids, shift, number) for one in building.elements]
    write_ifc(replace(building, elements=tuple(elements)), path)


def _moved(one: Element, ids: Ids, shift: tuple[float, float], number: int) -> Element:
    return replace(
        one,
        global_id=ids.of(one.global_id),
        name=f"{one.name}/{number}",
        xy=(one.xy[0] + shift[0], one.xy[1] + shift[1]),
        openings=tuple(replace(hole, global_id=ids.of(hole.global_id)) for hole in one.openings),
    )
