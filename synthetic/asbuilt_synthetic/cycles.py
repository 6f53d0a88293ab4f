"""Photos of a scene by path tracing (Blender's Cycles, headless, on the CPU): the slow, photographic renderer.

The camera is a pinhole on a canvas larger and finer than the photo. The picture then goes through the true lens
(`cycles_lens`) and the sensor (`cycles_develop`). So a world point lands in the photo where `cv2.projectPoints` says.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import cv2
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from asbuilt_synthetic.cycles_develop import auto_exposure, develop
from asbuilt_synthetic.cycles_lens import Canvas, canvas_for, through_lens
from asbuilt_synthetic.cycles_materials import build_decal_material, build_disc_material, build_material
from asbuilt_synthetic.cycles_mesh import body_object, decal_object, disc_object
from asbuilt_synthetic.cycles_world import light_world, render_settings
from asbuilt_synthetic.materials import MATERIALS, Material
from asbuilt_synthetic.model import Body, CameraTruth, FloatArray, Scene, Station

SAMPLES = 10
"""Paths per canvas pixel: the denoiser, guided by albedo and normal, leaves the grain."""
SUPERSAMPLE = 1.2
SIDES = ("left", "right")
_BLENDER_FROM_CV = np.diag([1.0, -1.0, -1.0, 1.0])


class Studio:
    """One scene set up in Blender once; takes any number of photos. Blender holds one at a time."""

    current: Studio | None = None

    def __init__(self, scene: Scene, threads: int = 2, materials: Mapping[str, Material] = MATERIALS) -> None:
        """Build every mesh, material and light of the scene; `materials` say what its bodies' names mean."""
        self.scene = scene
        self._known = materials
        self.stage = render_settings(threads)
        self._materials: dict[str, Any] = {}
        for body in scene.bodies:
            self._add_body(body)
        for index, decal in enumerate(scene.decals):
            name = f"decal {index}"
            self._link(decal_object(decal, scene.origin_m, build_decal_material(name, decal.image_srgb)))
        self._only_at: dict[str, list[Any]] = {}
        for station in scene.stations:
            self._add_station(station)
        light_world(self.stage, scene.light, scene.seed * 31 + scene.visit)
        camera = bpy.data.cameras.new("camera")
        camera.sensor_fit = "HORIZONTAL"
        camera.clip_start, camera.clip_end = 0.05, 1000.0
        self.camera = bpy.data.objects.new("camera", camera)
        self._link(self.camera)
        self.stage.camera = self.camera
        self._exposures: dict[str, float] = {}
        Studio.current = self

    @staticmethod
    def of(scene: Scene) -> Studio:
        """Give the studio of this scene, building it only when Blender holds another."""
        if Studio.current is None or Studio.current.scene is not scene:
            Studio.current = Studio(scene)
        return Studio.current

    def radiance(self, canvas: Canvas, world_from_cv: FloatArray, samples: int) -> NDArray[np.float32]:
        """Render linear radiance (h, w, 3) of a pinhole camera at a pose, denoised."""
        return self._trace(canvas, world_from_cv, samples, denoise=True)

    def photo(self, station: Station, side: str, samples: int, supersample: float) -> NDArray[np.uint8]:
        """Take one photo (H, W, 3) RGB as the camera stores it."""
        self._show_only(station)
        camera = self._camera_truth(side)
        exposure = self._exposure(station)
        canvas = canvas_for(camera, supersample)
        radiance = self._trace(canvas, world_from_camera(self.scene, station, side), samples, denoise=True)
        names = sum(ord(letter) << (index % 3) for index, letter in enumerate(station.name + side))
        seed = [self.scene.seed, self.scene.visit, names]
        return develop(through_lens(np.minimum(radiance, 6.0 / exposure), camera, canvas), exposure, seed)

    def _camera_truth(self, side: str) -> CameraTruth:
        if side not in SIDES:
            raise ValueError(f"side is {side!r}; it must be 'left' or 'right'")
        return self.scene.rig.left if side == "left" else self.scene.rig.right

    def _exposure(self, station: Station) -> float:
        """Meter the left camera once a station, so that both photos of a pair are exposed alike."""
        if station.name not in self._exposures:
            small = canvas_for(self.scene.rig.left, 0.12)
            preview = self._trace(small, world_from_camera(self.scene, station, "left"), 12, denoise=False)
            self._exposures[station.name] = self.scene.light.exposure * auto_exposure(preview)
        return self._exposures[station.name]

    def _add_body(self, body: Body) -> Any:
        if body.material not in self._known:
            known = ", ".join(sorted(self._known))
            raise KeyError(f"body {body.name}: no material {body.material!r}; known are {known}")
        if body.material not in self._materials:
            self._materials[body.material] = build_material(body.material, self._known[body.material])
        return self._link(body_object(body, self.scene.origin_m, self._materials[body.material]))

    def _add_station(self, station: Station) -> None:
        made = [self._add_body(body) for body in station.bodies]
        if station.disc is not None:
            name = f"disc {station.name}"
            paint = build_disc_material(name, station.disc.colour_srgb)
            made.append(self._link(disc_object(name, station.disc, self.scene.origin_m, paint)))
        self._only_at[station.name] = made

    def _link(self, made: Any) -> Any:
        self.stage.collection.objects.link(made)
        return made

    def _show_only(self, station: Station) -> None:
        for name, objects in self._only_at.items():
            for made in objects:
                made.hide_render = name != station.name

    def _trace(self, canvas: Canvas, world_from_cv: FloatArray, samples: int, denoise: bool) -> NDArray[np.float32]:
        """Render linear radiance (h, w, 3) of the pinhole canvas."""
        lens = self.camera.data
        lens.sensor_width = 36.0
        lens.lens = 36.0 * canvas.f_px / canvas.width_px
        lens.shift_x, lens.shift_y = canvas.blender_shift
        local = world_from_cv.copy()
        local[:3, 3] -= self.scene.origin_m
        self.camera.matrix_world = Matrix((local @ _BLENDER_FROM_CV).tolist())
        self.stage.render.resolution_x, self.stage.render.resolution_y = canvas.width_px, canvas.height_px
        self.stage.cycles.samples = samples
        self.stage.cycles.use_denoising = denoise
        return self._rendered()

    def _rendered(self) -> NDArray[np.float32]:
        output = self.stage.render
        output.image_settings.file_format = "OPEN_EXR"
        output.image_settings.color_depth = "32"
        output.image_settings.exr_codec = "NONE"
        with tempfile.TemporaryDirectory(prefix="asbuilt_cycles_") as folder, _quiet():
            output.filepath = str(Path(folder) / "render.exr")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(output.filepath)
            pixels = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
            image.pixels.foreach_get(pixels)
            shape = (image.size[1], image.size[0], 4)
            bpy.data.images.remove(image)
        return np.ascontiguousarray(pixels.reshape(shape)[::-1, :, :3])


