"""A small scene made by hand: a wall, a round column, ground, chessboards on known points, a tag and a disc."""

from __future__ import annotations

from datetime import date

import cv2
import numpy as np

from asbuilt_synthetic.model import Body, CameraTruth, Decal, Disc, FloatArray, Light, RigTruth, Scene, Station

ORIGIN_M = np.array([684213.25, 5348120.75, 512.5])
SQUARES = 8
SQUARE_M = 0.09
_HALF = 0.5  # photos of 640 x 480: a quarter of the time


def box(name: str, low: tuple[float, float, float], high: tuple[float, float, float], material: str) -> Body:
    """Make an axis-aligned box, corners relative to the origin."""
    corners = np.array(
        [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    )
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)
    return Body(
        name=name,
        vertices_m=corners + ORIGIN_M,
        triangles=triangles,
        face_id=np.full(len(triangles), -1, dtype=np.int32),
        material=material,
        texture_seed=len(name),
    )


def cylinder(name: str, centre: tuple[float, float], radius: float, height: float, material: str) -> Body:
    """Make an upright cylinder of 64 sides."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    ring = np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])
    vertices = np.vstack(
        [
            np.column_stack([ring, np.zeros(64)]),
            np.column_stack([ring, np.full(64, height)]),
            [[*centre, 0.0], [*centre, height]],
        ]
    )
    here, there = np.arange(64), (np.arange(64) + 1) % 64
    triangles = np.vstack(
        [
            np.column_stack([here, there, there + 64]),
            np.column_stack([here, there + 64, here + 64]),
            np.column_stack([here + 64, there + 64, np.full(64, 129)]),
        ]
    ).astype(np.int32)
    return Body(
        name=name,
        vertices_m=vertices + ORIGIN_M,
        triangles=triangles,
        face_id=np.full(len(triangles), -1, dtype=np.int32),
        material=material,
        texture_seed=5,
    )


def rig() -> RigTruth:
    """Make an imperfect rig: distorted, off-centre, the right camera turned."""

    def camera(f: float, cx: float, cy: float, k1: float) -> CameraTruth:
        centre = _HALF * (np.array([cx, cy]) + 0.5) - 0.5
        return CameraTruth(
            K=np.array([[_HALF * f, 0, centre[0]], [0, _HALF * (f + 0.7), centre[1]], [0, 0, 1.0]]),
            distortion=np.array([k1, 0.06, 0.0006, -0.0004, -0.01]),
            width_px=640,
            height_px=480,
        )

    right_from_left = np.eye(4)
    right_from_left[:3, :3] = cv2.Rodrigues(np.deg2rad([0.3, -0.5, 0.4]))[0]
    right_from_left[:3, 3] = (-0.2507, 0.0012, -0.0021)
    return RigTruth(
        left=camera(1046.3, 646.8, 471.4, -0.11),
        right=camera(1053.9, 631.2, 485.7, -0.125),
        right_from_left=right_from_left,
    )


def pose(
    from_m: tuple[float, float, float], towards_m: tuple[float, float, float], roll_deg: float = 1.5
) -> FloatArray:
    """Make world_from_left of a camera that looks at a point."""
    z = np.subtract(towards_m, from_m)
    z = z / np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    world_from_left = np.eye(4)
    turn = cv2.Rodrigues(np.array([0.0, 0.0, np.deg2rad(roll_deg)]))[0]
    world_from_left[:3, :3] = np.column_stack([x, np.cross(z, x), z]) @ turn
    world_from_left[:3, 3] = np.array(from_m) + ORIGIN_M
    return world_from_left


def checker(name: str, centre: FloatArray, world_from_left: FloatArray) -> Decal:
    """Make a chessboard about a world point, turned somewhat from the camera."""
    tilt = cv2.Rodrigues(np.array([0.25, -0.35, 0.1]))[0]
    axes = world_from_left[:3, :3] @ tilt
    half = SQUARES * SQUARE_M / 2
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    image = np.kron((np.indices((SQUARES, SQUARES)).sum(axis=0) % 2).astype(np.uint8), np.ones((16, 16), np.uint8))
    picture = np.repeat((30 + 190 * image)[..., None], 3, axis=2).astype(np.uint8)
    return Decal(name=name, corners_m=centre + corners @ axes[:, :2].T, image_srgb=picture)


def checker_corners(decal: Decal) -> FloatArray:
    """Give the inner corners (49, 3) of a chessboard in world metres, row by row."""
    top_left, top_right, _, bottom_left = decal.corners_m
    steps = np.arange(1, SQUARES) / SQUARES
    return np.array(
        [top_left + s * (top_right - top_left) + t * (bottom_left - top_left) for t in steps for s in steps]
    )


def disc_outline(disc: Disc, points: int = 720) -> FloatArray:
    """Give world points (points, 3) on the rim of the target."""
    right = np.cross([0.0, 0.0, 1.0], disc.normal)
    right /= np.linalg.norm(right)
    up = np.cross(disc.normal / np.linalg.norm(disc.normal), right)
    angle = np.linspace(0.0, 2 * np.pi, points, endpoint=False)[:, None]
    return np.asarray(disc.centre_m + disc.radius_m * (np.cos(angle) * right + np.sin(angle) * up))


def backdrop(disc: Disc) -> Decal:
    """Make a grey sheet of 1.2 m, 0.1 m behind the target."""
    right = np.cross([0.0, 0.0, 1.0], disc.normal)
    right /= np.linalg.norm(right)
    up = np.cross(disc.normal / np.linalg.norm(disc.normal), right)
    corners = np.array([[-0.6, 0.6], [0.6, 0.6], [0.6, -0.6], [-0.6, -0.6]]) @ np.array([right, up])
    grey = np.full((8, 8, 3), 110, dtype=np.uint8)
    return Decal(name="backdrop", corners_m=disc.centre_m - 0.1 * disc.normal + corners, image_srgb=grey)


def tag(name: str, centre: tuple[float, float, float], side_m: float) -> Decal:
    """Make an AprilTag with its quiet zone on a plane of constant y, seen from -y; `side_m` is the tag without it."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    picture = np.full((100, 100), 255, np.uint8)
    picture[10:90, 10:90] = cv2.aruco.generateImageMarker(dictionary, 7, 80)
    half = side_m / 2 * 100 / 80
    corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
    return Decal(
        name=name, corners_m=corners + np.array(centre) + ORIGIN_M, image_srgb=np.repeat(picture[..., None], 3, 2)
    )


