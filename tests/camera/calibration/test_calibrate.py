from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.calibration.boards import Board, BoardCorners, find_board, same_way_round
from asbuilt_bim.camera.calibration.calibrate import calibrate_stereo
from asbuilt_bim.camera.photo.read import decode, photo_from_bytes
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.report.wording.reasons import words_of
from tests.camera.board_pictures import CHARUCO, CHESS, RIGHT_FROM_LEFT, K, as_photo, pairs
from tests.camera.virtual import exif_block, with_exif


@pytest.mark.parametrize("board", [CHESS, CHARUCO], ids=["chessboard", "charuco"])
def test_photos_of_a_board_give_the_rig_that_took_them(board: Board) -> None:
    told: list[tuple[int, int]] = []
    found = calibrate_stereo(pairs(board, 8), board, lambda done, of: told.append((done, of)))
    rig, sigma = found.rig, np.sqrt(np.diag(found.rig.covariance))[:14]
    assert told[-1] == (8, 8) and len(found.views) == 8 and not found.left_out
    assert rig.rms_px < 0.15
    assert abs(rig.baseline_m / np.linalg.norm(RIGHT_FROM_LEFT[:3, 3]) - 1.0) < 0.003
    assert abs(rig.left.K[0, 0] - K[0, 0]) < 5.0 * sigma[0] < 10.0  # eight pairs of a board that may bend
    assert abs(rig.right.K[0, 2] - K[0, 2]) < 5.0 * sigma[6]
    assert found.checks.length_error is not None and found.checks.length_error < 0.005
    assert 0.2 < found.checks.coverage_left <= 1.0
    assert found.checks.hold_out_rms_px < 0.6  # a third of so few views leaves corners of the frame open
    assert (rig.camera_model, rig.camera_serial, rig.camera_serial_right) == ("Maker One", "L-1", "R-2")


def test_pairs_with_left_and_right_swapped_are_refused_by_name() -> None:
    with pytest.raises(CalibrationError, match="left and right are swapped"):
        calibrate_stereo([(right, left) for left, right in pairs(CHESS, 8)], CHESS)


def test_a_square_in_millimetres_is_refused_by_the_baseline_or_its_size() -> None:
    with pytest.raises(CalibrationError, match="square_m"):
        Board(kind="chessboard", columns=9, rows=6, square_m=60.0)
    with pytest.raises(CalibrationError, match=r"baseline comes out at 3\.3\d* m .*square_m"):
        calibrate_stereo(pairs(CHESS, 8), Board(kind="chessboard", columns=9, rows=6, square_m=1.0))


def test_a_pair_not_taken_at_one_moment_is_left_out_by_name() -> None:
    taken = list(pairs(CHESS, 8))
    taken[3] = (taken[3][0], taken[5][1])
    found = calibrate_stereo(taken, CHESS)
    assert len(found.views) == 7
    (left_out,) = found.left_out
    assert (left_out.code, left_out.subject.name) == (Reason.BOARD_PAIR_MOVED, "left_04.jpg + right_06.jpg")
    assert abs(found.rig.baseline_m - 0.2) < 0.002


def test_many_pairs_of_a_board_that_stood_in_few_places_are_refused_with_how_many() -> None:
    rng, taken = np.random.default_rng(5), list(pairs(CHESS, 2))
    again = []
    for k in range(12):
        photos = (decode(photo) for photo in taken[k % 2])
        noisy = [np.clip(photo + rng.normal(0.0, 2.0, photo.shape), 0, 255).astype(np.uint8) for photo in photos]
        again.append((as_photo(f"left_{k}.jpg", noisy[0], "L-1"), as_photo(f"right_{k}.jpg", noisy[1], "R-2")))
    with pytest.raises(CalibrationError, match=r"12 pairs show the board in 2 places \(.*at least 6 are needed; move"):
        calibrate_stereo(again, CHESS)


def test_a_pair_that_is_there_again_under_another_name_counts_once_and_is_named() -> None:
    taken = list(pairs(CHESS, 8))
    copies = [replace(photo, name=f"copy_{photo.name}") for photo in taken[2]]
    found = calibrate_stereo([*taken, (copies[0], copies[1])], CHESS)
    assert len(found.views) == 8
    (left_out,) = found.left_out
    assert "copy_left_03.jpg" in left_out.subject.name
    assert (left_out.code, left_out.values["other"]) == (Reason.BOARD_PAIR_TWICE, "left_03.jpg + right_03.jpg")
    with pytest.raises(CalibrationError, match=r"1 good pairs .*at least 6") as refused:
        calibrate_stereo([taken[0]] * 8, CHESS)
    assert {one.code for one in refused.value.rejections} == {Reason.BOARD_PAIR_TWICE}


def test_the_left_photos_given_as_the_right_ones_too_are_told_so_and_no_square_is_blamed() -> None:
    taken = list(pairs(CHESS, 8))
    with pytest.raises(CalibrationError, match=r"left and right are the same photos \(8 of 8 pairs") as refused:
        calibrate_stereo([(left, left) for left, _ in taken], CHESS)
    assert "square" not in str(refused.value)
    taken[2] = (taken[2][0], taken[2][0])
    (left_out,) = calibrate_stereo(taken, CHESS).left_out
    assert (left_out.code, left_out.subject.name) == (Reason.BOARD_PAIR_OF_ONE_PHOTO, "left_03.jpg + left_03.jpg")
    saved_again = [
        (left, photo_from_bytes("again.jpg", cv2.imencode(".jpg", decode(left))[1].tobytes())) for left, _ in taken
    ]
    with pytest.raises(CalibrationError, match=r"baseline comes out at .* m .* photos of one camera: name the other's"):
        calibrate_stereo(saved_again, CHESS)


