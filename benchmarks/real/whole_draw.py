"""Draws surveyed tags and the red disc into both photos of a real pair, where they would be seen."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from benchmarks.real.whole_places import Place, Print
from benchmarks.real.whole_scenes import GAMMA, Scene
from benchmarks.real.whole_truth import World

MODULES, MODULE_PX = 8, 24  # AprilTag 36h11 with its black border, and one module of white all round
OVER = 4  # pixels are drawn as this many by this many
BLUR_PX = 0.6  # of a sharp lens
OFF_WALL_M = 0.002
BLACK, WHITE = 0.04, 0.85  # printer's ink and paper, of the light that the brightest surroundings reflect
LEAST_LIGHT = 0.2  # of what the photo calls white
DISC_BGR = (0.015, 0.01, 0.6)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """Both photos with everything in them, and the tags' corners in the world: id, (4, 3)."""

    left: ByteImage
    right: ByteImage
    tags: tuple[tuple[int, FloatArray], ...]


def draw(world: World, place: Place) -> Drawn:
    """Draw a place's tags, and its disc where the photos have colour.

    Raises: SystemExit where a print would be outside a photo, or behind what the known points show.
    """
    photos = [world.scene.left.copy(), world.scene.right.copy()]
    tags, order = [], sorted(range(len(place.tags)), key=lambda one: -place.tags[one].depth_m)
    for number in order:  # the nearer ones last
        corners = print_corners(world, place.tags[number], place.tag_m)
        wide = print_corners(world, place.tags[number], place.tag_m * (MODULES + 2) / MODULES)
        _refuse_hidden(world.scene, world.left_from(wide), f"{world.scene.name}: tag {number}")
        picture = tag_picture(number)
        photos = [_pasted(world.scene, one, world.left_from(wide), picture, side) for side, one in enumerate(photos)]
        tags.append((number, corners))
    if place.disc is not None and world.scene.in_colour:
        square = world.left_from(print_corners(world, place.disc, place.disc_m))
        _refuse_hidden(world.scene, square, f"{world.scene.name}: the disc")
        photos = [_pasted(world.scene, one, square, disc_picture(), side) for side, one in enumerate(photos)]
    return Drawn(left=photos[0], right=photos[1], tags=tuple(sorted(tags, key=lambda one: one[0])))


def print_corners(world: World, spot: Print, side_m: float) -> FloatArray:
    """Return the world corners of a square print: top-left, top-right, bottom-right, bottom-left from the front."""
    eye = world.world_from_left[:3, 3]
    ray = (world.scene.rays(np.array([spot.at_px])) @ world.world_from_left[:3, :3].T)[0]
    if spot.on:
        body = world.bodies[spot.on]
        normal = body.normal
        middle = eye + ray * ((body.at_m - eye) @ normal) / (ray @ normal) + OFF_WALL_M * normal
    else:
        middle = eye + ray * spot.depth_m
        normal = (eye - middle) * [1.0, 1.0, 0.0]
        normal = normal / np.linalg.norm(normal)
    up, half = np.array([0.0, 0.0, 1.0]), 0.5 * side_m
    along = np.cross(up, normal)
    return np.array([middle + a * half * along + b * half * up for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))])


def tag_picture(number: int) -> FloatArray:
    """Return a tag with its white rim: (N, N, 4), blue, green, red as shares of white, and how much it covers."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    ink = np.asarray(cv2.aruco.generateImageMarker(family, number, MODULES * MODULE_PX), dtype=np.float64) / 255.0
    grey = BLACK + np.pad(ink, MODULE_PX, constant_values=1.0) * (WHITE - BLACK)
    return np.dstack([grey, grey, grey, np.ones_like(grey)])


def disc_picture() -> FloatArray:
    """Return the red disc, as `tag_picture` does."""
    size = 400
    rows, columns = np.indices((size, size)) - 0.5 * (size - 1)
    inside = (np.hypot(rows, columns) <= 0.5 * size).astype(np.float64)
    return np.dstack([*(np.full((size, size), one) for one in DISC_BGR), inside])


def _pasted(scene: Scene, photo: ByteImage, corners_m: FloatArray, picture: FloatArray, side: int) -> ByteImage:
    """Put a picture on a quad into a photo: blurred as by a lens, lit as its surroundings, with the photo's noise."""
    at = scene.pixels(corners_m, right=side == 1)
    low, high = np.floor(at.min(axis=0)).astype(int) - 4, np.ceil(at.max(axis=0)).astype(int) + 5
    grey = photo[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    own = (grey / 255.0) ** GAMMA
    size = picture.shape[0]
    ends = np.array([[0, 0], [size, 0], [size, size], [0, size]], dtype=np.float32) - 0.5
    onto = cv2.getPerspectiveTransform(ends, ((at - low + 0.5) * OVER - 0.5).astype(np.float32))
    premultiplied = np.dstack([picture[..., :3] * picture[..., 3:], picture[..., 3]])
    fine = cv2.warpPerspective(premultiplied, onto, (own.shape[1] * OVER, own.shape[0] * OVER), flags=cv2.INTER_AREA)
    fine = cv2.GaussianBlur(fine, (0, 0), BLUR_PX * OVER)
    patch = np.asarray(cv2.resize(fine, (own.shape[1], own.shape[0]), interpolation=cv2.INTER_AREA))
    light = max(LEAST_LIGHT, float(np.quantile(own, 0.9)))
    noise = np.random.default_rng([side, *low]).normal(0.0, _noise(photo), own.shape[:2])[..., None]
    mixed = 255.0 * (own * (1.0 - patch[..., 3:]) + patch[..., :3] * light) ** (1.0 / GAMMA) + noise * patch[..., 3:]
    made = photo.copy()
    made[low[1] : high[1], low[0] : high[0]] = np.clip(np.round(mixed), 0, 255).astype(np.uint8)
    return made


def _noise(photo: ByteImage) -> float:
    """Return the photo's noise in grey levels, from how pixels differ from their neighbours (Immerkaer)."""
    grey = np.asarray(cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY), dtype=np.float64)
    kernel = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])
    return float(np.median(np.abs(cv2.filter2D(grey, -1, kernel))) / 0.6745 / 6.0)


def _refuse_hidden(scene: Scene, corners_m: FloatArray, what: str) -> None:
    """Refuse a print of which a photo shows no more than a part."""
    height, width = scene.left.shape[:2]
    for right in (False, True):
        quad = scene.pixels(corners_m, right).astype(np.float32)
        if quad.min() < 5.0 or (quad.max(axis=0) > (width - 6.0, height - 6.0)).any():
            raise SystemExit(f"{what} leaves the {'right' if right else 'left'} photo: {np.round(quad).tolist()}")
        known = scene.pixels(scene.points_m, right).astype(np.float32)
        near = np.flatnonzero(np.all((known > quad.min(axis=0)) & (known < quad.max(axis=0)), axis=1))
        inside = [one for one in near if cv2.pointPolygonTest(quad, known[one].tolist(), measureDist=False) > 0]
        nearer = scene.points_m[inside, 2] < corners_m[:, 2].mean() - 0.05 * corners_m[:, 2].mean()
        if len(inside) and nearer.mean() > 0.02:
            raise SystemExit(f"{what} is hidden in the {'right' if right else 'left'} photo: {nearer.mean():.0%}")
