"""Where a round column's lateral surface ends: inside its silhouette both photos show one surface, outside they don't.

A joint between panels, a stain or the border of shade is an upright line too, and both photos show it. But the lateral
surface goes on past it. An edge of the background has the background on both sides. The silhouette alone parts the two.
"""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, median
from asbuilt_bim.geometry.robust_least_squares import robust_sigma
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle
from asbuilt_bim.measure.outline.edges import Line, edge_share, pixel_plane
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.stereo.warp import sample

STEP_PX = 0.5
REACH_PX, REACH_SHARE = 7.0, 0.3
"""How far off the stereo circle's side, in pixels or of its radius, the silhouette may lie."""
AROUND_PX = 6.0
"""What is looked at beyond the furthest place."""
CORE_PX = 6.0
BAND = 8
"""Grey levels are compared in means over bands of this many rows: grain and JPEG differ between the photos."""
FOREIGN_SIGMAS, LEAST_SIGMA_GREY = 3.0, 0.5
EDGE_WORTH_PX = 12.0
"""An edge over a side's whole length weighs as much as so many pixels of surface: an even sky looks alike in both."""
BLUR_PX = 1.5
LEAST_PARTING, PLAIN_STRENGTH = 0.25, 0.4
"""An end is plain where a quarter more of its length differs beyond than within, or where 0.4 of it shows an edge."""
LEAST_PAIRED = 0.7
LEAST_BANDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class LateralEnd:
    """How far the lateral surface ends off the expected line (px, outward), and which shares of its length are foreign.

    `outside` and `within` are the shares of the bands just outside and inside that differ between the photos.
    """

    offset_px: float
    strength: float
    outside: float
    within: float

    @property
    def parts(self) -> bool:
        """Say whether the photos differ much more outside than within."""
        return self.outside - self.within > LEAST_PARTING

    @property
    def plain(self) -> bool:
        """Say whether the lateral surface plainly ends here: the photos part, or show an edge."""
        return self.parts or self.strength > PLAIN_STRENGTH


def lateral_end(bench: Workbench, circle: Circle, line: Line, chord: FloatArray) -> LateralEnd | None:
    """Find the surface's end near `line`, the circle's side in the left photo; `chord` (3,) is the silhouettes' plane.

    None where the right photo doesn't show the side, or too little of it is seen.
    """
    half_px = circle.f_px * circle.radius_m / circle.z_m
    reach = max(REACH_PX, REACH_SHARE * half_px)
    inward = max(reach + CORE_PX, 0.8 * half_px)
    across = np.arange(-np.ceil(inward / STEP_PX), np.ceil((reach + AROUND_PX) / STEP_PX) + 1) * STEP_PX
    length = line.length_px
    along = np.linspace(0.02, 0.98, int(np.clip(length, 8, 400)))[:, None] * length
    at = line.start + along[..., None] * line.direction + across[:, None] * line.normal
    x, y = at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)
    flat, surface = _disparities(bench, circle, at, pixel_plane(chord, bench.pair.camera))
    there = [(at[..., 0] - d).astype(np.float32) for d in (flat, 0.5 * (flat + surface), surface)]
    paired = sample(bench.slopes.valid_right, there[-1], y) > 0.9
    if paired.mean() < LEAST_PAIRED or len(along) < LEAST_BANDS * BAND:
        return None
    left = sample(bench.grey_levels[0], x, y)
    apart = [np.where(paired, left - sample(bench.grey_levels[1], u, y), np.nan) for u in there]
    foreign = foreign_share(np.stack(apart), across <= -reach, BAND)
    # each photo is asked alone: beyond an outer edge lies another background in each
    rises = [sample(s, u, y) for s, u in ((bench.slopes.left_x, x), (bench.slopes.right_x, there[-1]))]
    edges = np.mean([edge_share(rise, rise) for rise in rises], axis=0)
    return _parting(foreign, edges, across, reach)


def _disparities(bench: Workbench, circle: Circle, at: FloatArray, chord: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the disparities at places (..., 2) of the left photo: of the sides' plane, and of the lateral surface.

    Past the lateral surface both are the plane's. Where the circle is drawn too wide, the true surface lies between
    them.
    """
    camera, view = bench.pair.camera, bench.scene.level.view
    rays = np.ones((*at.shape[:-1], 3))
    rays[..., :2] = (at - [camera.cx_px, camera.cy_px]) / camera.f_px
    level_x, _, forward = view.coordinates(rays)
    flat: FloatArray = at @ chord[:2] + chord[2]
    surface = disparity_of_circle(circle, level_x) * forward
    found: FloatArray = np.where(np.isfinite(surface), np.fmax(surface, flat), flat)
    return flat, found


def surface_disparity(bench: Workbench, circle: Circle, chord: FloatArray, at: FloatArray) -> FloatArray:
    """Return the lateral surface's disparity at places (..., 2) of the left photo; past it, that of its sides' plane.

    `chord` (3,): the silhouettes' plane, q.
    """
    return _disparities(bench, circle, at, pixel_plane(chord, bench.pair.camera))[1]


def foreign_share(apart: FloatArray, core: BoolArray, band: int) -> FloatArray:
    """Return, per place across (T,), the share of bands where the photos differ by more than in the core.

    A band is the mean of `band` profiles. `apart` (K, S, T) are the differences as K disparities give them, the
    lateral surface's last: the least one counts.
    """
    count = apart.shape[1] // band
    bands = apart[:, : count * band].reshape(len(apart), count, band, -1).mean(axis=2)  # NaN where not in both photos
    inner = bands[-1][:, core]
    inner = inner[np.isfinite(inner)]
    middle = median(inner) if inner.size else 0.0
    sigma = max(robust_sigma(inner - middle) if inner.size else 0.0, LEAST_SIGMA_GREY)
    least = np.abs(bands - middle).min(axis=0)
    with np.errstate(invalid="ignore"):
        differ = least > FOREIGN_SIGMAS * sigma
    known = np.isfinite(least).sum(axis=0)
    share: FloatArray = np.where(known > 0, differ.sum(axis=0) / np.maximum(known, 1), 0.5)
    return share


def _parting(foreign: FloatArray, edges: FloatArray, across: FloatArray, reach: float) -> LateralEnd:
    """Return where the lateral surface inside and foreign things outside part best, an edge between them."""
    like = np.cumsum(1.0 - 2.0 * foreign) * STEP_PX
    score = np.where(np.abs(across) <= reach, like + EDGE_WORTH_PX * edges, -np.inf)
    best = int(np.argmax(score))
    outside, within = shares_around(foreign, across - across[best])
    return LateralEnd(offset_px=float(across[best]), strength=float(edges[best]), outside=outside, within=within)


def shares_around(foreign: FloatArray, off_px: FloatArray) -> tuple[float, float]:
    """Return the mean foreign shares beyond and within an end from which the places lie `off_px` (T,) away."""
    outside, within = (
        float(foreign[(side * off_px > BLUR_PX) & (side * off_px < AROUND_PX)].mean()) for side in (1.0, -1.0)
    )
    return outside, within
