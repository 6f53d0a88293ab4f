from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.control_file import COLUMNS, ControlPoints, read_control_points
from asbuilt_bim.camera.calibration.control_rig import rig_from_control_points
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid
from asbuilt_bim.report.page.calibration import calibration_html
from tests.camera.virtual import SIZE, parameters, rig
from tests.notes import codes

LEFT_FROM_WORLD = rigid([0.1, -0.3, 0.05], [0.4, -0.2, 1.0])


def control(count: int, noise_px: float, seed: int = 0, far: tuple[float, float, float] = (0, 0, 0)) -> ControlPoints:
    random = np.random.default_rng(seed)
    in_left = random.uniform([-0.5, -0.42, 3.5], [0.58, 0.42, 9.0], (count, 3))
    in_left[:, :2] *= in_left[:, 2:]
    left, right = rig().left.project(in_left), rig().right.project(apply(rig().right_from_left, in_left))
    return ControlPoints(
        names=tuple(f"P{number}" for number in range(count)),
        points_m=frozen(apply(inverse(LEFT_FROM_WORLD), in_left) + far),
        left_px=frozen(left + random.normal(0, noise_px, left.shape)),
        right_px=frozen(right + random.normal(0, noise_px, right.shape)),
    )


def test_points_without_noise_give_the_rig_that_saw_them_far_from_the_origin_too() -> None:
    found = rig_from_control_points(control(24, 0.0, far=(512_340.0, 5_403_210.0, 420.0)), SIZE)
    error = np.abs(parameters(found.rig) - parameters(rig()))
    assert error[:8].max() < 0.5 and error[8:].max() < 1e-3  # what the weak prior of the lens leaves
    assert found.rig.rms_px < 0.01 and not found.left_out
    assert found.checks.length_error is not None and found.checks.length_error < 1e-4


def test_their_sigma_is_a_promise() -> None:
    scores = []
    for seed in range(20):
        found = rig_from_control_points(control(40, 0.5, seed), SIZE)
        error = parameters(found.rig) - parameters(rig())
        scores.append(error @ np.linalg.solve(found.rig.covariance[:14, :14], error) / 14)
    assert abs(np.mean(scores) - 1.0) < 6.0 * np.sqrt(2.0 / (14 * 20))


def test_a_wrong_point_is_left_out_by_name() -> None:
    points = control(24, 0.3)
    moved = np.array(points.right_px)
    moved[7] += [40.0, -25.0]
    found = rig_from_control_points(replace(points, right_px=frozen(moved)), SIZE)
    assert [(one.code, one.subject.name) for one in found.left_out] == [(Reason.CONTROL_POINT_MISFIT, "P7")]
    assert abs(found.rig.baseline_m - rig().baseline_m) < 0.01


def test_few_points_take_the_lens_to_be_straight_and_say_so() -> None:
    found = rig_from_control_points(control(9, 0.2), SIZE)
    assert not found.rig.left.distortion.any()
    assert Reason.CONTROL_POINTS_FEW in codes(found.checks.warnings)


def test_points_over_the_middle_of_the_photo_alone_are_warned_of() -> None:
    points = control(60, 0.2)
    near = np.all(np.abs(points.left_px - np.array(SIZE) / 2) < np.array(SIZE) / 3, axis=1)
    inner = replace(
        points,
        names=tuple(points.names[i] for i in np.flatnonzero(near)),
        points_m=frozen(points.points_m[near]),
        left_px=frozen(points.left_px[near]),
        right_px=frozen(points.right_px[near]),
    )
    found = [rig_from_control_points(one, SIZE).checks.warnings for one in (inner, points)]
    assert [Reason.CONTROL_POINTS_REACH in codes(each) for each in found] == [
        True,
        False,
    ]


def test_points_in_one_plane_too_few_and_in_millimetres_are_refused_by_name() -> None:
    flat = control(12, 0.0)
    in_left = apply(LEFT_FROM_WORLD, flat.points_m)
    wall: FloatArray = in_left / in_left[:, 2:] * 5.0
    left, right = rig().left.project(wall), rig().right.project(apply(rig().right_from_left, wall))
    points = ControlPoints(
        names=flat.names, points_m=frozen(wall), left_px=frozen(left), right_px=frozen(right)
    )  # fmt: skip
    with pytest.raises(CalibrationError, match=r"in the left photo: DLT: the points lie in one plane"):
        rig_from_control_points(points, SIZE)
    with pytest.raises(CalibrationError, match="5 points, at least 6"):
        rig_from_control_points(control(5, 0.0), SIZE)
    big = control(24, 0.0)
    with pytest.raises(CalibrationError, match=r"baseline comes out at 249\.\d m.*give their coordinates in metres"):
        rig_from_control_points(
            replace(big, points_m=frozen(big.points_m * 1000.0)),
            SIZE,
        )
    with pytest.raises(CalibrationError, match="left and right are swapped"):
        rig_from_control_points(
            replace(big, left_px=big.right_px, right_px=big.left_px),
            SIZE,
        )


