"""Fixed patches of a rig at rest: squares of the photo that lie on one plane, measured again in every frame.

A patch is a polygon of the picture that never changes. So what its area scatters by is its plane's noise alone, and
the plane's part of the image sigma has to say how much. OpenCV's plain matching chooses the patches: the evenest
squares first, no two in touch. So they stay the same ones whatever the program's own matching becomes.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.geometry.disparity_plane import fit_q
from asbuilt_bim.measure.planes.halves import as_halves_agree
from asbuilt_bim.measure.planes.refine import Pictures, pictures, refine_plane
from asbuilt_bim.measure.sigma.area import image_sigma_m2, rings_area_m2
from asbuilt_bim.vision.stereo.matching import grey
from benchmarks.real.laser_truth import plain_disparity
from benchmarks.real.truth_planes import Near

SIDE_PX, STEP_PX = 96, 24
MOST_PATCHES = 16
"""Of a scene; of some of them the program refines no plane, since nothing is drawn on them."""
CHOSEN_BY = 6
"""Frames that patches are chosen by, spread evenly: the median of what was matched in them."""
MEASURED_SHARE, SEEN_SHARE = 0.4, 0.1
"""Pixels of a square that have that median; those of one frame that can say whether it shows the patch."""
EVEN_PX, ON_SHARE = 0.5, 0.9
"""How far a patch's depths lie off their plane, by the median; how many of them lie on it."""
ON_PLANE, SAME = Near(px=1.0, share=0.1), Near(px=2.0, share=0.2)
"""What lies on it; and in a single frame: one with fewer shows something else, such as a person before it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """A rectified pair of a rig at rest and its disparity (H, W) by plain matching."""

    pair: RectifiedPair
    disparity_px: Float32Array

    @classmethod
    def of(cls, pair: RectifiedPair) -> Frame:
        """Match a pair plainly, where there is a photo."""
        return cls(pair=pair, disparity_px=plain_disparity(pair))

    def rays(self) -> FloatArray:
        """Return the rays (H, W, 3) of the rectified frame, z = 1."""
        camera = self.pair.camera
        rows, columns = np.indices(self.pair.valid_left.shape)
        x, y = (columns - camera.cx_px) / camera.f_px, (rows - camera.cy_px) / camera.f_px
        return np.stack([x, y, np.ones_like(x)], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A square of the rectified left photo: its left and top pixel."""

    x: int
    y: int

    @property
    def ring(self) -> FloatArray:
        """Return its corners (4, 2) in px."""
        x0, y0, x1, y1 = self.x, self.y, self.x + SIDE_PX, self.y + SIDE_PX
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=np.float64)

    @property
    def box(self) -> tuple[slice, slice]:
        """Return its rows and columns."""
        return slice(self.y, self.y + SIDE_PX), slice(self.x, self.x + SIDE_PX)


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeat:
    """One thing measured in several frames: its areas and their image sigmas, by frame.

    Of a face also what its first outline covers on each frame's plane, and each frame's outline on its first plane.
    """

    name: str
    areas_m2: tuple[float, ...]
    sigmas_m2: tuple[float, ...]
    by_plane_m2: tuple[float, ...] = ()
    by_outline_m2: tuple[float, ...] = ()

    @property
    def scatter_m2(self) -> float:
        """Return the standard deviation over the frames."""
        return float(np.std(self.areas_m2, ddof=1))

    @property
    def ratio(self) -> float:
        """Return how many of the stated sigmas it scatters by."""
        return self.scatter_m2 / float(np.sqrt(np.mean(np.square(self.sigmas_m2))))


def pooled(repeats: Sequence[Repeat]) -> float:
    """Return the scatter in stated sigmas of all together: root mean square, each with its number of frames."""
    freedom = np.array([len(one.areas_m2) - 1 for one in repeats], dtype=np.float64)
    squares = np.array([one.ratio**2 for one in repeats])
    return float(np.sqrt(np.sum(freedom * squares) / np.sum(freedom))) if len(repeats) else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """A patch and its usual plane q (3,) in px, and how far depths lie off it."""

    patch: Patch
    q_px: FloatArray
    uneven_px: float


