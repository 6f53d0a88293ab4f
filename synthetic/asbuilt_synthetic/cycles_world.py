"""Sun, sky and the render settings."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from asbuilt_synthetic.cycles_nodes import Nodes
from asbuilt_synthetic.cycles_sky import sky_panorama
from asbuilt_synthetic.model import Light

_SUN_IRRADIANCE = 4.2


def render_settings(threads: int) -> Any:
    """Empty Blender and set it up for a headless path trace on the CPU; gives the Blender scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage = bpy.context.scene
    stage.render.engine = "CYCLES"
    stage.render.threads_mode = "FIXED"
    stage.render.threads = threads
    stage.render.use_persistent_data = True
    stage.render.resolution_percentage = 100
    stage.render.film_transparent = False
    stage.view_settings.view_transform = "Raw"
    settings = stage.cycles
    settings.device = "CPU"
    settings.use_adaptive_sampling = True
    settings.adaptive_threshold = 0.06
    settings.adaptive_min_samples = 8
    settings.use_light_tree = False
    settings.denoiser = "OPENIMAGEDENOISE"
    settings.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    settings.denoising_prefilter = "NONE"
    settings.denoising_quality = "HIGH"
    settings.max_bounces = 4
    settings.diffuse_bounces = 3
    settings.glossy_bounces = 2
    settings.transmission_bounces = 0
    settings.sample_clamp_indirect = 4.0
    settings.sample_clamp_direct = 0.0
    settings.pixel_filter_type = "BLACKMAN_HARRIS"
    settings.filter_width = 1.5
    settings.caustics_reflective = False
    settings.caustics_refractive = False
    return stage


def light_world(stage: Any, light: Light, seed: int) -> None:
    """Put the sun and a sky with soft clouds over the scene."""
    clear = float(np.clip(light.sun_strength, 0.0, 1.0))
    towards = np.asarray(light.towards_sun, dtype=np.float64)
    towards = towards / np.linalg.norm(towards)
    if clear > 0.0:
        lamp = bpy.data.lights.new("sun", "SUN")
        lamp.energy = _SUN_IRRADIANCE * clear
        lamp.angle = np.deg2rad(0.55 + 6.0 * (1.0 - clear))
        low = float(np.clip(1.0 - towards[2], 0.0, 1.0))
        lamp.color = (1.0, 0.955 - 0.10 * low**2, 0.88 - 0.28 * low**2)
        sun = bpy.data.objects.new("sun", lamp)
        sun.rotation_mode = "QUATERNION"
        sun.rotation_quaternion = Vector(towards.tolist()).to_track_quat("Z", "Y")
        stage.collection.objects.link(sun)
    _sky(stage, sky_panorama(light, seed))


def _sky(stage: Any, panorama: NDArray[np.float32]) -> None:
    """Wrap a panorama (H, W, 3), first row straight up, around the world."""
    height, width, _ = panorama.shape
    image = bpy.data.images.new("sky", width=width, height=height, alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = panorama[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    world = bpy.data.worlds.new("sky")
    stage.world = world
    nodes = Nodes(world.node_tree)
    environment = nodes.add("ShaderNodeTexEnvironment", image=image, interpolation="Linear")
    background = nodes.add("ShaderNodeBackground")
    nodes.put(background.inputs["Color"], environment.outputs["Color"])
    nodes.put(nodes.add("ShaderNodeOutputWorld").inputs["Surface"], background.outputs[0])
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = 512
