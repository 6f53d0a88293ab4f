"""The measuring steps that need no photo: closed forms, invariants, worked numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Literal

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import seen_points
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.transform import apply, rigid
from asbuilt_bim.measure.algorithm_1 import boundary_pixels, world_from_boundary
from asbuilt_bim.measure.depth_reference import pack, unpack, unpack_occluder_free
from asbuilt_bim.measure.finish import Settled, _open_sigma, _side_sigma_px, outline_on_plane, plane_covariance
from asbuilt_bim.measure.outline.contour import contours
from asbuilt_bim.measure.outline.edges import Line, find_edge, gradients
from asbuilt_bim.measure.outline.ends import End, Ends
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline
from asbuilt_bim.measure.outline.steps import straight_region
from asbuilt_bim.measure.planes.adjust import PlaneSight, Touch, adjust_planes
from asbuilt_bim.measure.planes.face_hypotheses import contradiction
from asbuilt_bim.measure.sigma.area import (
    area_per_pixel_m2,
    calibration_sigmas_m2,
    image_sigma_m2,
    rig_parts,
    rings_area_m2,
)
from asbuilt_bim.vision.stereo.depth import DepthMap
from tests.measure.box_world import make_camera
from tests.measure.published import paper_area

CAMERA = make_camera(640, 480, 500.0)
FB = CAMERA.f_px * CAMERA.baseline_m


def facing(depth_m: float) -> np.ndarray:
    return np.array([0.0, 0.0, FB / depth_m])


def square_px(half: float) -> np.ndarray:
    c = np.array([CAMERA.cx_px, CAMERA.cy_px])
    return c + half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def test_the_published_method_gives_a_facing_square_less_half_a_pixel_all_round() -> None:
    k = np.array([[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]])
    mask = np.zeros((480, 640), dtype=bool)
    mask[200:300, 300:400] = True
    area = paper_area(mask, np.full(mask.shape, 5.0), k)
    assert area == pytest.approx((99 * 5.0 / 500.0) ** 2, rel=1e-12)


def test_the_published_method_measures_the_shadow_of_an_oblique_face() -> None:
    # 2 m x 2 m turned by 60 degrees about the vertical, far off: its shadow is 4 cos 60 = 2 m2
    k = np.array([[8000.0, 0.0, 320.0], [0.0, 8000.0, 240.0], [0.0, 0.0, 1.0]])
    mask = np.zeros((480, 640), dtype=bool)
    mask[80:400, 240:400] = True
    shape = world_from_boundary(boundary_pixels(mask), np.full(len(boundary_pixels(mask)), 50.0), k)
    assert np.ptp(shape, axis=0) == pytest.approx([159 * 50 / 8000, 319 * 50 / 8000])
    assert paper_area(mask, np.full(mask.shape, 50.0), k) == pytest.approx(2.0, rel=0.02)


def test_boundary_pixels_run_along_the_contour_not_along_the_raster() -> None:
    mask = np.zeros((40, 40), dtype=bool)
    mask[10:30, 5:35] = True
    steps = np.diff(boundary_pixels(mask), axis=0)
    assert np.abs(steps).max() == 1.0


def test_no_mask_has_no_area() -> None:
    empty = np.zeros((20, 20), dtype=bool)
    assert paper_area(empty, np.ones((20, 20)), np.eye(3)) == 0.0


def test_a_mask_is_made_of_pixel_areas() -> None:
    mask = np.zeros((60, 60), dtype=bool)
    mask[20:40, 10:50] = True
    (ring,) = contours(mask)
    x, y = ring.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    assert area == pytest.approx(20 * 40, abs=1.0)
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((9.5, 49.5, 19.5, 39.5), abs=0.26)


def test_a_hole_is_a_second_ring_the_other_way_round() -> None:
    mask = np.zeros((80, 80), dtype=bool)
    mask[10:70, 10:70] = True
    mask[30:50, 30:50] = False
    outer, hole = contours(mask)
    areas = [
        0.5 * float(np.sum(r[:, 0] * np.roll(r[:, 1], -1) - np.roll(r[:, 0], -1) * r[:, 1])) for r in (outer, hole)
    ]
    assert areas == pytest.approx([3600.0, -400.0], abs=3.0)


def test_a_facing_square_has_its_area_and_a_pixel_its_share() -> None:
    q = facing(4.0)
    assert rings_area_m2([square_px(100.0)], q, CAMERA) == pytest.approx((200 * 4 / 500) ** 2, rel=1e-12)
    centre = np.array([CAMERA.cx_px, CAMERA.cy_px])
    assert area_per_pixel_m2(centre, q, CAMERA) == pytest.approx((4.0 / 500.0) ** 2, rel=1e-12)


def test_a_pixels_share_of_an_oblique_plane_is_what_the_rings_area_says() -> None:
    q = np.array([25.0, 3.0, 30.0])
    middle = np.array([420.0, 200.0])
    small = middle + 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    assert area_per_pixel_m2(middle, q, CAMERA) == pytest.approx(rings_area_m2([small], q, CAMERA), rel=1e-4)


def test_half_a_pixel_on_one_side_of_a_hundred_is_half_a_per_cent() -> None:
    ring, q = square_px(50.0), facing(5.0)
    edges = [(ring[:2].mean(axis=0), 100.0, 0.5)]
    sigma = image_sigma_m2([ring], edges, 0.0, q, np.zeros((3, 3)), CAMERA)
    assert sigma / rings_area_m2([ring], q, CAMERA) == pytest.approx(0.005, rel=1e-6)


def test_a_tenth_of_a_pixel_of_disparity_is_twice_its_share_of_area() -> None:
    q = facing(5.0)
    sigma = image_sigma_m2([square_px(50.0)], [], 0.0, q, np.diag([0.0, 0.0, 0.1**2]), CAMERA)
    area = rings_area_m2([square_px(50.0)], q, CAMERA)
    assert sigma / area == pytest.approx(2 * 0.1 / q[2], rel=1e-3)


def rig_with(sigmas: dict[int, float]) -> StereoRig:
    k = np.array([[500.0, 0.0, CAMERA.cx_px], [0.0, 500.0, CAMERA.cy_px], [0.0, 0.0, 1.0]])
    camera = Intrinsics(K=k, distortion=np.zeros(5), width_px=640, height_px=480)
    covariance = np.zeros((14, 14))
    for i, sigma in sigmas.items():
        covariance[i, i] = sigma**2
    return StereoRig(
        left=camera, right=camera, right_from_left=rigid(np.eye(3), [-0.25, 0.0, 0.0]), covariance=covariance
    )


def test_a_baseline_one_per_cent_off_is_two_per_cent_of_area() -> None:
    outline = ([square_px(60.0)], facing(5.0))
    sigma = calibration_sigmas_m2([outline], rig_with({11: 0.0025}), CAMERA)[0]
    assert sigma / rings_area_m2(outline[0], outline[1], CAMERA) == pytest.approx(0.02, rel=0.01)


def test_a_yaw_of_two_tenths_of_a_degree_is_what_was_measured_of_it() -> None:
    # disparity 25 px at 5 m; 0.2 degrees of yaw move it by f tan = 1.745 px, area by about 2 x 7 %
    outline = ([square_px(60.0)], facing(5.0))
    sigma = calibration_sigmas_m2([outline], rig_with({9: np.radians(0.2)}), CAMERA)[0]
    assert sigma / rings_area_m2(outline[0], outline[1], CAMERA) == pytest.approx(2 * 1.745 / 25.0, rel=0.05)


def leaning_away(angle_rad: float, depth_m: float) -> np.ndarray:
    """Return q of a wall turned about the vertical, that far away in the middle of the photo."""
    normal = np.array([np.sin(angle_rad), 0.0, np.cos(angle_rad)])
    return FB * normal / (depth_m * normal[2])


def place_sigmas(rig: StereoRig, ring: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return sigmas (3,) of a plane's place by the rig: offset (m), tilts about u and v (rad)."""
    (part,) = rig_parts([([ring], q)], rig, CAMERA)
    frame, (outline,) = outline_on_plane([ring], q, CAMERA, np.array([0.0, 1.0, 0.0]))
    middle = frame.from_uv(outline.mean(axis=0))
    return np.sqrt(np.maximum(np.diag(plane_covariance(q, part.q_covariance, frame, middle, CAMERA)), 0.0))


