"""Pictures that networks are judged on: small ray-cast pairs of sites never trained on, drawn once, with their truth.

python benchmarks/networks/pictures.py 20 21      draws the pairs of these seeds that aren't there yet

A seed gives two visits of five stations at 640 x 480. One file a visit, networks/pairs-SEED-VISIT.npz of the benchmark
folder: the photos as the lens drew them, and of each left pixel the element and 1/Z.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_synthetic.model import CameraTruth, RigTruth, Station
from asbuilt_synthetic.model import Scene as TrueScene
from asbuilt_synthetic.raycast import render
from asbuilt_synthetic.rig import rig_truth
from asbuilt_synthetic.scene import scene as true_scene
from asbuilt_synthetic.truth import pixel_truth
from asbuilt_synthetic.twins_scene import twin_scene

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import Rectification, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from benchmarks.faces.twins import twin_folder
from benchmarks.sites import SAMPLE, benchmark_folder

REPORTING_SEEDS = tuple(range(118, 138))
DEVELOPMENT_SEEDS = (20, 24)
VISITS = (0, 1)
SAMPLE_SEED, SAMPLE_VISITS = 7, ("2026-03-02", "2026-03-16")
STATIONS = 5
WIDTH_PX = 640
TRIES = 300
"""Places tried for five stations; the sites of benchmarks/site/site.py try 1200 and see more of the building."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """One rectified pair with the truth of its left photo: element number + 1 (0 none) and 1/Z (0 sky), (H, W).

    `kinds` names each element, "wall" or "column".
    """

    pair: RectifiedPair
    element: NDArray[np.int32]
    inverse_depth_per_m: NDArray[np.float32]
    kinds: tuple[str, ...]


def small_rig(rig: RigTruth) -> RigTruth:
    """Return the rig with its photos shrunk to 640 px of width."""
    return replace(rig, left=_small(rig.left), right=_small(rig.right))


def _small(camera: CameraTruth) -> CameraTruth:
    scale = WIDTH_PX / camera.width_px
    height = round(camera.height_px * scale)
    shrink = np.array([[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0.0, 0.0, 1.0]])
    return replace(camera, K=shrink @ camera.K, width_px=WIDTH_PX, height_px=height)


def rig_of(rig: RigTruth) -> StereoRig:
    """Return a rig as it was drawn, without a covariance."""
    left, right = (
        Intrinsics(K=c.K, distortion=c.distortion, width_px=c.width_px, height_px=c.height_px)
        for c in (rig.left, rig.right)
    )
    return StereoRig(left=left, right=right, right_from_left=rig.right_from_left, covariance=np.zeros((14, 14)))


def kinds_of(scene: TrueScene) -> tuple[str, ...]:
    """Return "wall" or "column" of each element."""
    return tuple("column" if "Column" in element.ifc_class else "wall" for element in scene.elements)


def shot_of(
    prepared: Rectification,
    photos: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    owner: NDArray[np.int32],
    depth_m: NDArray[np.floating[Any]],
    kinds: tuple[str, ...],
    name: str,
) -> Shot:
    """Rectify a pair (BGR) and carry the truth of its left photo, -1 and inf where there is nothing, along."""
    pair = rectify(prepared, *photos, name)
    height, width = pair.valid_left.shape

    def carried(truth: NDArray[np.float32]) -> NDArray[np.float32]:
        maps = np.array(prepared.left_map)
        return np.asarray(cv2.remap(truth, maps, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT))

    element = carried((owner + 1).astype(np.float32)).astype(np.int32)
    inverse = carried((1.0 / depth_m).astype(np.float32))
    y, x = np.mgrid[0:height, 0:width]
    ahead = pair.camera.rays(np.stack([x, y], axis=-1))[..., 2]  # Z of the left camera for each of the rectified one
    return Shot(
        pair=pair, element=np.where(pair.valid_left, element, 0), kinds=kinds,
        inverse_depth_per_m=(inverse * ahead).astype(np.float32),
    )  # fmt: skip


def drawn_visit(seed: int, visit: int) -> Path:
    """Draw (or find) the pairs of a visit; its file holds no pair where the site offers too few stations."""
    path = benchmark_folder() / "networks" / f"pairs-{seed}-{visit}.npz"
    if path.exists():
        return path
    path.parent.mkdir(exist_ok=True)
    try:
        drawn = true_scene(seed, visit, STATIONS, TRIES)
    except RuntimeError:
        drawn = None
    rows = [_drawn(replace(drawn, rig=small_rig(drawn.rig)), station) for station in drawn.stations] if drawn else []
    held = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    fresh = path.with_suffix(".part.npz")
    np.savez_compressed(fresh, **held, kinds=np.array(kinds_of(drawn) if drawn else (), dtype=np.str_))
    fresh.replace(path)
    return path


def _drawn(scene: TrueScene, station: Station) -> dict[str, NDArray[np.generic]]:
    truth = pixel_truth(scene, station)
    left, right = (render(scene, station, side)[..., ::-1] for side in ("left", "right"))
    owner = truth.element.astype(np.int16)
    return {"left": left, "right": right, "owner": owner, "depth_m": truth.depth_m.astype(np.float32)}


def drawn_shots(seeds: tuple[int, ...]) -> Iterator[Shot]:
    """Give the pairs of seeds, one by one."""
    for seed in seeds:
        prepared = rectification(rig_of(small_rig(rig_truth(seed))))
        for visit in VISITS:
            with np.load(drawn_visit(seed, visit), allow_pickle=False) as held:
                kinds = tuple(str(kind) for kind in held["kinds"])
                rows = {name: held[name] for name in ("left", "right", "owner", "depth_m") if name in held}
            for k in range(len(rows.get("left", ()))):
                photos = (np.ascontiguousarray(rows["left"][k]), np.ascontiguousarray(rows["right"][k]))
                name = f"{seed}-{visit}-{k}"
                yield shot_of(prepared, photos, rows["owner"][k].astype(np.int32), rows["depth_m"][k], kinds, name)


def sample_shots(stations: tuple[int, ...], visits: tuple[int, ...] = VISITS) -> Iterator[Shot]:
    """Give the shipped sample's path-traced pairs."""
    for visit in visits:
        scene = true_scene(SAMPLE_SEED, visit)
        prepared = rectification(rig_of(scene.rig))
        for station in (scene.stations[k] for k in stations):
            folder = SAMPLE / "visits" / SAMPLE_VISITS[visit]
            yield _photographed(scene, station, prepared, folder, f"{station.name}_")


def twin_shots(seeds: tuple[int, ...]) -> Iterator[Shot]:
    """Give path-traced pairs of specimens on open ground."""
    for seed in seeds:
        scene = twin_scene(seed)
        folder = twin_folder(seed, "cycles")
        yield _photographed(scene, scene.stations[0], rectification(rig_of(scene.rig)), folder, "")


def _photographed(scene: TrueScene, station: Station, prepared: Rectification, folder: Path, prefix: str) -> Shot:
    left, right = (cv2.imread(str(folder / f"{prefix}{side}.jpg")) for side in ("left", "right"))
    truth = pixel_truth(scene, station)
    return shot_of(prepared, (left, right), truth.element, truth.depth_m, kinds_of(scene), f"{folder.name} {prefix}")


if __name__ == "__main__":
    for number in sys.argv[1:]:
        for occasion in VISITS:
            print(drawn_visit(int(number), occasion))
