"""Is a calibration to be trusted? A small reprojection error proves little: these are the figures that say more."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust, rms_px
from asbuilt_bim.camera.calibration.lens_check import CornerFit, better_lens
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, right_from_left_of
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, freeze, frozen
from asbuilt_bim.geometry.transform import apply, rigid

BASELINE_M = (0.02, 3.0)
"""No site rig is narrower or wider; outside, the board's square was given in another unit."""
_GRID = (8, 6)
_FOLDS = 3
_LOW_COVERAGE = 0.6
_LARGE_HOLD_OUT = 1.5  # times the rms of the fit itself
_LARGE_LENGTH_ERROR = 0.005  # of a length: 1 % of area
_LARGE_SCALE_SIGMA = 0.005


@dataclass(frozen=True, slots=True, kw_only=True)
class Checks:
    """What is known of a calibration beyond its own misfit.

    Coverage: share of an 8 x 6 grid of the frame where corners were seen. Hold-out: a third of the pairs at a time is
    kept out, and the rig is fitted to the others. The board's pose is from the LEFT photo, the misfit that of the
    corners in the right one. Length: median relative error of the boards' diagonals, triangulated in those same views.
    Lens left: what another model of lens explains of the residuals, 0 where none does.
    """

    coverage_left: float
    coverage_right: float
    hold_out_rms_px: float
    length_error: float | None  # None where no two points are known in both photos
    focal_sigma_px: float
    baseline_sigma_m: float
    lens_left_px: float
    warnings: tuple[Note, ...]


def refuse_impossible(right_from_left: FloatArray, scale: str, remedy: str) -> None:
    """Refuse a rig whose right camera doesn't stand to the right, or whose baseline can't be.

    `scale` says what the rig's scale comes from, `remedy` what to do where it is off.

    Raises: CalibrationError.
    """
    x, y, z = -right_from_left[:3, :3].T @ right_from_left[:3, 3]
    baseline = float(np.linalg.norm([x, y, z]))
    low, high = BASELINE_M
    if not low <= baseline <= high:
        one = ". Or left and right are photos of one camera: name the other's" if baseline < low else ""
        raise CalibrationError(
            f"calibration: the baseline comes out at {baseline:.4g} m (limit {low:g} to {high:g} m) with {scale}; "
            f"{remedy}{one}"
        )
    if x < 0.0 and abs(x) > abs(y):
        raise CalibrationError(
            f"calibration: left and right are swapped: the right camera stands {-x:.3f} m to the LEFT of the left one. "
            "Exchange left and right of the board photos (and of the stations, if they were named the same way)"
        )
    if abs(x) < np.hypot(y, z):
        raise CalibrationError(
            f"calibration: the right camera stands at x {x:.3f}, y {y:.3f}, z {z:.3f} m of the left one, not beside "
            "it. Use photos as the cameras stored them, of a rig held level"
        )


def corner_fits(views: list[BoardView], adjusted: Adjustment) -> tuple[CornerFit, CornerFit]:
    """Gather all corners of the left and of the right camera with their residuals."""
    sides: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for view, residual in zip(views, adjusted.residuals, strict=True):
        split = 2 * len(view.left_px)
        sides[0].append(residual[:split].reshape(-1, 2))
        sides[1].append(residual[split:].reshape(-1, 2))
    pixels = [view.left_px for view in views], [view.right_px for view in views]
    left, right = (
        CornerFit(
            pixels=frozen(np.concatenate(at)),
            residual_px=frozen(np.concatenate(off)),
            view=freeze(np.repeat(np.arange(len(off), dtype=np.int32), [len(one) for one in off])),
        )
        for at, off in zip(pixels, sides, strict=True)
    )
    return left, right


def check_calibration(views: list[BoardView], adjusted: Adjustment, rig: StereoRig) -> Checks:
    """Measure coverage, hold-out error, a known length, sigma of focal length and baseline, what the lens left."""
    size = rig.left.width_px, rig.left.height_px
    left = share_covered(np.concatenate([view.left_px for view in views]), size)
    right = share_covered(np.concatenate([view.right_px for view in views]), size)
    hold_out, length = _hold_out(views, adjusted, size)
    focal_sigma, baseline_sigma, relative = scale_sigmas(rig)
    lens = better_lens(views, adjusted)
    off = length or 0.0
    warnings: list[Note] = []
    if min(left, right) < _LOW_COVERAGE:
        warnings.append(warning(Reason.CALIBRATION_COVERAGE, {"share": min(left, right)}))
    if hold_out > max(_LARGE_HOLD_OUT * adjusted.rms_px, 0.3):
        warnings.append(warning(Reason.CALIBRATION_HOLD_OUT, {"hold_out_px": hold_out, "rms_px": adjusted.rms_px}))
    if off > _LARGE_LENGTH_ERROR:
        warnings.append(warning(Reason.CALIBRATION_LENGTH, {"share": off}))
    if relative > _LARGE_SCALE_SIGMA:
        warnings.append(warning(Reason.CALIBRATION_SCALE, {"share": relative}))
    if lens is not None:
        warnings.append(warning(Reason.CALIBRATION_LENS, {"left_px": lens.left_px, "model": lens.model}))
    return Checks(
        coverage_left=left,
        coverage_right=right,
        hold_out_rms_px=hold_out,
        length_error=length,
        focal_sigma_px=focal_sigma,
        baseline_sigma_m=baseline_sigma,
        lens_left_px=lens.left_px if lens is not None else 0.0,
        warnings=tuple(warnings),
    )