def world_from_camera(scene: Scene, station: Station, side: str) -> FloatArray:
    """Give the pose (4, 4) of one camera of the rig at a station."""
    if side == "left":
        return np.array(station.world_from_left, dtype=np.float64)
    return np.asarray(station.world_from_left @ np.linalg.inv(scene.rig.right_from_left))


def render(
    scene: Scene, station: Station, side: str, samples: int = SAMPLES, supersample: float = SUPERSAMPLE
) -> NDArray[np.uint8]:
    """Take the distorted photo (H, W, 3) RGB of one side at one station; the scene is kept for the next call."""
    return Studio.of(scene).photo(station, side, samples, supersample)


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotoTiming:
    """One photo that was made: where it lies and how long it took."""

    station: str
    side: str
    path: Path
    seconds: float


def render_site(
    scene: Scene,
    path_of: Callable[[Station, str], Path],
    write: Callable[[Path, NDArray[np.uint8]], None],
    *,
    samples: int = SAMPLES,
    supersample: float = SUPERSAMPLE,
    report: Callable[[PhotoTiming], None] | None = None,
) -> list[PhotoTiming]:
    """Take every photo of a visit that is not there yet; `write` must put the file in place whole."""
    made: list[PhotoTiming] = []
    for station in scene.stations:
        for side in SIDES:
            path = path_of(station, side)
            if path.exists():
                continue
            start = time.perf_counter()
            write(path, render(scene, station, side, samples, supersample))
            made.append(PhotoTiming(station=station.name, side=side, path=path, seconds=time.perf_counter() - start))
            if report is not None:
                report(made[-1])
    return made


@contextmanager
def _quiet() -> Iterator[None]:
    """Send Blender's own chatter on stdout to nowhere while it renders."""
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def main(arguments: list[str] | None = None) -> None:
    """Render one photo of a site to a picture file."""
    from asbuilt_synthetic.scene import scene as build_scene

    parser = argparse.ArgumentParser(prog="python -m asbuilt_synthetic.cycles", description=main.__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--visit", type=int, default=0)
    parser.add_argument("--station", required=True)
    parser.add_argument("--side", choices=SIDES, default="left")
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--supersample", type=float, default=SUPERSAMPLE)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args(arguments)
    site = build_scene(given.seed, given.visit)
    stations = {station.name: station for station in site.stations}
    if given.station not in stations:
        parser.error(
            f"no station {given.station!r} at visit {given.visit} of seed {given.seed}; there are {', '.join(stations)}"
        )
    start = time.perf_counter()
    photo = render(site, stations[given.station], given.side, given.samples, given.supersample)
    cv2.imwrite(str(given.out), cv2.cvtColor(photo, cv2.COLOR_RGB2BGR))
    sys.stdout.write(f"{given.out}: {time.perf_counter() - start:.1f} s\n")


if __name__ == "__main__":
    main()
