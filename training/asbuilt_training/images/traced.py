"""Takes the same pictures by path tracing (Blender's Cycles): slow, and nearer to photographs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from asbuilt_synthetic.cycles import Studio
from asbuilt_synthetic.cycles_lens import Canvas
from asbuilt_synthetic.materials import Material
from asbuilt_synthetic.model import Light, Scene
from asbuilt_synthetic.progress import FIRST_DAY
from asbuilt_synthetic.rig import rig_truth

from asbuilt_training.images.draw import HEIGHT_PX, WIDTH_PX, Layers, View, layers, rays
from asbuilt_training.images.looks import draw_material, name_of
from asbuilt_training.images.stage import Stage

SAMPLES = 28
_VARIANTS = 3  # materials of one name in a scene
_set_up: list[tuple[Stage, Studio]] = []  # Blender holds one scene at a time


def trace(stage: Stage, view: View, rng: np.random.Generator) -> Layers:
    """Take one picture of a stage; its materials are drawn when its first picture is asked for."""
    if not _set_up or _set_up[0][0] is not stage:
        scene, materials = _scene(stage, rng)
        _set_up[:] = [(stage, Studio(scene, threads=1, materials=materials))]
    w, h = WIDTH_PX, HEIGHT_PX
    canvas = Canvas(f_px=view.fx_px, cx_px=(w - 1) / 2, cy_px=(h - 1) / 2, width_px=w, height_px=h)
    radiance = _set_up[0][1].radiance(canvas, view.world_from_camera, SAMPLES)
    triangle, t = stage.tracer.first_hit(view.world_from_camera[:3, 3], rays(view, w, h))
    return layers(stage, triangle, t, np.maximum(radiance, 0))


def _scene(stage: Stage, rng: np.random.Generator) -> tuple[Scene, dict[str, Material]]:
    """Give a stage's things as the path tracer wants them, with what their materials' names mean."""
    names = sorted({name_of(t.part) for t in stage.place.things})
    materials = {f"{name} {k}": draw_material(name, rng) for name in names for k in range(_VARIANTS)}
    bodies = []
    for t in stage.place.things:
        variant = int(rng.integers(_VARIANTS))
        bodies.append(replace(t.part, material=f"{name_of(t.part)} {variant}").placed(np.eye(4)))
    strength = float(np.clip(stage.weather.sun.max() / 1.5, 0, 1))
    light = Light(
        towards_sun=stage.weather.towards_sun,
        sun_strength=strength,
        sky_srgb=(168, 190, 220) if strength > 0.4 else (196, 202, 210),
        exposure=1.0,
    )
    scene = Scene(
        seed=int(rng.integers(1 << 20)), visit=0, day=FIRST_DAY, origin_m=stage.origin_m, bodies=tuple(bodies),
        decals=(), faces=(), elements=(), markers=(), rig=rig_truth(0), stations=(), light=light,
    )  # fmt: skip
    return scene, materials
