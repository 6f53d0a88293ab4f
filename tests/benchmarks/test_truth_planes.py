"""The truth's planes and the shares that judge sigma, held against closed forms."""

from __future__ import annotations

from math import comb
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import rejected
from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.geometry.disparity_plane import plane_of
from benchmarks.real.face_truth import _ring_of, area_on, not_rejected, region_case
from benchmarks.real.shots import read_pfm, rectified_rig
from benchmarks.real.truth_planes import Region, is_upright, plane_within, upright_regions

F_PX, BASELINE_M, SIZE_PX = 500.0, 0.1, (400, 300)
Q_OF_WALL = np.array([0.0, 0.0, F_PX * BASELINE_M / 4.0])  # 4 m away, square to the axis


def rays() -> FloatArray:
    camera = rectified_rig(F_PX, (199.5, 149.5), BASELINE_M, SIZE_PX).left
    rows, columns = np.indices((SIZE_PX[1], SIZE_PX[0]))
    return camera.rays(np.stack([columns, rows], axis=-1).astype(np.float64))


def wall_over_floor() -> Float32Array:
    """Show a wall at 4 m above row 200, a floor 1 m below the camera under it."""
    disparity = rays() @ Q_OF_WALL
    disparity[200:] = np.maximum(rays() @ np.array([0.0, F_PX * BASELINE_M / 1.0, 0.0]), 0.1)[200:]
    return np.asarray(disparity, dtype=np.float32)


def test_most_pixels_name_the_plane_however_many_lie_elsewhere() -> None:
    truth = (rays() @ Q_OF_WALL + np.random.default_rng(1).normal(0.0, 0.03, SIZE_PX[::-1])).astype(np.float32)
    truth[:, 250:] += 3.0  # three eighths of it, and nowhere near
    found = plane_within(truth, rays(), np.ones(truth.shape, dtype=bool))
    assert found is not None
    assert found.q_px == pytest.approx(Q_OF_WALL, abs=0.01)
    assert found.share == pytest.approx(250 / 400, abs=0.01)


def test_an_outline_with_hardly_any_truth_has_no_plane() -> None:
    truth = np.full(SIZE_PX[::-1], np.nan, dtype=np.float32)
    truth[:, ::6] = (rays() @ Q_OF_WALL)[:, ::6]
    assert plane_within(truth, rays(), np.ones(truth.shape, dtype=bool)) is None


def test_a_wall_is_a_region_of_its_true_area_and_the_floor_is_none() -> None:
    (region,) = upright_regions(wall_over_floor(), rays(), F_PX * BASELINE_M)
    assert region.area_m2 == pytest.approx(400 * 200 * (4.0 / F_PX) ** 2, rel=0.02)  # a pixel sees 8 x 8 mm
    assert region.side_px == pytest.approx(200.0, abs=3.0)
    assert region.distance_m == pytest.approx(4.0)
    assert not region.mask[205:].any()


def test_gaps_of_a_laser_dont_split_a_wall() -> None:
    truth = wall_over_floor()
    truth[:, ::3] = np.nan
    (region,) = upright_regions(truth, rays(), F_PX * BASELINE_M)
    assert region.mask[20:180, 20:380].mean() > 0.97


def test_a_wall_under_half_a_square_metre_or_under_60_px_is_no_region() -> None:
    truth = np.full(SIZE_PX[::-1], np.nan, dtype=np.float32)
    truth[100:155, :] = (rays() @ Q_OF_WALL)[100:155, :]  # 1.4 m2, 55 px
    assert upright_regions(truth, rays(), F_PX * BASELINE_M) == []
    truth[:] = np.nan
    truth[100:180, 100:180] = (rays() @ Q_OF_WALL)[100:180, 100:180]  # 80 px, 0.41 m2
    assert upright_regions(truth, rays(), F_PX * BASELINE_M) == []


def test_upright_ends_at_20_degrees() -> None:
    for degrees, upright in ((19.0, True), (21.0, False)):
        lean = np.deg2rad(degrees)
        assert is_upright(np.array([0.3, np.tan(lean) * np.hypot(0.3, 1.0), 1.0])) is upright


def test_the_area_on_a_plane_is_that_of_its_rings_less_the_holes() -> None:
    plane = plane_of(Q_OF_WALL, F_PX * BASELINE_M)
    square = np.array([[-1.0, -1.0, 4.0], [1.0, -1.0, 4.0], [1.0, 1.0, 4.0], [-1.0, 1.0, 4.0]])
    hole = square * [0.5, 0.5, 1.0]
    assert area_on(plane, [square / 4.0, hole / 4.0]) == pytest.approx(4.0 - 1.0)


def binomial(k: int, n: int, p: float) -> float:
    return comb(n, k) * p**k * (1.0 - p) ** (n - k)


def test_the_share_within_two_sigma_is_judged_by_the_binomial_in_closed_form() -> None:
    n, p = 16, 0.9545
    z = np.array([0.5] * 12 + [3.0] * 4)
    as_rare = sum(binomial(k, n, p) for k in range(n + 1) if binomial(k, n, p) <= binomial(12, n, p) * (1 + 1e-7))
    within, found, holds = not_rejected(2, z)
    assert (within, holds) == (12, False)
    assert found == pytest.approx(as_rare, rel=1e-9)
    assert not_rejected(2, np.array([0.5] * 15 + [3.0]))[2]


def test_a_sigma_that_is_far_too_large_is_rejected_too() -> None:
    assert not_rejected(1, np.full(30, 0.1))[2] is False


def test_no_case_proves_nothing() -> None:
    assert not_rejected(1, np.zeros(0)) == (0, 1.0, False)


def test_a_region_is_found_where_the_program_says_that_it_cant_measure_it_there() -> None:
    mask = np.zeros((100, 100), dtype=bool)
    mask[:, :50] = True
    region = Region(mask=mask, q_px=Q_OF_WALL, area_m2=1.0, side_px=50.0, distance_m=4.0)
    half, less = mask.copy(), mask.copy()
    half[:50], less[:51] = False, False
    assert region_case("scene", region, [], [half]).became == "said"
    assert region_case("scene", region, [], [less]).became == "missed"
    assert region_case("scene", region, [], []).became == "missed"


def test_a_rejection_says_where_only_if_it_tells_its_box() -> None:
    face, seen = about(SubjectKind.FACE, "A/x1", "A"), dict[str, Value](label="wall", area_m2=1.0, distance_m=4.0)
    uncertain = dict[str, Value](**seen, limit_share=0.25)
    narrow = dict[str, Value](**seen, width_px=8.0, limit_px=12.0)
    box = dict[str, Value](box_px=(0, 2, 9, 8))
    told = _ring_of(rejected(Reason.FACE_UNCERTAIN, face, **(uncertain | box)))
    assert told is not None and told.tolist() == [[0.0, 2.0], [9.0, 2.0], [9.0, 8.0], [0.0, 8.0]]
    assert _ring_of(rejected(Reason.FACE_UNCERTAIN, face, **uncertain)) is None
    assert _ring_of(rejected(Reason.FACE_NARROW, face, **(narrow | box))) is not None


def test_the_scale_in_a_pfms_header_is_no_factor(tmp_path: Path) -> None:
    """Middlebury's files of 2014 say -0.003922 there, and OpenCV divides by it."""
    rows = np.array([[1.0, 2.0], [3.0, np.inf]], dtype="<f4")
    path = tmp_path / "disparity.pfm"
    path.write_bytes(b"Pf\n2 2\n-0.003922\n" + rows[::-1].tobytes())
    assert read_pfm(path).tolist() == [[1.0, 2.0], [3.0, float("inf")]]
