"""Every other surface of a site: earth, boards, ply, steel, rust, brick, paint, cloth, leaves, panes."""

from __future__ import annotations

import numpy as np

from asbuilt_synthetic.cycles_nodes import Nodes
from asbuilt_synthetic.cycles_surface import Look, Surface, from_line, mottled
from asbuilt_synthetic.materials import Courses, Material, linear_rgb


def ground(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Earth or grass: clods in relief, stones of other colours in a share of the cells."""
    colour, _, _ = mottled(nodes, surface, material)
    distance, random = nodes.cells(surface.at, 0.3 / material.grain_m)
    stone, other, _ = nodes.split(random)
    is_stone = nodes.math("MULTIPLY", nodes.math("LESS_THAN", stone, 0.34), nodes.ramp(distance, 0.42, 0.30))
    pebble = nodes.mix(other, (0.12, 0.10, 0.08), (0.42, 0.39, 0.34))
    colour = nodes.mix(nodes.math("MULTIPLY", is_stone, 0.7), colour, pebble)
    clods = nodes.noise(surface.at, 6.0, 3.0, 0.75)
    colour = nodes.brighten(colour, nodes.ramp(clods, 0.25, 0.75, 0.78, 1.2))
    return Look(colour, nodes.math("MULTIPLY", clods, 6.0 * material.bump_m), material.roughness)


def wood(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Boards with fibres along the face's long way up, and a tone per board."""
    colour, _, _ = mottled(nodes, surface, material)
    fibre = nodes.noise(
        nodes.combine(
            nodes.math("MULTIPLY", surface.along, 60.0),
            nodes.math("MULTIPLY", surface.up, 4.0),
            nodes.math("MULTIPLY", surface.body_random, 90.0),
        ),
        1.0,
        4.0,
        0.65,
    )
    colour = nodes.brighten(colour, nodes.ramp(fibre, 0.25, 0.75, 0.8, 1.18))
    board = nodes.math("FLOOR", nodes.math("DIVIDE", surface.along, 0.20))
    tone = nodes.random(nodes.combine(board, surface.body_random, 0.5))
    gap = from_line(nodes, nodes.math("DIVIDE", surface.along, 0.20), 0.20)
    colour = nodes.brighten(
        colour,
        nodes.math("MULTIPLY", nodes.ramp(tone, 0.0, 1.0, 0.84, 1.12), nodes.ramp(gap, 0.0015, 0.004, 0.35, 1.0)),
    )
    return Look(colour, nodes.math("MULTIPLY", fibre, material.bump_m), material.roughness)


def ply(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Coated formwork sheets: rotary-cut figure, cement film and scratches."""
    colour, _, grain = mottled(nodes, surface, material)
    figure = nodes.noise(
        nodes.combine(
            nodes.math("MULTIPLY", surface.along, 9.0),
            nodes.math("MULTIPLY", surface.up, 2.2),
            nodes.math("MULTIPLY", surface.body_random, 90.0),
        ),
        1.0,
        4.0,
        0.6,
    )
    colour = nodes.brighten(colour, nodes.ramp(figure, 0.25, 0.75, 0.76, 1.18))
    film = nodes.noise(surface.at, 3.5, 4.0, 0.7)
    colour = nodes.mix(nodes.ramp(film, 0.50, 0.74, 0.0, 0.55), colour, (0.36, 0.35, 0.32))
    return Look(colour, nodes.math("MULTIPLY", grain, material.bump_m), nodes.ramp(film, 0.4, 0.7, 0.45, 0.8))


def steel(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Painted or galvanised steel with splashes of concrete."""
    colour, _, _ = mottled(nodes, surface, material)
    splashes = nodes.noise(surface.at, 16.0, 3.0, 0.7)
    colour = nodes.mix(nodes.ramp(splashes, 0.56, 0.64, 0.0, 0.7), colour, linear_rgb(material.second_srgb))
    return Look(colour, None, nodes.ramp(splashes, 0.5, 0.65, material.roughness, 0.85))


def rust(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Ribbed bars, rusty in stains."""
    colour, stains, _ = mottled(nodes, surface, material)
    ribs = nodes.math("SINE", nodes.math("MULTIPLY", surface.up, 2.0 * np.pi / 0.012))
    colour = nodes.brighten(colour, nodes.ramp(ribs, -1.0, 1.0, 0.72, 1.2))
    return Look(
        nodes.mix(nodes.ramp(stains, 0.45, 0.6, 0.0, 0.6), colour, (0.24, 0.10, 0.045)), None, material.roughness
    )


def masonry(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Bricks in running bond, a tone for each, recessed mortar."""
    courses = material.courses or Courses(brick_m=(0.24, 0.083), mortar_m=0.011, mortar_srgb=(176, 168, 154))
    colour, _, grain = mottled(nodes, surface, material)
    length, tall = courses.brick_m
    row = nodes.math("DIVIDE", surface.up, tall)
    shifted = nodes.math(
        "ADD",
        nodes.math("DIVIDE", surface.along, length),
        nodes.math("MULTIPLY", nodes.math("FLOORED_MODULO", nodes.math("FLOOR", row), 2.0), 0.5),
    )
    tone = nodes.random(nodes.combine(nodes.math("FLOOR", shifted), nodes.math("FLOOR", row), surface.body_random))
    colour = nodes.mix(nodes.math("MULTIPLY", tone, 0.7), colour, linear_rgb(material.second_srgb))
    joint = nodes.math("MINIMUM", from_line(nodes, shifted, length), from_line(nodes, row, tall))
    mortar = nodes.ramp(joint, 0.42 * courses.mortar_m, 0.58 * courses.mortar_m, 1.0, 0.0)
    bed = nodes.brighten(linear_rgb(courses.mortar_srgb), nodes.ramp(grain, 0.2, 0.8, 0.8, 1.2))
    colour = nodes.mix(mortar, colour, bed)
    return Look(
        colour, nodes.math("MULTIPLY", nodes.math("SUBTRACT", 1.0, mortar), material.bump_m), material.roughness
    )


def painted(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """A plain coat with faint stains."""
    colour, _, grain = mottled(nodes, surface, material)
    height = nodes.math("MULTIPLY", grain, material.bump_m) if material.bump_m > 0.0 else None
    return Look(colour, height, material.roughness)


def cloth(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Folds in relief, darker in their depth."""
    colour, _, _ = mottled(nodes, surface, material)
    folds = nodes.noise(surface.at, 9.0, 2.0, 0.5)
    colour = nodes.brighten(colour, nodes.ramp(folds, 0.3, 0.7, 0.8, 1.12))
    height = nodes.math("MULTIPLY", folds, 2.0 * material.bump_m) if material.bump_m > 0.0 else None
    return Look(colour, height, material.roughness)


def leaves(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Clusters of leaves as cells, dark between them."""
    colour, _, _ = mottled(nodes, surface, material)
    distance, random = nodes.cells(surface.at, 1.0 / (2.0 * material.grain_m))
    tone, hue, _ = nodes.split(random)
    colour = nodes.brighten(colour, nodes.ramp(tone, 0.0, 1.0, 0.45, 1.5))
    colour = nodes.mix(nodes.math("MULTIPLY", hue, 0.35), colour, (0.16, 0.17, 0.04))
    height = nodes.math("MULTIPLY", distance, -material.bump_m)
    return Look(nodes.brighten(colour, nodes.ramp(distance, 0.2, 0.8, 1.15, 0.45)), height, material.roughness)


def glass(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """A window pane by day: dark, with the room's stains of light and a gloss of sky."""
    colour, _, _ = mottled(nodes, surface, material)
    return Look(nodes.brighten(colour, 0.7), None, material.roughness)