def patches_of(frames: Sequence[Frame]) -> list[Placed]:
    """Choose the patches of a rig's frames, the evenest first, with the plane that the frames' median depth shows."""
    some = np.unique(np.linspace(0, len(frames) - 1, CHOSEN_BY).round().astype(int))
    stack = np.stack([frames[k].disparity_px for k in some])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # pixels that no frame measures are NaN, as they should be
        usual = np.nanmedian(stack, axis=0).astype(np.float32)
    rays = frames[0].rays()
    grid = [
        Patch(x=x, y=y)
        for y in range(0, usual.shape[0] - SIDE_PX, STEP_PX)
        for x in range(0, usual.shape[1] - SIDE_PX, STEP_PX)
    ]
    whole = frames[0].pair.valid_left & frames[0].pair.valid_right
    grid = [patch for patch in grid if whole[patch.box].all()]
    placed = [one for patch in grid if (one := _placed(usual, rays, patch)) is not None]
    chosen: list[Placed] = []
    for one in sorted(placed, key=lambda one: (one.uneven_px, one.patch.y, one.patch.x)):
        others = [other.patch for other in chosen]
        if all(max(abs(one.patch.x - other.x), abs(one.patch.y - other.y)) > SIDE_PX for other in others):
            chosen.append(one)
    return chosen[:MOST_PATCHES]


def _placed(usual: Float32Array, rays: FloatArray, patch: Patch) -> Placed | None:
    """Fit a square's plane; None where too little was measured, or where there is no one plane."""
    d = usual[patch.box]
    seen = np.isfinite(d)
    if seen.mean() < MEASURED_SHARE:
        return None
    r, depths = rays[patch.box][seen], d[seen].astype(np.float64)
    q, _ = fit_q(r, depths, EVEN_PX)
    off = np.abs(depths - r @ q)
    if np.median(off) > EVEN_PX or np.mean(off < ON_PLANE.of(depths)) < ON_SHARE:
        return None
    return Placed(patch=patch, q_px=q, uneven_px=float(np.median(off)))


def measured_patches(frames: Sequence[Frame], placed: Sequence[Placed], scene: str) -> list[Repeat]:
    """Measure every patch in every frame that shows it; those seen in under three frames are left out."""
    rays = frames[0].rays()
    found: list[list[tuple[float, float]]] = [[] for _ in placed]
    for frame in frames:
        both = pictures(grey(frame.pair.left), grey(frame.pair.right), frame.pair.valid_right)
        for one, into in zip(placed, found, strict=True):
            if _shows(frame, rays, one):
                into += _refined(frame, both, rays, one.patch, one.q_px)
    return [
        Repeat(name=f"{scene}: {one.patch.x}, {one.patch.y} px", areas_m2=tuple(area for area, _ in its),
               sigmas_m2=tuple(sigma for _, sigma in its))
        for one, its in zip(placed, found, strict=True) if len(its) >= 3
    ]  # fmt: skip


def _shows(frame: Frame, rays: FloatArray, one: Placed) -> bool:
    """Say whether nothing stands before a patch in a frame; where hardly a depth was matched, nothing says so."""
    plane = rays[one.patch.box] @ one.q_px
    off = np.abs(frame.disparity_px[one.patch.box] - plane)
    known = np.isfinite(off)
    if known.sum() < SEEN_SHARE * SIDE_PX**2:
        return True
    return bool(np.mean(off[known] < SAME.of(plane)[known]) >= ON_SHARE)


def _refined(
    frame: Frame, both: Pictures, rays: FloatArray, patch: Patch, start: FloatArray
) -> list[tuple[float, float]]:
    """Return the patch's area and image sigma on the plane refined on its pixels; nothing where they don't hold it."""
    mask = np.zeros(rays.shape[:2], dtype=bool)
    mask[patch.box] = True
    fit = refine_plane(both, rays, mask, start)
    if fit is None:
        return []
    fit = as_halves_agree(fit)
    camera = frame.pair.camera
    sigma = image_sigma_m2([patch.ring], (), 0.0, fit.q_px, fit.covariance, camera)
    return [(rings_area_m2([patch.ring], fit.q_px, camera), sigma)]
