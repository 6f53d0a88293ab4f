"""A circle in space from its outline in both rectified photos.

The centre of an ellipse is not the picture of the circle's centre. Fitting the circle itself, rather than two ellipses,
makes that exact and uses one shape for both photos. It gives the covariance of what is asked for: centre and diameter.
"""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.robust_least_squares import cauchy, robust_sigma
from asbuilt_bim.geometry.transform import unit
from asbuilt_bim.vision.target.circle_arcs import arcs_of, without_foreign_arc
from asbuilt_bim.vision.target.ellipse import Ellipse, conic_distance, ellipse_of

_ROUNDS = 25
_ROBUST_ROUNDS = 2
_LEAST_SPREAD_PX = 0.02
_STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5])
_SIGNS = np.array([[1.0], [1.0], [-1.0]])  # of the unit circle x^2 + y^2 - 1
_MOST_AVERTED = 0.1  # cosine with the ray to it: no disc that leans more is a disc in the photo
_MOST_SCALED, _MOST_SLOPE = 2.0, 20.0  # ln of the radius, tangent of the lean: a step beyond follows no outline
_HELD = 1e8  # information on a radius that is held
POINTS_PER_OBSERVATION = 10.0
"""Edge points 1.2 px apart share JPEG's blocks (8 px of brightness, 16 of colour) and err together: ten are one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpaceCircle:
    """A circle in the RECTIFIED left frame: `centre_px` (2,) of its centre's picture, `disparity_px`, `normal` (3,).

    `covariance` (4, 4) of [x px, y px, disparity px, ln radius], `rms_px` the misfit of the outline.
    """

    centre_px: FloatArray
    disparity_px: float
    radius_m: float
    normal: FloatArray
    covariance: FloatArray
    rms_px: float


def fit_circle(
    left_edge: FloatArray,
    right_edge: FloatArray,
    left: Ellipse,
    right: Ellipse,
    camera: RectifiedCamera,
    sigma_px: FloatArray | None = None,
    held_m: float | None = None,
    start: SpaceCircle | None = None,
) -> SpaceCircle | None:
    """Fit the circle whose pictures run through both outlines (N, 2) and (M, 2); None where the fit fails.

    An ellipse leaves two tilts open; both are tried, and the one that both photos agree on is taken.
    `sigma_px` (N + M,) says how sure the points are against each other; they are alike where it isn't given. A radius
    that is `held_m` stays as it is: foreign points can't shrink the circle.
    """
    trust = np.ones(len(left_edge) + len(right_edge)) if sigma_px is None else np.median(sigma_px) / sigma_px
    free = np.array([True, True, True, held_m is None, True, True])
    facing = _axes(left.centre, camera)
    both = (start, mirrored(start, camera)) if start is not None else ()
    starts = [_parameters(one, facing) for one in both] or _starts(left, right, camera, held_m)
    fits = [_descend(start, left_edge, right_edge, camera, facing, trust, free) for start in starts]
    good = [fit for fit in fits if np.all(np.isfinite(fit[0])) and fit[0][2] > 0.0]
    if not good:
        return None
    parameters, jacobian, residual = min(good, key=lambda fit: float(np.sum(np.square(trust * fit[2]))))
    arcs = np.concatenate([arcs_of(left_edge, left), arcs_of(right_edge, right)])
    for _ in range(_ROBUST_ROUNDS):
        kept = np.flatnonzero(trust > 0.0)  # what was left out before doesn't count as well fitted
        weighed = trust[kept, None] * jacobian[np.ix_(kept, free)]
        trust[kept] *= without_foreign_arc(weighed, trust[kept] * residual[kept], arcs[kept])
        spread = max(robust_sigma((trust * residual)[trust > 0.0]), _LEAST_SPREAD_PX)
        weight = trust * np.sqrt(cauchy(trust * residual / spread))
        parameters, jacobian, residual = _descend(parameters, left_edge, right_edge, camera, facing, weight, free)
    if not np.all(np.isfinite(parameters)):
        return None
    freedom = max(int(np.sum(trust > 0.0)) - len(parameters), 1)
    off = trust * residual
    variance = float(off @ off) / freedom * POINTS_PER_OBSERVATION
    # The tilt of a disc seen from the front is nearly free; a weak prior (about a radian) keeps the inverse finite.
    prior = np.diag([0.0, 0.0, 0.0, 0.0 if held_m is None else _HELD, 1.0, 1.0])
    information = jacobian.T @ jacobian / max(variance, 1e-6) + prior
    return SpaceCircle(
        centre_px=frozen(parameters[:2]),
        disparity_px=float(parameters[2]),
        radius_m=float(np.exp(parameters[3])),
        normal=frozen(_normals(parameters[None], facing)[0]),
        covariance=frozen(np.linalg.inv(information)[:4, :4]),
        rms_px=float(np.sqrt(off @ off / (trust @ trust))),
    )


def between(one: SpaceCircle, other: SpaceCircle, share: float) -> SpaceCircle:
    """Return the circle between two of nearly the same place, `share` of the way to the other, whose lean it keeps.

    Both saw the same photos: it isn't taken for surer than they are.
    """
    near = 1.0 - share
    return replace(
        other,
        centre_px=frozen(near * one.centre_px + share * other.centre_px),
        disparity_px=near * one.disparity_px + share * other.disparity_px,
        radius_m=one.radius_m**near * other.radius_m**share,
        covariance=frozen(near * one.covariance + share * other.covariance),
    )


def guessed_circles(
    ellipse: Ellipse, disparity_px: float, radius_m: float, camera: RectifiedCamera
) -> tuple[SpaceCircle, ...]:
    """Return both circles of a given radius about where an ellipse of the left photo and a disparity place one."""
    right, facing = replace(ellipse, x_px=ellipse.x_px - disparity_px), _axes(ellipse.centre, camera)
    return tuple(
        SpaceCircle(
            centre_px=frozen(parameters[:2]), disparity_px=disparity_px, radius_m=radius_m,
            normal=frozen(_normals(parameters[None], facing)[0]), covariance=frozen(np.eye(4)), rms_px=0.0,
        )
        for parameters in _starts(ellipse, right, camera, radius_m)
    )  # fmt: skip


def mirrored(circle: SpaceCircle, camera: RectifiedCamera) -> SpaceCircle:
    """Return the circle that leans the other way, whose picture in the left photo is nearly the same."""
    ray = _axes(circle.centre_px, camera)[2]
    normal = 2.0 * float(circle.normal @ ray) * ray - circle.normal
    return replace(circle, normal=frozen(unit(normal)))


def _starts(left: Ellipse, right: Ellipse, camera: RectifiedCamera, radius_m: float | None) -> list[FloatArray]:
    """Return both circles (6,) whose picture in the left photo is an ellipse.

    Reference: Kanatani & Liu 1993, the normals of a circle from the eigenvectors of its cone.
    """
    disparity = left.x_px - right.x_px
    radius = radius_m or left.major_px * camera.baseline_m / disparity
    values, vectors = np.linalg.eigh(camera.K.T @ left.conic @ camera.K)
    lean = np.sqrt((values[2] - values[1]) / (values[2] - values[0])) * vectors[:, 2]
    facing = np.sqrt((values[1] - values[0]) / (values[2] - values[0])) * vectors[:, 0]
    base, axes = [left.x_px, left.y_px, disparity, np.log(radius)], _axes(left.centre, camera)
    return [np.array([*base, *_lean(normal, axes)]) for normal in (facing + lean, facing - lean)]


def _axes(pixel: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return what lies level and down square to a pixel's ray, and the ray, as rows (3, 3).

    A circle's lean is measured against its ray: aside, one that is well seen may be edge-on to the optical axis.
    """
    ray = unit(camera.rectified_rays(pixel))
    level = unit(np.array([ray[2], 0.0, -ray[0]]))
    return np.stack([level, np.cross(ray, level), ray])


