"""Writes a pair of twins with its exact truth: photos, which face each pixel shows, areas and what is in view whole.

The stations of a site get the same truth (`write_stations`); their photos lie in the site's own folder.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np

from asbuilt_synthetic.crowd import crowded_plan
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.lens import camera_of, in_frame, project, world_from_camera
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.model import CameraTruth, FloatArray, Scene, Station
from asbuilt_synthetic.scene import first_face
from asbuilt_synthetic.scene import scene as site_scene
from asbuilt_synthetic.truth import disc_truth, element_samples, pixel_truth
from asbuilt_synthetic.twins import plan
from asbuilt_synthetic.twins_scene import twin_scene

MARGIN_PX = 6.0  # within it an edge can't be distinguished from the photo's end
_QUALITY = 95
_PATHS = {"samples": 5, "supersample": 1.1}  # the denoiser keeps texture by its albedo: a third of a site photo's time


def write_twin(seed: int, folder: Path, renderer: str = "raycast", crowded: bool = False) -> None:
    """Write left.jpg, right.jpg, faces.png (number of the face + 1 in the distorted left photo) and truth.json."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = twin_scene(seed, crowded)
    station = scene.stations[0]
    render = import_module(f"asbuilt_synthetic.{renderer}").render
    options = _PATHS if renderer == "cycles" else {}
    for side in ("left", "right"):
        photo = np.ascontiguousarray(render(scene, station, side, **options)[..., ::-1])
        cv2.imwrite(str(folder / f"{side}.jpg"), photo, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    drawn = crowded_plan(seed) if crowded else plan(seed)
    objects = [{"kind": one.kind, "material": one.material} for one in drawn.objects]
    _write_truth(scene, station, objects, folder, renderer)


def write_stations(seed: int, out: Path, renderer: str = "raycast") -> None:
    """Write faces.png, depth_mm.png and truth.json for each station of a site's two visits; no photos."""
    for visit in range(2):
        scene = site_scene(seed, visit)
        objects = [{"kind": e.ifc_class, "material": ""} for e in scene.elements]
        exposed = _exposed_shares(scene)
        for station in scene.stations:
            folder = out / scene.day.isoformat() / station.name
            folder.mkdir(parents=True, exist_ok=True)
            _write_truth(scene, station, objects, folder, renderer, exposed)


def _exposed_shares(scene: Scene) -> dict[int, float]:
    """Return by the number of each face what share of its poured area no other concrete touches."""
    first, found = first_face(design(scene.seed)), dict[int, float]()
    for e, s in zip(scene.elements, element_samples(scene), strict=True):
        for side in np.unique(s.side[s.built]):
            own = s.built & (s.side == side)
            found[first[e.global_id] + int(side)] = float(s.area_m2[own & s.exposed].sum() / s.area_m2[own].sum())
    return found


def _write_truth(
    scene: Scene, station: Station, objects: Sequence[dict[str, str]], folder: Path, renderer: str,
    exposed: Mapping[int, float] = MappingProxyType({}),
) -> None:  # fmt: skip
    """Write what each pixel of the left photo shows, how far away, and all faces that it shows."""
    seen = pixel_truth(scene, station)
    labels = seen.face + 1
    cv2.imwrite(str(folder / "faces.png"), labels.astype(np.uint8))
    cv2.imwrite(str(folder / "depth_mm.png"), np.clip(1000.0 * seen.depth_m, 0.0, 65535.0).astype(np.uint16))
    pixels = np.bincount(labels.ravel(), minlength=len(scene.faces) + 1)[1:]
    truth = {**twin_truth(scene, station, pixels), "objects": list(objects), "renderer": renderer}
    for face in truth["faces"]:
        face["exposed_share"] = exposed.get(face["face"], 1.0)
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")


def in_camera(scene: Scene, station: Station, index: int) -> dict[str, Any]:
    """Tell where a face lies as a whole, seen or not, in the LEFT camera's frame: its triangles (M, 3, 3), its axis."""
    body = next(b for b in scene.bodies if (b.face_id == index).any())
    camera_from_world = np.linalg.inv(station.world_from_left)
    corners = transform(camera_from_world, body.vertices_m)[body.triangles[body.face_id == index]]
    face = scene.faces[index]
    return {
        "triangles_m": np.round(corners, 5).tolist(),
        "origin_m": transform(camera_from_world, face.origin_m[None])[0].tolist(),
        "normal": (camera_from_world[:3, :3] @ face.normal).tolist(),
    }


def twin_truth(scene: Scene, station: Station, pixels: np.ndarray) -> dict[str, Any]:
    """Tell rig, target and every face that the left photo shows; lengths in metres."""
    disc = disc_truth(scene, station)
    element = {e.global_id: k for k, e in enumerate(scene.elements)}
    return {
        "seed": scene.seed,
        "rig": {
            "left": camera_truth(scene.rig.left),
            "right": camera_truth(scene.rig.right),
            "right_from_left": scene.rig.right_from_left.tolist(),
        },
        "target": None if disc is None else {"depth_m": disc.depth_m, "range_m": disc.range_m},
        "faces": [
            {
                "face": k, "object": element[f.element],
                **face_truth(scene, station, k), **in_camera(scene, station, k),
            }
            for k, f in enumerate(scene.faces)
            if pixels[k] > 0
        ],
    }  # fmt: skip


def face_truth(scene: Scene, station: Station, index: int) -> dict[str, Any]:
    """Tell one face. Nothing stands before another here, so what is in the frame and faces both cameras is in view."""
    face = scene.faces[index]
    body = next(b for b in scene.bodies if (b.face_id == index).any())
    corners = body.vertices_m[body.triangles[body.face_id == index]].reshape(-1, 3)
    low, high = corners[:, 2].min(), corners[:, 2].max()
    whole = True
    for side in ("left", "right"):
        pose, camera = world_from_camera(scene.rig, station, side), camera_of(scene.rig, side)
        shown = corners
        if face.kind == "cylinder":
            shown = _shown_half(corners, face.origin_m, pose[:3, 3])
        elif (pose[:3, 3] - face.origin_m) @ face.normal <= 0.0:
            whole = False
        px = project(camera, transform(np.linalg.inv(pose), shown))
        whole &= bool(in_frame(camera, px, MARGIN_PX).all())
        if side == "left":
            level = np.c_[shown[:, :2], np.full(len(shown), np.clip(pose[2, 3], low, high))]
            across = float(np.ptp(project(camera, transform(np.linalg.inv(pose), level))[:, 0]))
            narrow = min(across, float(np.ptp(px[:, 1])))
    way = station.world_from_left[:3, 3] - face.origin_m
    cosine = float(way @ face.normal / np.linalg.norm(way)) if face.kind == "plane" else 1.0
    return {
        "kind": face.kind,
        "area_m2": face.design_area_m2,
        "radius_m": face.radius_m,
        "height_m": float(high - low),
        "whole": whole,
        "narrow_px": narrow,
        "distance_m": float(np.linalg.norm(way)),
        "level_distance_m": float(np.linalg.norm(way[:2])),  # of a round one, to its axis
        "incidence_deg": float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)))),
    }


