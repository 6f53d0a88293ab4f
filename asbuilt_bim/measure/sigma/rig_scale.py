"""What a station shows of the rig's scale: target and markers as the rig triangulates them; and whether it shows any.

Their true sizes are not asked for here: measuring stays the same whatever is known of them.
"""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.vision.markers.find import MarkerSighting
from asbuilt_bim.vision.target.find import TargetOptions, TargetSighting, find_target


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScaleEvidence:
    """Lengths as one station's photos show them: `marker_corners_m` (M, 4, 3) in the left frame, of `marker_ids`.

    `marker_sigma` (M,) is the relative standard deviation of a marker's size, `marker_depth_m` (M,) a corner's own in
    depth; `target_diameter_m` is 0 where no single
    disc is seen in both photos, and `target_m` (3,) its centre.
    """

    target_diameter_m: float
    marker_ids: tuple[int, ...]
    marker_corners_m: FloatArray
    marker_sigma: FloatArray
    marker_depth_m: FloatArray
    target_m: FloatArray | None = None


def scale_evidence(
    pair: RectifiedPair, target: TargetSighting | None, markers: tuple[MarkerSighting, ...], options: TargetOptions
) -> ScaleEvidence:
    """Gather what a station shows of scale; a single disc of another size than given counts: the rig may be wrong."""
    if target is None and options.diameter_m is not None:
        target, _ = find_target(pair, replace(options, diameter_m=None, required=False))
    ids, corners, sigmas, depths = [], [], [], []
    for marker in markers:
        if marker.right_px is None:
            continue
        disparity = marker.left_px[:, 0] - marker.right_px[:, 0]
        if disparity.min() <= 0.5:
            continue
        side = float(np.mean(np.linalg.norm(np.roll(marker.left_px, -1, axis=0) - marker.left_px, axis=1)))
        ids.append(marker.marker_id)
        corners.append(pair.camera.points(marker.left_px, disparity))
        # four corners' disparities are averaged, and of each side both ends err
        depth = marker.sigma_px * np.sqrt(2.0) / float(np.mean(disparity)) / 2.0
        sigmas.append(float(np.hypot(depth, marker.sigma_px / side)))
        depths.append(2.0 * depth * float(np.mean(corners[-1][:, 2])))
    return ScaleEvidence(
        target_diameter_m=0.0 if target is None else target.diameter_m,
        marker_ids=tuple(ids),
        marker_corners_m=frozen(np.array(corners).reshape(-1, 4, 3)),
        marker_sigma=frozen(np.array(sigmas)),
        marker_depth_m=frozen(np.array(depths)),
        target_m=None if target is None else frozen(pair.camera.points(target.left_px, target.disparity_px)),
    )


def without_scale(
    name: str,
    target: TargetSighting | None,
    reasons: tuple[Rejection, ...],
    markers: tuple[MarkerSighting, ...],
    *,
    required: bool,
    least: int,
) -> tuple[Rejection, ...]:
    """Return why a station without a target can't be used; empty where it can: `least` markers hold the scale too."""
    if target is not None:
        return ()
    if required:
        return reasons or (rejected(Reason.TARGET_ABSENT, about(SubjectKind.TARGET, station=name)),)
    both = sum(1 for marker in markers if marker.right_px is not None)
    if both >= least:
        return ()
    few = rejected(Reason.SCALE_UNCHECKED, about(SubjectKind.STATION, name), found=both, needed=least)
    return (*reasons, few)
