"""Rendered photos of boards that are warped, misprinted and held by hand, and the corners found in them.

A generator of its own, apart from the one of the sites: small pictures, nothing but the board and a blurred yard.
Truth is exact: each pixel is the mean of nine rays through the lens, met with the bowed board.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import Board, find_board, same_way_round
from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid, rotation_from_vector

FLATNESS_M, PRINT_SHARE = 2e-4, 1e-3
"""Of the boards drawn: sigma of each bow's edge against its middle; of the print's scale, and of its stretch."""
_MOST_HAND = 3e-4
"""Metres and radians: what a hand moves the board by between the two exposures, at the most one sigma."""
_FINE, _CELL = 3, 60
_CHESS = Board(kind="chessboard", columns=9, rows=6, square_m=0.07)
_CHARUCO = Board(kind="charuco", columns=9, rows=7, square_m=0.08, marker_m=0.06, dictionary="DICT_4X4_50")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrintedBoard:
    """A board as it came out of the printer and off the shelf: `bow_m` (3,) of u^2, u v, v^2; sides' scales (2,)."""

    board: Board
    bow_m: FloatArray
    scale: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RenderedRig:
    """A true rig, the board it was shown, and what the program's own finder saw of it: one view a pair."""

    true: StereoRig
    printed: PrintedBoard
    views: list[BoardView]
    true_px: list[tuple[FloatArray, FloatArray]]  # of each view's corners, left and right


def rendered_rig(number: int, seed: int) -> RenderedRig:
    """Draw a rig and a board, photograph it with both cameras, and find its corners."""
    rng = np.random.default_rng([seed, number])
    board = (_CHARUCO, _CHESS)[number % 2]
    size = (800, 600) if board.kind == "charuco" else (640, 480)
    true = _true_rig(rng, size)
    common, apart = rng.normal(0.0, PRINT_SHARE, 2)
    printed = PrintedBoard(
        board=board, bow_m=rng.normal(0.0, FLATNESS_M, 3), scale=1.0 + common + 0.5 * apart * np.array([1.0, -1.0])
    )
    hand = rng.uniform(0.0, _MOST_HAND)
    views, places = [], []
    for k, pose in enumerate(_poses(true, board, rng, int(rng.integers(16, 25)))):
        moved = true.right_from_left @ _moved(pose, printed, hand, rng)
        look = rng.uniform([0.55, 0.4, 0.6], [0.8, 0.95, 2.5])  # blur in px, light, noise in grey levels
        found = []
        for camera, place in ((true.left, pose), (true.right, moved)):
            seen = find_board(photo(camera, place, printed, look, rng), board)
            found.append((seen, camera.project(apply(place, corners_m(printed)))))
        (left, left_true), (right, right_true) = found
        if left is None or right is None:
            continue
        right = same_way_round(left, right, board)
        points = board.points_m
        views.append(BoardView(
            name=f"{k + 1:02d}", left_points_m=points[left.indices], left_px=left.pixels,
            right_points_m=points[right.indices], right_px=right.pixels,
        ))  # fmt: skip
        places.append((_alike(left_true[left.indices], left.pixels), _alike(right_true[right.indices], right.pixels)))
    return RenderedRig(true=true, printed=printed, views=views, true_px=places)


def _alike(true_px: FloatArray, found_px: FloatArray) -> FloatArray:
    """Return true corners in the order in which they were found: a chessboard looks the same from both ends."""
    apart = [np.abs(one - found_px).max() for one in (true_px, true_px[::-1])]
    return true_px if apart[0] <= apart[1] else true_px[::-1]


def corners_m(printed: PrintedBoard) -> FloatArray:
    """Return where the inner corners (N, 3) of a board truly lie, its origin at the first, z away from the camera."""
    board = printed.board
    middle = board.points_m.mean(axis=0)
    flat = (board.points_m - middle)[:, :2] * printed.scale
    return np.c_[flat + middle[:2], bow_m(printed, flat)]


def bow_m(printed: PrintedBoard, flat_m: FloatArray) -> FloatArray:
    """Return how far (...) the board lies out of its plane at places (..., 2) from its middle."""
    half = 0.5 * np.ptp(printed.board.points_m[:, :2], axis=0)
    u, v = flat_m[..., 0] / half[0], flat_m[..., 1] / half[1]
    a, b, c = printed.bow_m
    return np.asarray(a * u * u + b * u * v + c * v * v)


def photo(
    camera: Intrinsics, camera_from_board: FloatArray, printed: PrintedBoard, look: FloatArray, rng: np.random.Generator
) -> ByteImage:
    """Take a grey photo of a board: light that falls off, a lens's blur, noise, a tone curve, JPEG."""
    light = _yard(camera, rng).copy()
    outline = _outline(printed.board)
    seen = camera.project(apply(camera_from_board, outline))
    low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 2, 0)
    high = np.minimum(np.ceil(seen.max(axis=0)).astype(int) + 3, [camera.width_px, camera.height_px])
    size = (high - low + 1) // 2 * 2
    patch = _texture(printed.board)
    columns, rows = _texels(camera, camera_from_board, printed, low, size)
    fine = cv2.remap(patch, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(-1.0,))
    within = (fine >= 0.0).astype(np.float32)
    across, down = (int(length) for length in size)
    share, grey = (
        cv2.resize(one, (across, down), interpolation=cv2.INTER_AREA) for one in (within, np.maximum(fine, 0.0))
    )
    window = light[low[1] : low[1] + down, low[0] : low[0] + across]
    window *= 1.0 - share[: window.shape[0], : window.shape[1]]
    window += grey[: window.shape[0], : window.shape[1]]
    return _developed(light, look, rng)