def site() -> Scene:
    """Make the hand-made site with stations "wall" (materials) and "boards" (chessboards over the whole frame)."""
    bodies = [
        box("ground", (-40, -40, -0.5), (40, 40, 0.0), "ground"),
        box("slab", (-4, -1, -0.3), (6, 5, 0.02), "concrete_slab"),
        box("wall", (-2.5, 3.0, 0.02), (3.0, 3.25, 3.0), "concrete"),
        cylinder("column", (-1.2, 1.4), 0.2, 3.0, "concrete"),
        box("square", (1.7, 1.2, 0.02), (2.1, 1.6, 2.0), "concrete"),
        box("ply", (3.4, 2.6, 0.02), (5.2, 2.63, 2.6), "formwork_ply"),
        box("steel", (-4.4, 2.6, 0), (-3.2, 2.7, 2.7), "formwork_steel"),
        box("timber", (0.6, 0.8, 0.02), (1.5, 1.1, 0.12), "timber"),
        box("house", (-12, 22, 0), (6, 30, 7), "brick"),
        box("pane", (-6, 21.95, 1.2), (-4.6, 22.0, 2.8), "glass"),
        box("plastered", (8, 18, 0), (20, 26, 9), "plaster"),
        box("fence", (-20, 14, 0), (-5, 14.1, 2.0), "hoarding"),
        box("bush", (5, 12, 0), (8, 14, 3), "foliage"),
        box("lawn", (-30, 15, 0), (30, 16, 0.02), "grass"),
        box("red", (0.9, 2.3, 0.02), (1.2, 2.6, 0.9), "red_paint"),
        box("man", (-3.0, 1.2, 0.02), (-2.6, 1.5, 1.1), "cloth_blue"),
        box("vest", (-3.0, 1.2, 1.1), (-2.6, 1.5, 1.6), "cloth_orange_vest"),
        box("tarp", (2.6, 0.4, 0.02), (3.4, 1.0, 0.5), "tarpaulin"),
        *(cylinder(f"bar {k}", (1.75 + 0.1 * (k % 4), 1.25 + 0.3 * (k // 4)), 0.008, 2.7, "rebar") for k in range(8)),
        *(cylinder(f"tube {k}", (3.1 + 0.9 * k, 2.3), 0.024, 3.4, "scaffold_steel") for k in range(3)),
    ]
    camera_pose = pose((0.3, -2.6, 1.6), (0.2, 3.0, 1.35))
    boards_pose = pose((0.0, 12.0, 2.0), (0.0, 30.0, 2.2), -2.0)
    boards = []
    for index, (x, y) in enumerate(
        [(-0.46, -0.33), (0.53, -0.33), (-0.46, 0.32), (0.53, 0.33), (0.0, 0.0), (0.0, -0.3)]
    ):
        centre = boards_pose[:3, :3] @ (np.array([x, y, 1.0]) * 2.6) + boards_pose[:3, 3]
        boards.append(checker(f"board {index}", centre, boards_pose))
    disc = Disc(centre_m=np.array([0.55, 2.2, 1.5]) + ORIGIN_M, normal=np.array([-0.1, -0.99, 0.05]), radius_m=0.15)
    stations = (
        Station(name="wall", world_from_left=camera_pose, disc=disc),
        Station(name="boards", world_from_left=boards_pose, disc=None),
    )
    return Scene(
        seed=3,
        visit=0,
        day=date(2026, 3, 2),
        origin_m=ORIGIN_M,
        bodies=tuple(bodies),
        decals=(*boards, tag("tag", (-0.6, 2.998, 1.6), 0.28)),
        faces=(),
        elements=(),
        markers=(),
        rig=rig(),
        stations=stations,
        light=Light(
            towards_sun=np.array([-0.45, -0.55, 0.7]), sun_strength=0.2, sky_srgb=(120, 160, 215), exposure=1.0
        ),
    )