@pytest.mark.parametrize("angle_deg", [0.0, 60.0, 75.0])
def test_a_baseline_one_per_cent_off_moves_a_wall_by_that_along_its_own_normal_and_turns_it_by_nothing(
    angle_deg: float,
) -> None:
    rig, angle = rig_with({11: 0.0025}), np.radians(angle_deg)
    offset, *tilts = place_sigmas(rig, square_px(20.0), leaning_away(angle, 5.0))
    assert offset == pytest.approx(0.01 * 5.0 * np.cos(angle), rel=0.01)
    assert max(tilts) < 1e-4


def test_a_scale_that_nobody_checked_moves_a_wall_as_a_baseline_does() -> None:
    rig = rig_with({})
    rig = replace(rig, width=replace(rig.width, scale_share=0.01, turn_rad=(0.0,) * 5, lens_px=0.0))
    offset, *tilts = place_sigmas(rig, square_px(20.0), leaning_away(np.radians(60.0), 5.0))
    assert offset == pytest.approx(0.01 * 2.5, rel=0.01) and max(tilts) < 1e-6


def test_what_the_rig_leaves_of_a_walls_place_is_what_rigs_drawn_from_its_covariance_make_of_it() -> None:
    sigmas = {0: 1.0, 9: np.radians(0.02), 10: np.radians(0.02), 11: 0.0005}
    rig, q, ring = rig_with(sigmas), leaning_away(np.radians(60.0), 6.0), square_px(60.0)
    frame, (outline,) = outline_on_plane([ring], q, CAMERA, np.array([0.0, 1.0, 0.0]))
    corners = frame.from_uv(outline)
    seen = seen_points(rig, *(p[:, :2] / p[:, 2:] for p in (corners, apply(rig.right_from_left, corners))))
    rng, found = np.random.default_rng(4), []
    for _ in range(4000):
        change = np.zeros(14)
        change[list(sigmas)] = rng.normal(size=len(sigmas)) * list(sigmas.values())
        moved = midpoints(*seen.rays(change))
        slopes = np.linalg.lstsq(np.column_stack([outline, np.ones(4)]), (moved - corners) @ frame.normal, rcond=None)[
            0
        ]
        found.append([slopes @ [*outline.mean(axis=0), 1.0], slopes[1], slopes[0]])
    assert place_sigmas(rig, ring, q) == pytest.approx(np.std(found, axis=0), rel=0.05)