def _developed(light: Float32Array, look: FloatArray, rng: np.random.Generator) -> ByteImage:
    blur_px, bright, noise = look
    height, width = light.shape
    x, y = np.linspace(-1, 1, width)[None], np.linspace(-1, 1, height)[:, None]
    slope = rng.normal(0.0, 0.08, 2)
    light = light * bright * (1.0 + slope[0] * x + slope[1] * y - 0.12 * (x * x + y * y))
    light = cv2.GaussianBlur(light, (0, 0), blur_px)
    grey = 255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / rng.uniform(1.9, 2.5))
    grey += rng.normal(0.0, 1.0, grey.shape) * noise * np.sqrt(0.4 + grey / 200.0)
    coded = cv2.imencode(".jpg", np.clip(np.rint(grey), 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 92])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def _yard(camera: Intrinsics, rng: np.random.Generator) -> Float32Array:
    small = rng.uniform(0.1, 0.5, (12, 16)).astype(np.float32)
    return np.asarray(cv2.resize(small, (camera.width_px, camera.height_px), interpolation=cv2.INTER_CUBIC))


def _texture(board: Board) -> Float32Array:
    """Return the print in light, `_CELL` texels a square, a white margin of a square less; its origin two squares in.

    The first inner corner lies at texel (2 _CELL - 0.5), between texels.
    """
    if board.kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        drawn = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
        inner = drawn.generateImage((board.columns * _CELL, board.rows * _CELL))
    else:
        y, x = np.indices((board.rows + 1, board.columns + 1))
        inner = np.kron(((x + y) % 2) * 255, np.ones((_CELL, _CELL)))
    return np.pad(0.04 + 0.76 * (inner.astype(np.float32) / 255.0), _CELL, constant_values=0.8).astype(np.float32)


def _outline(board: Board) -> FloatArray:
    (across, down), s = board.inner, board.square_m
    ring = [(x, y) for x in np.linspace(-2, across + 1, 9) for y in (-2, down + 1)]
    ring += [(x, y) for y in np.linspace(-2, down + 1, 9) for x in (-2, across + 1)]
    return np.c_[np.array(ring) * s, np.zeros(len(ring))]


def _texels(
    camera: Intrinsics, camera_from_board: FloatArray, printed: PrintedBoard, low: np.ndarray, size: np.ndarray
) -> tuple[Float32Array, Float32Array]:
    """Return which texels (columns, rows) a window's sub-pixels see, `_FINE` a pixel each way.

    Rays are met with the bowed board in the middle of each 2 x 2 pixels, and the texels between are interpolated.
    """
    x, y = (low[k] - 0.5 + (np.arange(-1, size[k] // 2 + 1) + 0.5) * 2.0 for k in (0, 1))
    rays = camera.rays(np.stack(np.meshgrid(x, y), axis=-1))
    board = printed.board
    middle = board.points_m.mean(axis=0)
    eye = -camera_from_board[:3, :3].T @ camera_from_board[:3, 3] - middle
    along = rays @ camera_from_board[:3, :3]
    away = -eye[2] / along[..., 2]
    for _ in range(2):  # a bow of a millimetre: the second step moves by less than a micrometre
        away = (bow_m(printed, eye[:2] + away[..., None] * along[..., :2]) - eye[2]) / along[..., 2]
    flat = eye[:2] + away[..., None] * along[..., :2]
    coarse = (flat / printed.scale + middle[:2]) / board.square_m * _CELL + 2.0 * _CELL - 0.5
    more = 2 * _FINE
    columns, rows = (
        cv2.resize(coarse[..., k].astype(np.float32), (len(x) * more, len(y) * more), interpolation=cv2.INTER_LINEAR)
        for k in (0, 1)
    )
    inner = slice(more, -more), slice(more, -more)
    return np.ascontiguousarray(columns[inner]), np.ascontiguousarray(rows[inner])


def _moved(pose: FloatArray, printed: PrintedBoard, hand: float, rng: np.random.Generator) -> FloatArray:
    """Return the board's pose a moment later, moved and turned about its middle."""
    middle = np.eye(4)
    middle[:3, 3] = printed.board.points_m.mean(axis=0)
    turn, shift = rng.normal(0.0, hand, 3), rng.normal(0.0, hand, 3)
    shaken = rigid(turn, shift)
    moved: FloatArray = pose @ middle @ shaken @ np.linalg.inv(middle)
    return moved


def _true_rig(rng: np.random.Generator, size: tuple[int, int]) -> StereoRig:
    sides, f = [], rng.uniform(0.75, 0.9) * size[0]
    for _ in range(2):
        K = np.diag([rng.normal(f, 0.004 * f), 0.0, 1.0])
        K[1, 1] = K[0, 0] * rng.normal(1.0, 5e-4)
        K[:2, 2] = (np.array(size) - 1) / 2 + rng.normal(0.0, 0.006 * size[0], 2)
        k1 = rng.uniform(-0.18, 0.02)
        lens = [k1, -0.35 * k1 * rng.uniform(0.4, 1.2), *rng.normal(0.0, 3e-4, 2), rng.normal(0.0, 0.01)]
        sides.append(Intrinsics(K=frozen(K), distortion=frozen(lens), width_px=size[0], height_px=size[1]))
    turn = rotation_from_vector(np.deg2rad(rng.normal(0.0, 0.5, 3)))
    centre = np.array([rng.uniform(0.12, 0.3), *rng.normal(0.0, 0.002, 2)])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, -turn @ centre
    return StereoRig(left=sides[0], right=sides[1], right_from_left=frozen(pose),
                     covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))))  # fmt: skip


