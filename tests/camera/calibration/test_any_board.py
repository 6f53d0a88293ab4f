"""A board that nobody described is known by its photos, and named as the sheets of `print board` name it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.calibration import any_board
from asbuilt_bim.camera.calibration.any_board import SeenBoard, board_shown
from asbuilt_bim.report.sheets.fitting import largest_board
from asbuilt_bim.report.sheets.pdf import PAPERS


def picture(columns: int, rows: int, dictionary: str) -> np.ndarray:
    printed = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard((columns, rows), 1.0, 0.75, printed)
    return np.asarray(board.generateImage((40 * columns, 40 * rows), marginSize=40))


def test_a_printed_board_is_named_as_its_sheet_names_it() -> None:
    board = largest_board(PAPERS["A4"])
    seen = board_shown(picture(board.columns, board.rows, board.dictionary))
    assert seen == SeenBoard(kind="charuco", columns=board.columns, rows=board.rows, dictionary=board.dictionary)


@pytest.mark.parametrize(
    ("size", "printed", "named"), [(9, "DICT_4X4_50", "DICT_4X4_100"), (16, "DICT_5X5_250", "DICT_5X5_1000")]
)
def test_a_dictionary_is_named_that_holds_all_markers_of_the_board(
    size: int, printed: str, named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(any_board, "_sizes", lambda _: [(size, size)])  # the right one alone: others take seconds each
    seen = board_shown(picture(size, size, printed))
    assert seen is not None and seen.dictionary == named
