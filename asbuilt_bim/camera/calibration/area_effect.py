"""What a calibration's uncertainty does to an area: a square face's sigma over the frame, and where it comes from."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.board_sigma import SOURCES
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.camera.rig_numbers import seen_points
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply

DISTANCE_M, SIDE_M = 5.0, 1.0
"""Where areas are judged: the middle of the 3 to 8 m from which faces are photographed."""
DISTANCES_M = (3.0, DISTANCE_M, 8.0)
PLACES = tuple((x, y) for y in (0.25, 0.5, 0.75) for x in (0.2, 0.5, 0.8))
"""Of the frame's width and height: a face of 1 m2 at 3 m is still seen whole there."""
MAP_CELLS = (8, 6)
_PARTS = {
    "focal lengths": (0, 1, 4, 5),
    "directions of the cameras": (2, 3, 6, 7, 8, 9, 10),  # principal points and rotation: one makes up for the other
    "baseline": (11, 12, 13),
}
_STEPS = np.array([0.1] * 8 + [1e-5] * 3 + [1e-5] * 3)  # px, rad, m: small against what they do, large against digits
_LENS_STEP = 1e-5
_CORNERS = 0.5 * SIDE_M * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AreaEffect:
    """Sigma of the area of a face 1 m square, seen from the front, as a share of it.

    `sigma` is in the middle of the left frame at 5 m, `worst` at the worst of `PLACES` there. `maps` (3, 6, 8) are over
    the cells of the left frame at `DISTANCES_M`; NaN where the right photo doesn't show it. `parts` holds what each
    group of the rig's numbers would do by itself at the worst place; they are correlated, and don't add up. `sources`
    does so by what the errors come from; their squares add up. It is empty where that isn't known.
    """

    sigma: float
    worst: float
    worst_place: tuple[float, float]
    maps: FloatArray
    parts: tuple[tuple[str, float], ...]
    sources: tuple[tuple[str, float], ...]


def area_effect(rig: StereoRig, by_source: FloatArray | None = None) -> AreaEffect | None:
    """Return what the rig's covariance does to areas; None where the covariance isn't known."""
    if not rig.covariance.any():
        return None
    at = area_slopes(rig, PLACES, DISTANCE_M)
    sigmas = _sigmas(at, rig.covariance)
    worst = int(np.nanargmax(sigmas))
    slopes = at[worst : worst + 1]
    parts = [(name, rows) for name, rows in _PARTS.items()]
    if rig.knows_lenses:
        parts.append(("lenses", tuple(range(len(PARAMETERS), len(rig.covariance)))))
    return AreaEffect(
        sigma=float(sigmas[PLACES.index((0.5, 0.5))]),
        worst=float(sigmas[worst]),
        worst_place=PLACES[worst],
        maps=np.stack([_map(rig, distance_m) for distance_m in DISTANCES_M]),
        parts=tuple((name, _of_rows(slopes, rig.covariance, rows)) for name, rows in parts),
        sources=()
        if by_source is None
        else tuple((name, float(_sigmas(slopes, one)[0])) for name, one in zip(SOURCES, by_source, strict=True)),
    )


def area_slopes(rig: StereoRig, places: tuple[tuple[float, float], ...], distance_m: float) -> FloatArray:
    """Return how a square metre's area changes with each of the rig's numbers (N, P), as a share of it.

    The squares face the left camera at places (N) of its frame; NaN where a lens shows nothing.
    """
    frame = np.array([rig.left.width_px, rig.left.height_px])
    centres = rig.left.rays(np.array(places) * frame - 0.5) * distance_m
    squares = centres[:, None] + _CORNERS
    in_left = squares.reshape(-1, 3)
    in_right = apply(rig.right_from_left, in_left)
    seen = seen_points(rig, in_left[:, :2] / in_left[:, 2:], in_right[:, :2] / in_right[:, 2:])

    def areas(change: FloatArray) -> FloatArray:
        met = midpoints(*seen.rays(change)).reshape(squares.shape)
        across: FloatArray = np.cross(met[:, 2] - met[:, 0], met[:, 3] - met[:, 1])
        share: FloatArray = 0.5 * np.linalg.norm(across, axis=1) / SIDE_M**2
        return share

    steps = np.r_[_STEPS, np.full(len(rig.covariance) - len(_STEPS), _LENS_STEP)]
    changes = [
        (areas(change) - areas(-change)) / (2.0 * step) for change, step in zip(np.diag(steps), steps, strict=True)
    ]
    return np.stack(changes, axis=1)


def _map(rig: StereoRig, distance_m: float) -> FloatArray:
    across, down = MAP_CELLS
    middles = tuple(((x + 0.5) / across, (y + 0.5) / down) for y in range(down) for x in range(across))
    sigmas = _sigmas(area_slopes(rig, middles, distance_m), rig.covariance)
    rays = rig.left.rays(np.array(middles) * [rig.left.width_px, rig.left.height_px] - 0.5)
    in_right = rig.right.project(apply(rig.right_from_left, rays * distance_m))
    size = np.array([rig.right.width_px, rig.right.height_px])
    sigmas[~np.all((in_right > -0.5) & (in_right < size - 0.5), axis=1)] = np.nan
    return sigmas.reshape(down, across)


def _of_rows(slopes: FloatArray, covariance: FloatArray, rows: tuple[int, ...]) -> float:
    at = list(rows)
    return float(_sigmas(slopes[:, at], covariance[np.ix_(at, at)])[0])


def _sigmas(slopes: FloatArray, covariance: FloatArray) -> FloatArray:
    variances = np.einsum("ni,ij,nj->n", slopes, covariance, slopes)
    sigmas: FloatArray = np.sqrt(np.maximum(variances, 0.0))
    return sigmas
