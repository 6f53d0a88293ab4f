"""Words on the sheets to print."""

from collections.abc import Sequence

from asbuilt_bim.camera.calibration.boards import Board

RULER = "This line is 100 mm. If a tape says otherwise, print again at 100 %, without 'fit to page'."
TILES = "Row {} of {}, column {} of {}. Cut along the grey frame, lay the edges together on a flat plate."


def board_words(board: Board) -> tuple[str, ...]:
    """Return what stands below a board."""
    size = f"{board.columns} x {board.rows}"
    if board.kind == "chessboard":
        what = f"Chessboard, {size} inner corners, squares of {_mm(board.square_m)}."
    else:
        marker = f"markers of {_mm(board.marker_m)}, {board.dictionary}"
        what = f"ChArUco board, {size} squares of {_mm(board.square_m)}, {marker}."
    return what, "Glue it on a flat, stiff plate. Measure ten squares, and write a square's side into the project file."


def board_yaml(board: Board) -> str:
    """Return the board as a project file has it."""
    lengths = f"square_m: {board.square_m:g}"
    if board.kind == "charuco":
        lengths += f", marker_m: {board.marker_m:g}, dictionary: {board.dictionary}"
    return f"{{kind: {board.kind}, columns: {board.columns}, rows: {board.rows}, {lengths}}}"


def tag_words(family: str, tag_id: int, size_m: float) -> tuple[str, ...]:
    """Return what stands below a marker."""
    return (
        f"Marker {tag_id}, {family}, black square {_mm(size_m)}. This edge is the print's lower one.",
        "The grey strokes point at the four corners of the black square: those are surveyed. Don't cut the white off.",
    )


def target_words(diameter_m: float) -> tuple[str, ...]:
    """Return what stands below the target."""
    return (
        f"Target, diameter {_mm(diameter_m)}. Glue it on a flat, stiff plate; matt paper, no lamination.",
        "Measure the disc across, and write that as diameter_m into the project file.",
    )


def title_of(words: Sequence[str]) -> str:
    """Return the title of a file of sheets."""
    return f"asbuilt-bim: {words[0].split('.')[0]}"


def _mm(length_m: float) -> str:
    return f"{length_m * 1000.0:g} mm"
