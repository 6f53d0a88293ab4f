"""Places cameras where photos of sites are taken: on foot, from fixed points high up, and at odd places."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from asbuilt_synthetic.model import FloatArray
from asbuilt_synthetic.rig import rotation

from asbuilt_training.classes import COLUMN, CONCRETE, WALL
from asbuilt_training.images.draw import WIDTH_PX, View, rays
from asbuilt_training.images.stage import Stage

Rng = np.random.Generator
_CANDIDATES = 48
_ROUNDS = 12
_NEAR_M = 60.0  # what is wider than this is ground or far away
_LOOK = (32, 24)  # the small picture by which a view is judged
_LEAST_SHARE, _MOST_SHARE = 0.03, 0.92


def views(stage: Stage, count: int, rng: Rng) -> Iterator[View]:
    """Yield up to `count` views of a stage, half as many without concrete; fewer where no camera finds a place."""
    bare = not np.isin(stage.kind, CONCRETE).any()
    for _ in range(count // 2 if bare else count):
        how = str(rng.choice(["on foot", "far", "odd"], p=[0.6, 0.25, 0.15]))
        empty = rng.random() < 0.08
        for _ in range(_ROUNDS):
            found = _view(stage, how, empty and not bare, rng)
            if found is not None:
                yield found
                break


def _view(stage: Stage, how: str, empty: bool, rng: Rng) -> View | None:
    """Draw places about points on concrete and take the first from which the view is worth a picture."""
    aim = _points_on_concrete(stage, _CANDIDATES, rng)
    nearest, furthest = {"on foot": (3.0, 14.0), "far": (10.0, 60.0), "odd": (0.8, 9.0)}[how]
    away = np.exp(rng.uniform(np.log(nearest), np.log(furthest), _CANDIDATES))
    angle = rng.uniform(0, 2 * np.pi, _CANDIDATES)
    eye = aim + np.c_[away * np.cos(angle), away * np.sin(angle), np.zeros(_CANDIDATES)]
    if how == "far":
        eye[:, 2] = rng.uniform(4, 30, _CANDIDATES)
        ok = np.ones(_CANDIDATES, bool)
    else:
        eye, ok = _on_floor(stage, eye, (1.3, 1.9) if how == "on foot" else (0.5, 2.6), rng)
    ok &= _has_room(stage, eye, 0.45)
    if rng.random() < 0.6:
        ok &= stage.tracer.is_free(eye, aim, 0.1)
    for k in np.flatnonzero(ok)[:3]:
        field = float(rng.uniform(*{"on foot": (45, 75), "far": (30, 80), "odd": (40, 85)}[how]))
        view = View(
            world_from_camera=_pose(eye[k], aim[k], how, empty, np.deg2rad(field), rng),
            fx_px=WIDTH_PX / 2 / float(np.tan(np.deg2rad(field) / 2)),
        )
        if _is_worth(stage, view, empty, rng):
            return view
    return None


def _points_on_concrete(stage: Stage, count: int, rng: Rng) -> FloatArray:
    """Draw points (N, 3) in world on walls or columns (each half of the time), else on anything near."""
    kind = stage.kind[stage.tracer.body]
    wanted = [k for k in (WALL, COLUMN) if (kind == k).any()]
    chosen = wanted[int(rng.integers(len(wanted)))] if wanted else None
    near = [t for t in stage.place.things if np.ptp(t.part.vertices_m) < _NEAR_M]
    bodies = [t.part for t in near if chosen is None or t.kind == chosen]
    corners = np.concatenate([p.vertices_m[p.triangles] for p in bodies])
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    pick = rng.choice(len(corners), count, p=area / area.sum())
    weight = rng.dirichlet(np.ones(3), count)
    return np.asarray((corners[pick] * weight[:, :, None]).sum(1))


def _on_floor(stage: Stage, eye: FloatArray, over_m: tuple[float, float], rng: Rng) -> tuple[FloatArray, np.ndarray]:
    """Drop places (N, 3) to the level floor below and lift them to a height of eye over it; tell where there is one."""
    down = np.broadcast_to(np.array([0, 0, -1.0], np.float32), eye.shape)
    triangle, t = stage.tracer.first_hit(eye, down)
    ok = (triangle >= 0) & (t < 12)
    ok &= np.abs(stage.tracer.normal[triangle][:, 2]) > 0.9
    out = eye.copy()
    out[:, 2] += -np.where(ok, t, 0) + rng.uniform(*over_m, len(eye))
    return out, ok


def _has_room(stage: Stage, eye: FloatArray, reach_m: float) -> np.ndarray:
    """Tell where (N,) nothing is within reach of a camera, sideways, above and below."""
    ways = np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0.7, 0.7, 0], [-0.7, 0.7, 0], [0, 0, 1], [0, 0, -1]]
    )
    starts = np.repeat(eye, len(ways), axis=0)
    dark = stage.tracer.is_dark(starts, np.tile(ways, (len(eye), 1)).astype(np.float32), reach_m)
    return np.asarray(~dark.reshape(len(eye), len(ways)).any(1))


def _pose(eye: FloatArray, aim: FloatArray, how: str, empty: bool, field_rad: float, rng: Rng) -> FloatArray:
    way = aim - eye
    yaw = (
        np.arctan2(way[1], way[0])
        + rng.uniform(-0.38, 0.38) * field_rad
        + (np.pi * rng.uniform(0.5, 1.5) if empty else 0)
    )
    rise = np.arctan2(way[2], np.hypot(way[0], way[1]))
    if how == "on foot":
        pitch, roll = np.clip(0.4 * rise + np.deg2rad(rng.uniform(-8, 12)), -0.2, 0.35), rng.uniform(-3, 3)
    elif how == "far":
        pitch, roll = rise + np.deg2rad(rng.uniform(-10, 10)), rng.uniform(-3, 3)
    else:
        pitch, roll = rise * rng.uniform(0.2, 1) + np.deg2rad(rng.uniform(-15, 25)), rng.uniform(-12, 12)
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.c_[right, np.cross(forward, right), forward] @ rotation(np.array([0, 0, np.deg2rad(roll)]))
    pose[:3, 3] = eye
    return pose


def _is_worth(stage: Stage, view: View, empty: bool, rng: Rng) -> bool:
    """Judge a view by a small picture: enough concrete and not only that, nothing before the lens."""
    triangle, t = stage.tracer.first_hit(view.world_from_camera[:3, 3], rays(view, *_LOOK))
    kind = np.where(triangle >= 0, stage.kind[stage.tracer.body[triangle]], 0)
    if (t < 0.5).mean() > 0.02:
        return False
    share = np.isin(kind, CONCRETE).mean()
    if empty or not stage.instance.any():
        return bool(share < 0.02 and (triangle >= 0).mean() > 0.3)
    if share > 0.7 and rng.random() < 0.6:
        return False
    return bool(_LEAST_SHARE < share < _MOST_SHARE)
