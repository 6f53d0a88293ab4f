"""Poses and clicked points of a project: read, checked, and brought into the IFC's world."""

from __future__ import annotations

from contextlib import nullcontext
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.errors import ProjectError, SurveyError
from asbuilt_bim.geometry.transform import apply, rigid
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import KnownPlaces, check_places, known_places, looking
from tests.match.small_site import FAR, box, element, model

DAY = date(2026, 3, 2)
HEAD = "date,station,x_m,y_m,z_m,bearing_deg,pitch_deg,roll_deg,sigma_m,sigma_deg\n"


def project(folder: Path, extra: str) -> Project:
    path = folder / "project.yaml"
    path.write_text(
        "format: asbuilt-bim/project\nversion: 1\nname: Site\nifc: design.ifc\nrig: {file: rig.yaml}\n"
        "visits:\n  - date: 2026-03-02\n    stations: [{name: A1, left: a.jpg, right: b.jpg}]\n" + extra,
        encoding="utf-8",
    )
    return read_project(path)


def places(folder: Path, rows: str, where: str = "ifc", scale: float = 1.0) -> KnownPlaces:
    (folder / "poses.csv").write_text(HEAD + rows, encoding="utf-8")
    made = project(folder, f"poses: {{file: poses.csv, coordinates: {where}}}\n")
    map_from_world = rigid([0.0, 0.0, np.pi / 2.0], [500_000.0, 5_400_000.0, 400.0])
    return known_places(made, lambda: (map_from_world, scale))


def test_a_project_without_markers_poses_or_points_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProjectError, match=r"placed by markers\.survey, by poses, by control_points, or by the design"):
        project(tmp_path, "")


def test_a_survey_without_the_size_of_its_markers_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProjectError, match="a survey needs size_m"):
        project(tmp_path, "markers: {survey: markers.csv}\n")


@pytest.mark.parametrize(
    ("bearing", "ahead"), [(0.0, [0.0, 1.0, 0.0]), (90.0, [1.0, 0.0, 0.0]), (180.0, [0.0, -1.0, 0.0])]
)
def test_a_bearing_counts_clockwise_from_y(bearing: float, ahead: list[float]) -> None:
    turn = looking(np.radians(bearing), 0.0, 0.0)
    np.testing.assert_allclose(turn[:, 2], ahead, atol=1e-12)
    np.testing.assert_allclose(turn[:, 1], [0.0, 0.0, -1.0], atol=1e-12)  # down


def test_pitch_looks_up_and_roll_turns_clockwise() -> None:
    assert looking(0.0, 0.1, 0.0)[2, 2] == pytest.approx(np.sin(0.1))
    right = looking(0.0, 0.0, 0.1)[:, 0]
    assert right[2] == pytest.approx(-np.sin(0.1))  # the camera's right side goes down


@pytest.mark.parametrize(("key", "unit", "wanted"), [("bearing", "gon", "degrees"), ("x", "mm", "metres")])
def test_a_column_in_another_unit_than_it_is_read_in_is_refused(
    tmp_path: Path, key: str, unit: str, wanted: str
) -> None:
    heads, rows = "station,x [m],y [m],z (m),bearing [deg],sigma_m [m]\n", "A1,1,2,3,90,0.02\n"
    made = project(tmp_path, "poses: {file: poses.csv}\n")
    (tmp_path / "poses.csv").write_text(heads + rows, encoding="utf-8")
    assert len(known_places(made, lambda: pytest.fail("no map")).poses) == 1
    right = f"{key} [{'deg' if unit == 'gon' else 'm'}]"
    (tmp_path / "poses.csv").write_text(heads.replace(right, f"{key} [{unit}]", 1) + rows, encoding="utf-8")
    with pytest.raises(SurveyError, match=rf"'{key} \[{unit}\]' is read in {wanted}; bring it into {wanted}, as {key}"):
        known_places(made, lambda: pytest.fail("no map"))


@pytest.mark.parametrize(
    ("heading", "fits"),
    [("x (Easting)", True), ("x (local) [m]", True), ("x (m ü. NN)", True), ("x (in world)", True), ("x []", True),
     ("x (east) [mm]", False), ("x [in mm]", False), ("x (US ft)", False), ("x [in]", False), ("x [Feet]", False)],
)  # fmt: skip
def test_words_in_a_headings_brackets_are_no_unit_and_a_unit_behind_them_is(
    tmp_path: Path, heading: str, fits: bool
) -> None:
    made = project(tmp_path, "poses: {file: poses.csv}\n")
    text = f"station,{heading},y,z,bearing,sigma_m\nA1,1,2,3,90,0.02\n"
    (tmp_path / "poses.csv").write_text(text, encoding="utf-8")
    with nullcontext() if fits else pytest.raises(SurveyError, match="is read in metres; bring it into metres, as x_m"):
        assert len(known_places(made, lambda: pytest.fail("no map")).poses) == 1


