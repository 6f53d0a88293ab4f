"""Pictures of printed boards by a pinhole, for tests that must start from photos."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.photo.read import Photo, photo_from_bytes
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from tests.camera.virtual import exif_block, with_exif

SIZE = (640, 480)
K = np.array([[520.0, 0.0, 322.0], [0.0, 520.0, 238.0], [0.0, 0.0, 1.0]])
RIGHT_FROM_LEFT = rigid([0.004, -0.012, 0.003], [-0.2, 0.002, 0.001])
CHESS = Board(kind="chessboard", columns=9, rows=6, square_m=0.06)
CHARUCO = Board(kind="charuco", columns=8, rows=5, square_m=0.08, marker_m=0.06)
_CELL = 40  # pixels a square in the printed picture


def printed(board: Board) -> ByteImage:
    if board.kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
        drawn = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
        inner = drawn.generateImage((board.columns * _CELL, board.rows * _CELL))
    else:
        y, x = np.indices((board.rows + 1, board.columns + 1))
        inner = np.kron(((x + y) % 2) * 255, np.ones((_CELL, _CELL))).astype(np.uint8)
    return np.asarray(np.pad(inner, _CELL, constant_values=255), dtype=np.uint8)


def picture(board: Board, camera_from_board: FloatArray, seed: int) -> ByteImage:
    """The board's frame has its origin at the first inner corner, x and y along the squares."""
    square = board.square_m
    pixel_to_board = np.array([[square / _CELL, 0, 0], [0, square / _CELL, 0], [0, 0, 1.0]])
    pixel_to_board[:2, 2] = (0.5 / _CELL - 2.0) * square
    to_photo = K @ camera_from_board[:3, [0, 1, 3]] @ pixel_to_board
    refined_mask = np.array([[4.0, 0, 1.5], [0, 4.0, 1.5], [0, 0, 1.0]])
    size = (SIZE[0] * 4, SIZE[1] * 4)
    big = cv2.warpPerspective(printed(board), refined_mask @ to_photo, size, borderValue=(120,), flags=cv2.INTER_LINEAR)
    grey = cv2.resize(big, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64) * 0.8 + 20
    noisy = grey + np.random.default_rng(seed).normal(0, 1.5, grey.shape)
    return np.repeat(np.clip(np.rint(noisy), 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


def as_photo(name: str, image: ByteImage, serial: str) -> Photo:
    jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    return photo_from_bytes(name, with_exif(jpeg, exif_block(serial=serial)))


@cache
def pairs(board: Board, count: int) -> tuple[tuple[Photo, Photo], ...]:
    """Pairs of a board that both cameras see whole, tilted every way."""
    random = np.random.default_rng(11)
    across, down = board.inner
    corners = np.array([[x, y, 0.0] for x in (-2, across + 1) for y in (-2, down + 1)]) * board.square_m
    middle = board.points_m.mean(axis=0)
    found: list[tuple[Photo, Photo]] = []
    while len(found) < count:
        turn = rotation_from_vector(random.uniform([-0.6, -0.6, -0.25], [0.6, 0.6, 0.25]))
        place = random.uniform([-0.25, -0.3, 0.9], [0.45, 0.3, 1.5])
        left_from_board = rigid(turn, place - turn @ middle)
        poses = (left_from_board, RIGHT_FROM_LEFT @ left_from_board)
        seen = [(corners @ pose[:3, :3].T + pose[:3, 3]) @ K.T for pose in poses]
        if all(((s[:, :2] / s[:, 2:] > 2) & (s[:, :2] / s[:, 2:] < np.array(SIZE) - 3)).all() for s in seen):
            n = len(found) + 1
            left, right = (picture(board, pose, 2 * n + side) for side, pose in enumerate(poses))
            found.append((as_photo(f"left_{n:02d}.jpg", left, "L-1"), as_photo(f"right_{n:02d}.jpg", right, "R-2")))
    return tuple(found)