def test_a_file_of_control_points_is_read_with_points_that_one_photo_shows(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    rows = "\nA1;1.5;2;3;10;20;30;40\n\nÄ2;1;2;3;10;20;;\n"
    file.write_text("\ufeff" + ";".join(COLUMNS) + rows, encoding="utf-8")
    found = read_control_points(file)
    assert found.names == ("A1", "Ä2") and found.points_m[0].tolist() == [1.5, 2.0, 3.0]
    assert found.right_px[0].tolist() == [30.0, 40.0] and np.isnan(found.right_px[1]).all()


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("A,1,2,x,1,1,1,1", "line 2: point A: x_m, y_m, z_m must be numbers"),
        ("A,1,2,3,1,1,1,1\nA,1,2,3,1,1,1,1", "line 3: id 'A' is there twice"),
        ("A,1,2,3,1,,1,1", "line 2: point A: x and y of a photo go together"),
        ("A,1,2,3,1,nan,1,1", "line 2: point A: pixels must be numbers"),
        (",1,2,3,1,1,1,1", "line 2: id '' is empty"),
        ("A,1,2", "line 2: point A: x_m, y_m, z_m"),
    ],
)
def test_bad_lines_of_control_points_are_named(tmp_path: Path, rows: str, says: str) -> None:
    file = tmp_path / "points.csv"
    file.write_text(",".join(COLUMNS) + "\n" + rows + "\n", encoding="utf-8")
    with pytest.raises(CalibrationError) as raised:
        read_control_points(file)
    assert says in str(raised.value) and str(file) in str(raised.value)


@pytest.mark.parametrize("sign", [";", "\t"])
def test_control_points_between_semicolons_or_tabs_may_have_decimal_commas(tmp_path: Path, sign: str) -> None:
    file = tmp_path / "points.csv"
    file.write_text(sign.join(COLUMNS) + "\nA;1,5;2;3;10,25;4;;\n".replace(";", sign), encoding="utf-8")
    found = read_control_points(file)
    assert found.points_m.tolist() == [[1.5, 2.0, 3.0]] and found.left_px.tolist() == [[10.25, 4.0]]


def test_one_place_under_two_ids_is_refused_by_both(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text(",".join(COLUMNS) + "\nA,1,2,3,4,5,6,7\nB,1,2,3.0,40,50,60,70\n")
    with pytest.raises(CalibrationError, match=r"points\.csv: B and A are one place"):
        read_control_points(tmp_path / "points.csv")


def test_marks_outside_the_photo_are_refused_by_name() -> None:
    points = control(24, 0.2)
    low = int(np.argmax(points.left_px[:, 1]))
    with pytest.raises(CalibrationError, match=rf"control point P{low}: .* px lies outside the left photo of 1280 x "):
        rig_from_control_points(points, (SIZE[0], int(points.left_px[low, 1])))


def test_points_and_marks_all_at_one_place_are_refused_in_words() -> None:
    points = control(24, 0.2)
    with pytest.raises(CalibrationError, match="DLT: the points lie in one plane"):
        rig_from_control_points(replace(points, points_m=frozen(np.zeros((24, 3)))), SIZE)
    with pytest.raises(CalibrationError, match="in the left photo: DLT: "):
        rig_from_control_points(replace(points, left_px=frozen(np.full((24, 2), 300.0))), SIZE)


def test_without_two_points_in_both_photos_no_length_is_claimed_to_fit() -> None:
    points = control(24, 0.2)
    left, right = np.array(points.left_px), np.array(points.right_px)
    left[::2], right[1::2] = np.nan, np.nan
    found = rig_from_control_points(replace(points, left_px=frozen(left), right_px=frozen(right)), SIZE)
    assert found.checks.length_error is None
    assert "The two points furthest apart" not in calibration_html(found, ())


def test_more_points_than_hands_mark_are_refused(tmp_path: Path) -> None:
    rows = [f"P{number},1,2,3,4,5,6,7" for number in range(501)]
    (tmp_path / "many.csv").write_text("\n".join([",".join(COLUMNS), *rows]), encoding="utf-8")
    with pytest.raises(CalibrationError, match="501 points, limit 500"):
        read_control_points(tmp_path / "many.csv")


def test_no_control_points_at_all_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("", encoding="utf-8")
    with pytest.raises(CalibrationError, match="the table is empty"):
        read_control_points(tmp_path / "empty.csv")
    (tmp_path / "empty.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(CalibrationError, match="columns are missing: id"):
        read_control_points(tmp_path / "empty.csv")
    (tmp_path / "head.csv").write_text(",".join(COLUMNS), encoding="utf-8")
    with pytest.raises(CalibrationError, match="0 points, at least 6"):
        rig_from_control_points(read_control_points(tmp_path / "head.csv"), SIZE)
    with pytest.raises(CalibrationError, match=r"none\.csv: there is no such file"):
        read_control_points(tmp_path / "none.csv")
