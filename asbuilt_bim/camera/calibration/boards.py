"""Boards: what is printed on them, and where a photo shows its corners."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, IntArray, freeze, frozen

BoardKind = Literal["chessboard", "charuco"]

_QUAD_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_SB_FLAGS = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
_CHESS_WINDOW = 0.35  # of a square's side: clear of the neighbours' edges
_LARGEST_WINDOW = 13
_CHARUCO_WINDOW = 0.15  # where squares are too small to part their edges from their markers'
_LEAST_CLEAR_PX = 3.0  # between a square's edge and its marker's, for both to be told apart
_BLURRED_PX = 2.5  # how far a marker's edge reaches out of it
_LEAST_ARM_PX = 2.0  # of an edge between squares: less of it is no edge
_STEPS, _STILL_PX = 20, 1e-4
_LIGHT = ((np.arange(256) / 255.0) ** 2.2).astype(np.float32)
_MOST_SQUARES = 60
FLATNESS_M, PRINT_SHARE = 2e-4, 1e-3
"""What a board on glass or composite keeps to, and a laser printer's squares against a steel rule."""
_FEWEST_CORNERS = 8
"""A view with fewer tells less than the six numbers of its own pose take up, twice over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A calibration board. Chessboard: `columns` x `rows` INNER corners; ChArUco: squares.

    `square_m` is a square's side in metres, the one length that the whole rig's scale hangs on; `marker_m` and
    `dictionary` (an OpenCV name such as DICT_5X5_100) are for ChArUco only. `flatness_m` is the sigma of how far the
    board bends out of its plane, its edge against its middle. `print_share` is that of the print's scale, and of one
    side's against the other's.
    """

    kind: BoardKind
    columns: int
    rows: int
    square_m: float
    marker_m: float = 0.0
    dictionary: str = "DICT_5X5_100"
    flatness_m: float = FLATNESS_M
    print_share: float = PRINT_SHARE

    def __post_init__(self) -> None:
        if self.kind not in ("chessboard", "charuco"):
            raise CalibrationError(f"board.kind: {self.kind!r} is not known; use chessboard or charuco")
        if self.columns < 3 or self.rows < 3:
            raise CalibrationError(
                f"board: {self.columns} x {self.rows} is too small; at least 3 x 3 (inner corners, or ChArUco squares)"
            )
        if self.columns > _MOST_SQUARES or self.rows > _MOST_SQUARES:
            raise CalibrationError(
                f"board: {self.columns} x {self.rows} is no board that a camera can see (limit {_MOST_SQUARES} a side)"
            )
        if not 0.001 <= self.square_m <= 1.0:
            raise CalibrationError(
                f"board.square_m: {self.square_m:g} m is no square of a board (limit 0.001 to 1 m); give it in metres"
            )
        if self.kind == "charuco" and not 0.0 < self.marker_m < self.square_m:
            raise CalibrationError(
                f"board.marker_m: {self.marker_m:g} m must lie between 0 and square_m, {self.square_m:g} m"
            )
        if self.kind == "charuco" and not (self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary)):
            raise CalibrationError(
                f"board.dictionary: {self.dictionary!r} is no ArUco dictionary, such as DICT_5X5_100"
            )
        if self.kind == "charuco" and (have := _markers_in(self.dictionary)) < self.columns * self.rows // 2:
            raise CalibrationError(
                f"board: {self.columns} x {self.rows} squares hold {self.columns * self.rows // 2} markers, and "
                f"{self.dictionary} has {have} only; give columns, rows and dictionary as they were printed"
            )

    @property
    def inner(self) -> tuple[int, int]:
        """Return the numbers of inner corners, across and down."""
        less = 1 if self.kind == "charuco" else 0
        return self.columns - less, self.rows - less

    @property
    def points_m(self) -> FloatArray:
        """Return all inner corners (N, 3) on the board, z = 0, row by row, in metres."""
        across, down = self.inner
        grid = np.zeros((down, across, 3))
        grid[..., 0] = np.arange(across) * self.square_m
        grid[..., 1] = np.arange(down)[:, None] * self.square_m
        return frozen(grid.reshape(-1, 3))


def _markers_in(dictionary: str) -> int:
    return int(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList.shape[0])


