"""What a rig's numbers contradict: the size that they are said to be of, the type of camera, another file of it."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.camera_types import CameraType
from asbuilt_bim.camera.rig_formats.zed import SIZES
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, RigError, rejected

OFF_CENTRE = 0.2
"""Of a side: how far a principal point may lie from the frame's middle. Middlebury's crops lie 0.11 off, bought
cameras 0.04; numbers of a photo half as large lie 0.25 off."""
BASELINE_DOUBT = 0.025
"""Of a nominal baseline: an OAK-D's own memory is 1.6 % off its data sheet, ZEDs 0.1 %; an owner's ZED pair was 4 %."""
BASELINE_REFUSED = 0.10
"""An estimate that wandered off, as visual odometry's do, or another camera's file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubts:
    """What contradicts a rig that is used all the same, and by what share its baseline is in doubt."""

    warnings: tuple[Rejection, ...] = ()
    baseline_share: float = 0.0


def refuse_size(rig: StereoRig, where: str) -> None:
    """Refuse numbers that belong to photos of another size than they are said to.

    Raises: RigError with the code `RIG_SIZE_CONTRADICTED`.
    """
    if not all(_is_off_centre(camera) for camera in (rig.left, rig.right)):
        return
    camera = rig.left
    likely = 2.0 * camera.K[0, 2], 2.0 * camera.K[1, 2]
    known = min(SIZES.values(), key=lambda size: abs(np.log(size[0] / likely[0])) + abs(np.log(size[1] / likely[1])))
    near = all(abs(side / other - 1.0) < 0.15 for side, other in zip(known, likely, strict=True))
    of = f"{known[0]}x{known[1]}" if near else f"about {likely[0]:.0f}x{likely[1]:.0f}"
    subject = about(SubjectKind.RIG)
    raise RigError(
        f"{where}: it says {camera.width_px}x{camera.height_px}, and its principal point ({camera.K[0, 2]:.0f}, "
        f"{camera.K[1, 2]:.0f}) is that of photos of {of}. Correct the size, or take the camera's own file",
        [
            rejected(
                Reason.RIG_SIZE_CONTRADICTED, subject, size_px=(camera.width_px, camera.height_px), likely_px=likely
            )
        ],
    )


def _is_off_centre(camera: Intrinsics) -> bool:
    size = np.array([camera.width_px, camera.height_px], dtype=np.float64)
    return bool(np.all(np.abs((camera.K[:2, 2] + 0.5) / size - 0.5) > OFF_CENTRE))


def against_type(rig: StereoRig, camera: CameraType, where: str) -> Doubts:
    """Hold a baseline against that of its type of camera.

    Raises: RigError with the code `RIG_BASELINE_NOT_OF_TYPE` where it is off by over `BASELINE_REFUSED`.
    """
    nominal = camera.nearest_m(rig.baseline_m)
    share = rig.baseline_m / nominal - 1.0
    if abs(share) <= BASELINE_DOUBT:
        return Doubts()
    found = rejected(
        Reason.RIG_BASELINE_NOT_OF_TYPE, about(SubjectKind.RIG), camera=camera.name, nominal_m=nominal,
        baseline_m=rig.baseline_m, share=share,
    )  # fmt: skip
    if abs(share) > BASELINE_REFUSED:
        raise RigError(
            f"{where}: its eyes stand {1000.0 * rig.baseline_m:.1f} mm apart, and a {camera.name} has "
            f"{1000.0 * nominal:.0f} mm ({share:+.0%}): an estimated pose, or another camera's file. Take the camera's "
            "own calibration, or calibrate it here",
            [found],
        )
    return Doubts(warnings=(found,), baseline_share=abs(share))


def against_other(rig: StereoRig, other: StereoRig, name: str) -> Doubts:
    """Hold a baseline against that of another file, `name`, of the same camera."""
    share = other.baseline_m / rig.baseline_m - 1.0
    if abs(share) <= BASELINE_DOUBT:
        return Doubts()
    found = rejected(
        Reason.RIG_FILES_CONTRADICT, about(SubjectKind.RIG), file=name, baseline_m=rig.baseline_m,
        other_m=other.baseline_m, share=share,
    )  # fmt: skip
    return Doubts(warnings=(found,), baseline_share=abs(share))
