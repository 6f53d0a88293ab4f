"""Upright planes, round columns and level surfaces grown in a disparity map.

In the levelled view a building is a plan drawing. Columns of pixels vote for the disparities that stand upright in
them. Votes without a jump in depth between them form a chain. A chain is cut into the fewest straight pieces (planes)
or arcs (round columns) that explain it. No pixel is visited twice, and nothing is drawn at random.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.geometry.level import LevelledMap
from asbuilt_bim.geometry.polyline import fit_line, straight_pieces
from asbuilt_bim.geometry.profile import Chain, chains, modes
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle, fit_round

SMEAR_PX = 8.0
"""The matcher's own window and a bit: what is narrower between two depths is smeared, not seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GrowOptions:
    """What counts as an upright surface."""

    least_rise_m: float = 0.35  # a kerb or a sole plate is lower, a poured lift is higher
    mode_sigma_px: float = 0.12  # scatter of a column's mean disparity, smoothing of the matcher included
    rig_sigma_px: float = 0.15  # disparity that a calibrated rig may err by in common (yaw of 0.008 degrees)
    most_sigma_share: float = 0.20  # sigma of an area over it, beyond which its number says nothing
    piece_penalty: float = 30.0  # a corner must explain 30 units of chi-square: 5 sigma
    corner_deg: float = 20.0  # two faces of one body meet at more: corners are square, chamfers 45 degrees
    touch_px: float = 0.8  # pieces meet where their lines pass each other within this

    @property
    def least_disparity_px(self) -> float:
        """Return the disparity from which a plane's area can be known at all.

        Depth is Z = f b / d, and an area grows with Z squared: its sigma over itself is 2 sigma_d / d. sigma_d holds
        what the pixels scatter by and what the rig errs by.
        """
        return 2.0 * float(np.hypot(self.mode_sigma_px, self.rig_sigma_px)) / self.most_sigma_share

    def reach_m(self, f_px: float, baseline_m: float) -> float:
        """Return the distance up to which a rig measures surfaces: where their disparity is the least one."""
        return f_px * baseline_m / self.least_disparity_px


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """One upright surface: level x range, slope and offset of its line (or its circle), its chain and place in it.

    `convex_next` says that the next piece of the chain goes on from it without a jump, in an edge towards the camera.
    """

    x0_px: float
    x1_px: float
    slope: float
    offset_px: float
    circle: Circle | None
    chain: int
    convex_next: bool = False

    def at(self, x_px: FloatArray) -> FloatArray:
        """Return the level disparity at level x (...), NaN beside a round piece."""
        if self.circle is None:
            return self.slope * x_px + self.offset_px
        return disparity_of_circle(self.circle, x_px)


def upright_pixels(level: LevelledMap) -> tuple[BoolArray, Float32Array]:
    """Say which pixels' disparity doesn't change along the plumb line (a wall's), and how it does change, px per px.

    Level surfaces change by d / y (y from the horizon), upright ones by 0; the cut lies half-way.
    """
    weight = level.measured.astype(np.float32)
    values = np.where(level.measured, level.d_px, 0.0).astype(np.float32)
    steps = np.arange(-7, 8, dtype=np.float32)
    ones, across = np.ones(15, np.float32), np.ones(5, np.float32)

    def moment(image: Float32Array, kernel: Float32Array) -> Float32Array:
        return cv2.sepFilter2D(image, cv2.CV_32F, across, kernel, borderType=cv2.BORDER_CONSTANT)  # type: ignore[return-value]

    s0, s1, s2 = moment(weight, ones), moment(weight, steps), moment(weight, steps * steps)
    t0, t1 = moment(weight * values, ones), moment(weight * values, steps)
    spread = s0 * s2 - s1 * s1
    slope = np.where(spread > 1.0, (s0 * t1 - s1 * t0) / np.maximum(spread, 1.0), np.float32(np.nan))
    floor = level.d_px / np.where(np.abs(level.y_px) < 1.0, 1.0, level.y_px)
    upright = level.measured & (np.abs(slope) < np.minimum(0.5 * np.abs(floor), 0.08))
    return upright, slope.astype(np.float32)


def grow_pieces(level: LevelledMap, upright: BoolArray, options: GrowOptions) -> list[Piece]:
    """Grow the upright pieces of one photo; `upright` (H, W) are the pixels that may vote."""
    used = upright & (level.d_px > options.least_disparity_px)
    if np.count_nonzero(used) < 200:
        return []
    d = level.d_px[used]
    largest = float(np.quantile(d, 0.9995)) + 2.0
    columns, levels, support, start = modes(level.x_px[used], d, 0.5 * options.least_rise_m / level.baseline_m, largest)
    if len(levels) == 0:
        return []
    pieces: list[Piece] = []
    for number, chain in enumerate(chains(columns, levels, support, start)):
        pieces += _pieces_of_chain(chain, number, level.view.f_px, level.baseline_m, options)
    return pieces


def _pieces_of_chain(chain: Chain, number: int, f_px: float, baseline_m: float, options: GrowOptions) -> list[Piece]:
    sigma = np.full(len(chain.x_px), options.mode_sigma_px)
    runs = straight_pieces(chain.x_px, chain.d_px, sigma, options.piece_penalty)
    arc = fit_round(chain.x_px, chain.d_px, sigma, runs, options.piece_penalty, f_px, baseline_m)
    built: list[Piece] = []
    for start, stop in runs:
        if arc is not None and arc.start <= start < arc.stop:
            if start == arc.start:
                built.append(
                    Piece(
                        x0_px=float(chain.x_px[arc.start]), x1_px=float(chain.x_px[arc.stop - 1]), slope=0.0,
                        offset_px=float(np.median(chain.d_px[arc.start : arc.stop])), circle=arc.circle,
                        chain=number,
                    )
                )  # fmt: skip
            continue
        x, d = chain.x_px[start:stop], chain.d_px[start:stop]
        slope, offset = fit_line(x, d, sigma[start:stop])
        built.append(
            Piece(
                x0_px=float(x[0]),
                x1_px=float(x[-1]),
                slope=slope,
                offset_px=offset,
                circle=None,
                chain=number,
            )
        )
    wide = [piece for piece in built if piece.x1_px - piece.x0_px >= SMEAR_PX]
    return _joined(wide, f_px, options)


def _turn_deg(one: Piece, other: Piece, f_px: float) -> float:
    """Return how far two planes' directions are apart: d = slope x + offset has the normal (slope f, offset)."""
    turn = np.arctan2(one.slope * f_px, one.offset_px) - np.arctan2(other.slope * f_px, other.offset_px)
    return float(np.degrees(turn))


def _joined(built: list[Piece], f_px: float, options: GrowOptions) -> list[Piece]:
    """Mark which neighbours in a chain touch in a convex edge."""
    joined: list[Piece] = []
    for one, other in pairwise(built):
        seam = np.array(0.5 * (one.x1_px + other.x0_px))
        both_flat = one.circle is None and other.circle is None
        gap = abs(float(one.at(seam) - other.at(seam))) if both_flat else np.inf
        corner = bool(gap < options.touch_px) and _turn_deg(one, other, f_px) > options.corner_deg
        joined.append(replace(one, convex_next=corner))
    return joined + built[-1:]
