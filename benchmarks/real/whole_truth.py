"""The design built on the truth: where the faces lie in the world, what truly stands of them, and what is in view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from benchmarks.real.whole_places import Box, Element, Place
from benchmarks.real.whole_scenes import Scene

WORLD_TURN_RAD, WORLD_AT_M = 0.5, (120.0, 240.0, 30.0)
"""The world is turned and far from the camera, so that nothing fits by chance."""
OFF_M, OFF_SHARE = 0.05, 0.02
"""A point counts as on a face when it is nearer than this, or than this share of its distance."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """An element in the world: a box behind its face, or a cylinder, with what is true of it."""

    element: Element
    at_m: FloatArray  # lower left corner of the face as it is seen; of a round column the foot of its axis
    along: FloatArray  # unit, level, along the face
    normal: FloatArray  # unit, level, towards the camera
    size_m: tuple[float, float, float]  # along, deep, high; of a round column twice the diameter, and high
    completion: float
    visible: float  # of the points in view within its outline, those not before it
    agree: float  # of the points not before it, those that say what the truth says


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class World:
    """A scene's world frame with its bodies."""

    scene: Scene
    world_from_left: FloatArray
    bodies: dict[str, Body]

    def left_from(self, points_m: FloatArray) -> FloatArray:
        """Return world points in the left camera's frame."""
        return np.asarray((points_m - self.world_from_left[:3, 3]) @ self.world_from_left[:3, :3])

    def to(self, points_m: FloatArray) -> FloatArray:
        """Return the left camera's points in the world."""
        return np.asarray(points_m @ self.world_from_left[:3, :3].T + self.world_from_left[:3, 3])


def build_world(scene: Scene, place: Place) -> World:
    """Choose the frame and put the design's elements where the known points say that they stand."""
    world_from_left = _frame(_up(scene, place))
    empty = World(scene=scene, world_from_left=world_from_left, bodies={})
    bodies: dict[str, Body] = {}
    for element in place.elements:
        bodies[element.name] = _body(empty, element, bodies)
    return World(scene=scene, world_from_left=world_from_left, bodies=bodies)


def points_in(scene: Scene, box: Box) -> FloatArray:
    """Return the known points that the left photo shows inside a box."""
    at = scene.pixels(scene.points_m)
    inside = (at[:, 0] >= box[0]) & (at[:, 0] <= box[2]) & (at[:, 1] >= box[1]) & (at[:, 1] <= box[3])
    return scene.points_m[inside]


def plane_of(points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the plane (a point, the normal towards the camera) that most of the points lie near."""
    rng, best = np.random.default_rng(0), np.zeros(len(points_m), dtype=bool)
    near_m = np.maximum(0.5 * OFF_M, 0.5 * OFF_SHARE * points_m[:, 2])
    for _ in range(300):
        a, b, c = points_m[rng.choice(len(points_m), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        near = np.abs((points_m - a) @ normal) < near_m * np.linalg.norm(normal)
        best = near if near.sum() > best.sum() else best
    middle = points_m[best].mean(axis=0)
    weights = 1.0 / points_m[best][:, 2] ** 2  # depth's noise grows as its square
    normal = np.linalg.eigh(np.cov((points_m[best] - middle).T * weights))[1][:, 0]
    return middle, normal * -np.sign(normal @ middle)


def _up(scene: Scene, place: Place) -> FloatArray:
    """Return what is up in the left camera's frame: as published, or square to the planes that are plumb."""
    if scene.up is not None:
        return scene.up
    up = np.array([0.0, -1.0, 0.0])
    if place.floor_px is not None:
        return plane_of(points_in(scene, place.floor_px))[1]
    boxes = place.upright_px or tuple(one.plane_px for one in place.elements if one.plane_px)[:1]
    plumb = [plane_of(points_in(scene, box))[1] for box in boxes]
    if len(plumb) == 2:
        edge = np.cross(plumb[0], plumb[1])
        return np.asarray(edge * np.sign(edge @ up) / np.linalg.norm(edge))
    up -= (up @ plumb[0]) * plumb[0]  # one wall: the photo's own columns say the rest
    return np.asarray(up / np.linalg.norm(up))


def _frame(up: FloatArray) -> FloatArray:
    level = np.cross([0.0, 0.0, 1.0], up)
    level /= np.linalg.norm(level)
    upright = np.stack([level, np.cross(up, level), up])  # world axes before the turn, in the left frame
    c, s = np.cos(WORLD_TURN_RAD), np.sin(WORLD_TURN_RAD)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ upright
    pose[:3, 3] = WORLD_AT_M
    return pose


def _body(world: World, element: Element, others: dict[str, Body]) -> Body:
    if element.shape == "round":
        return _round(world, element)
    eye = world.world_from_left[:3, 3]
    middle, normal = _face_plane(world, element, others)
    along = np.cross([0.0, 0.0, 1.0], normal)
    x0, y0, x1, y1 = element.box_px
    corners = world.scene.rays(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])) @ world.world_from_left[:3, :3].T
    corners = eye + corners * ((middle - eye) @ normal / (corners @ normal))[:, None]
    u, z = (corners - middle) @ along, corners[:, 2]
    left, right = float(u[[0, 3]].mean()), float(u[[1, 2]].mean())
    low, high = float(z[2:].mean()), float(z[:2].mean())
    flat = middle + left * along
    at = np.array([flat[0], flat[1], low])
    size = (right - left, element.thickness_m, high - low)
    completion = float(element.stands)
    if element.real_top_px is not None:
        ray = world.scene.rays(np.array([[0.5 * (x0 + x1), element.real_top_px]])) @ world.world_from_left[:3, :3].T
        top = (eye + ray * ((middle - eye) @ normal / (ray @ normal))[:, None])[0, 2]
        completion = float((top - low) / (high - low))
    ends = element.box_px if element.real_top_px is None else (x0, element.real_top_px, x1, y1)
    points = world.to(points_in(world.scene, ends))
    visible, agree = _seen((points - at) @ normal, np.linalg.norm(points - eye, axis=1), element.stands)
    return Body(element=element, at_m=at, along=along, normal=normal, size_m=size, completion=completion,
                visible=visible, agree=agree)  # fmt: skip