def test_a_board_that_is_not_found_is_asked_for_its_dictionary() -> None:
    other = replace(CHARUCO, dictionary="DICT_4X4_50")
    with pytest.raises(CalibrationError, match="0 good pairs") as refused:
        calibrate_stereo(pairs(CHARUCO, 8), other)
    assert "8 x 5 ChArUco squares of DICT_4X4_50" in words_of(refused.value.rejections[0]).remedy


def test_a_board_photo_taken_at_another_zoom_is_left_out_by_its_exif() -> None:
    taken = list(pairs(CHESS, 8))
    zoomed = with_exif(cv2.imencode(".jpg", decode(taken[2][0]))[1].tobytes(), exif_block(focal_mm=12.0))
    taken[2] = (photo_from_bytes("zoomed.jpg", zoomed), taken[2][1])
    found = calibrate_stereo(taken, CHESS)
    (left_out,) = found.left_out
    words = words_of(left_out)
    assert "zoomed.jpg" in words.what and "12 mm" in words.value and "8 mm" in words.limit


def test_a_pair_without_a_board_is_left_out_and_too_few_pairs_are_refused_with_reasons() -> None:
    blank = [
        as_photo(f"blank_{side}.jpg", np.full((480, 640, 3), grey, np.uint8), "")
        for side, grey in (("l", 90), ("r", 91))
    ]
    taken = [*pairs(CHESS, 8)[:5], (blank[0], blank[1])]
    with pytest.raises(CalibrationError, match=r"5 good pairs .*at least 6") as refused:
        calibrate_stereo(taken, CHESS)
    (missing,) = refused.value.rejections
    assert missing.code is Reason.BOARD_NOT_FOUND and "blank_l.jpg" in missing.subject.name


def test_board_photos_of_different_sizes_are_refused_by_name() -> None:
    small = as_photo("small.jpg", np.zeros((240, 320, 3), np.uint8), "L-1")
    with pytest.raises(CalibrationError, match=r"small\.jpg: 320 x 240 px, the others 640 x 480"):
        calibrate_stereo([*pairs(CHESS, 8), (small, small)], CHESS)


def test_corners_are_found_to_a_tenth_of_a_pixel_and_numbered_alike_in_both_photos() -> None:
    left, right = pairs(CHESS, 8)[0]
    in_left, in_right = find_board(decode(left), CHESS), find_board(decode(right), CHESS)
    assert in_left is not None and in_right is not None
    turned = BoardCorners(indices=in_right.indices, pixels=in_right.pixels[::-1])
    for seen in (in_right, turned):
        numbered = same_way_round(in_left, seen, CHESS).pixels
        homography, _ = cv2.findHomography(in_left.pixels, numbered)
        moved = cv2.perspectiveTransform(in_left.pixels[:, None], homography)[:, 0]
        assert np.sqrt(np.mean((moved - numbered) ** 2)) < 0.1
        assert np.median(in_left.pixels[:, 0] - numbered[:, 0]) > 0.0  # the right camera sees things further left


@pytest.mark.parametrize(
    "wrong",
    [
        {"kind": "dots"},
        {"columns": 2},
        {"rows": 100_000},
        {"kind": "charuco", "marker_m": 0.04, "columns": 20, "rows": 20, "dictionary": "DICT_4X4_50"},
        {"square_m": 0.0},
        {"kind": "charuco", "marker_m": 0.07},
        {"kind": "charuco", "marker_m": 0.04, "dictionary": "DICT_NONE"},
    ],
)
def test_a_board_that_cannot_be_is_refused_by_its_key(wrong: dict[str, object]) -> None:
    right = {"kind": "chessboard", "columns": 9, "rows": 6, "square_m": 0.06}
    with pytest.raises(CalibrationError, match="board"):
        Board(**{**right, **wrong})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("printed", "change", "says"),
    [
        (CHARUCO, (CHARUCO.rows, CHARUCO.columns), "columns and rows are exchanged"),
        (CHARUCO, (CHARUCO.columns - 1, CHARUCO.rows - 1), "inner corners"),
        (CHESS, (CHESS.columns + 1, CHESS.rows + 1), "INNER corners are counted"),
    ],
    ids=["exchanged", "corners for squares", "squares for corners"],
)
def test_a_board_declared_other_than_printed_is_one_line_with_what_to_write(
    printed: Board, change: tuple[int, int], says: str
) -> None:
    told = replace(printed, columns=change[0], rows=change[1])
    with pytest.raises(CalibrationError, match=says) as caught:
        calibrate_stereo(pairs(printed, 3), told)
    assert f"Write columns: {printed.columns}, rows: {printed.rows}" in str(caught.value)
    assert "\n" not in str(caught.value) and not caught.value.rejections


def test_photos_of_no_board_are_still_named_one_by_one() -> None:
    blank = [tuple(replace(photo) for photo in pair) for pair in pairs(CHESS, 6)]
    with pytest.raises(CalibrationError, match="0 good pairs") as caught:
        calibrate_stereo(blank, replace(CHARUCO, dictionary="DICT_6X6_250"))  # type: ignore[arg-type]
    assert len(caught.value.rejections) == 6
