"""How well what was seen fits the design from a place: odds of each pair of faces, and the place that fits best.

What isn't built can't be seen; what stands elsewhere is as likely anywhere. So a face that fits nowhere costs little,
and pulls nowhere.

Reference: Dempster, Laird & Rubin 1977, maximum likelihood from incomplete data via the EM algorithm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import rotation_from_vector, wrapped
from asbuilt_bim.register.by_design.planes import Seen, Upright
from asbuilt_bim.register.options import FURTHEST_M, PAST_M

BUILT_M = 0.01
"""How far a built face lies off its design: two of these are the 20 mm that EN 13670 allows."""
ENDS_M = 0.02
"""How well the end of a face is seen and built."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
SHARES, SHARES_WEIGHT = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
"""How much of what is seen is of the design (Q,): nobody knows, so all shares are as likely, and summed over."""
OF_DESIGN = 0.5
"""The mean of these."""
MISTAKEN = 0.05
"""How often somebody is wrong about a place, by a storey, a date or a photo: one in twenty, before anything is seen."""
WIDTHS_M = 4.0
"""Over how much the widths of things on a site spread."""
HEIGHT_LOOSE_M = 0.6
"""How far heights may be off before the camera's height is known."""
LEAST_OVERLAP = 0.5  # of the seen height
ROUNDS = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prior:
    """What is known of a place before: level place (2,) and bearing, with sigmas; None: anywhere in `area_m2`, any way.

    `turn_rad` is counter-clockwise from above: the level frame's y ahead, in the world. `linked` is what is known of
    the places of stations that are tied to it.
    """

    level_m: FloatArray
    sigma_m: float | None
    turn_rad: float
    sigma_rad: float | None
    area_m2: float
    storey_share: float  # one over the number of storeys that it may be
    linked: tuple["LinkedPrior", ...] = ()

    def log_density(self, turn_rad: float, place_m: FloatArray) -> float:
        """Return the logarithm of how likely a place is, per square metre and radian."""
        total = np.log(self.storey_share) + sum(one.log_fit(turn_rad, place_m) for one in self.linked)
        if self.sigma_m is None:
            total -= np.log(self.area_m2)
        else:
            off = (place_m - self.level_m) / self.sigma_m
            total -= 0.5 * float(off @ off) + np.log(2.0 * np.pi * self.sigma_m**2)
        if self.sigma_rad is None:
            return float(total - np.log(2.0 * np.pi))
        sigmas = float(wrapped(turn_rad - self.turn_rad)) / self.sigma_rad
        return float(total - 0.5 * sigmas**2 - np.log(np.sqrt(2.0 * np.pi) * self.sigma_rad))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkedPrior:
    """A station that is tied to another: by how much it stands beside it (2,), is turned, and what is known of it."""

    level_m: FloatArray
    turn_rad: float
    known: Prior

    def log_fit(self, turn_rad: float, place_m: FloatArray) -> float:
        """Return the logarithm of how well its own rough place fits a place of the other; it may be a mistake."""
        known = self.known
        squares = 0.0
        if known.sigma_m is not None:
            off = (place_m + turned(turn_rad) @ self.level_m - known.level_m) / known.sigma_m
            squares += float(off @ off)
        if known.sigma_rad is not None:
            squares += float(wrapped(turn_rad + self.turn_rad - known.turn_rad) / known.sigma_rad) ** 2
        return float(np.log((1.0 - MISTAKEN) * np.exp(-0.5 * squares) + MISTAKEN))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """A place, and what fits there: `turn_rad`, `place_m` (2,), the camera's height, and the design face of each seen.

    `on` (N,) is -1 for what fits nowhere. `covariance` (3, 3) is of [turn, x, y]. `by_share` (Q,) is the logarithm of
    how many times likelier the place makes what was seen than that it is of no design at all, for each share of it that
    is.
    """

    turn_rad: float
    place_m: FloatArray
    on: NDArray[np.intp]
    covariance: FloatArray
    by_share: FloatArray

    @property
    def log_odds(self) -> float:
        """Return the logarithm of the odds, whatever the share."""
        return summed(self.by_share)


def summed(by_share: FloatArray) -> float:
    """Return the logarithm of odds summed over all shares, of their logarithms (Q,)."""
    most = float(by_share.max())
    return most + float(np.log(SHARES_WEIGHT @ np.exp(by_share - most)))


def turned(turn_rad: float) -> FloatArray:
    """Return the turn in plan (2, 2)."""
    return rotation_from_vector([0.0, 0.0, turn_rad])[:2, :2]


