"""Twins of the paper's experiments: made once (or found), read back as rectified pairs with the truth beside them."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.planes.face_hypotheses import filled
from asbuilt_bim.measure.station_faces import FaceOptions, StationFaces, measure_faces
from asbuilt_bim.measure.workbench import marks_mask
from asbuilt_bim.vision.markers.find import find_markers
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.scene.bars import without_bars
from asbuilt_bim.vision.scene.geometric import segment_scene
from asbuilt_bim.vision.scene.read import Scene, read_scene
from asbuilt_bim.vision.scene.sky import find_sky
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from asbuilt_bim.vision.target.find import TargetOptions, TargetSighting, find_target
from benchmarks.sites import ROOT, benchmark_folder

RAYCAST_SEEDS = (*range(100, 146), *range(154, 164))
CYCLES_SEEDS = tuple(range(146, 154))
TARGET_DIAMETER_M = 0.30


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TwinPair:
    """One pair with its truth; `labels` (H, W) is the number of the face + 1 in the RECTIFIED left photo, 0 none."""

    name: str
    pair: RectifiedPair
    rig: StereoRig
    labels: NDArray[np.uint8]
    truth: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Read:
    """What stereo and the target finder say of a pair, once for all ways to measure it."""

    twin: TwinPair
    scene: Scene
    target: TargetSighting | None
    marks: NDArray[np.bool_]
    sky: NDArray[np.bool_]


def twin_folder(seed: int, renderer: str) -> Path:
    """Make (or find) the pair of a seed; making needs `pip install -e synthetic`, and bpy for "cycles"."""
    folder = benchmark_folder() / "twins"
    own = folder / f"twin-{seed}-{renderer}"
    if not (own / "truth.json").exists():
        command = [sys.executable, "-m", "asbuilt_synthetic.twins_truth", "--seeds", str(seed)]
        command += ["--renderer", renderer, "--out", str(folder)]
        path = os.pathsep.join([str(ROOT / "synthetic"), os.environ.get("PYTHONPATH", "")])
        if subprocess.run(command, check=False, env={**os.environ, "PYTHONPATH": path}).returncode != 0:
            raise SystemExit(f"twin {seed}: no pair could be made by {renderer}; it needs: pip install -e synthetic")
    return own


def cycles_seeds() -> tuple[int, ...]:
    """Return the seeds of the path-traced pairs that are there or can be made; without Blender's wheel, say so."""
    folder = benchmark_folder() / "twins"
    if importlib.util.find_spec("bpy") is not None:
        return CYCLES_SEEDS
    there = tuple(seed for seed in CYCLES_SEEDS if (folder / f"twin-{seed}-cycles" / "truth.json").exists())
    if there != CYCLES_SEEDS:
        left_out = len(CYCLES_SEEDS) - len(there)
        print(f"{left_out} path-traced pairs are left out: they need pip install -e synthetic[cycles]", file=sys.stderr)
    return there


def load_twin(folder: Path, rig: StereoRig | None = None, photos: Path | None = None) -> TwinPair:
    """Read a pair and rectify it, with its true rig unless another is given.

    `photos`: what left.jpg and right.jpg are called where they lie elsewhere, up to "left.jpg" and "right.jpg".
    """
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    chosen = rig if rig is not None else true_rig(truth)
    prepared = rectification(chosen)
    start = f"{folder}/" if photos is None else str(photos)
    left, right = (cv2.imread(f"{start}{side}.jpg") for side in ("left", "right"))
    faces = cv2.imread(str(folder / "faces.png"), cv2.IMREAD_UNCHANGED)
    labels = cv2.remap(faces, np.array(prepared.left_map), None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return TwinPair(
        name=folder.name, pair=rectify(prepared, left, right, folder.name), rig=chosen, labels=labels, truth=truth
    )


def true_rig(truth: dict[str, Any]) -> StereoRig:
    """Return the rig as it was drawn: known all but exactly, where zeros would mean that nobody knows."""
    left, right = (
        Intrinsics(
            K=np.array(c["K"]), distortion=np.array(c["distortion"]), width_px=c["width_px"], height_px=c["height_px"]
        )
        for c in (truth["rig"]["left"], truth["rig"]["right"])
    )
    pose = np.array(truth["rig"]["right_from_left"])
    return StereoRig(left=left, right=right, right_from_left=pose, covariance=1e-18 * np.eye(14))


def read_twin(twin: TwinPair) -> Read:
    """Match, read the surfaces and find the target."""
    target, _ = find_target(twin.pair, TargetOptions(diameter_m=TARGET_DIAMETER_M))
    marks = marks_mask(twin.pair.valid_left.shape, find_markers(twin.pair), target)
    depth = depth_map(twin.pair, SemiGlobalMatcher())
    scene = without_bars(read_scene(twin.pair, depth), twin.pair, marks)
    return Read(twin=twin, scene=scene, target=target, marks=marks, sky=find_sky(twin.pair, depth))


def measured(read: Read, true_masks: bool) -> StationFaces:
    """Measure all faces, with the truth's instances or with the program's own."""
    pair = read.twin.pair
    instances = true_instances(read.twin) if true_masks else segment_scene(pair, read.scene)
    return measure_faces(pair, read.scene, instances, read.twin.rig, FaceOptions(), read.marks, read.sky)


def true_instances(twin: TwinPair) -> list[Instance]:
    """Hand out the true masks, one an object, as a perfect segmenter would."""
    found: list[Instance] = []
    for number, what in enumerate(twin.truth["objects"]):
        faces = [f["face"] + 1 for f in twin.truth["faces"] if f["object"] == number]
        mask = np.isin(twin.labels, faces)
        if not mask.any():
            continue
        x, y, width, height = cv2.boundingRect(mask.astype(np.uint8))
        label = "wall" if what["kind"] == "wall" else "column"
        box = (x, y, x + width, y + height)
        found.append(Instance(label=label, score=1.0, mask=mask, box_px=box, source=InstanceSource.GIVEN))
    return found


def by_truth(twin: TwinPair, faces: tuple[MeasuredFace, ...]) -> dict[int, MeasuredFace]:
    """Return, by true face number, the measured face that shares most with it; half of a measured one must be it."""
    best: dict[int, tuple[float, MeasuredFace]] = {}
    sizes = np.bincount(twin.labels.ravel(), minlength=256)
    for face in faces:
        inside = filled([np.asarray(ring) for ring in face.outline_px], twin.labels.shape)
        counts = np.bincount(twin.labels[inside], minlength=256)
        counts[0] = 0
        label = int(np.argmax(counts))
        shared = float(counts[label])
        if shared < 0.5 * np.count_nonzero(inside):
            continue
        union = sizes[label] + np.count_nonzero(inside) - shared
        if shared / union > best.get(label - 1, (0.0, face))[0]:
            best[label - 1] = (shared / union, face)
    return {number: face for number, (_, face) in best.items()}
