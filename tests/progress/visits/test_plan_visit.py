"""A planned visit: what it promises is open to view, and a person can stand where it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimModel, Obstacle
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.geometry.arrays import FloatArray, freeze, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.read.floors import read_floors
from asbuilt_bim.progress.surface import SurfaceState, unseen
from asbuilt_bim.progress.visits.expected import expected_stations
from asbuilt_bim.progress.visits.places import BODY_M, EDGE_M, EYE_M, standing_places
from asbuilt_bim.progress.visits.plan_visit import (
    LEAST_GAIN_M2,
    PlannedVisit,
    _needed,
    _View,
    of_squares,
    plan_visit,
    seen_from,
)
from asbuilt_bim.progress.visits.sights import FAR_M, NEAR_M, TAKEN, rig_frames, sighted_patches, upright_pose
from asbuilt_bim.progress.visits.squares import Squares, wanted_squares
from asbuilt_bim.progress.visits.surroundings import Surroundings, surroundings
from asbuilt_bim.progress.visits.tags import TagInPlace, helpful_tags
from tests.ifc.models import ModelBuilder

HALL_M = 16.0, 12.0
"""A slab of this size, its top at 0, with a wall across it at x = 8 from y = 0 to 8, and an opening."""
OPENING_M = (10.0, 2.0, 13.0, 5.0)


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> tuple[BimModel, tuple[Obstacle, ...]]:
    model = ModelBuilder(storeys=1)
    model.box("IfcWall", "Across", (7.9, 0.0, 0.0), (0.2, 8.0, 3.0))
    model.box("IfcColumn", "Free", (3.8, 9.8, 0.0), (0.4, 0.4, 3.0))
    slab = model.box("IfcSlab", "Slab", (0.0, 0.0, -0.2), (*HALL_M, 0.2))
    x0, y0, x1, y1 = OPENING_M
    model.opening(slab, (x0, y0, -0.2), (x1 - x0, y1 - y0, 0.6))
    path = model.write(tmp_path_factory.mktemp("ifc") / "hall.ifc")
    return read_design(path), read_floors([path])


@pytest.fixture(scope="module")
def rig() -> StereoRig:
    return stereo_rig()


def stereo_rig() -> StereoRig:
    camera = Intrinsics(
        K=frozen([[1050.0, 0.0, 639.5], [0.0, 1050.0, 479.5], [0.0, 0.0, 1.0]]),
        distortion=frozen(np.zeros(5)),
        width_px=1280,
        height_px=960,
    )
    return rig_of_unknown_sigma(camera, camera, rigid(np.eye(3), np.array([-0.25, 0.0, 0.0])))


@pytest.fixture(scope="module")
def plan(hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig) -> PlannedVisit:
    design, floors = hall
    return plan_visit(design, floors, rig, {one.global_id for one in design.elements}, {})


def eyes(hall: tuple[BimModel, tuple[Obstacle, ...]], floors: tuple[Obstacle, ...] | None = None) -> FloatArray:
    design, slabs = hall
    standing = {one.global_id for one in design.elements}
    found = standing_places(design, design.storeys[0].global_id, standing, slabs if floors is None else floors)
    assert found is not None
    return found.eyes_m


def test_places_lie_on_the_slab_off_its_edge_its_opening_and_the_wall(
    hall: tuple[BimModel, tuple[Obstacle, ...]],
) -> None:
    x, y, z = eyes(hall).T
    assert len(x) > 100 and np.allclose(z, EYE_M)
    assert x.min() >= EDGE_M and y.min() >= EDGE_M and x.max() <= 16.0 - EDGE_M and y.max() <= 12.0 - EDGE_M
    x0, y0, x1, y1 = OPENING_M
    assert not np.any((x > x0 - 0.5) & (x < x1 + 0.5) & (y > y0 - 0.5) & (y < y1 + 0.5))
    assert not np.any((np.abs(x - 8.0) < 0.1 + BODY_M - 0.1) & (y < 8.0))
    assert np.any((x > x1 + 0.5) & (y > y0) & (y < y1)), "past the opening there is floor again"


def test_without_a_slab_the_floor_reaches_as_far_as_walls_and_columns_and_the_plan_says_so(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig
) -> None:
    design, _ = hall
    x, y, _ = eyes(hall, ()).T
    assert x.max() < 8.0 and y.max() < 10.5
    bare = plan_visit(design, (), rig, {one.global_id for one in design.elements}, {})
    assert bare.by_hull == (design.storeys[0].global_id,)


def test_a_wall_hides_what_is_behind_it_and_not_what_is_before_it(
    hall: tuple[BimModel, tuple[Obstacle, ...]],
) -> None:
    design, floors = hall
    wall = next(one for one in design.elements if one.name == "Across")
    eye, points = np.array([4.0, 4.0, 1.5]), np.array([[12.0, 4.0, 1.5], [7.0, 4.0, 1.5], [12.0, 4.0, 12.0]])
    assert surroundings(design, {wall.global_id}, floors).free(eye, points).tolist() == [False, True, True]
    assert surroundings(design, set(), floors).free(eye, points).tolist() == [True, True, True]


def test_what_stations_promise_is_near_enough_in_both_photos_and_not_behind_the_wall(
    plan: PlannedVisit, rig: StereoRig
) -> None:
    assert plan.stations
    for station in plan.stations:
        eye = station.world_from_left[:3, 3]
        points = plan.wanted.points_m[station.patches]
        away = np.linalg.norm(points - eye, axis=1)
        assert away.min() >= NEAR_M and away.max() <= FAR_M
        for camera, pose in ((rig.left, np.eye(4)), (rig.right, rig.right_from_left)):
            pixels = camera.project(apply(pose, apply(inverse(station.world_from_left), points)))
            assert np.all((pixels >= 0.0) & (pixels <= [1279.0, 959.0]))
        west = eye[0] < 8.0
        of_wall = np.abs(points[:, 0] - 8.0) < 0.3
        assert np.all((points[of_wall][:, 0] < 8.0) == west), "each side from its own side"


def test_what_a_column_hides_from_the_right_eye_alone_is_not_promised(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig
) -> None:
    design, floors = hall
    wall = next(one for one in design.elements if one.name == "Across")
    pose, frames = upright_pose(np.array([3.0, 4.0, 1.5]), 0.0), rig_frames(rig)
    open_view = plan_visit(design, floors, rig, {wall.global_id}, {})
    post = Obstacle(
        global_id="post", ifc_class="IfcMember",
        vertices_m=frozen([[3.3, 3.76, 0.0], [3.3, 3.70, 0.0], [3.3, 3.76, 3.0], [3.3, 3.70, 3.0]]),
        triangles=freeze(np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)),
    )  # fmt: skip
    hidden = surroundings(design, {wall.global_id}, (*floors, post))
    before = seen_from(frames, open_view.around, pose, open_view.wanted)
    after = seen_from(frames, hidden, pose, open_view.wanted)
    left = sighted_patches(hidden, pose[:3, 3], open_view.wanted.part(before), TAKEN)
    assert left.sum() > after.sum() < before.sum(), "the left eye still sees more"


def test_one_side_of_a_wall_is_enough_and_no_station_is_idle(plan: PlannedVisit) -> None:
    assert plan.seen_m2 > 0.9 * float(plan.wanted.area_m2[plan.visible].sum())
    times = np.sum([of_squares(plan.wanted, one.patches) for one in plan.stations], axis=0)
    for station in plan.stations:
        alone = of_squares(plan.wanted, station.patches) & (times == 1)
        assert plan.wanted.area_m2[alone].sum() >= LEAST_GAIN_M2
    assert len(plan.stations) <= 6
    assert plan.wanted.total_m2 == pytest.approx(8.0 * 3.0 + 3.0 * 0.4 + 2 * 0.0, abs=1.5)


def test_so_many_stations_at_most_and_the_plan_knows_that_more_would_help(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig, plan: PlannedVisit
) -> None:
    design, floors = hall
    one = plan_visit(design, floors, rig, {e.global_id for e in design.elements}, {}, most=1)
    assert len(one.stations) == 1 and one.limited and one.seen_m2 < plan.seen_m2
    assert not plan.limited


def test_of_so_many_stations_at_most_those_are_chosen_that_count(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig
) -> None:
    design, floors = hall
    wanted = {e.global_id for e in design.elements}

    def east(around: Surroundings, pose: FloatArray) -> bool:
        return bool(pose[0, 3] > 8.0)

    for most in (1, 2):
        found = plan_visit(design, floors, rig, wanted, {}, most=most, counts=east)
        assert len(found.stations) == most and all(one.world_from_left[0, 3] > 8.0 for one in found.stations)
    none = plan_visit(design, floors, rig, wanted, {}, most=1, counts=lambda around, pose: False)
    assert len(none.stations) == 1, "where none counts, the best is told with what it needs"


def test_of_so_many_stations_at_most_the_first_shows_what_is_late(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig
) -> None:
    design, floors = hall
    wanted = {e.global_id for e in design.elements}
    column = next(one for one in design.elements if one.name == "Free")
    found = plan_visit(design, floors, rig, wanted, {}, most=1, first={column.global_id})
    (station,) = found.stations
    shown = {found.wanted.elements[i].name for i in found.wanted.element[of_squares(found.wanted, station.patches)]}
    assert "Free" in shown


def test_what_a_station_of_today_shows_is_not_wanted_again(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig, plan: PlannedVisit
) -> None:
    design, floors = hall
    taken = [one.world_from_left for one in plan.stations]
    left = plan_visit(design, floors, rig, {e.global_id for e in design.elements}, {}, taken=taken)
    assert left.asked_m2 == pytest.approx(plan.wanted.total_m2)
    assert left.wanted.total_m2 <= plan.wanted.total_m2 - plan.seen_m2 + 1e-9
    assert sum(left.unseen_m2(hidden=False).values()) + left.seen_m2 + sum(
        left.unseen_m2(hidden=True).values()
    ) == pytest.approx(left.wanted.total_m2)


def test_what_was_seen_built_on_one_side_is_not_due_and_what_was_seen_open_is(
    hall: tuple[BimModel, tuple[Obstacle, ...]],
) -> None:
    design, _ = hall
    wall = next(one for one in design.elements if one.name == "Across")
    face = max(wall.faces, key=lambda one: one.exposed_area_m2)
    state: SurfaceState = unseen(face)
    built = replace(state, built_uv_m=face.exposed_uv_m, unknown_uv_m=(), built_area_m2=face.exposed_area_m2)
    opened = replace(state, open_uv_m=face.exposed_uv_m, unknown_uv_m=(), open_area_m2=face.exposed_area_m2)
    ids = {wall.global_id}
    assert wanted_squares(design, ids, {face.face_id: built}).total_m2 < 0.1
    assert wanted_squares(design, ids, {face.face_id: opened}).total_m2 == pytest.approx(24.0, abs=1.0)


def test_a_frame_shows_what_lies_ahead_and_nothing_behind(rig: StereoRig) -> None:
    frames = rig_frames(rig)
    pose = upright_pose(np.array([0.0, 0.0, 1.5]), 0.0)
    points = np.array([[5.0, 0.0, 1.5], [-5.0, 0.0, 1.5], [5.0, 4.0, 1.5], [5.0, -2.0, 1.5], [5.0, 0.0, 4.5]])
    assert frames.show(pose, points).tolist() == [True, False, False, True, False]
    turned = frames.show_upright(np.array([0.0, 0.0, 1.5]), np.array([0.0, np.pi]), points)
    assert turned[0].tolist() == [True, False, False, True, False] and turned[1].tolist()[:2] == [False, True]


def test_tags_are_wanted_only_where_stations_see_too_few_and_then_where_most_see_them(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig, plan: PlannedVisit
) -> None:
    design, _ = hall
    found = helpful_tags(plan, rig, (), 0.25, design.elements)
    assert 1 <= len(found) <= 2
    assert found[0].needy and set(found[0].needy) <= set(found[0].stations)
    plenty = [
        TagInPlace(number=i, middle_m=np.array([x, y, 1.5]), normal=np.array(n), size_m=0.25)
        for i, (x, y, n) in enumerate(
            (x, y, n)
            for x in (7.89, 8.11)
            for y in np.linspace(0.3, 7.7, 30)
            for n in [(-1.0 if x < 8.0 else 1.0, 0.0, 0.0)]
        )
    ]
    lacking = [one for one in expected_stations(plan, rig, plenty, design.elements, 2048) if len(one.tags) < 2]
    helped = helpful_tags(plan, rig, plenty, 0.25, design.elements)
    assert {n for tag in helped for n in tag.needy} <= {one.planned.number for one in lacking}


def test_a_nearer_face_is_expected_to_be_known_better(plan: PlannedVisit, rig: StereoRig) -> None:
    stations = expected_stations(plan, rig, (), plan.wanted.elements, 2048)
    assert all(0.0005 < one.sigma < 0.2 for one in stations)
    assert all(one.distance_m + 0.5 >= NEAR_M and one.distance_m <= FAR_M for one in stations)
    assert all(one.shown and len(one.nearest) <= 2 for one in stations)


def test_a_station_shows_by_the_design_what_its_plan_says(
    hall: tuple[BimModel, tuple[Obstacle, ...]], rig: StereoRig, plan: PlannedVisit
) -> None:
    for one in plan.stations:
        seen = seen_from(rig_frames(rig, margin=0.0), plan.around, one.world_from_left, plan.wanted)
        assert np.all(seen[one.patches])


def test_a_view_whose_squares_the_others_show_is_dropped() -> None:
    squares = Squares(
        elements=(), points_m=frozen(np.zeros((4, 3))), corners_m=frozen(np.zeros((4, 4, 3))),
        normals=frozen(np.zeros((4, 3))), face=freeze(np.zeros(4, np.int32)),
        square=freeze(np.arange(4, dtype=np.int32)),
        area_m2=frozen(np.full(4, 2.0)), element=freeze(np.zeros(4, np.int32)),
    )  # fmt: skip

    def view(*shown: int) -> _View:
        numbers = np.array(shown, dtype=np.int32)
        return _View(storey="", pose=np.eye(4), patches=numbers, squares=numbers)

    middle, left, right = view(1, 2), view(0, 1), view(2, 3)
    assert _needed([middle, left, right], squares) == [left, right]
    assert _needed([left, right], squares) == [left, right]
