"""All planes of a station solved together: what the photos say of each, and what building practice says of all.

Soft constraints, each tested: one vertical for the station; right angles where two faces of an instance touch; touching
faces agree along their edge. A constraint that fails at 3 sigma is dropped, and the worst one first, so a battered wall
stays battered.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray

PLUMB_SIGMA_RAD = np.radians(0.25)
"""EN 13670 lets a storey-high wall lean by h / 300, 0.19 degrees; plus what an edge detector errs."""
SQUARE_SIGMA_RAD = np.radians(0.5)
"""10 mm over a side of 0.5 m is 1.1 degrees at the worst: half of it is the usual formwork."""
TOUCH_SIGMA_PX = 0.1
"""Two faces that share an edge share its disparity; chamfers of 15 mm at 5 m make 0.15 px."""
MOST_MISS_SIGMA = 3.0
STEPS = 3
"""The constraints are nearly linear in q: the third step moves nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneSight:
    """What the photos alone say of one plane: q (3,), covariance (3, 3)."""

    q_px: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Touch:
    """Planes `one` and `other` meet in a visible edge that runs through these rectified rays (K, 3).

    `off_px` is by how much their disparities may differ there because the edge itself lies off by its own sigma.
    """

    one: int
    other: int
    rays: FloatArray
    off_px: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjusted:
    """The planes after adjustment: q (n, 3), covariances (n, 3, 3), plumb (3,) downwards.

    `joint` (3n, 3n) is the covariance of all q together: planes that were held against each other err together.
    """

    q_px: FloatArray
    covariance: FloatArray
    joint: FloatArray
    down: FloatArray


@dataclass(slots=True, kw_only=True, eq=False)
class _Row:
    """One observation: residual over sigma, and its derivatives by column."""

    name: str
    residual: float
    columns: list[int]
    derivatives: FloatArray
    tested: bool


def adjust_planes(
    sights: Sequence[PlaneSight],
    touches: Sequence[Touch],
    down: FloatArray,
    down_sigma_rad: float,
) -> Adjusted:
    """Solve all planes and the vertical together by Gauss-Newton, dropping constraints that the photos contradict."""
    count = len(sights)
    q = np.array([s.q_px for s in sights], dtype=np.float64).reshape(count, 3)
    whiteners = [np.linalg.cholesky(np.linalg.inv(s.covariance + 1e-12 * np.eye(3))).T for s in sights]
    plumb = np.array(down, dtype=np.float64)
    dropped: set[str] = set()
    normal = np.eye(3 * count + 2)
    while True:
        rows: list[_Row] = []
        tilt = np.zeros(2)
        axes = _axes(plumb)
        start = plumb
        for _ in range(STEPS):
            plumb = start + tilt @ axes
            plumb = plumb / np.linalg.norm(plumb)
            rows = _rows(sights, whiteners, touches, q, plumb, axes, tilt / down_sigma_rad, down_sigma_rad)
            rows = [row for row in rows if row.name not in dropped]
            matrix = np.zeros((len(rows), 3 * count + 2))
            for i, row in enumerate(rows):
                matrix[i, row.columns] = row.derivatives
            residual = np.array([row.residual for row in rows])
            normal = matrix.T @ matrix + 1e-12 * np.eye(matrix.shape[1])
            change = -np.linalg.solve(normal, matrix.T @ residual)
            q = q + change[: 3 * count].reshape(count, 3)
            tilt = tilt + change[3 * count :]
        worst = max((row for row in rows if row.tested), key=lambda row: abs(row.residual), default=None)
        if worst is None or abs(worst.residual) <= MOST_MISS_SIGMA:
            break
        dropped.add(worst.name)
        q = np.array([s.q_px for s in sights], dtype=np.float64).reshape(count, 3)
        plumb = np.array(down, dtype=np.float64)
    joint = np.asarray(np.linalg.inv(normal)[: 3 * count, : 3 * count], dtype=np.float64)
    blocks = np.array([joint[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(count)]).reshape(count, 3, 3)
    return Adjusted(q_px=q, covariance=blocks, joint=joint, down=plumb)


def _axes(plumb: FloatArray) -> FloatArray:
    """Return two directions (2, 3) at right angles to the plumb line."""
    first = np.cross(plumb, np.array([0.0, 0.0, 1.0]))
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(plumb, first)])


def _rows(
    sights: Sequence[PlaneSight],
    whiteners: Sequence[FloatArray],
    touches: Sequence[Touch],
    q: FloatArray,
    plumb: FloatArray,
    axes: FloatArray,
    tilt_sigmas: FloatArray,
    down_sigma_rad: float,
) -> list[_Row]:
    count = len(sights)
    tilts = [3 * count, 3 * count + 1]
    rows: list[_Row] = []
    for i, sight in enumerate(sights):
        rows += _plane_rows(i, sight, whiteners[i], q[i], plumb, axes, tilts)
    for k in range(2):
        rows.append(
            _Row(
                name=f"vertical {k}", residual=float(tilt_sigmas[k]), columns=[tilts[k]],
                derivatives=np.array([1.0 / down_sigma_rad]), tested=False,
            )
        )  # fmt: skip
    for k, touch in enumerate(touches):
        rows += _touch_rows(k, touch, q)
    return rows


def _plane_rows(
    i: int,
    sight: PlaneSight,
    whitener: FloatArray,
    q: FloatArray,
    plumb: FloatArray,
    axes: FloatArray,
    tilts: list[int],
) -> list[_Row]:
    """Return what the photos say of plane i, and that it stands upright."""
    columns = [3 * i, 3 * i + 1, 3 * i + 2]
    whitened = whitener @ (q - sight.q_px)
    rows = [
        _Row(
            name=f"photos {i} {k}", residual=float(whitened[k]), columns=columns, derivatives=whitener[k], tested=False
        )
        for k in range(3)
    ]
    value, slope = _cosine(q, plumb)
    by_tilt = axes @ q / np.linalg.norm(q)
    derivatives = np.concatenate([slope, by_tilt]) / PLUMB_SIGMA_RAD
    residual = value / PLUMB_SIGMA_RAD
    rows.append(
        _Row(name=f"plumb {i}", residual=residual, columns=columns + tilts, derivatives=derivatives, tested=True)
    )
    return rows


def _touch_rows(number: int, touch: Touch, q: FloatArray) -> list[_Row]:
    i, j = touch.one, touch.other
    columns = [3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2]
    sigma = float(np.hypot(TOUCH_SIGMA_PX, touch.off_px)) * np.sqrt(len(touch.rays))
    rows = [
        _Row(
            name=f"touch {number}", residual=float((q[i] - q[j]) @ ray) / sigma, columns=columns,
            derivatives=np.concatenate([ray, -ray]) / sigma, tested=True,
        )
        for ray in touch.rays
    ]  # fmt: skip
    value, by_i = _cosine(q[i], q[j] / np.linalg.norm(q[j]))
    _, by_j = _cosine(q[j], q[i] / np.linalg.norm(q[i]))
    rows.append(
        _Row(
            name=f"square {number}", residual=value / SQUARE_SIGMA_RAD, columns=columns,
            derivatives=np.concatenate([by_i, by_j]) / SQUARE_SIGMA_RAD, tested=True,
        )
    )  # fmt: skip
    return rows


def _cosine(q: FloatArray, axis: FloatArray) -> tuple[float, FloatArray]:
    """Return the cosine between q and a unit axis, and its derivative by q (3,)."""
    length = float(np.linalg.norm(q))
    n = q / length
    value = float(n @ axis)
    return value, (axis - value * n) / length
