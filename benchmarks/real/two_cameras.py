"""One wall by a wide and by a narrow pair of cameras: no truth, but both must say the same.

Where the two left cameras stand to each other isn't published. It comes from features in both photos: the wide pair's
depth gives them their places, and the narrow photo its own pose and principal point. So faces may differ by what that
pose leaves open, and their lines only inform.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.errors import MeasureError
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import apply, rigid
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.measure.planes.face_hypotheses import filled
from asbuilt_bim.vision.stereo.matching import grey
from benchmarks.real.face_truth import area_on, middle
from benchmarks.real.scenes import NARROW_BASELINE_M, NARROW_F_PX, STEREO, wide_shot
from benchmarks.real.shots import Shot, photos_of, rectified_rig, size_of
from benchmarks.real.truth_planes import angle_deg
from benchmarks.table import Line, told

SHARED = 0.5
"""Of the smaller of two faces, to be taken for one wall."""
LEAST_MATCHES, RATIO = 30, 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Both:
    """One wall by both pairs: tilt between the planes, how far they are apart by distance, and the areas' ratio less 1.

    The area is that of the narrow face's outline on either plane.
    """

    tilt_deg: float
    apart_share: float
    area_off: float


def two_camera_lines(name: str, measured: Callable[[Shot], PairMeasurement | MeasureError]) -> list[Line]:
    """Measure `NAME`l and `NAME`s and tell how their faces agree."""
    left = STEREO / f"eth3d_pairs/{name}s/im0.png"
    wide, its = measured(wide_shot(f"{name}l")), photos_of(f"{name}s", left, left.with_name("im1.png"))
    what = f"{name}, wide beside narrow camera"
    if isinstance(wide, MeasureError):
        return [told(f"{what}: the wide pair was refused", "", 0)]
    placed = _narrow_camera(wide, left, size_of(its.left))
    if placed is None:
        return [told(f"{what}: too few features in both", "", 0)]
    centre, narrow_from_wide, matches = placed
    rig = rectified_rig(NARROW_F_PX, centre, NARROW_BASELINE_M, size_of(its.left))
    narrow = measured(Shot(photos=its, rig=rig))
    if isinstance(narrow, MeasureError):
        return [told(f"{what}: the narrow pair was refused", "", 0)]
    pairs = [both for face in narrow.faces if (both := _same_wall(face, narrow, wide, narrow_from_wide)) is not None]
    lines = [told(f"{what}: faces of each, in both", f"{len(wide.faces)}, {len(narrow.faces)}, {len(pairs)}", matches)]
    for both in pairs:
        text = f"{both.tilt_deg:.1f} deg, {both.apart_share:+.1%}, {both.area_off:+.1%}"
        lines.append(told("  tilt, offset by distance, area on the wide plane", text, 1))
    return lines


def _narrow_camera(
    wide: PairMeasurement, left: Path, size_px: tuple[int, int]
) -> tuple[tuple[float, float], FloatArray, int] | None:
    """Return the narrow camera's principal point, its pose (4, 4), and the number of features that gave them."""
    points, pixels = _features(wide, left)
    if len(points) < LEAST_MATCHES:
        return None
    K = np.array([[NARROW_F_PX, 0.0, 0.5 * size_px[0]], [0.0, NARROW_F_PX, 0.5 * size_px[1]], [0.0, 0.0, 1.0]])
    found, _, _, inside = cv2.solvePnPRansac(points, pixels, K, np.zeros(5), reprojectionError=8.0)
    if not found or inside is None or len(inside) < LEAST_MATCHES:
        return None
    kept = inside.ravel()
    fixed = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_FOCAL_LENGTH | cv2.CALIB_ZERO_TANGENT_DIST
    fixed |= cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    _, K, _, turns, shifts = cv2.calibrateCamera(
        [points[kept].astype(np.float32)], [pixels[kept].astype(np.float32)], size_px, K, np.zeros(5), flags=fixed
    )
    centre = float(K[0, 2]), float(K[1, 2])
    return centre, rigid(np.asarray(turns[0]).ravel(), np.asarray(shifts[0]).ravel()), len(kept)


def _features(wide: PairMeasurement, left: Path) -> tuple[FloatArray, FloatArray]:
    """Return places (N, 3) by the wide pair's depth and pixels (N, 2) in the narrow photo of what both show."""
    pair, disparity = wide.detail.pair, wide.detail.depth.disparity_px
    sift = cv2.SIFT.create(8000)
    images = [np.asarray(cv2.imread(str(left), cv2.IMREAD_GRAYSCALE)), grey(pair.left).astype(np.uint8)]
    (narrow_at, narrow), (wide_at, its) = (sift.detectAndCompute(image, None) for image in images)
    pairs = cv2.BFMatcher().knnMatch(narrow, its, k=2)
    good = [one for one, two in pairs if one.distance < RATIO * two.distance]
    at = np.array([wide_at[one.trainIdx].pt for one in good]).reshape(-1, 2)
    pixels = np.array([narrow_at[one.queryIdx].pt for one in good]).reshape(-1, 2)
    d = disparity[np.round(at[:, 1]).astype(np.intp), np.round(at[:, 0]).astype(np.intp)]
    known = np.isfinite(d) & (d > 2.0)
    return pair.camera.points(at[known], d[known]), pixels[known]


def _same_wall(
    face: MeasuredFace, narrow: PairMeasurement, wide: PairMeasurement, narrow_from_wide: FloatArray
) -> Both | None:
    """Find the wide pair's face of a narrow one's wall and compare their planes."""
    camera = narrow.detail.pair.camera
    shape = (camera.height_px, camera.width_px)
    if not isinstance(face.frame, PlaneFrame):
        return None
    own, best, most = filled(face.outline_px, shape), None, SHARED
    for other in wide.faces:
        if not isinstance(other.frame, PlaneFrame):
            continue
        ring = camera.project(apply(narrow_from_wide, other.frame.from_uv(other.outline_uv_m[0])))
        if not np.all(np.isfinite(ring)):
            continue
        mask = filled([ring], shape)
        share = np.count_nonzero(own & mask) / max(1, min(np.count_nonzero(own), np.count_nonzero(mask)))
        if share > most:
            best, most = other.frame.moved(narrow_from_wide), share
    if best is None:
        return None
    on_wide = area_on(best.plane, [camera.rays(ring) for ring in face.outline_px])
    return Both(
        tilt_deg=angle_deg(best.normal, face.frame.normal),
        apart_share=float(best.plane.distance_m(middle(face))) / face.distance_m,
        area_off=on_wide / face.area_m2 - 1.0,
    )
