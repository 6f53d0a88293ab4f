"""What is printed is read back by our own finders, drawn at 300 dpi as a printer would."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from asbuilt_bim.camera.calibration.boards import Board, find_board
from asbuilt_bim.cli import app
from asbuilt_bim.errors import MissingExtraError, OptionError
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.report.sheets.drawings import board_drawing, tag_drawing, target_drawing
from asbuilt_bim.report.sheets.fitting import largest_board, largest_tag_m, largest_target_m
from asbuilt_bim.report.sheets.pdf import PAPERS, sheets_pdf
from asbuilt_bim.report.sheets.shapes import Drawing
from asbuilt_bim.terminal.parameters import FAMILY_NAMES
from asbuilt_bim.terminal.print_command import ids_of
from asbuilt_bim.vision.markers.find import FAMILIES, Family

pdfium = pytest.importorskip("pypdfium2")
DPI = 300.0
PX = DPI / 0.0254  # of a metre


def printed(*drawings: Drawing, paper: str = "A4") -> list[ByteImage]:
    """Return the pages as grey pictures, as a printer of 300 dpi lays them down."""
    document = pdfium.PdfDocument(sheets_pdf(drawings, PAPERS[paper]))
    pages = [np.asarray(document[i].render(scale=DPI / 72.0).to_numpy())[..., :3] for i in range(len(document))]
    return [np.ascontiguousarray(page) for page in pages]


def test_a_board_is_found_whole_and_its_squares_are_to_scale() -> None:
    for name in PAPERS:
        board = largest_board(PAPERS[name])
        (page,) = printed(board_drawing(board), paper=name)
        found = find_board(page, board)
        assert found is not None and len(found.indices) == len(board.points_m)
        across = found.pixels[board.inner[0] - 1] - found.pixels[0]
        assert np.hypot(*across) / PX == pytest.approx((board.inner[0] - 1) * board.square_m, abs=1e-4)


@pytest.mark.parametrize(("columns", "rows"), [(5, 6), (6, 5), (5, 7), (4, 4)])
def test_boards_of_every_parity_are_found_whole(columns: int, rows: int) -> None:
    board = Board(kind="charuco", columns=columns, rows=rows, square_m=0.022, marker_m=0.016)
    found = find_board(printed(board_drawing(board))[0], board)
    assert found is not None and len(found.indices) == len(board.points_m)


def test_a_chessboard_is_found_whole() -> None:
    board = Board(kind="chessboard", columns=5, rows=7, square_m=0.024)
    found = find_board(printed(board_drawing(board))[0], board)
    assert found is not None and len(found.indices) == 35


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_markers_of_every_family_are_read_with_their_number_upright_and_to_scale(family: str) -> None:
    size_m = largest_tag_m(PAPERS["A4"], family)
    (page,) = printed(tag_drawing(family, 7, size_m))
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(FAMILIES[family]))
    corners, ids, _ = detector.detectMarkers(page)
    assert ids is not None and ids.ravel().tolist() == [7]
    top_left, top_right, bottom_right, _ = corners[0][0]
    assert top_left[0] < top_right[0] and top_left[1] == pytest.approx(top_right[1], abs=2.0)  # this side up
    assert np.hypot(*(bottom_right - top_right)) / PX == pytest.approx(size_m, abs=2e-4)


def test_the_target_has_its_diameter_in_both_directions() -> None:
    diameter_m = largest_target_m(PAPERS["A4"])
    (page,) = printed(target_drawing(diameter_m))
    red = (page[..., 2] > 150) & (page[..., 1] < 100)
    rows, columns = np.flatnonzero(red.any(axis=1)), np.flatnonzero(red.any(axis=0))
    for seen in (rows, columns):
        assert (seen[-1] - seen[0] + 1) / PX == pytest.approx(diameter_m, abs=2e-4)


def test_what_no_page_holds_goes_in_tiles_that_fit_together_again() -> None:
    board = Board(kind="charuco", columns=7, rows=9, square_m=0.042, marker_m=0.031)
    pages = printed(board_drawing(board))
    assert len(pages) == 4
    whole = glued(pages, board_drawing(board))
    found = find_board(whole, board)
    assert found is not None and len(found.indices) == len(board.points_m)
    across = found.pixels[board.inner[0] - 1] - found.pixels[0]
    assert np.hypot(*across) / PX == pytest.approx((board.inner[0] - 1) * board.square_m, abs=4e-4)


def glued(pages: list[ByteImage], drawing: Drawing) -> ByteImage:
    """Cut four tiles along their frames and lay them edge to edge, two a row."""
    width, height = round(drawing.width_m / 2 * PX), round(drawing.height_m / 2 * PX)
    top, left = round(0.010 * PX), round((pages[0].shape[1] - width) / 2)
    cut = [page[top : top + height, left : left + width] for page in pages]
    return np.vstack([np.hstack(cut[:2]), np.hstack(cut[2:])])


def test_the_ruler_is_a_hundred_millimetres_long() -> None:
    (page,) = printed(target_drawing(0.05))
    dark = page.max(axis=2) < 128
    lengths = dark[round(0.257 * PX) : round(0.267 * PX)].sum(axis=1)
    assert lengths.max() / PX == pytest.approx(0.100, abs=3e-4)


def test_the_same_sheet_is_the_same_file() -> None:
    assert sheets_pdf([target_drawing(0.1)], PAPERS["A4"]) == sheets_pdf([target_drawing(0.1)], PAPERS["A4"])


def test_the_command_lists_the_families_that_are_found() -> None:
    assert get_args(Family) == FAMILY_NAMES


def test_a_marker_that_its_family_lacks_is_refused_with_those_that_it_has() -> None:
    with pytest.raises(OptionError, match="markers 0 to 29, not 30"):
        tag_drawing("apriltag_16h5", 30, 0.1)


@pytest.mark.parametrize("text", ["", "a", "-1", "3-", "0-1000", "5-2", "9999999"])
def test_numbers_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(OptionError, match="--ids"):
        ids_of(text)


def test_numbers_are_read_once_each() -> None:
    assert ids_of("0-3,2, 8") == (0, 1, 2, 3, 8)


def test_a_file_of_more_pages_than_anyone_prints_is_refused() -> None:
    with pytest.raises(OptionError, match="limit 200"):
        sheets_pdf([tag_drawing("apriltag_36h11", one, 1.0) for one in range(20)], PAPERS["A4"])


def test_without_the_extra_its_install_line_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "reportlab.pdfgen.canvas", None)
    with pytest.raises(MissingExtraError, match=r"pip install reportlab"):
        sheets_pdf([target_drawing(0.1)], PAPERS["A4"])


def test_the_command_writes_once_and_says_what_the_project_file_needs(tmp_path: Path) -> None:
    out = tmp_path / "tags.pdf"
    call = ["print", "tags", "--ids", "0-2", "--out", str(out)]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0 and "size_m: 0.13" in done.output
    assert len(pdfium.PdfDocument(out.read_bytes())) == 3
    again = CliRunner().invoke(app, call)
    assert again.exit_code == 1 and "--replace" in again.output
    assert CliRunner().invoke(app, [*call, "--replace"]).exit_code == 0
    assert CliRunner().invoke(app, ["print", "board", "--board", "x", "--out", str(tmp_path / "b.pdf")]).exit_code == 1


def test_the_command_says_how_many_sheets_there_are_and_of_what_no_sheet_holds_that_it_goes_in_tiles(
    tmp_path: Path,
) -> None:
    call = ["print", "tags", "--ids", "0-2", "--out"]
    large = CliRunner().invoke(app, [*call, str(tmp_path / "large.pdf"), "--size", "0.25"]).output
    assert "12 sheets of A4" in large and "each goes in 4 tiles" in large
    small = CliRunner().invoke(app, [*call, str(tmp_path / "small.pdf"), "--size", "0.1"]).output
    assert "3 sheets of A4" in small and "tiles" not in small


def test_the_command_prints_on_american_paper(tmp_path: Path) -> None:
    out = tmp_path / "tags.pdf"
    done = CliRunner().invoke(app, ["print", "tags", "--ids", "0", "--paper", "letter", "--out", str(out)])
    assert done.exit_code == 0 and "1 sheet of Letter" in done.output
    assert pdfium.PdfDocument(out.read_bytes())[0].get_size() == pytest.approx((612.0, 792.0))  # 8.5 x 11 inches
