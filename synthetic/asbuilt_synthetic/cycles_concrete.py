"""Concrete as formwork leaves it: stains, run-off, lifts, blowholes, panel joints, tie holes."""

from __future__ import annotations

from typing import Any

from asbuilt_synthetic.cycles_nodes import Nodes, Value
from asbuilt_synthetic.cycles_surface import Look, Surface, from_line, mottled
from asbuilt_synthetic.materials import Formwork, Material


def concrete(nodes: Nodes, surface: Surface, material: Material) -> Look:
    """Lay stains, vertical run-off, level lifts, pores and the prints of the formwork on the base colour."""
    colour, stains, _ = mottled(nodes, surface, material)
    height: Value | None = None
    x, y, z = nodes.split(surface.at)
    streaks = nodes.noise(nodes.combine(x, y, nodes.math("MULTIPLY", z, 0.06)), 6.0, 3.0, 0.65)
    wet = nodes.math("MULTIPLY", nodes.ramp(streaks, 0.52, 0.72), nodes.ramp(stains, 0.30, 0.6))
    colour = nodes.brighten(colour, nodes.ramp(wet, 0.0, 1.0, 1.0, 0.62))
    washed = nodes.math("MULTIPLY", nodes.ramp(streaks, 0.46, 0.26), nodes.ramp(stains, 0.62, 0.40))
    colour = nodes.mix(nodes.math("MULTIPLY", washed, 0.45), colour, (0.56, 0.55, 0.52))
    lifts = nodes.noise(
        nodes.combine(nodes.math("MULTIPLY", x, 0.12), nodes.math("MULTIPLY", y, 0.12), z), 3.0, 2.0, 0.6
    )
    colour = nodes.brighten(colour, nodes.ramp(lifts, 0.3, 0.7, 0.90, 1.08))
    if material.pore_radius_m > 0.0:
        pores = _pores(nodes, surface, material, nodes.ramp(streaks, 0.3, 0.65, 0.25, 1.6))
        colour = nodes.brighten(colour, nodes.math("SUBTRACT", 1.0, nodes.math("MULTIPLY", pores, 0.6)))
    if material.formwork is not None:
        colour, height = _formwork_prints(nodes, surface, material.formwork, colour)
    return Look(colour, height, material.roughness)


def _pores(nodes: Nodes, surface: Surface, material: Material, crowding: Value) -> Any:
    """Blowholes 0..1: spheres of random radius in a share of the cells of a grid, cut by the surface."""
    scale = 0.16 / material.pore_radius_m
    distance, random = nodes.cells(surface.at, scale)
    red, green, _ = nodes.split(random)
    there = nodes.math("LESS_THAN", red, nodes.math("MULTIPLY", crowding, material.pore_share))
    unit = material.pore_radius_m * scale
    radius = nodes.math("MULTIPLY_ADD", nodes.math("POWER", green, 4.0), 1.5 * unit, 0.32 * unit)
    inside = nodes.math("SUBTRACT", nodes.math("MULTIPLY", radius, there), distance)
    return nodes.ramp(inside, 0.0, 0.05)


def _formwork_prints(nodes: Nodes, surface: Surface, formwork: Formwork, colour: Value) -> tuple[Any, Any]:
    """Panels of slightly different tone, fins and bleeding at their joints, and recessed tie holes with dark rims."""
    width, tall = formwork.panel_m
    start = nodes.math("MULTIPLY", surface.body_random_2, 0.4)
    along = nodes.math("DIVIDE", nodes.math("ADD", surface.along, start), width)
    up = nodes.math("DIVIDE", surface.up, tall)
    column, row = nodes.math("FLOOR", along), nodes.math("FLOOR", up)
    tone = nodes.random(nodes.combine(column, row, surface.body_random))
    colour = nodes.brighten(colour, nodes.ramp(tone, 0.0, 1.0, 0.88, 1.10))
    joint = nodes.math("MINIMUM", from_line(nodes, along, width), from_line(nodes, up, tall))
    line = nodes.ramp(joint, 0.4 * formwork.joint_m, formwork.joint_m, 1.0, 0.0)
    bleeding = nodes.math("MULTIPLY", nodes.ramp(joint, 0.0, 0.035, 1.0, 0.0), 0.16)
    colour = nodes.brighten(
        colour, nodes.math("SUBTRACT", nodes.math("SUBTRACT", 1.0, bleeding), nodes.math("MULTIPLY", line, 0.38))
    )
    spacing_along, spacing_up = formwork.tie_spacing_m
    in_tie = nodes.math(
        "MULTIPLY",
        nodes.math(
            "FRACT",
            nodes.math(
                "DIVIDE", nodes.math("ADD", nodes.math("ADD", surface.along, start), spacing_along / 2), spacing_along
            ),
        ),
        spacing_along,
    )
    up_tie = nodes.math(
        "MULTIPLY",
        nodes.math("FRACT", nodes.math("DIVIDE", nodes.math("ADD", surface.up, spacing_up * 0.62), spacing_up)),
        spacing_up,
    )
    away = nodes.vector(
        "LENGTH",
        nodes.combine(
            nodes.math("SUBTRACT", in_tie, spacing_along / 2), nodes.math("SUBTRACT", up_tie, spacing_up / 2)
        ),
    )
    hole = nodes.ramp(away, formwork.tie_radius_m * 0.85, formwork.tie_radius_m, 1.0, 0.0)
    rim = nodes.ramp(away, formwork.tie_radius_m, formwork.tie_radius_m * 3.2, 0.20, 0.0)
    colour = nodes.brighten(
        colour, nodes.math("SUBTRACT", nodes.math("SUBTRACT", 1.0, rim), nodes.math("MULTIPLY", hole, 0.55))
    )
    return colour, nodes.math("SUBTRACT", nodes.math("MULTIPLY", line, 0.002), nodes.math("MULTIPLY", hole, 0.006))