def test_a_pose_is_read_with_its_sigmas(tmp_path: Path) -> None:
    known = places(tmp_path, "2026-03-02,A1,1,2,3.5,90,0,0,0.02,0.5\n")
    pose = known.given(DAY)["A1"]
    np.testing.assert_allclose(pose.world_from_left[:3, 3], [1.0, 2.0, 3.5])
    assert np.sqrt(pose.covariance[5, 5]) == pytest.approx(0.02)
    assert np.degrees(np.sqrt(pose.covariance[0, 0])) == pytest.approx(0.5)
    assert known.given(date(2026, 3, 9)) == {}


def test_pitch_and_roll_that_are_left_out_are_those_that_the_photos_show_to_be_plumb(tmp_path: Path) -> None:
    true = looking(np.radians(30.0), np.radians(-3.0), np.radians(2.0))
    known = places(tmp_path, "2026-03-02,A1,1,2,3.5,30,,-3,0.02,0.5\n")
    seen = SimpleNamespace(station="A1", vertical=true.T @ [0.0, 0.0, 1.0])
    pose = known.given(DAY, [seen])["A1"]  # type: ignore[list-item]
    np.testing.assert_allclose(pose.world_from_left[:3, :3], true, atol=1e-9)
    sigma_deg = np.degrees(np.sqrt(np.diag(pose.covariance)[:3]))
    assert sigma_deg[:2].max() < 0.1 and sigma_deg[2] == pytest.approx(0.5)
    blind = known.given(DAY, [SimpleNamespace(station="A1", vertical=None)])["A1"]  # type: ignore[list-item]
    assert np.degrees(np.sqrt(blind.covariance[0, 0])) > 20.0  # nothing says how it was tilted
    whole = places(tmp_path, "2026-03-02,A1,1,2,3.5,30,-3,2,0.02,0.5\n").given(DAY, [seen])["A1"]  # type: ignore[list-item]
    np.testing.assert_allclose(whole.world_from_left[:3, :3], true, atol=1e-9)


def test_a_pose_on_the_map_is_brought_into_the_ifc_world_scale_and_all(tmp_path: Path) -> None:
    scale = 0.9996
    known = places(tmp_path, f",A1,{500_000 - 20 * scale},{5_400_000 + 10 * scale},403,90,0,0,0.02,0.5\n", "map", scale)
    pose = known.given(DAY)["A1"].world_from_left
    np.testing.assert_allclose(pose[:3, 3], [10.0, 20.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(
        pose[:3, 2], [0.0, -1.0, 0.0], atol=1e-9
    )  # east on the map is -y of a world turned by 90°


def test_every_wrong_row_is_named_with_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(SurveyError) as caught:
        places(tmp_path, ",B9,1,2,3,90,0,0,0.02,1\n,A1,x,2,3,90,0,0,0.02,1\n,A1,1,2,3,90,0,0,0,1\n,A1,1,2,3,,0,0,1,1\n")
    told = str(caught.value)
    for part in ("there is no station 'B9'", "'x' is no number", "sigma_m is 0", "bearing_deg is empty"):
        assert part in told


def test_clicked_points_go_through_the_lens_model_into_the_rectified_photo(tmp_path: Path) -> None:
    from tests.camera.virtual import rig
    from tests.register.linked_scene import stations

    (tmp_path / "points.csv").write_text("station,point,x_m,y_m,z_m,x_px,y_px\nA1,P1,1,2,3,700,500\n", encoding="utf-8")
    known = known_places(project(tmp_path, "control_points: points.csv\n"), lambda: (np.eye(4), 1.0))
    seen = stations()[1]
    ((point,),) = known.clicked(DAY, rig(), [seen]).values()
    ray = rig().left.rays(np.array([[700.0, 500.0]]))[0]
    np.testing.assert_allclose(seen.camera.project(apply(np.eye(4), ray)), point.left_px)
    assert known.clicked(date(2027, 1, 1), rig(), []) == {}


@pytest.mark.parametrize(("metres", "refused"), [(1.0, False), (3.2808, True)])
def test_poses_far_from_the_building_are_refused_and_not_taken_for_another_sites_photos(
    tmp_path: Path, metres: float, refused: bool
) -> None:
    design = model([element("W", "wall", box(0, 0, 0, 3, 0.25, 3))])
    x, y, z = metres * FAR
    known = places(tmp_path, f"2026-03-02,A1,{x},{y},{z},0,0,0,0.01,0.1\n")
    with pytest.raises(SurveyError, match=r"poses: 1 of 1 lie .* \(A1: .*in metres") if refused else nullcontext():
        assert check_places(known, design) == ()


def test_clicked_points_far_from_the_building_are_refused(tmp_path: Path) -> None:
    design = model([element("W", "wall", box(0, 0, 0, 3, 0.25, 3))])
    (tmp_path / "points.csv").write_text("station,point,x_m,y_m,z_m,x_px,y_px\nA1,P1,1,2,3,700,500\n", encoding="utf-8")
    known = known_places(project(tmp_path, "control_points: points.csv\n"), lambda: (np.eye(4), 1.0))
    with pytest.raises(SurveyError, match=r"control_points: 1 of 1 lie .*\(P1: "):
        check_places(known, design)
