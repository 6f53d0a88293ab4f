from dataclasses import replace

import numpy as np
import pytest

from asbuilt_synthetic import raycast
from asbuilt_synthetic.lens import project
from asbuilt_synthetic.meshes import box
from asbuilt_synthetic.model import CameraTruth, Disc, Light, RigTruth, Scene, Station
from asbuilt_synthetic.progress import FIRST_DAY
from asbuilt_synthetic.tracer import disc_mesh

ORIGIN = np.array([3000.0, -2000.0, 300.0])


def _scene(disc: Disc | None, bodies=()) -> Scene:
    camera = CameraTruth(
        K=np.array([[260.0, 0, 158.3], [0, 261.0, 121.7], [0, 0, 1]]),
        distortion=np.array([-0.12, 0.03, 2e-4, -3e-4, 0.0]),
        width_px=320,
        height_px=240,
    )
    right = np.eye(4)
    right[0, 3] = -0.25
    light = Light(towards_sun=np.array([0, -0.6, 0.8]), sun_strength=0.0, sky_srgb=(200, 205, 210), exposure=1.0)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # looks along +y
    pose[:3, 3] = ORIGIN
    station = Station(name="T", world_from_left=pose, disc=disc)
    return Scene(
        seed=0,
        visit=0,
        day=FIRST_DAY,
        origin_m=ORIGIN,
        bodies=bodies,
        decals=(),
        faces=(),
        elements=(),
        markers=(),
        rig=RigTruth(left=camera, right=camera, right_from_left=right),
        stations=(station,),
        light=light,
    )


def _wall(y: float, material: str = "concrete"):
    return replace(
        box("w", (-9, y, -9), (9, y + 0.1, 9), material).placed(np.eye(4)),
        vertices_m=box("w", (-9, y, -9), (9, y + 0.1, 9), material).vertices_m + ORIGIN,
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_disc_covers_the_pixels_that_its_projection_covers(side, monkeypatch):
    """Coverage, read from radiance before any tone curve, matches the projected polygon to 0.05 px of its edge."""
    monkeypatch.setattr(raycast, "_develop", lambda radiance, seed: radiance)
    disc = Disc(
        centre_m=ORIGIN + np.array([0.31, 3.4, 0.27]),
        normal=np.array([0.2, -0.97, 0.1]) / np.linalg.norm([0.2, -0.97, 0.1]),
        radius_m=0.15,
    )
    plain = raycast.render(_scene(None, (_wall(8.0),)), _scene(None).stations[0], side)
    with_disc = _scene(disc, (_wall(8.0),))
    seen = raycast.render(with_disc, with_disc.stations[0], side)
    ratio = seen[..., 1] / plain[..., 1]
    pure = np.median(ratio[ratio < 0.2])
    covered = float(((1 - ratio) / (1 - pure)).sum())
    shift = np.array([0.25 if side == "right" else 0.0, 0, 0])
    _, rim = disc_mesh(disc)
    local = rim - ORIGIN - shift
    px = project(with_disc.rig.left, np.c_[local[:, 0], -local[:, 2], local[:, 1]])
    x, y = px.T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    outline = np.linalg.norm(px - np.roll(px, 1, 0), axis=1).sum()
    assert abs(covered - area) / outline < 0.05
    yy, xx = np.mgrid[0:240, 0:320]
    weight = (1 - ratio) / (1 - pure)
    weight[np.hypot(xx - x.mean(), yy - y.mean()) > 20] = 0
    centroid = [(xx * weight).sum() / weight.sum(), (yy * weight).sum() / weight.sum()]
    a = x * np.roll(y, -1) - np.roll(x, -1) * y
    true = [((x + np.roll(x, -1)) * a).sum() / (3 * a.sum()), ((y + np.roll(y, -1)) * a).sum() / (3 * a.sum())]
    assert np.abs(np.array(centroid) - true).max() < 0.05


def test_the_grain_lies_on_the_surface_the_same_in_both_photos(monkeypatch):
    monkeypatch.setattr(raycast, "_develop", lambda radiance, seed: radiance)
    s = _scene(None, (_wall(2.6),))
    left, right = (raycast.render(s, s.stations[0], side)[..., 1] for side in ("left", "right"))
    patch = left[90:150, 150:210]
    shift = 260 * 0.25 / 2.6
    best = max(
        (np.corrcoef(patch.ravel(), right[90:150, 150 - d : 210 - d].ravel())[0, 1], -abs(d - shift))
        for d in range(15, 36)
    )
    assert best[0] > 0.9 and best[1] > -1.01
    assert patch.std() / patch.mean() > 0.04


def test_a_photo_is_the_same_when_taken_again():
    s = _scene(None, (_wall(4.0),))
    first, second = (raycast.render(s, s.stations[0], "left") for _ in range(2))
    assert first.dtype == np.uint8 and first.shape == (240, 320, 3) and np.array_equal(first, second)
