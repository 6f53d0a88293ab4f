"""The classes of a training picture's pixels: what is drawn, what is learned and what the card says agree on these."""

from __future__ import annotations

CLASSES = ("background", "wall", "column", "slab or beam", "formwork", "other")
BACKGROUND, WALL, COLUMN, SLAB, FORMWORK, OTHER = range(len(CLASSES))
CONCRETE = (WALL, COLUMN)
"""The classes that come as things with a number: what the program measures."""
IGNORED = 255
"""Nobody asks what stands in such a pixel."""
BOND_STEPS = (2, 8, 24)
"""How far apart in half-size pixels the pixels are of which the network says whether they are one thing's."""
