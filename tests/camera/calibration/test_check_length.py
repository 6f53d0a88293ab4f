from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.calibration.boards import Board, board_of
from asbuilt_bim.camera.calibration.check_length import check_board, check_points, refuse_wrong_scale
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply
from tests.camera.board_pictures import CHARUCO, CHESS, RIGHT_FROM_LEFT, K, pairs
from tests.camera.virtual import rig

ENDS = np.array([[-0.5, 0.1, 2.0], [0.7, 0.1, 2.0]])  # 1.2 m across the view


def marks(ends: FloatArray = ENDS) -> FloatArray:
    one = rig()
    left, right = one.left.project(ends), one.right.project(apply(one.right_from_left, ends))
    return np.stack([left[0], right[0], left[1], right[1]])


def scaled(factor: float) -> StereoRig:
    """A rig as it comes out when the squares were typed `factor` too large."""
    pose = np.array(rig().right_from_left)
    pose[:3, 3] *= factor
    return replace(rig(), right_from_left=frozen(pose))


@pytest.mark.parametrize("lens", ["five", "rational", "fisheye"])
def test_points_are_found_where_both_photos_show_them(lens: str) -> None:
    one = rig(lens)  # type: ignore[arg-type]
    points = np.random.default_rng(0).uniform([-1, -0.7, 2], [1, 0.7, 9], (50, 3))
    left, right = one.left.project(points), one.right.project(apply(one.right_from_left, points))
    assert np.abs(triangulate(one.left, one.right, one.right_from_left, left, right) - points).max() < 1e-8


def test_a_known_length_confirms_a_rig_and_refuses_one_whose_squares_were_typed_wrong() -> None:
    good = check_points(rig(), marks(), 1.200)
    assert good.measured_m == pytest.approx(1.2, abs=1e-9)
    refuse_wrong_scale(good)
    wrong = check_points(scaled(1.25), marks(), 1.200)
    assert wrong.off == pytest.approx(0.25, abs=1e-6)
    with pytest.raises(CalibrationError, match=r"comes out at 1\.5000 m instead of 1\.2000 m \(\+25\.00 %.*square_m"):
        refuse_wrong_scale(wrong)


def test_a_length_in_another_unit_is_told_as_such() -> None:
    for known in (1200.0, 120.0, 0.0012):
        with pytest.raises(CalibrationError, match="metres; one of the two was given in another unit"):
            refuse_wrong_scale(check_points(rig(), marks(), known))


def test_the_sigma_of_the_marks_is_that_of_many_hands() -> None:
    one = rig()
    hands = marks() + np.random.default_rng(1).normal(0, 0.5, (2000, 4, 2))
    left, right = hands[:, 0::2].reshape(-1, 2), hands[:, 1::2].reshape(-1, 2)
    ends = triangulate(one.left, one.right, one.right_from_left, left, right).reshape(-1, 2, 3)
    spread = np.std(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
    assert check_points(one, marks(), 1.2).sigma_m == pytest.approx(spread, rel=0.06)  # 1.6 % is a sigma of it


def test_a_length_far_off_proves_nothing_and_is_said_to() -> None:
    far = check_points(rig(), marks(ENDS * [1.0, 1.0, 5.0]), 1.200)
    with pytest.raises(CalibrationError, match=r"only \(limit 1 %\), which proves nothing; take it nearer"):
        refuse_wrong_scale(far)


def test_marks_of_different_things_and_marks_outside_the_photos_are_refused() -> None:
    shifted = marks()
    shifted[3, 1] += 30.0
    with pytest.raises(CalibrationError, match=r"point 2: its places .* don't meet \(15\.\d px apart, limit 5 px"):
        check_points(rig(), shifted, 1.2)
    with pytest.raises(CalibrationError, match=r"5000,10 lies outside the right photo of 1280 x 960 px"):
        check_points(rig(), np.array([[10.0, 10.0], [5000.0, 10.0], [10.0, 10.0], [10.0, 10.0]]), 1.2)


def test_marks_and_photos_of_left_and_right_exchanged_are_refused_as_that() -> None:
    with pytest.raises(CalibrationError, match=r"point 1 comes out .* m BEHIND the rig: left and right are exchanged"):
        check_points(rig(), marks()[[1, 0, 3, 2]], 1.2)
    camera = replace(rig().left, K=frozen(K), distortion=frozen(np.zeros(5)), width_px=640, height_px=480)
    true = rig_of_unknown_sigma(camera, camera, RIGHT_FROM_LEFT)
    taken = pairs(CHESS, 8)
    with pytest.raises(CalibrationError, match=r"right_01\.jpg \+ left_01\.jpg: corner 1 .* are exchanged"):
        check_board(true, (taken[0][1], taken[0][0]), CHESS)
    with pytest.raises(CalibrationError, match=r"left_01\.jpg \+ right_02\.jpg: corner 1.* or of two pairs"):
        check_board(true, (taken[0][0], taken[1][1]), CHESS)


def test_a_second_board_measures_the_scale_to_a_thousandth() -> None:
    camera = replace(rig().left, K=frozen(K), distortion=frozen(np.zeros(5)), width_px=640, height_px=480)
    true = rig_of_unknown_sigma(camera, camera, RIGHT_FROM_LEFT)
    pair = pairs(CHESS, 8)[0]
    found = check_board(true, pair, CHESS)
    assert found.known_m == pytest.approx(0.06 * np.hypot(8, 5))
    assert abs(found.off) < 0.003 and found.sigma_m / found.known_m < 0.005
    refuse_wrong_scale(found)
    with pytest.raises(CalibrationError, match="scale is off"):
        refuse_wrong_scale(check_board(true, pair, replace(CHESS, square_m=0.058)))
    with pytest.raises(CalibrationError, match=r"left_01\.jpg \+ right_01\.jpg: the board was not found"):
        check_board(true, pair, CHARUCO)


@pytest.mark.parametrize(
    "text",
    ["", "chessboard", "chessboard,9x6", "chessboard,9,6,0.02", "charuco,9x7,0.08", "dots,9x7,0.08", "chess,axb,1"],
)
def test_a_board_in_other_words_is_refused_with_the_words_expected(text: str) -> None:
    with pytest.raises(CalibrationError, match="expected chessboard,COLUMNSxROWS,SQUARE_M"):
        board_of(text)


def test_boards_are_read_from_one_line() -> None:
    assert board_of("chessboard,9x6,0.06") == CHESS
    charuco = Board(kind="charuco", columns=9, rows=7, square_m=0.08, marker_m=0.06, dictionary="DICT_5X5_100")
    assert board_of("charuco,9x7,0.08,0.06,DICT_5X5_100") == charuco
    with pytest.raises(CalibrationError, match="no ArUco dictionary"):
        board_of("charuco,9x7,0.08,0.06,CharucoBoard")
    assert hasattr(cv2.aruco, "CharucoBoard")