def board_of(text: str) -> Board:
    """Read a board from one line: chessboard,9x6,0.025 or charuco,9x7,0.08,0.06,DICT_5X5_100.

    Raises: CalibrationError for anything else.
    """
    kind, _, rest = text.partition(",")
    size, *lengths = rest.split(",")
    try:
        columns, rows = (int(number) for number in size.lower().split("x"))
        if kind == "chessboard" and len(lengths) == 1:
            return Board(kind="chessboard", columns=columns, rows=rows, square_m=float(lengths[0]))
        if kind == "charuco" and len(lengths) == 3:
            square_m, marker_m = float(lengths[0]), float(lengths[1])
            name = lengths[2].strip()
            return Board(
                kind="charuco", columns=columns, rows=rows, square_m=square_m, marker_m=marker_m, dictionary=name
            )
    except ValueError:
        pass
    raise CalibrationError(
        f"board {text[:80]!r}: expected chessboard,COLUMNSxROWS,SQUARE_M (inner corners) or "
        "charuco,COLUMNSxROWS,SQUARE_M,MARKER_M,DICTIONARY (squares), lengths in metres"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardCorners:
    """The corners that one photo shows: indices (N,) into `Board.points_m` and pixels (N, 2) of the original photo."""

    indices: IntArray
    pixels: FloatArray


def find_board(image: ByteImage, board: Board) -> BoardCorners | None:
    """Find the board's corners in a photo (BGR or grey) to a few hundredths of a pixel; None where it isn't seen."""
    grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    return _chessboard(grey, board) if board.kind == "chessboard" else _charuco(grey, board)


def same_way_round(left: BoardCorners, right: BoardCorners, board: Board) -> BoardCorners:
    """Return the right photo's corners numbered as the left's: a chessboard looks the same from both ends.

    The rig's cameras stand side by side, so the board's sides point the same way in both photos.
    """
    across, down = board.inner
    if board.kind == "charuco" or len(left.indices) != across * down or len(right.indices) != across * down:
        return right
    grid = right.pixels.reshape(down, across, 2)
    turned = [grid, grid[::-1, ::-1]]
    if across == down:
        turned += [np.rot90(grid), np.rot90(grid, -1)]
    model = _directions(left.pixels.reshape(down, across, 2))
    best = max(turned, key=lambda one: float(np.sum(_directions(one) * model)))
    return BoardCorners(indices=right.indices, pixels=frozen(best.reshape(-1, 2)))


def _directions(grid: FloatArray) -> FloatArray:
    sides = np.stack([grid[:, -1].mean(0) - grid[:, 0].mean(0), grid[-1].mean(0) - grid[0].mean(0)])
    unit: FloatArray = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    return unit


def _chessboard(grey: ByteImage, board: Board) -> BoardCorners | None:
    """Find a whole chessboard by its squares (quick), or else by sectors; corners are saddle points of the light.

    Reference: Duda & Frese 2018, Accurate detection and localization of checkerboard corners for calibration.
    """
    size = board.inner
    found, corners = cv2.findChessboardCorners(grey, size, None, _QUAD_FLAGS)
    if not found:
        found, corners = cv2.findChessboardCornersSB(grey, size, None, _SB_FLAGS)
    if not found:
        found, corners = cv2.findChessboardCornersSB(grey, size, None, _SB_FLAGS | cv2.CALIB_CB_EXHAUSTIVE)
    if not found:
        return None
    # The saddle point of the light is nearer than the sectors: 0.25 px rms against 0.34 on real boards.
    grid = np.asarray(corners, dtype=np.float32).reshape(size[1], size[0], 2)
    across, down = grid[:, -1].mean(0) - grid[:, 0].mean(0), grid[-1].mean(0) - grid[0].mean(0)
    if across[0] * down[1] < across[1] * down[0]:
        grid = grid[:, ::-1]  # a print is never seen from behind
    pixels = _saddle_points(grey, grid.reshape(-1, 2), _CHESS_WINDOW)
    return BoardCorners(indices=freeze(np.arange(len(pixels), dtype=np.int32)), pixels=pixels)


def _saddle_points(grey: ByteImage, near: FloatArray | Float32Array, share: float) -> FloatArray:
    """Move corners (N, 2) to the saddle points of the light round them, in windows of +-`share` of the squares' side.

    In light, not in grey values: a tone curve bends the edges that meet there.
    """
    apart = np.linalg.norm(near[:, None] - near[None], axis=-1) + np.eye(len(near)) * 1e9
    half = int(np.clip(share * float(apart.min(axis=1).min()), 2, _LARGEST_WINDOW))
    light = cv2.LUT(grey, _LIGHT)
    start = np.ascontiguousarray(near, dtype=np.float32).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    return frozen(np.asarray(cv2.cornerSubPix(light, start, (half, half), (-1, -1), criteria)).reshape(-1, 2))


def _charuco(grey: ByteImage, board: Board) -> BoardCorners | None:
    """Find the corners of a ChArUco board, as today's or as OpenCV's older releases number its squares."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    best: BoardCorners | None = None
    for legacy in (False, True):
        printed = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
        printed.setLegacyPattern(legacy)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(printed).detectBoard(grey)
        if ids is not None and len(ids) >= max(_FEWEST_CORNERS, 0 if best is None else len(best.indices) + 1):
            near = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
            indices = np.asarray(ids, dtype=np.int32).ravel()
            best = BoardCorners(indices=freeze(indices), pixels=_where_squares_meet(grey, near, indices, board))
        if best is not None or board.rows % 2:  # both numberings are the same where the rows are odd
            break
    return best


def _where_squares_meet(grey: ByteImage, near: FloatArray, indices: IntArray, board: Board) -> FloatArray:
    """Move a ChArUco board's corners (N, 2) to the saddle points of the light, by the edges between squares alone.

    A marker's edges lie in the windows, too, as near as (square - marker) / 2, and would pull. So of a window +-0.35 of
    a square only a cross along the board's own axes counts, too narrow for a marker to reach into.

    Reference: Forstner & Gulch 1987, a fast operator for detection and precise location of corners (eq. of the point).
    """
    axes = _axes_px(near, indices, board)
    lengths = np.linalg.norm(axes, axis=2)
    width_px = np.abs(np.linalg.det(axes)) / np.maximum(lengths.max(axis=1), 1e-9)  # 0 where corners lie on one line
    clear = 0.5 * (1.0 - board.marker_m / board.square_m)
    if not clear * width_px.min() >= _LEAST_CLEAR_PX:
        return _saddle_points(grey, near, _CHARUCO_WINDOW)
    half = int(np.clip(_CHESS_WINDOW * lengths.min(), 2, _LARGEST_WINDOW))
    steps = np.arange(-half, half + 1, dtype=np.float64)
    window = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    on_board = np.abs(np.einsum("nij,wj->nwi", np.linalg.inv(np.swapaxes(axes, 1, 2)), window))  # in squares
    arm = np.maximum(clear * lengths - _BLURRED_PX, _LEAST_ARM_PX) / lengths
    weight = np.any(on_board < arm[:, None, :], axis=2) * np.exp(-((window / half) ** 2).sum(axis=1))
    light = cv2.LUT(grey, _LIGHT)
    slopes = [cv2.Sobel(light, cv2.CV_32F, *order, ksize=1, scale=0.5) for order in ((1, 0), (0, 1))]
    at = near.copy()
    for _ in range(_STEPS):
        columns, rows = np.moveaxis((at[:, None] + window).astype(np.float32), 2, 0)
        gx, gy = (cv2.remap(one, columns, rows, cv2.INTER_LINEAR).astype(np.float64) for one in slopes)
        g = np.stack([gx, gy], axis=-1)
        across = np.einsum("nw,nwi,nwj->nij", weight, g, g)
        pull = np.einsum("nw,nwi,nw->ni", weight, g, np.einsum("nwi,wi->nw", g, window))
        step = np.linalg.solve(across + 1e-12 * np.eye(2), pull[:, :, None])[:, :, 0]
        step = np.where(np.abs(at + step - near).max(axis=1, keepdims=True) <= half, step, 0.0)
        at = at + step
        if np.abs(step).max() < _STILL_PX:
            break
    return frozen(at)


def _axes_px(pixels: FloatArray, indices: IntArray, board: Board) -> FloatArray:
    """Return the board's axes at its corners (N, 2, 2): what a square's two sides are in pixels there; 0 if unknown."""
    squares = board.points_m[indices][:, :2] / board.square_m
    seen = cv2.findHomography(squares, pixels)[0]
    if seen is None:
        return np.zeros((len(pixels), 2, 2))
    steps = ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0])
    at, right, below = (cv2.perspectiveTransform((squares + np.array(step))[None], seen)[0] for step in steps)
    return np.stack([right - at, below - at], axis=1)