def test_a_rig_of_unknown_covariance_is_trusted_to_its_usual_yaw_and_lenses() -> None:
    # 0.02 degrees of yaw and 0.2 px of lens: some 0.26 px of 25, twice that of the area
    outline = ([square_px(60.0)], facing(5.0))
    share = calibration_sigmas_m2([outline], rig_with({}), CAMERA)[0] / rings_area_m2(*outline, CAMERA)
    assert 2 * 0.17 / 25.0 < share < 2 * 0.4 / 25.0


def test_a_rig_of_unknown_covariance_leaves_more_open_of_what_is_farther() -> None:
    near, far = calibration_sigmas_m2(
        [([square_px(60.0)], facing(5.0)), ([square_px(60.0)], facing(10.0))], rig_with({}), CAMERA
    )
    assert far / near > 6.0  # four times the area, twice the share of the disparity


def test_a_tilt_of_a_face_seen_from_the_front_counts_by_how_it_bends_the_area() -> None:
    square, q = [square_px(50.0)], facing(5.0)
    tilted = image_sigma_m2(square, [], 0.0, q, np.diag([(0.3 * q[2]) ** 2, 0.0, 0.0]), CAMERA)
    # area grows by 1 / cos: of a tilt whose tangent is 0.3, by half its square; the root of three times that
    assert tilted / rings_area_m2(square, q, CAMERA) == pytest.approx(np.sqrt(3.0) * 0.5 * 0.3**2, rel=0.15)


