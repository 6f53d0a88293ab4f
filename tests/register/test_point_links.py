"""Stations linked by points: right where depth agrees, none on what repeats, a sigma that number doesn't shrink."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid, rotation_from_vector, vector_from_rotation
from asbuilt_bim.register.between import between, between_rows
from asbuilt_bim.register.block_adjustment import CommonNoise, Sightings, State, adjust
from asbuilt_bim.register.known import known_pose
from asbuilt_bim.register.point_links import PointLink, Shown, link_by_points
from asbuilt_bim.register.redundancy import hanging
from asbuilt_bim.vision.landmarks.find import MOST, Landmarks, find_landmarks

CAMERA = RectifiedCamera(
    f_px=1000.0, cx_px=640.0, cy_px=480.0, baseline_m=0.3, width_px=1280, height_px=960,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip
NOISE = 0.3
FIRST_FROM_SECOND = rigid(rotation_from_vector(np.array([0.02, 0.12, -0.01])), np.array([0.9, 0.05, 0.3]))


def cloud(rng: np.random.Generator, count: int = 400) -> FloatArray:
    """Points of a wall, a column before it, and a floor, in the first camera's frame."""
    wall = np.column_stack([rng.uniform(-4, 4, count), rng.uniform(-2, 1.4, count), rng.normal(6.0, 0.02, count)])
    floor = np.column_stack([rng.uniform(-3, 3, count // 2), np.full(count // 2, 1.5), rng.uniform(3, 6, count // 2)])
    return np.concatenate([wall, floor])


def shown(
    name: str, points: FloatArray, looks: FloatArray, pose: FloatArray, rng: np.random.Generator, shift_px: float = 0.0
) -> Shown:
    """What a camera at `pose` shows of points, with noise; `shift_px` is put on all disparities."""
    here = apply(inverse(pose), points)
    pixels = CAMERA.project(here) + rng.normal(0.0, NOISE, (len(points), 2))
    sigma = 0.25
    disparity = CAMERA.f_px * CAMERA.baseline_m / here[:, 2] + rng.normal(0.0, sigma, len(points)) + shift_px
    inside = (here[:, 2] > 1.0) & np.all((pixels > 0) & (pixels < [1280, 960]), axis=1)
    found = Landmarks(
        left_px=frozen(pixels[inside]), disparity_px=frozen(disparity[inside]),
        disparity_sigma_px=frozen(np.full(int(inside.sum()), sigma)),
        looks=(looks[inside] + rng.normal(0.0, 4.0, (int(inside.sum()), 128))).astype(np.float32), sigma_px=NOISE,
    )  # fmt: skip
    return Shown(name=name, camera=CAMERA, landmarks=found)


def two(seed: int, shift_px: float = 0.0) -> tuple[Shown, Shown]:
    rng = np.random.default_rng(seed)
    points = cloud(rng)
    looks = rng.uniform(0.0, 120.0, (len(points), 128))
    one = shown("A", points, looks, np.eye(4), rng, shift_px)
    return one, shown("B", points, looks, FIRST_FROM_SECOND, rng, shift_px)


def off(found: FloatArray, true: FloatArray) -> FloatArray:
    return np.append(vector_from_rotation(found[:3, :3] @ true[:3, :3].T), found[:3, 3] - true[:3, 3])


def test_two_stations_that_show_the_same_points_are_linked_where_they_stand() -> None:
    pulls = []
    for seed in range(8):
        link = link_by_points(*two(seed))
        assert link is not None and link.points > 100
        error = off(link.first_from_second, FIRST_FROM_SECOND)
        assert np.linalg.norm(error[3:]) < 0.01
        pulls.append(error / np.sqrt(np.diag(link.covariance)))
    assert np.abs(pulls).max() < 3.5


def test_stations_that_show_other_things_are_not_linked() -> None:
    one, _ = two(1)
    _, other = two(2)
    assert link_by_points(one, other) is None


def test_what_repeats_along_a_wall_links_nothing() -> None:
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(-6.0, 6.0, 0.3), np.arange(-1.5, 1.5, 0.3))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 6.0)])
    looks = np.repeat(rng.uniform(0.0, 120.0, (1, 128)), x.size, axis=0)
    one = shown("A", points, looks, np.eye(4), rng)
    assert link_by_points(one, shown("B", points, looks, rigid(np.eye(3), [0.75, 0.0, 0.0]), rng)) is None


def test_looks_that_agree_where_depth_does_not_link_nothing() -> None:
    one, other = two(4)
    rng = np.random.default_rng(5)
    wrong = rng.permutation(len(other.landmarks.looks))
    assert (
        link_by_points(one, replace(other, landmarks=replace(other.landmarks, looks=other.landmarks.looks[wrong])))
        is None
    )


def test_many_points_of_one_part_of_the_frame_do_not_make_a_sigma_vanish() -> None:
    few, many = [], []
    for count, found in ((150, few), (600, many)):
        rng = np.random.default_rng(6)
        points = cloud(rng, count)
        looks = rng.uniform(0.0, 120.0, (len(points), 128))
        pair = shown("A", points, looks, np.eye(4), rng), shown("B", points, looks, FIRST_FROM_SECOND, rng)
        link = link_by_points(*pair)
        assert link is not None
        found.append(np.sqrt(np.diag(link.covariance))[3:])
    assert np.all(many[0] > 0.55 * few[0])  # were all points' errors their own, four times as many gave 0.5
    assert many[0].min() > 0.0005


