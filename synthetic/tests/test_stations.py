import numpy as np

from asbuilt_synthetic.in_view import disc_is_seen
from asbuilt_synthetic.lens import camera_of, in_frame, project, world_from_camera
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.tracer import Tracer
from asbuilt_synthetic.truth import station_truth


def test_every_station_sees_at_least_two_tags_and_the_target_in_both_photos(site_scene):
    for station in site_scene.stations:
        tracer = Tracer(site_scene.origin_m, (*site_scene.bodies, *station.bodies))
        assert disc_is_seen(tracer, site_scene.rig, station)
        assert len(station_truth(site_scene, station).marker_ids) >= 2


def test_the_target_is_three_to_seven_metres_away_and_turned_at_most_35_degrees(site_scene):
    for station in site_scene.stations:
        way = station.world_from_left[:3, 3] - station.disc.centre_m
        distance = np.linalg.norm(way)
        assert 3 < distance < 7
        assert np.rad2deg(np.arccos(way @ station.disc.normal / distance)) < 35


def test_the_camera_is_held_upright_at_eye_height(site_scene):
    for station in site_scene.stations:
        r = station.world_from_left[:3, :3]
        assert np.allclose(r @ r.T, np.eye(3), atol=1e-12) and np.linalg.det(r) > 0
        assert abs(np.rad2deg(np.arcsin(r[2, 2]))) < 8.01  # pitch
        assert r[2, 1] < -0.98  # y points down
        height = station.world_from_left[2, 3] - site_scene.origin_m[2]
        assert 1.2 < height % 3.1 < 1.9


def test_both_cameras_see_the_disc_centre_where_the_truth_says(site_scene):
    for station in site_scene.stations:
        disc = station_truth(site_scene, station).disc
        for side, px in (("left", disc.left_px), ("right", disc.right_px)):
            pose = world_from_camera(site_scene.rig, station, side)
            camera = camera_of(site_scene.rig, side)
            again = project(camera, transform(np.linalg.inv(pose), station.disc.centre_m[None]))
            assert np.allclose(again[0], px) and in_frame(camera, again, 15.0).all()
        assert disc.depth_m <= disc.range_m