def upright_q(angle: float, offset: float) -> np.ndarray:
    return offset * np.array([np.sin(angle), 0.0, np.cos(angle)])


DOWN = np.array([0.0, 1.0, 0.0])


def corner(weak_error: float) -> tuple[list[PlaneSight], list[Touch], np.ndarray]:
    """A well-seen face and, at a right angle to it, one whose slope across is hardly known."""
    strong = upright_q(0.35, 40.0)
    ray = np.array([[0.1, -0.2, 1.0], [0.1, 0.3, 1.0]])
    n = np.array([np.sin(0.35 - np.pi / 2), 0.0, np.cos(0.35 - np.pi / 2)])
    weak = n * float(strong @ ray[0]) / float(n @ ray[0])
    sights = [
        PlaneSight(q_px=strong, covariance=1e-4 * np.eye(3)),
        PlaneSight(
            q_px=weak + np.array([weak_error, 0.0, -0.1 * weak_error]), covariance=np.diag([3600.0, 0.01, 36.0])
        ),
    ]
    return sights, [Touch(one=0, other=1, rays=ray)], weak


def test_a_weak_side_face_takes_its_direction_from_its_neighbour() -> None:
    sights, touches, weak = corner(weak_error=40.0)
    found = adjust_planes(sights, touches, DOWN, 1e-3)
    before = np.degrees(np.arccos(sights[1].q_px @ weak / np.linalg.norm(sights[1].q_px) / np.linalg.norm(weak)))
    after = np.degrees(np.arccos(min(1.0, found.q_px[1] @ weak / np.linalg.norm(found.q_px[1]) / np.linalg.norm(weak))))
    assert before > 3.0
    assert after < 0.3
    assert found.covariance[1][0, 0] < 0.05 * sights[1].covariance[0, 0]


def test_a_right_angle_that_the_photos_contradict_is_dropped() -> None:
    sights, touches, weak = corner(weak_error=0.0)
    skew = weak + np.array([30.0, 0.0, 40.0])  # some 20 degrees off, and surely so
    sure = [sights[0], PlaneSight(q_px=skew, covariance=1e-4 * np.eye(3))]
    found = adjust_planes(sure, touches, DOWN, 1e-3)
    assert found.q_px[1] == pytest.approx(skew, abs=0.1)


def test_a_battered_wall_stays_battered() -> None:
    leaning = upright_q(0.2, 40.0) + np.array([0.0, 2.0, 0.0])  # 2.9 degrees
    found = adjust_planes([PlaneSight(q_px=leaning, covariance=1e-4 * np.eye(3))], [], DOWN, 1e-3)
    assert found.q_px[0] == pytest.approx(leaning, abs=1e-3)


def test_a_straight_region_takes_the_rags_off_a_mask() -> None:
    rng = np.random.default_rng(2)
    own = np.zeros((200, 120), dtype=bool)
    for row in range(30, 170):
        own[row, 30 + rng.integers(-4, 5) : 90 + rng.integers(-4, 5)] = True
    cost = np.where(own, -0.3, 0.05).astype(np.float32)
    votes = np.zeros_like(cost)
    votes[:, 30] = votes[:, 90] = 0.8
    region = straight_region(cost, votes, np.zeros_like(cost), own)
    rows, columns = np.nonzero(region)
    assert (columns.min(), columns.max() + 1) == pytest.approx((30, 90), abs=1)
    assert (rows.min(), rows.max() + 1) == pytest.approx((30, 170), abs=1)
    assert region.sum() == (columns.max() + 1 - columns.min()) * (rows.max() + 1 - rows.min())


