"""A virtual rig with known truth, boards held before it, and picture files made by hand."""

from __future__ import annotations

import struct

import numpy as np

from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid, rotation_from_vector, vector_from_rotation

SIZE = (1280, 960)


LENSES = {
    "five": [-0.11, 0.04, 0.0006, -0.0004, -0.003],
    "rational": [0.12, -0.05, 0.0006, -0.0004, 0.01, 0.32, -0.02, 0.004],
    "fisheye": [-0.021, -0.006, 0.002, -0.0011],
}
FOCAL = {"five": 1052.0, "rational": 790.0, "fisheye": 640.0}


def camera(
    fx: float = 1052.0, cx: float = 646.0, cy: float = 472.0, k1: float = -0.11, lens: LensModel = "five"
) -> Intrinsics:
    K = frozen([[fx, 0.0, cx], [0.0, fx - 1.5, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen([k1, *LENSES[lens][1:]]), width_px=SIZE[0], height_px=SIZE[1])


def rig(lens: LensModel = "five") -> StereoRig:
    """A rig of about 62, 78 or 115 degrees across, with each kind of lens."""
    size, f, k1 = len(PARAMETERS), FOCAL[lens], LENSES[lens][0]
    return StereoRig(
        left=camera(f, k1=k1, lens=lens),
        right=camera(f - 5.0, 633.0, 481.0, k1 + 0.02, lens),
        right_from_left=frozen(rigid([0.006, -0.008, 0.004], [-0.2496, 0.0021, -0.0013])),
        covariance=frozen(np.zeros((size, size))),
        camera_model="Maker One",
        camera_serial="L-1",
        camera_serial_right="R-2",
        focal_length_mm=8.0,
        exif_orientation=1,
    )


def parameters(of: StereoRig) -> FloatArray:
    """In the order of rig.PARAMETERS."""
    cameras = [np.r_[c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2]] for c in (of.left, of.right)]
    return np.r_[cameras[0], cameras[1], vector_from_rotation(of.right_from_left[:3, :3]), of.right_from_left[:3, 3]]


def board_points(columns: int = 9, rows: int = 6, square_m: float = 0.08) -> FloatArray:
    grid = np.zeros((rows, columns, 3))
    grid[..., 0], grid[..., 1] = np.arange(columns) * square_m, np.arange(rows)[:, None] * square_m
    return grid.reshape(-1, 3)


def views(of: StereoRig, count: int, noise_px: float, seed: int) -> tuple[list[BoardView], FloatArray]:
    """Boards wholly seen by both cameras, and their true poses (count, 6) in the left frame.

    The poses come from a fixed sequence, the noise from `seed`.
    """
    poses_of, noise = np.random.default_rng(5), np.random.default_rng(seed)
    points = board_points()
    found: list[BoardView] = []
    poses = []
    while len(found) < count:
        turn = rotation_from_vector(poses_of.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))
        place = poses_of.uniform([-1.0, -0.8, 1.2], [1.0, 0.8, 2.6])
        left_from_board = rigid(turn, place - turn @ points.mean(axis=0))
        in_left = apply(left_from_board, points)
        seen = [of.left.project(in_left), of.right.project(apply(of.right_from_left, in_left))]
        if any((px < 0).any() or (px > np.array(SIZE) - 1).any() for px in seen):
            continue
        left, right = (px + noise.normal(0.0, noise_px, px.shape) for px in seen)
        found.append(
            BoardView(name=f"{len(found)}", left_points_m=points, left_px=left, right_points_m=points, right_px=right)
        )
        poses.append(np.r_[vector_from_rotation(turn), left_from_board[:3, 3]])
    return found, np.array(poses)


def exif_block(
    make: str = "Maker",
    model: str = "One",
    serial: str = "L-1",
    focal_mm: float = 8.0,
    orientation: int = 1,
    taken: str = "2026:03:02 09:12:00",
) -> bytes:
    """A little-endian EXIF block as cameras write it: main directory, EXIF directory, texts behind them."""
    texts = [text.encode() + b"\x00" * 6 for text in (make, model, serial, taken)]
    main_at, exif_at = 8, 8 + 2 + 4 * 12 + 4
    data_at = exif_at + 2 + 3 * 12 + 4
    places = np.cumsum([data_at, *map(len, texts)])
    main = struct.pack("<H", 4)
    main += struct.pack("<HHII", 0x010F, 2, len(texts[0]), places[0])
    main += struct.pack("<HHII", 0x0110, 2, len(texts[1]), places[1])
    main += struct.pack("<HHIHH", 0x0112, 3, 1, orientation, 0)
    main += struct.pack("<HHII", 0x8769, 4, 1, exif_at) + struct.pack("<I", 0)
    exif = struct.pack("<H", 3)
    exif += struct.pack("<HHII", 0x9003, 2, len(texts[3]), places[3])
    exif += struct.pack("<HHII", 0xA431, 2, len(texts[2]), places[2])
    exif += struct.pack("<HHII", 0x920A, 5, 1, places[4]) + struct.pack("<I", 0)
    assert main_at + len(main) == exif_at
    header = b"II*\x00" + struct.pack("<I", main_at)
    return header + main + exif + b"".join(texts) + struct.pack("<II", round(focal_mm * 100), 100)


def with_exif(jpeg: bytes, block: bytes) -> bytes:
    body = b"Exif\x00\x00" + block
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + jpeg[2:]
