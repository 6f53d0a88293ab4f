"""Tells what a camera at a station sees of surfaces, tags and the target: in frame, facing it, nothing before them."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from asbuilt_synthetic.lens import camera_of, in_frame, project, world_from_camera
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.model import Marker, RigTruth, Station
from asbuilt_synthetic.surface import Samples
from asbuilt_synthetic.tracer import Tracer, disc_mesh


def joined(parts: list[Samples]) -> Samples:
    """String samples of several elements together."""
    return Samples(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Samples)})


def points_in_view(
    tracers: tuple[Tracer, ...],
    rig: RigTruth,
    station: Station,
    side: str,
    s: Samples,
    most_incidence_deg: float = 80.0,
) -> np.ndarray:
    """Tell which exposed samples (N,) a camera sees: in frame, not too slant, nothing before them."""
    pose = world_from_camera(rig, station, side)
    camera = camera_of(rig, side)
    way = pose[:3, 3] - s.points_m
    cos = (way * s.normals).sum(1) / np.linalg.norm(way, axis=1)
    px = project(camera, transform(np.linalg.inv(pose), s.points_m))
    ok = s.exposed & (cos > np.cos(np.deg2rad(most_incidence_deg))) & in_frame(camera, px)
    index = np.flatnonzero(ok)
    end = s.points_m[index] + 0.003 * s.normals[index]
    for tracer in tracers:
        if len(index):
            free = tracer.is_free(np.broadcast_to(pose[:3, 3], end.shape), end)
            ok[index[~free]] = False
            index, end = index[free], end[free]
    return np.asarray(ok)


def marker_is_seen(tracers: tuple[Tracer, ...], rig: RigTruth, station: Station, marker: Marker) -> bool:
    """Tell whether a tag with its quiet zone is wholly in view of both cameras, 2.5 to 8 m away, facing them."""
    c = marker.true_corners_m
    middle = c.mean(0)
    normal = np.cross(c[3] - c[0], c[1] - c[0])
    normal /= np.linalg.norm(normal)
    grid = np.array([(a, b) for a in (-0.6, -0.3, 0, 0.3, 0.6) for b in (-0.6, -0.3, 0, 0.3, 0.6)])
    points = middle + grid[:, :1] * (c[1] - c[0]) + grid[:, 1:] * (c[3] - c[0]) + 0.004 * normal
    for side in ("left", "right"):
        pose, camera = world_from_camera(rig, station, side), camera_of(rig, side)
        way = pose[:3, 3] - middle
        distance = float(np.linalg.norm(way))
        if not 2.5 < distance < 8.0 or way @ normal / distance < np.cos(np.deg2rad(62)):
            return False
        px = project(camera, transform(np.linalg.inv(pose), points))
        if not in_frame(camera, px, 8.0).all():
            return False
        if not all(t.is_free(np.broadcast_to(pose[:3, 3], points.shape), points).all() for t in tracers):
            return False
    return True


def disc_is_seen(tracer: Tracer, rig: RigTruth, station: Station) -> bool:
    """Tell whether the target is wholly in view of both cameras, 3 to 7 m away, within 35 degrees of facing them."""
    disc = station.disc
    if disc is None:
        return False
    _, rim = disc_mesh(disc)
    ring = disc.centre_m + (rim[::8] - disc.centre_m) * 1.08
    points = np.concatenate([ring, disc.centre_m + (ring - disc.centre_m) * 0.5, disc.centre_m[None]])
    for side in ("left", "right"):
        pose, camera = world_from_camera(rig, station, side), camera_of(rig, side)
        way = pose[:3, 3] - disc.centre_m
        distance = float(np.linalg.norm(way))
        if not 3.0 < distance < 7.0 or way @ disc.normal / distance < np.cos(np.deg2rad(35)):
            return False
        px = project(camera, transform(np.linalg.inv(pose), points))
        if not in_frame(camera, px, 15.0).all():
            return False
        if not tracer.is_free(np.broadcast_to(pose[:3, 3], points.shape), points).all():
            return False
    return True