def test_a_real_step_is_kept() -> None:
    own = np.zeros((200, 160), dtype=bool)
    own[20:180, 20:80] = True
    own[100:180, 80:140] = True
    cost = np.where(own, -0.3, 0.3).astype(np.float32)
    zero = np.zeros_like(cost)
    assert np.array_equal(straight_region(cost, zero, zero, own), own)


def step_pictures(edge_x: float, disparity: float) -> tuple[np.ndarray, np.ndarray]:
    x = (np.arange(200 * 8) + 0.5) / 8 - 0.5
    pictures = []
    for place in (edge_x, edge_x - disparity):
        fine = np.where(x < place, 90.0, 160.0)
        row = cv2.GaussianBlur(fine[None].astype(np.float32), (0, 0), 5.0).reshape(200, 8).mean(axis=1)
        pictures.append(np.tile(row, (150, 1)).astype(np.float32))
    return pictures[0], pictures[1]


def test_an_edge_is_found_to_hundredths() -> None:
    left, right = step_pictures(100.37, 20.25)
    both = gradients(left, right, np.ones(left.shape, dtype=bool))
    line = Line(start=np.array([103.0, 20.0]), stop=np.array([103.0, 130.0]))
    line = line if line.normal[0] > 0 else Line(start=line.stop, stop=line.start)
    fit = find_edge(both, line, np.array([0.0, 0.0, 20.0]), 2.0, 0.0)
    assert fit is not None
    assert 0.5 * (fit.line.start[0] + fit.line.stop[0]) == pytest.approx(100.37, abs=0.03)
    assert fit.strength > 0.8


def test_the_backgrounds_own_edge_is_no_edge_of_the_face() -> None:
    left, right = step_pictures(100.0, 5.0)  # far behind a face of disparity 20
    both = gradients(left, right, np.ones(left.shape, dtype=bool))
    line = Line(start=np.array([101.0, 130.0]), stop=np.array([101.0, 20.0]))
    fit = find_edge(both, line, np.array([0.0, 0.0, 20.0]), 2.0, 0.0)
    assert fit is None or fit.strength < 0.2


def small_depth() -> tuple[DepthMap, np.ndarray]:
    disparity = np.full((481, 1301), 20.0, dtype=np.float32)
    disparity[:, 651:] = 60.0
    disparity[:100] = np.nan
    sigma = np.full(disparity.shape, 0.25, dtype=np.float32)
    sky = np.zeros(disparity.shape, dtype=bool)
    sky[:60] = True
    valid = np.isfinite(disparity)
    return DepthMap(
        disparity_px=disparity, sigma_px=sigma, valid=valid, f_px=1000.0, baseline_m=0.25, method="stereo"
    ), sky