def _face_plane(world: World, element: Element, others: dict[str, Body]) -> tuple[FloatArray, FloatArray]:
    """Return a point of a face and its level normal, in the world."""
    turn = world.world_from_left[:3, :3]
    if element.beside:
        return others[element.beside].at_m, others[element.beside].normal
    if element.plane_px is not None:
        middle, normal = plane_of(points_in(world.scene, element.plane_px))
    else:
        x0, y0, x1, y1 = element.box_px
        middle = world.scene.rays(np.array([[0.5 * (x0 + x1), 0.5 * (y0 + y1)]]))[0] * element.depth_m
        normal = -middle
    level = (turn @ normal) * [1.0, 1.0, 0.0]
    return world.to(middle), level / np.linalg.norm(level)


def _round(world: World, element: Element) -> Body:
    """Put a cylinder between the two upright rays of the box, its front where the points in `plane_px` are nearest."""
    assert element.plane_px is not None
    eye = world.world_from_left[:3, 3]
    x0, y0, x1, y1 = element.box_px
    mid_y = 0.5 * (y0 + y1)
    sides = world.scene.rays(np.array([[x0, mid_y], [x1, mid_y]])) @ world.world_from_left[:3, :3].T
    level = sides[:, :2] / np.linalg.norm(sides[:, :2], axis=1)[:, None]
    towards = level.sum(axis=0) / np.linalg.norm(level.sum(axis=0))
    half = float(np.arccos(np.clip(level[0] @ towards, -1.0, 1.0)))
    points = world.to(points_in(world.scene, element.plane_px))
    front = float(np.quantile((points - eye)[:, :2] @ towards, 0.1))
    axis = front / (1.0 - np.sin(half))
    radius = axis * np.sin(half)
    rays = world.scene.rays(np.array([[0.5 * (x0 + x1), y] for y in (y0, y1)])) @ world.world_from_left[:3, :3].T
    high, low = (float(eye[2] + axis * ray[2] / np.linalg.norm(ray[:2])) for ray in rays)
    normal = np.array([-towards[0], -towards[1], 0.0])
    foot = np.array([*(eye[:2] + axis * towards), low])
    own = world.to(points_in(world.scene, element.box_px))
    off = np.linalg.norm((own - foot)[:, :2], axis=1) - radius
    nearer = (own - foot) @ normal > radius
    visible, agree = _seen(np.where(nearer, np.abs(off), -np.abs(off)), np.linalg.norm(own - eye, axis=1), True)
    return Body(element=element, at_m=foot, along=np.cross([0.0, 0.0, 1.0], normal), normal=normal,
                size_m=(2 * radius, 2 * radius, high - low), completion=1.0, visible=visible, agree=agree)  # fmt: skip


def _seen(before_m: FloatArray, range_m: FloatArray, stands: bool) -> tuple[float, float]:
    """Return the share of points not before the face, and of those the share on it, or behind it where none stands."""
    if not len(before_m):
        return 1.0, 1.0  # nothing but sky within the outline
    near_m = np.maximum(OFF_M, OFF_SHARE * range_m)
    free = before_m < near_m
    right = np.abs(before_m) < near_m if stands else before_m < -near_m
    return float(free.mean()), float(right[free].mean()) if free.any() else 0.0
