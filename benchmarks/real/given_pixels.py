"""A face's plane if someone had told which pixels lie on it: that is what its sigma takes for granted.

The truth names the pixels of an outline that lie on its one plane, and gives the start. The program refines the plane
on them as it does. What then is off is the pictures' noise, the rig and the matching; the rest of a face's error is
that the wrong pixels were taken for one face.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.disparity_plane import plane_of
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.pair import PairMeasurement
from asbuilt_bim.measure.planes.halves import as_halves_agree
from asbuilt_bim.measure.planes.refine import Pictures, pictures, refine_plane
from asbuilt_bim.measure.sigma.area import image_sigma_m2, rings_area_m2
from asbuilt_bim.vision.stereo.matching import grey
from benchmarks.real.shots import Shot
from benchmarks.real.truth_planes import TRUTH, TruthPlane, angle_deg


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Area of the outline on the plane that was refined on given pixels, its sigma, and its tilt to the truth's."""

    area_m2: float
    sigma_m2: float
    tilt_deg: float


UNKNOWN = Given(area_m2=float("nan"), sigma_m2=float("nan"), tilt_deg=float("nan"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rectified:
    """A measured pair made ready: its pictures, rays (H, W, 3), and where each pixel lies in the original left photo.

    That place is rounded, and outside the photo where it has none.
    """

    both: Pictures
    rays: FloatArray
    at: tuple[FloatArray, FloatArray]  # columns, rows


def rectified(shot: Shot, found: PairMeasurement) -> Rectified:
    """Make a measured pair ready."""
    pair = found.detail.pair
    rows, columns = np.indices(pair.valid_left.shape)
    pixels = np.stack([columns, rows], axis=-1).astype(np.float64)
    left_rays = pair.camera.rays(pixels)
    at = np.round(shot.rig.left.project(left_rays))
    return Rectified(
        both=pictures(grey(pair.left), grey(pair.right), pair.valid_right),
        rays=left_rays @ pair.camera.rectified_from_left.T,
        at=(at[..., 0], at[..., 1]),
    )


def given_pixels(
    shot: Shot, found: PairMeasurement, ready: Rectified, face: MeasuredFace, truth: TruthPlane, mask: BoolArray
) -> Given:
    """Refine the truth's plane on its own pixels within an outline's `mask` (H, W of the original photo)."""
    assert shot.truth_px is not None
    camera = found.detail.pair.camera
    rays = shot.rays()
    with np.errstate(invalid="ignore"):
        on_plane = mask & (np.abs(shot.truth_px - rays @ truth.q_px) < TRUTH.of(shot.truth_px))
    columns, rows = (values.astype(np.intp) for values in ready.at)
    height, width = mask.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    used = _without_border(inside & on_plane[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)])
    # q turns with the frame, and grows with f b
    scale = camera.f_px * camera.baseline_m / shot.focal_baseline
    start = camera.rectified_from_left @ truth.q_px * scale
    fit = refine_plane(ready.both, ready.rays, used, start)
    if fit is None:
        return UNKNOWN
    fit = as_halves_agree(fit)
    plane = plane_of(fit.q_px, camera.f_px * camera.baseline_m)
    true = plane_of(start, camera.f_px * camera.baseline_m)
    rings = face.outline_px
    return Given(
        area_m2=rings_area_m2(rings, fit.q_px, camera),
        sigma_m2=image_sigma_m2(rings, (), 0.0, fit.q_px, fit.covariance, camera),
        tilt_deg=angle_deg(plane.normal, true.normal),
    )


def _without_border(used: BoolArray) -> BoolArray:
    """Leave out 2 px along the border, as the program does; what the truth doesn't show within is no border."""
    whole = cv2.morphologyEx(used.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    return used & (cv2.erode(whole, np.ones((5, 5), np.uint8), borderValue=0) > 0)
