"""The one test of a rig's scale: a known length, seen by it. A wrong square size cancels out of everything else."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.boards import Board, find_board, same_way_round
from asbuilt_bim.camera.calibration.parameters import CORNER_SIGMA_PX
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.triangulate import meeting_gap_px, triangulate
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray

CLICK_SIGMA_PX = 0.5
"""What a hand marks a point to, in a photo that it enlarged."""
SCALE_LIMIT = 0.01
"""Of a length, 2 % of an area: a print or a tape is good to a tenth of it, areas are wanted to 3 %."""
_SIGNIFICANT = 2.0
_OTHER_UNIT = 0.85  # off by so much, up or down, no print and no tape errs: millimetres, centimetres and inches do
_NO_MEETING_PX = 5.0  # five sigmas of a hand: these are not the same point


@dataclass(frozen=True, slots=True, kw_only=True)
class LengthCheck:
    """A known length as the rig measures it; `sigma_m` is that of the marks in the photos alone."""

    what: str
    known_m: float
    measured_m: float
    sigma_m: float

    @property
    def off(self) -> float:
        """Return the relative error of the measured length."""
        return self.measured_m / self.known_m - 1.0


def check_points(rig: StereoRig, marked_px: FloatArray, known_m: float) -> LengthCheck:
    """Measure the distance of two points that a hand marked: `marked_px` (4, 2) left, right, left, right.

    Pixels are those of the ORIGINAL photos of one pair.

    Raises: CalibrationError where a point lies outside the photos, or its two marks don't meet in space.
    """
    left, right = marked_px[0::2], marked_px[1::2]
    for number, pixels in enumerate(marked_px):
        camera = rig.left if number % 2 == 0 else rig.right
        if not (np.all(pixels >= -0.5) and pixels[0] < camera.width_px and pixels[1] < camera.height_px):
            side = "left" if number % 2 == 0 else "right"
            raise CalibrationError(
                f"check points: {pixels[0]:g},{pixels[1]:g} lies outside the {side} photo of {camera.width_px} x "
                f"{camera.height_px} px; give left and right pixels of the first end, then of the second"
            )
    _meet(rig, left, right, "check points: point {}")
    return _check("the marked length", rig, left, right, known_m, CLICK_SIGMA_PX)


def check_board(rig: StereoRig, pair: tuple[Photo, Photo], board: Board) -> LengthCheck:
    """Measure the diagonal of a second board, whose squares are known, in one pair of photos.

    Raises: CalibrationError where the board isn't found in both photos; PhotoError where they can't be decoded.
    """
    name = f"{pair[0].name} + {pair[1].name}"
    seen_left, seen_right = (find_board(decode(photo), board) for photo in pair)
    if seen_left is None or seen_right is None:
        raise CalibrationError(f"check board {name}: the board was not found in both photos; take it sharp and near")
    seen_right = same_way_round(seen_left, seen_right, board)
    common, at_left, at_right = np.intersect1d(seen_left.indices, seen_right.indices, return_indices=True)
    points = board.points_m[common]
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    ends = np.array(np.unravel_index(int(np.argmax(apart)), apart.shape))
    if len(common) < 2:
        raise CalibrationError(f"check board {name}: both photos have no two corners in common; show the whole board")
    left, right = seen_left.pixels[at_left[ends]], seen_right.pixels[at_right[ends]]
    _meet(rig, left, right, f"check board {name}: corner {{}}")
    return _check(f"the check board in {name}", rig, left, right, float(apart.max()), CORNER_SIGMA_PX)


def _meet(rig: StereoRig, left_px: FloatArray, right_px: FloatArray, what: str) -> None:
    """Refuse two ends (2, 2) whose pixels in both photos don't meet before the rig; `what` takes an end's number.

    Raises: CalibrationError with the first that doesn't.
    """
    points = triangulate(rig.left, rig.right, rig.right_from_left, left_px, right_px)
    gaps = meeting_gap_px(rig.left, rig.right, rig.right_from_left, points, left_px, right_px)
    for number, (point, gap) in enumerate(zip(points, gaps, strict=True), 1):
        if point[2] <= 0.0:
            raise CalibrationError(
                f"{what.format(number)} comes out {-point[2]:.3g} m BEHIND the rig: left and right are exchanged, "
                "or of two pairs"
            )
        if not gap < _NO_MEETING_PX:
            raise CalibrationError(
                f"{what.format(number)}: its places in the two photos don't meet ({gap:.1f} px apart, limit "
                f"{_NO_MEETING_PX:g} px): these are different things, photos of two moments, or the rig is wrong"
            )


def refuse_wrong_scale(check: LengthCheck) -> None:
    """Refuse a rig whose scale is off, and a check that can't tell.

    Raises: CalibrationError with both lengths.
    """
    sigma = check.sigma_m / check.known_m
    if abs(check.off) > _OTHER_UNIT:
        raise CalibrationError(
            f"check length: {check.what} comes out at {check.measured_m:.4g} m instead of {check.known_m:.4g} m: "
            "lengths and squares are in metres; one of the two was given in another unit"
        )
    if not np.isfinite(check.off) or sigma > SCALE_LIMIT:
        raise CalibrationError(
            f"check length: {check.what} is measured to {100 * sigma:.1f} % only (limit {100 * SCALE_LIMIT:g} %), "
            "which proves nothing; take it nearer, longer, and across the view"
        )
    if abs(check.off) > SCALE_LIMIT + _SIGNIFICANT * sigma:
        raise CalibrationError(
            f"check length: {check.what} comes out at {check.measured_m:.4f} m instead of {check.known_m:.4f} m "
            f"({100 * check.off:+.2f} %, limit {100 * SCALE_LIMIT:g} % and twice its sigma of {100 * sigma:.2f} %): "
            "the rig's scale is off. Measure the calibration board's squares on the print and give square_m"
        )


def _check(
    what: str, rig: StereoRig, left_px: FloatArray, right_px: FloatArray, known_m: float, sigma_px: float
) -> LengthCheck:
    """Measure, and carry the marks' sigma to the length by finite differences."""
    marks = np.concatenate([left_px, right_px])

    def length(at: FloatArray) -> float:
        ends = triangulate(rig.left, rig.right, rig.right_from_left, at[:2], at[2:])
        return float(np.linalg.norm(ends[1] - ends[0]))

    step = 0.01
    slopes = []
    for index in range(marks.size):
        moved = marks.copy()
        moved.flat[index] += step
        slopes.append((length(moved) - length(marks)) / step)
    sigma_m = float(sigma_px * np.linalg.norm(slopes))
    return LengthCheck(what=what, known_m=known_m, measured_m=length(marks), sigma_m=sigma_m)