def test_the_depth_reference_is_small_and_mixes_nothing() -> None:
    depth, sky = small_depth()
    reference = pack(depth, sky)
    disparity, sigma, scale = unpack(reference)
    assert disparity.shape[1] <= 640
    assert scale == 3
    known = disparity[np.isfinite(disparity) & (disparity > 0)]
    assert set(np.unique(known)) == {20.0, 60.0}
    assert np.all(disparity[: 60 // scale] == 0.0)
    assert np.isnan(disparity[-(-60 // scale) + 1 : 100 // scale - 1]).all()
    assert sigma[-1, 0] == pytest.approx(0.25)


def test_the_disparity_past_thin_things_is_kept_beside_the_other_pixel_for_pixel() -> None:
    depth, sky = small_depth()
    beyond = np.where(sky, 0.0, depth.disparity_px / 2.0).astype(np.float32)
    beyond[200:, :] = np.nan
    kept = unpack_occluder_free(pack(depth, sky, beyond))
    first, _, scale = unpack(pack(depth, sky))
    assert kept is not None and kept.shape == first.shape
    both = np.isfinite(kept) & (first > 0.0)
    assert both.any()
    np.testing.assert_allclose(kept[both], first[both] / 2.0)
    assert np.all(kept[: 60 // scale] == 0.0) and np.isnan(kept[-1]).all()
    assert unpack_occluder_free(pack(depth, sky)) is None


def test_a_damaged_depth_reference_is_named() -> None:
    depth, sky = small_depth()
    reference = pack(depth, sky)
    with pytest.raises(ValueError, match="disparity is no PNG"):
        unpack(type(reference)(png=b"junk", sigma_png=reference.sigma_png, scale=3))


LINE = Line(start=np.array([100.0, 200.0]), stop=np.array([100.0, 100.0]))
SOURCES: tuple[tuple[Literal["mask", "frame", "photo"], float], ...] = (("mask", 3.0), ("frame", 3.0), ("photo", 0.1))


def _side(source: Literal["mask", "frame", "photo"], sigma_px: float) -> FaceEdge:
    return FaceEdge(line=LINE, sigma_px=sigma_px, source=source, course="upright", neighbour=-1, fit=None)


@pytest.mark.parametrize(("source", "sigma_px"), SOURCES)
@pytest.mark.parametrize("is_end", [0.0, 0.5, 1.0])
def test_a_side_that_a_mask_alone_draws_lies_nearby_or_farther_off_anywhere_up_to_what_isnt_the_face(
    source: Literal["mask", "frame", "photo"], sigma_px: float, is_end: float
) -> None:
    side, end = _side(source, sigma_px), End(probability=is_end, open_px=24.0, far_px=60.0)
    share = np.sqrt((1.0 - is_end) / 12.0) if source == "mask" else 0.0
    assert _side_sigma_px(side, end) == pytest.approx(np.hypot(sigma_px, 24.0 * share))
    ends = Ends(probability=is_end, by_edge={0: end}, cut_by_frame=False, occluded=False, open_edge=True)
    settled = Settled(
        hypothesis=None, q_px=facing(5.0), covariance=np.eye(3),  # type: ignore[arg-type]
        outline=Outline(rings=(), edges=(side,)),
    )  # fmt: skip
    pixels_m2 = LINE.length_px * (5.0 / CAMERA.f_px) ** 2
    expected_m2 = np.sqrt(60.0**2 - 24.0**2) * share * pixels_m2
    assert _open_sigma(settled, ends, CAMERA) == pytest.approx(expected_m2, abs=1e-9)


@pytest.mark.parametrize(("tilt_px", "doubt", "is_open"), [(0.0, 1.0, False), (30.0, 1.0, True), (30.0, 0.0, False)])
def test_another_plane_that_dense_depth_shows_is_left_open_where_the_photos_contradict_themselves(
    tilt_px: float, doubt: float, is_open: bool
) -> None:
    rows, columns = np.indices((200, 300))
    rays = np.stack(
        [(columns - 150.0) / CAMERA.f_px, (rows - 100.0) / CAMERA.f_px, np.ones(rows.shape)], axis=-1
    )  # fmt: skip
    known, own = np.ones(rows.shape, dtype=bool), np.array([0.0, 0.0, 20.0])
    dense = rays @ (own + np.array([tilt_px, 0.0, 0.0]))
    level = SimpleNamespace(rays=rays, disparity_px=dense, sigma_px=np.full(rows.shape, 0.2), measured=known)
    bench = SimpleNamespace(scene=SimpleNamespace(level=level), marks=~known)
    hypothesis = SimpleNamespace(mask=known, doubt=doubt)
    found = contradiction(own, np.diag([1.0, 1.0, 1e-4]), hypothesis, bench)  # type: ignore[arg-type]
    assert (found[0, 0] > 0.4 * tilt_px**2) == is_open
    assert np.all(found == 0.0) != is_open