def _lean(normal: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the tangents (2,) by which a normal (3,) leans off the ray, level and down; it may look either way."""
    level, down, away = axes @ normal
    return np.array([level, down]) * (-float(np.sign(away)) / max(abs(float(away)), _MOST_AVERTED))


def _normals(parameters: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the unit normals (K, 3), towards us, of circles (K, 6)."""
    normal = parameters[:, 4:] @ axes[:2] - axes[2]
    return np.asarray(normal / np.sqrt(np.sum(normal**2, axis=-1, keepdims=True)), dtype=np.float64)


def _residual(
    parameters: FloatArray, left: FloatArray, right: FloatArray, camera: RectifiedCamera, axes: FloatArray
) -> FloatArray:
    """Return the distances (K, N + M) in pixels of both outlines from the pictures of K circles (K, 6)."""
    of_left, of_right = _conics(parameters, camera, axes)
    return np.concatenate([conic_distance(of_left, left), conic_distance(of_right, right)], axis=-1)


def outlines_of(circle: SpaceCircle, camera: RectifiedCamera) -> tuple[Ellipse | None, Ellipse | None]:
    """Return a circle's pictures in the left and the right photo; None where one is no ellipse."""
    axes = _axes(circle.centre_px, camera)
    left, right = (ellipse_of(conic[0]) for conic in _conics(_parameters(circle, axes)[None], camera, axes))
    return left, right


def _parameters(circle: SpaceCircle, axes: FloatArray) -> FloatArray:
    return np.array([*circle.centre_px, circle.disparity_px, np.log(circle.radius_m), *_lean(circle.normal, axes)])


def _conics(parameters: FloatArray, camera: RectifiedCamera, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the pictures (K, 3, 3) in the left and the right photo of circles (K, 6)."""
    x, y, disparity = parameters[:, :3].T
    across, down = (x - camera.cx_px) / camera.f_px, (y - camera.cy_px) / camera.f_px
    nx, ny, nz = _normals(parameters, axes).T
    level = np.sqrt(nx**2 + nz**2)
    ux, uz = -nz / level, nx / level  # u is level; v = normal x u
    share = np.exp(parameters[:, 3]) * disparity / (camera.f_px * camera.baseline_m)  # radius over depth
    planes = np.empty((2, len(parameters), 3, 3))
    planes[:, :, 0, 0], planes[:, :, 1, 0], planes[:, :, 2, 0] = share * ux, 0.0, share * uz
    planes[:, :, 0, 1], planes[:, :, 2, 1] = share * ny * uz, -share * ny * ux
    planes[:, :, 1, 1] = share * (nz * ux - nx * uz)
    planes[0, :, 0, 2], planes[1, :, 0, 2] = across, across - disparity / camera.f_px
    planes[:, :, 1, 2], planes[:, :, 2, 2] = down, 1.0
    planes[:, :, 0] = camera.f_px * planes[:, :, 0] + camera.cx_px * planes[:, :, 2]
    planes[:, :, 1] = camera.f_px * planes[:, :, 1] + camera.cy_px * planes[:, :, 2]
    back = np.linalg.inv(planes)
    left, right = np.swapaxes(back, -1, -2) @ (_SIGNS * back)
    return left, right


def _descend(
    start: FloatArray, left: FloatArray, right: FloatArray, camera: RectifiedCamera, axes: FloatArray,
    scale: FloatArray, free: BoolArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Return parameters (6,), their Jacobian and the plain residual at the least weighted squares.

    Levenberg-Marquardt by hand: for a blurred disc 7 m away SciPy ends at another minimum, 2.8 % off. The lean is
    given in `axes` (3, 3); `scale` (N + M,) multiplies the residuals; parameters that aren't `free` (6,) stay.
    """
    parameters, damping = start, 1e-3

    def weighted(at: FloatArray) -> FloatArray:
        return np.asarray(scale * _residual(at[None], left, right, camera, axes)[0], dtype=np.float64)

    residual = weighted(parameters)
    jacobian, at = np.zeros((len(residual), 6)), None
    for _ in range(_ROUNDS):
        if at is not parameters:  # after a step that led nowhere all but the damping is as it was
            at = parameters
            moved = scale * _residual((parameters + np.diag(_STEPS))[free], left, right, camera, axes)
            jacobian[:, free] = ((moved - residual) / _STEPS[free, None]).T
        hessian, gradient = jacobian.T @ jacobian, jacobian.T @ residual
        change = -np.linalg.solve(hessian + np.diag(damping * np.diag(hessian) + 1e-12), gradient)
        tried = parameters + change
        if tried[2] <= 0.0 or abs(tried[3] - start[3]) > _MOST_SCALED or np.abs(tried[4:]).max() > _MOST_SLOPE:
            damping *= 10.0
            continue
        after = weighted(tried)
        if after @ after < residual @ residual:
            gained = 1.0 - float(after @ after) / max(float(residual @ residual), 1e-30)
            parameters, residual, damping = tried, after, damping * 0.2
            if gained < 1e-9:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    return parameters, jacobian, _residual(parameters[None], left, right, camera, axes)[0]
