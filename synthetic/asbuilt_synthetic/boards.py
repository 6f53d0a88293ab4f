"""Shows the rig a ChArUco board near and far, tilted, over the whole frame: small scenes for calibration pairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_synthetic.background import background
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.lens import camera_of, directions, in_frame, project
from asbuilt_synthetic.meshes import box, join, transform, tube
from asbuilt_synthetic.model import Decal, FloatArray, Light, RigTruth, Scene, Station
from asbuilt_synthetic.progress import FIRST_DAY
from asbuilt_synthetic.rig import rotation

Renderer = Callable[[Scene, Station, str], np.ndarray]
BOARD_PAIRS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A ChArUco board: squares across and down, their sides."""

    columns: int = 9
    rows: int = 7
    square_m: float = 0.08
    marker_m: float = 0.06
    dictionary: str = "DICT_5X5_100"
    margin_m: float = 0.02

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the squares' field."""
        return self.columns * self.square_m, self.rows * self.square_m

    def image(self) -> np.ndarray:
        """Draw the board with its white margin, 80 px a square, in printer's black and white."""
        px = 80
        family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, family)
        grey = board.generateImage((self.columns * px, self.rows * px), marginSize=0, borderBits=1)
        m = round(self.margin_m / self.square_m * px)
        grey = np.pad(grey, m, constant_values=255)
        printed = (26 + (grey.astype(np.float32) / 255) * (208 - 26)).astype(np.uint8)
        return np.repeat(printed[:, :, None], 3, axis=2)

    def corners_m(self) -> FloatArray:
        """Return the inner corners (N, 3) about the board's middle, x right, y down, z away from the viewer."""
        w, h = self.size_m
        x, y = np.meshgrid(
            np.arange(1, self.columns) * self.square_m - w / 2, np.arange(1, self.rows) * self.square_m - h / 2
        )
        return np.asarray(np.c_[x.ravel(), y.ravel(), np.zeros(x.size)])


def board_pairs(
    rig: RigTruth, seed: int, renderer: Renderer, count: int = BOARD_PAIRS
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Photograph the board with both cameras: `count` pairs of distorted RGB photos."""
    return [
        (renderer(s, s.stations[0], "left"), renderer(s, s.stations[0], "right"))
        for s in board_scenes(rig, seed, count)
    ]


def board_scenes(rig: RigTruth, seed: int, count: int = BOARD_PAIRS) -> list[Scene]:
    """Build one small scene a pair: the yard behind, the rig still, the board held before it."""
    building = design(seed)
    rng = np.random.default_rng([seed, 10])
    yard = tuple(p.placed(building.world_from_local) for p in background(building))
    eye = np.array([building.axes_x_m[0] - 6.5, building.axes_y_m[0] - 4.5, 1.5])
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # looks along +x of the site
    pose[:3, 3] = eye
    world_from_left = building.world_from_local @ pose
    board = Board()
    image = board.image()
    sun = building.world_from_local[:3, :3] @ (np.array([-0.62, 0.45, 0.65]) / np.linalg.norm([-0.62, 0.45, 0.65]))
    light = Light(towards_sun=sun, sun_strength=0.35, sky_srgb=(196, 202, 210), exposure=1.0)
    out = []
    for k, left_from_board in enumerate(board_poses(rig, board, rng, count)):
        world_from_board = world_from_left @ left_from_board
        w, h = np.array(board.size_m) / 2 + board.margin_m
        quad = np.array([[-w, -h, 0], [w, -h, 0], [w, h, 0], [-w, h, 0]])
        plate = box("Board plate", (-w - 0.01, -h - 0.01, 0.002), (w + 0.01, h + 0.01, 0.012), "stand_black")
        pole = tube("Board pole", (0, 0.1, 0.02), (0, h + 0.9, 0.02), 0.015, "stand_black")
        body = join("Board", [plate, pole]).placed(world_from_board)
        station = Station(name=f"B{k + 1:02d}", world_from_left=world_from_left, disc=None, bodies=(body,))
        decal = Decal(name="board", corners_m=transform(world_from_board, quad), image_srgb=image)
        out.append(
            Scene(
                seed=seed,
                visit=900 + k,
                day=FIRST_DAY,
                origin_m=building.world_from_local[:3, 3].round(1),
                bodies=yard,
                decals=(decal,),
                faces=(),
                elements=(),
                markers=(),
                rig=rig,
                stations=(station,),
                light=light,
            )
        )
    return out


def board_poses(rig: RigTruth, board: Board, rng: np.random.Generator, count: int) -> list[FloatArray]:
    """Choose board poses (left camera from board, 4x4) that together cover both frames, corners too."""
    camera = rig.left
    grid = [(a, b) for b in (0.14, 0.5, 0.86) for a in (0.12, 0.37, 0.63, 0.88)]
    places = [(0.5, 0.5), *grid, *[(rng.uniform(0.25, 0.75), rng.uniform(0.25, 0.75)) for _ in range(count)]]
    poses: list[FloatArray] = []
    for k in range(count):
        a, b = places[k]
        for attempt in range(200):
            near = k % 3 == 0
            depth = rng.uniform(1.2, 1.6) if near else rng.uniform(1.5, 3.2) if k % 3 == 1 else rng.uniform(1.3, 2.2)
            px = np.array([[a * camera.width_px, b * camera.height_px]])
            middle = directions(camera, px)[0] * depth + [0.125 * (0.5 < a < 0.9), 0, 0]
            tilt = rng.uniform(-0.65, 0.65, 2) if k else np.zeros(2)
            turn = rotation(np.array([tilt[0], tilt[1], 0.0])) @ rotation(np.array([0, 0, rng.uniform(-0.35, 0.35)]))
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turn, middle
            share = min(_share_in_view(rig, side, pose, board) for side in ("left", "right"))
            if share >= (0.85 if attempt < 100 else 0.55):
                break
        poses.append(pose)
    return poses


def _share_in_view(rig: RigTruth, side: str, left_from_board: FloatArray, board: Board) -> float:
    camera = camera_of(rig, side)
    pose = left_from_board if side == "left" else rig.right_from_left @ left_from_board
    return float(in_frame(camera, project(camera, transform(pose, board.corners_m())), 6.0).mean())
