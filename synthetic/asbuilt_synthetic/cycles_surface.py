"""What a pattern starts from and what it yields: the point on the surface, and its look."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asbuilt_synthetic.cycles_nodes import Nodes, Value
from asbuilt_synthetic.materials import Material, linear_rgb


@dataclass(slots=True)
class Look:
    """What a pattern yields: albedo, height in metres (None: smooth), and roughness."""

    colour: Value
    height_m: Value | None
    roughness: Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """Where a shading point lies: metres in space (shifted per body), and on the face; the body's random numbers."""

    at: Any
    along: Any
    up: Any
    body_random: Any
    body_random_2: Any


def surface_point(nodes: Nodes) -> Surface:
    """Read the shading point: its place in space shifted at random per body, and its place on the face."""
    position = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    info = nodes.add("ShaderNodeObjectInfo")
    shift = nodes.brighten(info.outputs["Color"], 40.0)
    along, up, _ = nodes.split(nodes.add("ShaderNodeUVMap", uv_map="surface").outputs[0])
    red, green, _ = nodes.split(info.outputs["Color"])
    return Surface(at=nodes.vector("ADD", position, shift), along=along, up=up, body_random=red, body_random_2=green)


def mottled(nodes: Nodes, surface: Surface, material: Material) -> tuple[Any, Any, Any]:
    """Base colour with large stains and fine grain; gives (colour, stains, grain) for more to be laid on."""
    stains = nodes.noise(surface.at, 1.0 / material.mottle_m, 4.0, 0.62)
    grain = nodes.noise(surface.at, 0.16 / material.grain_m, 3.0, 0.85)
    base, second = linear_rgb(material.base_srgb), linear_rgb(material.second_srgb)
    colour = nodes.mix(nodes.ramp(stains, 0.45, 0.85, 0.0, 0.7), base, second)
    swing = material.mottle_contrast
    contrast = 2.4 * material.grain_contrast
    colour = nodes.brighten(
        colour,
        nodes.math(
            "MULTIPLY",
            nodes.ramp(stains, 0.25, 0.75, 1.0 + swing, 1.0 - swing),
            nodes.ramp(grain, 0.2, 0.8, 1.0 - contrast, 1.0 + contrast),
        ),
    )
    body = nodes.ramp(surface.body_random, 0.0, 1.0, 0.92, 1.08)
    warm = nodes.mix(surface.body_random_2, (1.03, 1.0, 0.95), (0.97, 1.0, 1.04))
    return nodes.brighten(nodes.vector("MULTIPLY", colour, warm), body), stains, grain


def from_line(nodes: Nodes, cycles: Value, period_m: float) -> Any:
    """Distance in metres to the nearest whole number of periods."""
    return nodes.math(
        "MULTIPLY", nodes.math("ABSOLUTE", nodes.math("SUBTRACT", cycles, nodes.math("ROUND", cycles))), period_m
    )
