"""Twins, crowded and bare ones, with the truth of every border and every area of every face in them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, rectification
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.planes.face_hypotheses import filled
from benchmarks.faces.twins import TwinPair, load_twin
from benchmarks.sites import ROOT, benchmark_folder, generated_site

BEYOND_PX = 700  # a face is drawn this far past the frame
END_PX, SIGMAS = 3.0, 2.5
"""An outline lies on a face's end within 3 px or 2.5 of the side's sigmas: how sure a place is, sigma tells."""
DRAWN_PX = 0.5
"""OpenCV's filled polygons hold the pixels of their border."""
LACKS = 0.03
"""An outline is whole where it holds all but so much of its face, or all but 3 px of the width of a narrow one."""
NEAR_CAMERA_M = 0.3
FAR_M = 9.8  # what lies further is the yard, which is no body of the truth
_AROUND = np.ones((3, 3), np.uint8)
Image = TypeVar("Image", BoolArray, FloatArray)


@dataclass(frozen=True, slots=False, kw_only=True, eq=False)
class TrueFace:
    """One face of one body: all of it, seen or not, as the rectified left photo would show it past its own frame."""

    number: int
    kind: str
    extent: BoolArray  # (H + 2 BEYOND, W + 2 BEYOND)
    seen: BoolArray  # (H, W) what the left photo shows of it
    area_m2: float  # of all of it that turns to the camera, and that no other concrete touches
    area_per_pixel_m2: FloatArray  # as `extent`: of the surface that a pixel sees

    @cached_property
    def off_end_px(self) -> FloatArray:
        """Return how far inside (positive) or outside its end each place of `extent` lies."""
        inside, outside = (
            cv2.distanceTransform(area.astype(np.uint8), cv2.DIST_L2, 5) for area in (self.extent, ~self.extent)
        )
        return np.asarray(np.where(self.extent, inside - 0.5, 0.5 - outside) - DRAWN_PX, dtype=np.float64)

    @cached_property
    def narrow_px(self) -> float:
        """Return the narrow side of its extent in the photo."""
        points = cv2.findNonZero(self.extent.astype(np.uint8))
        return float(min(cv2.minAreaRect(points)[1])) if points is not None else 0.0

    @property
    def seen_m2(self) -> float:
        """Return the area of what the left photo shows of it."""
        return self.within_m2(self.seen)

    def within_m2(self, outline: BoolArray) -> float:
        """Return how much of it, seen or not, an outline (H, W) holds.

        Next to a tangent of a round column a pixel sees a tenth of its lateral surface, though the pixel's middle lies
        past it: such a pixel is held where its neighbour is.
        """
        if self.kind == "cylinder":
            inner = cv2.erode(self.extent.astype(np.uint8), _AROUND) > 0
            outline = outline | (
                self._framed(self.extent & ~inner) & (cv2.dilate(outline.astype(np.uint8), _AROUND) > 0)
            )
        return float(self._framed(self.area_per_pixel_m2)[outline].sum())

    def at_end(self, points: FloatArray, sigma_px: float) -> BoolArray:
        """Say which places (N, 2) of a side lie on its end."""
        x, y = (np.round(points).astype(np.intp) + BEYOND_PX).T
        height, width = self.extent.shape
        off = self.off_end_px[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
        return np.asarray(np.abs(off) <= max(END_PX, SIGMAS * sigma_px))

    def _framed(self, image: Image) -> Image:
        return image[BEYOND_PX:-BEYOND_PX, BEYOND_PX:-BEYOND_PX]


def crowded_twin(seed: int) -> TwinPair:
    """Make (or find) a seed's crowded pair and read it."""
    folder = benchmark_folder() / "twins"
    own = folder_of(seed)
    if not (own / "truth.json").exists():
        kind = ["--crowded"] if is_crowded(seed) else []
        _make_truth("--seeds", str(seed), *kind, "--out", str(folder))
    return load_twin(own)


def station_twins(seed: int) -> Iterator[tuple[str, TwinPair]]:
    """Make (or find) the truth at every station of a site, and read it as the pair of a twin is read."""
    site, folder = generated_site(seed), benchmark_folder() / "stations"
    if not (folder / f"site-{seed}" / "complete").exists():
        _make_truth("--seeds", str(seed), "--stations", "--out", str(folder))
        (folder / f"site-{seed}" / "complete").touch()
    for own in sorted(path.parent for path in (folder / f"site-{seed}").glob("*/*/truth.json")):
        date, station = own.parts[-2:]
        yield f"site {seed} {date} {station}", load_twin(own, photos=site / "visits" / date / f"{station}_")


def _make_truth(*options: str) -> None:
    path = os.pathsep.join([str(ROOT / "synthetic"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "asbuilt_synthetic.twins_truth", *options]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": path})


def true_faces(twin: TwinPair) -> dict[int, TrueFace]:
    """Return every face of the twin that its left photo shows, by its number."""
    found = (_true_face(twin, face) for face in twin.truth["faces"])
    return {face.number: face for face in found if face is not None}


def _true_face(twin: TwinPair, face: dict[str, Any]) -> TrueFace | None:
    camera = twin.pair.camera
    triangles = np.array(face["triangles_m"])
    if (triangles @ camera.rectified_from_left.T)[..., 2].min() < NEAR_CAMERA_M:
        return None
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    facing = np.sum(across * triangles[:, 0], axis=1) < 0.0
    extent = np.zeros((camera.height_px + 2 * BEYOND_PX, camera.width_px + 2 * BEYOND_PX), np.uint8)
    for corners in camera.project(triangles[facing]):
        cv2.fillConvexPoly(extent, np.round((corners + BEYOND_PX) * 16.0).astype(np.int32), 1, shift=4)
    area_m2 = 0.5 * float(np.linalg.norm(across[facing], axis=1).sum())
    if face["kind"] == "cylinder":  # between the tangents
        area_m2 = (
            2.0 * face["radius_m"] * float(np.arccos(face["radius_m"] / face["level_distance_m"])) * face["height_m"]
        )
    each = _per_pixel_m2(face, camera, extent > 0)
    return TrueFace(
        number=face["face"], kind=face["kind"], extent=extent > 0, seen=twin.labels == face["face"] + 1,
        area_m2=area_m2 * face.get("exposed_share", 1.0),
        area_per_pixel_m2=each * (area_m2 / max(float(each.sum()), 1e-9)),
    )  # fmt: skip


def _per_pixel_m2(face: dict[str, Any], camera: RectifiedCamera, extent: BoolArray) -> FloatArray:
    """Return the surface that each pixel of `extent` sees: of a plane, or of an upright cylinder by its own normals."""
    rows, columns = np.nonzero(extent)
    x, y = columns - BEYOND_PX - camera.cx_px, rows - BEYOND_PX - camera.cy_px
    rays = np.stack([x, y, np.full(x.shape, camera.f_px)], axis=-1) / camera.f_px
    origin, normal = (camera.rectified_from_left @ np.array(face[key]) for key in ("origin_m", "normal"))
    found = np.zeros(extent.shape)
    if face["kind"] == "plane":
        found[rows, columns] = float(normal @ origin) ** 2 / np.maximum(np.abs(rays @ normal), 1e-3) ** 3
    else:
        found[rows, columns] = _of_cylinder(face["radius_m"], origin, normal, rays, camera.f_px) * camera.f_px**2
    return np.asarray(found / camera.f_px**2)


def _of_cylinder(radius_m: float, origin: FloatArray, axis: FloatArray, rays: FloatArray, f_px: float) -> FloatArray:
    """Return the lateral surface that each pixel (N,) sees: its angle round the axis times its height, both exact.

    Per steradian it grows without end towards the tangents; between a pixel's edges the angle doesn't.
    """
    centre = origin - (origin @ axis) * axis
    away = float(np.linalg.norm(centre))
    ahead = centre / away
    across = np.cross(axis, ahead)
    tangent = np.arcsin(radius_m / away)

    def swing(shift_px: float) -> FloatArray:
        """Return the rays' angle against the axis' direction, in plan, at a pixel's edge; no further than a tangent."""
        moved = rays + np.array([shift_px / f_px, 0.0, 0.0])
        return np.clip(np.arctan2(moved @ across, moved @ ahead), -tangent, tangent)

    def round_axis(angle: FloatArray) -> FloatArray:
        """Return where on the column a ray of such an angle ends, as an angle round its axis."""
        return np.arcsin(np.clip(away * np.sin(angle) / radius_m, -1.0, 1.0)) - angle

    turned = np.abs(round_axis(swing(0.5)) - round_axis(swing(-0.5)))
    angle = swing(0.0)
    level_m = away * np.cos(angle) - np.sqrt(np.maximum(radius_m**2 - (away * np.sin(angle)) ** 2, 0.0))
    in_plan = np.linalg.norm(rays - (rays @ axis)[:, None] * axis, axis=1)
    return np.asarray(radius_m * turned * level_m * abs(float(axis[1])) / (f_px * in_plan))


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What is true of a measured face: the body's face that it shows most of, and areas in m2; none: no concrete."""

    number: int  # -1: of no body
    share: float  # of its outline that this face fills, as seen
    true_m2: float
    seen_m2: float
    held_m2: float  # of the true face, seen or not, within the outline
    narrow_px: float
    is_background: bool


def is_whole(held_m2: float, true_m2: float, narrow_px: float) -> bool:
    """Say whether an outline that holds so much of a face is cut nowhere: its borders err by 3 px together, or 3 %."""
    return held_m2 >= (1.0 - max(LACKS, END_PX / max(narrow_px, END_PX))) * true_m2


def judged(twin: TwinPair, faces: dict[int, TrueFace], found: MeasuredFace, depth_m: FloatArray) -> Judged:
    """Hold a measured face against the truth."""
    inside = filled([np.asarray(ring) for ring in found.outline_px], twin.labels.shape)
    counts = np.bincount(twin.labels[inside], minlength=256)
    size = max(int(counts.sum()), 1)
    behind = bool(np.median(depth_m[inside]) > FAR_M) if inside.any() else True
    counts[0] = 0
    best = int(np.argmax(counts))
    if best - 1 not in faces or counts[best] < 0.5 * size:
        any_share = float(counts.sum()) / size
        return Judged(
            number=-1, share=any_share, true_m2=0.0, seen_m2=0.0, held_m2=0.0, narrow_px=0.0, is_background=behind
        )
    true = faces[best - 1]
    return Judged(
        number=true.number, share=counts[best] / size, true_m2=true.area_m2, seen_m2=true.seen_m2,
        held_m2=true.within_m2(inside), narrow_px=true.narrow_px, is_background=False,
    )  # fmt: skip


def true_depth_m(twin: TwinPair, seed: int) -> FloatArray:
    """Return the true depth (H, W) in metres in the rectified left photo; 65 where sky."""
    image = cv2.imread(str(folder_of(seed) / "depth_mm.png"), cv2.IMREAD_UNCHANGED)
    prepared = rectification(twin.rig)
    laid = cv2.remap(image, np.array(prepared.left_map), None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(laid, dtype=np.float64) / 1000.0


def folder_of(seed: int) -> Path:
    """Return where a seed's pair lies."""
    return benchmark_folder() / "twins" / f"twin-{seed}-{'crowded' if is_crowded(seed) else 'raycast'}"


def is_crowded(seed: int) -> bool:
    """Say whether a seed's scene is crowded: the latter half of each hundred is bare."""
    return seed % 100 < 50