def scale_sigmas(rig: StereoRig) -> tuple[float, float, float]:
    """Return sigma of the focal length in pixels (the worse one), of the baseline in metres, and both as one share."""
    shift = rig.right_from_left[:3, 3]
    along = shift / np.linalg.norm(shift)
    baseline_m = float(np.sqrt(max(float(along @ rig.covariance[11:14, 11:14] @ along), 0.0)))
    focal_px = float(np.sqrt(np.max(np.diag(rig.covariance)[[0, 4]])))
    return focal_px, baseline_m, float(np.hypot(focal_px / rig.left.K[0, 0], baseline_m / np.linalg.norm(shift)))


def warning(code: Reason, values: Values) -> Note:
    """Return a note on what to take care of with a calibration."""
    return noted(code, about(SubjectKind.RIG), **values)


def share_covered(pixels: FloatArray, size: tuple[int, int]) -> float:
    """Return the share of an 8 x 6 grid of the frame that pixels (N, 2) fall into."""
    cells = np.clip(np.floor((pixels + 0.5) / np.array(size) * np.array(_GRID)), 0, np.array(_GRID) - 1).astype(int)
    return float(len(np.unique(cells, axis=0)) / (_GRID[0] * _GRID[1]))


def _hold_out(views: list[BoardView], adjusted: Adjustment, size: tuple[int, int]) -> tuple[float, float | None]:
    """Return the rms in pixels in the right photos of views kept back, and the relative error of known lengths."""
    misses: list[FloatArray] = []
    lengths: list[float] = []
    for fold in range(_FOLDS):
        inside = [i for i in range(len(views)) if i % _FOLDS != fold]
        fitted = adjust(adjusted.shared, adjusted.poses[inside], [views[i] for i in inside])
        for index in set(range(len(views))) - set(inside):
            misses.append(_miss(fitted.shared, adjusted.poses[index], views[index], size))
            error = length_error(fitted.shared, views[index], size)
            if error is not None:
                lengths.append(error)
    return rms_px(np.concatenate(misses)), float(np.median(lengths)) if lengths else None


def _miss(shared: FloatArray, pose: FloatArray, view: BoardView, size: tuple[int, int]) -> FloatArray:
    """Fit the board's pose in the left photo alone and return its misfit in the right one."""
    from_left = replace(view, right_points_m=np.zeros((0, 3)), right_px=np.zeros((0, 2)))
    fitted = adjust(shared, pose[None], [from_left], free=np.zeros(len(shared), dtype=bool)).poses[0]
    in_left = apply(rigid(fitted[:3], fitted[3:]), view.right_points_m)
    right = camera_of(shared, 1, size)
    missed: FloatArray = (right.project(apply(right_from_left_of(shared), in_left)) - view.right_px).ravel()
    return missed


def length_error(shared: FloatArray, view: BoardView, size: tuple[int, int]) -> float | None:
    """Triangulate the two points furthest apart that both photos show; return the relative error of their distance.

    None where there are no two.
    """
    apart = np.linalg.norm(view.left_points_m[:, None] - view.right_points_m[None], axis=-1)
    in_left, in_right = np.nonzero(apart < 1e-9)
    if len(in_left) < 2:
        return None
    points = view.left_points_m[in_left]
    distances = np.linalg.norm(points[:, None] - points[None], axis=-1)
    ends = np.array(np.unravel_index(int(np.argmax(distances)), distances.shape))
    left, right = camera_of(shared, 0, size), camera_of(shared, 1, size)
    at = view.left_px[in_left[ends]], view.right_px[in_right[ends]]
    met = triangulate(left, right, right_from_left_of(shared), *at)
    error = abs(float(np.linalg.norm(met[0] - met[1]) / distances[ends[0], ends[1]]) - 1.0)
    return error if np.isfinite(error) else None