def _off(seen: Seen, design: Upright, turn: float, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return by how far each seen face lies off each design face (N, F): across it, along it, and in direction."""
    faces = seen.faces
    way = (faces.middles_m @ turned(turn).T + place)[:, None] - design.middles_m[None]
    across = np.einsum("nfk,fk->nf", way, design.normals)
    along = np.einsum("nfk,fk->nf", way, design.along)
    angle = wrapped(faces.angles_rad[:, None] + turn - design.angles_rad[None])
    return across, along, angle


def possible(seen: Seen, design: Upright, camera_m: float, loose_m: float) -> BoolArray:
    """Say which seen face (N, F) may be which design face by kind, width and height, the camera being at a height."""
    faces = seen.faces
    low, high = (faces.heights_m + camera_m).T[:, :, None]
    common = np.minimum(high + loose_m, design.heights_m[:, 1]) - np.maximum(low - loose_m, design.heights_m[:, 0])
    tall = common >= LEAST_OVERLAP * (high - low) + loose_m
    fits = faces.halves_m[:, None] <= design.halves_m[None] + PAST_M
    alike = np.abs(faces.halves_m[:, None] - design.halves_m[None]) <= 0.25 * design.halves_m[None]
    same = faces.round[:, None] == design.round[None]
    allowed: BoolArray = tall & same & np.where(design.round[None], alike, fits)
    return allowed


def ratios(
    seen: Seen, design: Upright, may: BoolArray, turn: float, place: FloatArray, wide: tuple[float, float]
) -> FloatArray:
    """Return how many times likelier each pair (N, F) is than that the seen face is of no design.

    What is of no design stands anywhere in view, as likely near as far. The design fills the view: a face is seen as
    often as it is wide from there. `wide` are sigmas of the place and turn themselves, while they aren't settled.
    """
    across, along, angle = _off(seen, design, turn, place)
    sigma = np.hypot(np.hypot(seen.offset_sigma_m, BUILT_M), wide[0])[:, None]
    turns = np.hypot(np.hypot(seen.angle_sigma_rad[:, None], _built_turn(design)[None]), wide[1])
    there = np.exp(-0.5 * np.square(across / sigma)) / (np.sqrt(2.0 * np.pi) * sigma)
    ends = np.hypot(ENDS_M, wide[0])
    inside = np.abs(along) + seen.faces.halves_m[:, None] <= design.halves_m[None] + PAST_M + wide[0]
    width = np.exp(-0.5 * np.square((seen.faces.halves_m[:, None] - design.halves_m) / ends))
    middle = np.exp(-0.5 * np.square(along / ends)) / (np.sqrt(2.0 * np.pi) * ends)
    whole = 2.0 * design.halves_m * middle * width * WIDTHS_M / (np.sqrt(2.0 * np.pi) * 2.0 * ends)
    share = seen.whole[:, None]
    flat = there * ((1.0 - share) * inside + share * whole) * np.exp(-0.5 * np.square(angle / turns))
    on_axis = there * np.exp(-0.5 * np.square(along / sigma)) / (np.sqrt(2.0 * np.pi) * sigma)
    either = np.where(design.round[None], on_axis * 2.0 * design.halves_m, flat)
    eyes, which = np.unique(seen.eyes_m, axis=0, return_inverse=True)
    slant = np.array([_slant(design, place + turned(turn) @ eye) for eye in eyes])[which.ravel()]
    found: FloatArray = np.where(may, either, 0.0) * FURTHEST_M * slant
    return found


def _slant(design: Upright, eye: FloatArray) -> FloatArray:
    """Return how much of a length of each design face (F,) is seen across the view from a place: none from behind."""
    way = eye - design.middles_m
    cosine = np.einsum("fk,fk->f", way, design.normals) / np.maximum(np.linalg.norm(way, axis=1), 0.1)
    slant: FloatArray = np.where(design.round, 1.0, np.maximum(cosine, 0.0))
    return slant


def _built_turn(design: Upright) -> FloatArray:
    """Return how far built faces (F,) turn from their design: both their ends lie off it."""
    length: FloatArray = np.maximum(2.0 * design.halves_m, 0.1)
    return np.where(design.round, np.pi, np.sqrt(2.0) * BUILT_M / length)


def fitted(
    seen: Seen, design: Upright, may: BoolArray, prior: Prior, start: tuple[float, FloatArray], disparity_px: float
) -> Fitted | None:
    """Return the place near a start that fits best, None where nothing holds it."""
    turn, place = start
    for wide in (0.05, 0.02, *[0.0] * ROUNDS):
        odds = ratios(seen, design, may, turn, place, (wide, 0.2 * wide))
        on, trust = _taken(odds)
        step = _step(seen, design, prior, turn, place, on, trust, disparity_px)
        if step is None:
            return None
        turn, place = float(turn + step[0][0]), place + step[0][1:3]
        if wide == 0.0 and np.abs(step[0][:3]).max() < 1e-5:
            break
    odds = ratios(seen, design, may, turn, place, (0.0, 0.0))
    on, trust = _taken(odds)
    step = _step(seen, design, prior, turn, place, on, trust, disparity_px)
    if step is None:
        return None
    covariance = step[1][:3, :3]
    volume = 0.5 * float(np.linalg.slogdet(2.0 * np.pi * covariance)[1])
    by_share = _evidence(odds, on, design.elements[on], seen.whole > 0.5) + prior.log_density(turn, place) + volume
    on = np.where(trust > 0.5, on, -1)
    return Fitted(turn_rad=turn, place_m=place, on=on, covariance=covariance, by_share=by_share)


def _taken(odds: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the design face (N,) that each seen one fits best, and how likely it is that."""
    on = np.argmax(odds, axis=1)
    best = odds[np.arange(len(on)), on] * OF_DESIGN
    trust: FloatArray = best / (1.0 - OF_DESIGN + odds.sum(axis=1) * OF_DESIGN)
    return on, trust


def _evidence(odds: FloatArray, on: NDArray[np.intp], element: NDArray[np.intp], whole: BoolArray) -> FloatArray:
    """Return the logarithm (Q,) of the odds of all that was seen; pieces of one design face say one thing once.

    The ends of a whole face (N,) are where the next faces of its element stand, so these say nothing new. What is cut
    of an element says something for each of its faces.
    """
    share = SHARES[:, None]
    sums = odds.sum(axis=1)
    each = np.log(1.0 - share + share * sums)
    fits = sums > 1.0
    total: FloatArray = each[:, ~fits].sum(axis=1)
    for one in np.unique(element[fits]):
        own = fits & (element == one)
        cut = own & ~whole
        pieces = [each[:, cut & (on == face)].max(axis=1) for face in np.unique(on[cut])]
        total = total + np.maximum(each[:, own].max(axis=1), np.sum(pieces, axis=0))
    return total


def _step(
    seen: Seen,
    design: Upright,
    prior: Prior,
    turn: float,
    place: FloatArray,
    on: NDArray[np.intp],
    trust: FloatArray,
    disparity_px: float,
) -> tuple[FloatArray, FloatArray] | None:
    """Return the step of turn, place and the rig's disparity (4,), and their covariance: weighted least squares."""
    arms = seen.faces.middles_m @ turned(turn).T
    own = trust / np.maximum(_shared(on, trust), 1.0)  # pieces of one face are built off it alike
    way = arms + place - design.middles_m[on]
    normals, along = design.normals[on], design.along[on]
    swing = np.stack([-arms[:, 1], arms[:, 0]], axis=-1)
    stretch = seen.by_disparity_m @ turned(turn).T
    rows, off, weight = [], [], []

    def add(directions: FloatArray, sigma: FloatArray, counts: FloatArray) -> None:
        level = [np.einsum("nk,nk->n", directions, one) for one in (swing, stretch, way)]
        rows.append(np.column_stack([level[0], directions, level[1]]))
        off.append(level[2])
        weight.append(counts / np.square(sigma))

    across = np.hypot(seen.offset_sigma_m, BUILT_M)
    add(normals, across, own)
    is_round = seen.faces.round
    same_width = np.abs(seen.faces.halves_m - design.halves_m[on]) <= 2.0 * ENDS_M
    ends = np.where(is_round, across, ENDS_M)
    add(along, ends, own * np.where(is_round, 1.0, seen.whole * same_width))
    angle = wrapped(seen.faces.angles_rad + turn - design.angles_rad[on])
    rows.append(np.tile([1.0, 0.0, 0.0, 0.0], (len(on), 1)))
    off.append(angle)
    weight.append(np.where(is_round, 0.0, own / (np.square(seen.angle_sigma_rad) + np.square(_built_turn(design)[on]))))
    matrix, residual, counts = np.concatenate(rows), np.concatenate(off), np.concatenate(weight)
    normal = (matrix * counts[:, None]).T @ matrix
    right = -(matrix * counts[:, None]).T @ residual
    held = np.zeros(4) if prior.sigma_m is None else np.array([0.0, *[prior.sigma_m**-2] * 2, 0.0])
    held[0] = 0.0 if prior.sigma_rad is None else prior.sigma_rad**-2
    held[3] = disparity_px**-2
    away = np.array([wrapped(turn - prior.turn_rad), *(place - prior.level_m), 0.0])
    normal[np.diag_indices(4)] += held
    right -= held * away
    if not _held(normal):
        return None
    covariance = np.linalg.inv(normal)
    return covariance @ right, covariance


def _held(normal: FloatArray) -> bool:
    """Say whether turn and place are held by what fits: to a radian and a metre in every direction."""
    return bool(np.linalg.eigvalsh(normal)[0] > 1.0)


def _shared(on: NDArray[np.intp], trust: FloatArray) -> FloatArray:
    """Return how many seen faces (N,) share the design face of each."""
    return np.array([trust[on == face].sum() for face in on])
