import cv2
import numpy as np

from asbuilt_synthetic.lens import directions, in_frame, project
from asbuilt_synthetic.rig import rig_truth


def test_projection_agrees_with_opencv():
    camera = rig_truth(5).left
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(-2.5, 2.5, 200), rng.uniform(-1.8, 1.8, 200), rng.uniform(4, 9, 200)]
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.K, camera.distortion)
    assert np.abs(project(camera, points) - theirs[:, 0]).max() < 1e-9


def test_the_ray_of_a_pixel_projects_back_onto_it_everywhere_in_the_frame():
    for seed in range(5):
        rig = rig_truth(seed)
        for camera in (rig.left, rig.right):
            x, y = np.meshgrid(np.linspace(0, camera.width_px - 1, 30), np.linspace(0, camera.height_px - 1, 20))
            px = np.c_[x.ravel(), y.ravel()]
            assert np.abs(project(camera, directions(camera, px)) - px).max() < 1e-6


def test_points_behind_the_camera_are_out_of_frame():
    camera = rig_truth(0).left
    assert not in_frame(camera, project(camera, np.array([[0.0, 0.0, -5.0]]))).any()


def test_the_rig_is_not_perfect_but_near_its_nominal_baseline():
    for seed in range(10):
        m = rig_truth(seed).right_from_left
        turn = np.rad2deg(np.arccos((np.trace(m[:3, :3]) - 1) / 2))
        assert abs(np.linalg.norm(m[:3, 3]) - 0.25) < 0.002 and 0.3 < turn < 1.1
        assert m[0, 3] < 0  # the right camera stands to the right