def _shown_half(corners: FloatArray, axis_m: FloatArray, eye_m: FloatArray) -> FloatArray:
    out = corners[:, :2] - axis_m[:2]
    radius = np.linalg.norm(out, axis=1)
    return corners[((eye_m[:2] - axis_m[:2]) * out).sum(1) >= radius**2 - 1e-9]


def camera_truth(c: CameraTruth) -> dict[str, Any]:
    return {"K": c.K.tolist(), "distortion": c.distortion.tolist(), "width_px": c.width_px, "height_px": c.height_px}


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the pairs of some seeds, or the truth at the stations of sites; those that are there already are kept."""
    parser = argparse.ArgumentParser(prog="python -m asbuilt_synthetic.twins_truth", description=main.__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--renderer", choices=["raycast", "cycles"], default="raycast")
    parser.add_argument("--crowded", action="store_true", help="bodies before one another, some cut by the frame")
    parser.add_argument("--stations", action="store_true", help="the stations of sites in the place of twins")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args(arguments)
    for seed in given.seeds:
        if given.stations:
            write_stations(seed, given.out / f"site-{seed}")
            continue
        folder = given.out / f"twin-{seed}-{'crowded' if given.crowded else given.renderer}"
        if not (folder / "truth.json").exists():
            write_twin(seed, folder, given.renderer, given.crowded)


if __name__ == "__main__":
    main()