def _poses(rig: StereoRig, board: Board, rng: np.random.Generator, count: int) -> list[FloatArray]:
    """Choose where the board is held (left_from_board), all over the frame, near and far, tilted every way."""
    size = np.array([rig.left.width_px, rig.left.height_px])
    middle, points = board.points_m.mean(axis=0), board.points_m
    grid = [(a, b) for b in (0.15, 0.5, 0.85) for a in (0.13, 0.38, 0.63, 0.87)]
    least = 0.5 if board.kind == "charuco" else 1.0
    ends = points if board.kind == "charuco" else _outline(board) * 0.9 + 0.1 * middle  # a white rim must be seen
    found: list[FloatArray] = []
    for k in range(count):
        wanted = np.array(grid[k] if k < len(grid) else rng.uniform(0.2, 0.8, 2))
        for attempt in range(300):
            place = wanted + (0.5 - wanted) * attempt / 400.0  # drawn in until it is seen
            away = rng.uniform(1.0, 1.5) if k % 3 == 0 else rng.uniform(1.2, 2.2)
            ray = rig.left.rays(place * size)
            turn = rotation_from_vector(rng.uniform([-0.65, -0.65, -0.35], [0.65, 0.65, 0.35]))
            pose = rigid(np.zeros(3), ray * away - turn @ middle)
            pose[:3, :3] = turn
            seen = [rig.left.project(apply(pose, ends)), rig.right.project(apply(rig.right_from_left @ pose, ends))]
            if min(float(((px > 4) & (px < size - 5)).all(axis=1).mean()) for px in seen) >= least:
                found.append(pose)
                break
    return found


def write_rendered(rig: RenderedRig, path: Path) -> None:
    """Keep a rig's truth and its corners, so that it is rendered once."""
    numbers = np.concatenate([rig.true.left.K.ravel(), rig.true.left.distortion, rig.true.right.K.ravel(),
                              rig.true.right.distortion, rig.true.right_from_left.ravel(),
                              [rig.true.left.width_px, rig.true.left.height_px]])  # fmt: skip
    arrays: dict[str, np.ndarray] = {
        "rig": numbers, "bow_m": rig.printed.bow_m, "scale": rig.printed.scale, "views": np.array([len(rig.views)])
    }  # fmt: skip
    for k, (view, true) in enumerate(zip(rig.views, rig.true_px, strict=True)):
        arrays |= {f"{k}_lm": view.left_points_m, f"{k}_lp": view.left_px, f"{k}_lt": true[0]}
        arrays |= {f"{k}_rm": view.right_points_m, f"{k}_rp": view.right_px, f"{k}_rt": true[1]}
    part = path.with_suffix(".part.npz")
    np.savez_compressed(part, **arrays)
    part.replace(path)


def read_rendered(path: Path, number: int) -> RenderedRig:
    """Read what `write_rendered` kept of the rig of a number."""
    with np.load(path) as held:
        n = held["rig"]
        size = int(n[44]), int(n[45])
        left, right = (
            Intrinsics(K=frozen(n[at : at + 9].reshape(3, 3)), distortion=frozen(n[at + 9 : at + 14]),
                       width_px=size[0], height_px=size[1])
            for at in (0, 14)
        )  # fmt: skip
        true = StereoRig(left=left, right=right, right_from_left=frozen(n[28:44].reshape(4, 4)),
                         covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))))  # fmt: skip
        views = [
            BoardView(name=f"{k + 1:02d}", left_points_m=held[f"{k}_lm"], left_px=held[f"{k}_lp"],
                      right_points_m=held[f"{k}_rm"], right_px=held[f"{k}_rp"])
            for k in range(int(held["views"][0]))
        ]  # fmt: skip
        true_px = [(held[f"{k}_lt"], held[f"{k}_rt"]) for k in range(len(views))]
        printed = PrintedBoard(board=(_CHARUCO, _CHESS)[number % 2], bow_m=held["bow_m"], scale=held["scale"])
    return RenderedRig(true=true, printed=printed, views=views, true_px=true_px)
