"""What the whole runs on real pairs draw into photos lies where the survey says, and wrong answers are counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.vision.markers.find import find_markers
from benchmarks.real.whole_draw import draw
from benchmarks.real.whole_places import Element, Place, Print
from benchmarks.real.whole_project import write_project
from benchmarks.real.whole_runs import Visit
from benchmarks.real.whole_scenes import Scene
from benchmarks.real.whole_truth import World, build_world

K = np.array([[600.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]])
PLACE = Place(
    role="develop",
    elements=(
        Element(name="wall", box_px=(60, 60, 580, 420), plane_px=(60, 60, 580, 420), real_top_px=150.0),
        Element(name="free", box_px=(250, 100, 380, 400), depth_m=2.0),
    ),
    tags=(Print(at_px=(180, 300), on="wall"), Print(at_px=(450, 200), depth_m=2.5)),
    tag_m=0.3,
)


@pytest.fixture
def world() -> World:
    """A grey wall 4 m ahead, known by a grid of points."""
    x, y = (one.ravel() for one in np.meshgrid(np.arange(0.0, 640.0, 8.0), np.arange(0.0, 480.0, 8.0)))
    rays = np.column_stack([x, y, np.ones(len(x))]) @ np.linalg.inv(K).T
    photo = np.full((480, 640, 3), 150, dtype=np.uint8)
    pose = np.eye(4)
    pose[0, 3] = -0.2
    scene = Scene(
        name="made", left=photo, right=photo, left_k=K, right_k=K, distortion=np.zeros(4), right_from_left=pose,
        points_m=4.0 * rays,
    )  # fmt: skip
    return build_world(scene, PLACE)


def test_a_drawn_tag_is_found_where_the_survey_has_it(world: World, tmp_path: Path) -> None:
    drawn = draw(world, PLACE)
    write_project(tmp_path, world, PLACE, drawn)
    pair = rectify(rectification(read_rig(tmp_path / "rig.yaml")), drawn.left, drawn.right, "made")
    found = {one.marker_id: one for one in find_markers(pair, "apriltag_36h11")}
    assert found.keys() == {0, 1}
    for number, corners in drawn.tags:
        right = found[number].right_px
        assert right is not None
        assert found[number].left_px == pytest.approx(world.scene.pixels(world.left_from(corners)), abs=0.15)
        assert right == pytest.approx(world.scene.pixels(world.left_from(corners), right=True), abs=0.15)


def test_the_truth_of_a_wall_that_ends_below_its_design_is_its_part(world: World) -> None:
    assert world.bodies["wall"].completion == pytest.approx((420.0 - 150.0) / (420.0 - 60.0), abs=0.01)
    assert world.bodies["wall"].agree == 1.0
    assert world.bodies["free"].completion == 0.0
    assert world.bodies["free"].agree == 1.0


def test_a_print_behind_the_wall_is_refused(world: World) -> None:
    behind = Place(role="develop", elements=PLACE.elements, tags=(Print(at_px=(320, 200), depth_m=5.0),), tag_m=0.3)
    with pytest.raises(SystemExit, match="is hidden in the left photo"):
        draw(world, behind)


@pytest.mark.parametrize(
    ("state", "lower", "upper", "wrong"),
    [("part", 0.7, 0.8, False), ("unknown", 0.0, 1.0, False), ("complete", 0.7, 1.0, True), ("part", 0.2, 0.4, True)],
)
def test_a_wrong_state_counts_and_bounds_without_the_truth_do(
    world: World, state: str, lower: float, upper: float, wrong: bool
) -> None:
    found = {"state": state, "completion": {"lower": lower, "upper": upper, "coverage": 1.0}}
    visit = Visit(scene="made", paint="as it is", body=world.bodies["wall"], found=found)
    assert visit.wrong is wrong
