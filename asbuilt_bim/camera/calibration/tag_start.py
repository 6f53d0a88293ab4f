"""A first estimate of a rig from single tags: focal lengths are tried, and the cameras laid over the tags' centres."""

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust
from asbuilt_bim.camera.calibration.parameters import (
    BoardView,
    camera_of,
    layout_of,
    pack,
    right_from_left_of,
    view_residual,
)
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import COEFFICIENTS, LensModel
from asbuilt_bim.camera.triangulate import square_poses, triangulate
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, laid_over, rotation_from_vector, vector_from_rotation

_FOCAL_TRIED = (0.45, 0.8, 1.4, 2.4)  # of the frame's width; the adjustment finds what lies between
_LARGEST = 24  # sightings: enough for a start, and the best
_FEWEST_CENTRES = 3
_ROUNDS = 5
_TAG_ROUNDS = 12
_TURNED_OVER = 5
_CLEARLY = 0.999  # of the sum of squares: the same pose found again is no other


def start_tags(views: list[BoardView], size: tuple[int, int], lens: LensModel) -> tuple[FloatArray, FloatArray]:
    """Return shared parameters (S,) with an ideal lens, and each tag's left_from_tag (V, 6).

    Raises: CalibrationError where the tags give none.
    """
    largest = sorted(views, key=lambda view: -cv2.contourArea(view.left_px.astype(np.float32)))[:_LARGEST]
    tried = [found for share in _FOCAL_TRIED if (found := _tried(largest, size, lens, share)) is not None]
    if not tried:
        raise CalibrationError(
            "calibration: the tags don't give a rig; show more of them at once, near, tilted, at several distances"
        )
    best = min(tried, key=lambda found: found[1])[0]
    return best, np.stack([tag_pose(best, view, size) for view in views])


def adjust_tags(
    shared: FloatArray, poses: FloatArray, views: list[BoardView], free: BoolArray | None = None
) -> Adjustment:
    """Adjust the rig and all tags; a tag that fits better tilted to its other side is turned over, and again.

    The adjustment alone can't: between the two tilts every step is uphill, and a rig bends to suit the wrong ones.
    """
    done = adjust(shared, poses, views, free=free)
    for _ in range(_TURNED_OVER):
        turned = np.stack([_other_side(done.shared, pose, view) for pose, view in zip(done.poses, views, strict=True)])
        if np.array_equal(turned, done.poses):
            break
        done = adjust(done.shared, turned, views, free=free)
    return done


def _other_side(shared: FloatArray, pose: FloatArray, view: BoardView) -> FloatArray:
    """Return a tag's pose (6,), or the one mirrored at its line of sight where it fits better."""
    residual = view_residual(shared, pose, view)[0]
    at = pose[3:] / np.linalg.norm(pose[3:])
    turn = rotation_from_vector(pose[:3])
    mirror = np.eye(3) - 2.0 * np.outer(at, at)
    flipped = np.column_stack([mirror @ turn[:, 0], mirror @ turn[:, 1], np.zeros(3)])
    flipped[:, 2] = np.cross(flipped[:, 0], flipped[:, 1])
    other, cost = _fitted(shared, np.r_[vector_from_rotation(flipped), pose[3:]], view)
    return other if cost < _CLEARLY * float(residual @ residual) else pose


def _tried(
    views: list[BoardView], size: tuple[int, int], lens: LensModel, share: float
) -> tuple[FloatArray, float] | None:
    """Return the shared parameters with focal lengths near a share of the frame's width, and the misfit."""
    f = share * size[0]
    K = frozen([[f, 0.0, 0.5 * (size[0] - 1)], [0.0, f, 0.5 * (size[1] - 1)], [0.0, 0.0, 1.0]])
    camera = Intrinsics(K=K, distortion=frozen(np.zeros(COEFFICIENTS[lens])), width_px=size[0], height_px=size[1])
    relative = _relative(views, camera)
    if relative is None:
        return None
    shared = pack(camera, camera, relative)
    try:
        poses = np.stack([tag_pose(shared, view, size) for view in views])
        held = adjust_tags(shared, poses, views, _pose_alone(shared))  # the focal length as tried
        done = adjust_tags(held.shared, held.poses, views)
    except np.linalg.LinAlgError:
        return None
    misfit = done.rms_px
    focal = done.shared[[0, 1, layout_of(shared).camera, layout_of(shared).camera + 1]]
    usable = np.all(np.isfinite(done.shared)) and np.all((focal > 0.2 * size[0]) & (focal < 20.0 * size[0]))
    return (done.shared, misfit) if usable and np.isfinite(misfit) else None