def test_what_the_rigs_disparity_is_off_by_moves_a_link_as_it_says() -> None:
    plain, shifted = link_by_points(*two(7)), link_by_points(*two(7, shift_px=0.5))
    assert plain is not None and shifted is not None
    moved = off(shifted.first_from_second, plain.first_from_second)
    assert moved[3:] == pytest.approx(0.5 * plain.by_disparity[3:], abs=0.002)
    assert np.linalg.norm(moved[3:]) > 0.003


def test_slopes_of_a_link_are_those_of_its_residuals() -> None:
    link = link_by_points(*two(8))
    assert link is not None
    rng = np.random.default_rng(9)
    stations = np.array([rigid(rotation_from_vector(rng.normal(0, 0.5, 3)), rng.normal(0, 3, 3)) for _ in range(2)])
    stations[1] = stations[0] @ link.first_from_second
    rows = between_rows([between(link, 0, 1)], stations, 0.1)
    for k, slopes in ((0, rows.by_first[0]), (1, rows.by_second[0])):
        for number in range(6):
            step = np.zeros(6)
            step[number] = 1e-4
            there = stations.copy()
            there[k, :3, :3] = rotation_from_vector(step[:3]) @ there[k, :3, :3]
            there[k, :3, 3] += step[3:]
            change = (between_rows([between(link, 0, 1)], there, 0.1).residual[0] - rows.residual[0]) / 1e-4
            assert change == pytest.approx(slopes[:, number], rel=1e-2, abs=5.0)


def chain(wrong: bool) -> tuple[State, Sightings, list[PointLink]]:
    """Three stations of which the first is known; the link of the other two may be wrong by half a metre."""
    covariance = frozen(np.diag([1e-3] * 3 + [2e-3] * 3) ** 2)
    true = [np.eye(4), rigid(np.eye(3), [1.0, 0.0, 0.0]), rigid(np.eye(3), [2.0, 0.5, 0.0])]
    links = []
    for a, b in ((0, 1), (0, 2), (1, 2)):
        between_two = inverse(true[a]) @ true[b]
        if wrong and (a, b) == (1, 2):
            between_two[0, 3] += 0.5
        link = PointLink(
            first=str(a), second=str(b), first_from_second=frozen(between_two), covariance=covariance,
            by_disparity=frozen(np.zeros(6)), points=50,
        )  # fmt: skip
        links.append(link)
    seen = Sightings(
        station=np.zeros(0, dtype=np.intp), tag=np.zeros(0, dtype=np.intp), pixels=np.zeros((0, 4, 4)),
        both=np.zeros(0, dtype=bool), corner_px=np.zeros(0),
        noise=CommonNoise(direction_px=0.15, between_px=0.06, edge_px=0.1), cameras=[CAMERA] * 3,
    )  # fmt: skip
    state = State(stations=np.array(true), tags=np.zeros((0, 4, 4)), sizes_m=np.zeros(0))
    return state, seen, links


def test_links_place_stations_without_a_tag_and_their_sigma_grows_along_the_walk() -> None:
    state, seen, links = chain(wrong=False)
    known = [known_pose("station 0", 0, state.stations[0], np.diag([1e-4] * 3 + [1e-3] * 3) ** 2)]
    made = adjust(
        state, seen, known, 0.1, between=[between(one, int(one.first), int(one.second)) for one in links[::2]]
    )
    assert made is not None
    sigma = [float(np.sqrt(np.trace(one[3:, 3:]) / 3.0)) for one in made.station_covariance]
    assert sigma[0] < sigma[1] < sigma[2]
    assert sigma[1] == pytest.approx(np.hypot(0.001, 0.002), rel=0.1)


def test_a_link_that_contradicts_the_others_is_far_off() -> None:
    state, seen, links = chain(wrong=True)
    known = [known_pose("station 0", 0, state.stations[0], np.diag([1e-4] * 3 + [1e-3] * 3) ** 2)]
    rows = [between(one, int(one.first), int(one.second)) for one in links]
    made = adjust(state, seen, known, 0.1, between=rows, reach=8.0)
    assert made is not None
    assert made.between_off[2] > 20.0 and made.between_off[:2].max() < 20.0


def test_a_station_that_points_link_does_not_hang_on_one_print() -> None:
    sees = {"A": (1, 2), "B": (2,), "C": ()}
    assert hanging(sees, (1,), ("A",)) == {"B": 2}
    assert hanging(sees, (1,), ("A",), {"A": ("B",), "B": ("A", "C"), "C": ("B",)}) == {}


def test_landmarks_are_spread_and_have_the_disparity_of_their_place() -> None:
    rng = np.random.default_rng(10)
    grey = np.kron(rng.integers(0, 255, (80, 80)), np.ones((8, 8))).astype(np.uint8)
    disparity = np.tile(np.linspace(5.0, 50.0, 320, dtype=np.float32), (320, 1))
    disparity[:, 300:] = np.nan
    found = find_landmarks(grey, 1.0, disparity, np.full_like(disparity, 0.2), 2)
    assert 100 < len(found.left_px) <= MOST
    assert found.left_px[:, 0].max() < 600.0
    column = np.floor((found.left_px[:, 0] + 0.5) / 2).astype(int)
    assert found.disparity_px == pytest.approx(disparity[0, column])
