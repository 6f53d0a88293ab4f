"""Blender materials: patterns fixed to the surface, so that both photos of a pair see the same grain."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from asbuilt_synthetic import cycles_patterns as patterns
from asbuilt_synthetic.cycles_concrete import concrete
from asbuilt_synthetic.cycles_nodes import Nodes
from asbuilt_synthetic.cycles_surface import Look, surface_point
from asbuilt_synthetic.materials import Material, linear_rgb

_DECAL_WIDTH_PX = 640
_PATTERNS = {
    "concrete": concrete, "ground": patterns.ground, "wood": patterns.wood, "ply": patterns.ply,
    "steel": patterns.steel, "rust": patterns.rust, "masonry": patterns.masonry, "painted": patterns.painted,
    "cloth": patterns.cloth, "leaves": patterns.leaves, "glass": patterns.glass,
}  # fmt: skip


def build_material(name: str, material: Material) -> Any:
    """Make the Blender material of one entry of MATERIALS.

    The pattern is evaluated for what the camera sees directly. Light that bounces off the surface meets its mean
    colour, which looks the same and takes a fraction of the time.
    """
    made = bpy.data.materials.new(name)
    nodes = Nodes(made.node_tree)
    look = _PATTERNS[material.kind](nodes, surface_point(nodes), material)
    seen = _closure(nodes, material, look)
    bounced = nodes.add("ShaderNodeBsdfDiffuse")
    nodes.put(bounced.inputs["Color"], linear_rgb(material.base_srgb))
    mix = nodes.add("ShaderNodeMixShader")
    nodes.put(mix.inputs[0], nodes.add("ShaderNodeLightPath").outputs["Is Camera Ray"])
    nodes.put(mix.inputs[1], bounced.outputs[0])
    nodes.put(mix.inputs[2], seen)
    output = nodes.add("ShaderNodeOutputMaterial")
    nodes.put(output.inputs["Surface"], mix.outputs[0])
    return made


def build_decal_material(name: str, image_srgb: NDArray[np.uint8]) -> Any:
    """Make a matt printed picture; small pictures are enlarged by whole numbers so that their edges stay sharp."""
    times = max(1, _DECAL_WIDTH_PX // image_srgb.shape[1])
    large = np.repeat(np.repeat(image_srgb, times, axis=0), times, axis=1)[::-1]
    height, width = large.shape[:2]
    image = bpy.data.images.new(name, width=width, height=height, alpha=False)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = large.astype(np.float32) / 255.0
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    made = bpy.data.materials.new(name)
    nodes = Nodes(made.node_tree)
    texture = nodes.add("ShaderNodeTexImage", image=image, interpolation="Linear", extension="EXTEND")
    nodes.put(texture.inputs["Vector"], nodes.add("ShaderNodeUVMap", uv_map="surface").outputs[0])
    printed = nodes.brighten(texture.outputs["Color"], 0.80)
    bsdf = nodes.add("ShaderNodeBsdfDiffuse")
    nodes.put(bsdf.inputs["Color"], nodes.vector("ADD", printed, (0.012, 0.012, 0.012)))
    nodes.put(nodes.add("ShaderNodeOutputMaterial").inputs["Surface"], bsdf.outputs[0])
    return made


def build_disc_material(name: str, colour_srgb: tuple[int, int, int]) -> Any:
    """Make the matt paint of the target: its colour in front, dark behind."""
    made = bpy.data.materials.new(name)
    nodes = Nodes(made.node_tree)
    geometry = nodes.add("ShaderNodeNewGeometry")
    dust = nodes.noise(geometry.outputs["Position"], 40.0, 3.0, 0.6)
    front = nodes.brighten(linear_rgb(colour_srgb), nodes.ramp(dust, 0.2, 0.8, 0.92, 1.08))
    bsdf = nodes.add("ShaderNodeBsdfDiffuse")
    nodes.put(bsdf.inputs["Color"], nodes.mix(geometry.outputs["Backfacing"], front, (0.05, 0.05, 0.05)))
    nodes.put(nodes.add("ShaderNodeOutputMaterial").inputs["Surface"], bsdf.outputs[0])
    return made


def _closure(nodes: Nodes, material: Material, look: Look) -> Any:
    matt = material.roughness >= 0.8 and material.metallic == 0.0
    if matt:
        bsdf = nodes.add("ShaderNodeBsdfDiffuse")
        nodes.put(bsdf.inputs["Color"], look.colour)
    else:
        bsdf = nodes.add("ShaderNodeBsdfPrincipled")
        nodes.put(bsdf.inputs["Base Color"], look.colour)
        nodes.put(bsdf.inputs["Metallic"], material.metallic)
        nodes.put(bsdf.inputs["Roughness"], look.roughness)
    if look.height_m is not None:
        bump = nodes.add("ShaderNodeBump")
        nodes.put(bump.inputs["Height"], look.height_m)
        nodes.put(bump.inputs["Distance"], 1.0)
        nodes.put(bump.inputs["Strength"], 1.0)
        nodes.put(bsdf.inputs["Normal"], bump.outputs[0])
    return bsdf.outputs[0]