def _pose_alone(shared: FloatArray) -> BoolArray:
    free = np.zeros(len(shared), dtype=bool)
    free[-6:] = True
    return free


def _relative(views: list[BoardView], camera: Intrinsics) -> FloatArray | None:
    """Lay the tags' centres, as each photo shows them by its own, over one another: right_from_left (4, 4)."""
    centres = [
        [one.mean(axis=0) for one in both if one is not None]
        for view in views
        if len(both := [_in_front(camera, view.left_points_m, view.left_px),
                        _in_front(camera, view.right_points_m, view.right_px)]) == 2
        and all(one is not None for one in both)
    ]  # fmt: skip
    if len(centres) < _FEWEST_CENTRES:
        return None
    left, right = (np.stack([pair[side] for pair in centres]) for side in (0, 1))
    distance = np.linalg.norm(left, axis=1)
    weights = 1.0 / distance**2
    pose = np.eye(4)
    for _ in range(_ROUNDS):
        pose = laid_over(left, right, weights)
        misfit = np.linalg.norm(apply(pose, left) - right, axis=1) / distance
        scale = max(float(np.median(misfit)), 1e-9)
        weights = 1.0 / distance**2 / (1.0 + (misfit / (2.0 * scale)) ** 2)
    return pose


def _in_front(camera: Intrinsics, points_m: FloatArray, pixels: FloatArray) -> FloatArray | None:
    """Return a tag's corners (4, 3) in a camera's frame, by the photo alone; None where it can't be."""
    poses = square_poses(points_m, camera.rays(pixels))
    return None if not poses else apply(poses[0], points_m)


def tag_pose(shared: FloatArray, view: BoardView, size: tuple[int, int]) -> FloatArray:
    """Return left_from_tag (6,) that fits both photos best with a rig as it is.

    Tried are what the left photo says alone, tilted to either side, and the corners as both photos place them.
    """
    left, right = camera_of(shared, 0, size), camera_of(shared, 1, size)
    begun = square_poses(view.left_points_m, left.rays(view.left_px))
    met = triangulate(left, right, right_from_left_of(shared), view.left_px, view.right_px)
    if np.all(np.isfinite(met)) and np.all(met[:, 2] > 0.0):
        begun.append(laid_over(view.left_points_m, met))
    if not begun:
        raise np.linalg.LinAlgError("a tag that stands before neither camera")
    fitted = [_fitted(shared, np.r_[vector_from_rotation(pose[:3, :3]), pose[:3, 3]], view) for pose in begun]
    best: FloatArray = min(fitted, key=lambda one: one[1])[0]
    return best


def _fitted(shared: FloatArray, pose: FloatArray, view: BoardView) -> tuple[FloatArray, float]:
    """Fit one tag's pose to both photos (Levenberg-Marquardt); returns it and the sum of squares."""
    residual, _, by_pose = view_residual(shared, pose, view)
    cost, damping = float(residual @ residual), 1e-3
    for _ in range(_TAG_ROUNDS):
        normal = by_pose.T @ by_pose
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -by_pose.T @ residual)
        after, _, slopes = view_residual(shared, pose + step, view)
        new_cost = float(after @ after)
        if np.isfinite(new_cost) and new_cost < cost:
            pose, residual, by_pose, damping = pose + step, after, slopes, damping * 0.1
            if cost - new_cost < 1e-9 * cost:
                break
            cost = new_cost
        else:
            damping *= 10.0
    return pose, cost
