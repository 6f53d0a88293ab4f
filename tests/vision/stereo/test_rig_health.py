from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.photo.overlap import PairMatches
from asbuilt_bim.camera.photo.working_size import working_rig
from asbuilt_bim.camera.rectify import RectifiedCamera, rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import rig_numbers
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid, rotation_from_vector
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.stereo.rig_fit import (
    area_effects,
    corrected_rig,
    fit_rig,
    relative_units,
    row_effect_px,
    worst_area_effect,
)
from asbuilt_bim.vision.stereo.rig_health import (
    RigVerdict,
    StationHealth,
    judge,
    judge_visit,
    levelled,
    refined_rig,
    station_health,
)
from asbuilt_bim.vision.stereo.rig_rejection import RIG, rig_doubt, rig_rejection
from tests.camera.virtual import rig
from tests.vision.flat_scene import disc, pair_of

SIGMAS = np.array([0.4, 0.4, 0.1, 0.1, 0.4, 0.4, 0.1, 0.1, 2e-5, 2e-5, 2e-5, 3e-5, 2e-5, 1e-4])
"""Of a good calibration's numbers, principal points held by the rotation that they go with."""


def calibrated() -> StereoRig:
    return replace(rig(), covariance=frozen(np.diag(SIGMAS**2)))


def turned(of: StereoRig, degrees: tuple[float, float, float]) -> StereoRig:
    """The right camera turned about its own centre."""
    return replace(of, right_from_left=frozen(rigid(np.deg2rad(degrees), np.zeros(3)) @ of.right_from_left))


def scene(seed: int, count: int = 700) -> FloatArray:
    """Points (N, 3) on the ground, on a wall and scattered, as a site has them, in the left frame."""
    rng = np.random.default_rng([seed, 3])
    ground = np.c_[rng.uniform(-4, 4, count), np.full(count, 1.5), rng.uniform(3, 14, count)]
    wall = np.c_[rng.uniform(-3, 3, count), rng.uniform(-2, 1.5, count), rng.normal(6.0, 0.05, count)]
    far = rng.uniform([-15, -8, 8], [15, 2, 40], (count, 3))
    return np.concatenate([ground, wall, far])


def seen(points_m: FloatArray, true: StereoRig, used: StereoRig, seed: int, noise_px: float = 0.1) -> PairMatches:
    """Matches in the pixels that `used` rectifies to, of photos that the `true` rig took."""
    prepared = rectification(used)
    camera = prepared.camera
    rng = np.random.default_rng([seed, 4])
    photos = true.left.project(points_m), true.right.project(apply(true.right_from_left, points_m))
    size = np.array([1280, 960])
    inside = [((p > 0) & (p < size - 1)).all(axis=1) for p in photos]
    matches = []
    for photo, lens, turn in zip(
        photos, (used.left, used.right), (camera.rectified_from_left, prepared.rectified_from_right), strict=True
    ):
        noisy = photo[inside[0] & inside[1]] + rng.normal(0.0, noise_px, (int((inside[0] & inside[1]).sum()), 2))
        rays = lens.rays(noisy) @ turn.T
        matches.append(rays[:, :2] / rays[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px])
    return PairMatches(left_px=matches[0], right_px=matches[1])


def health(name: str, true: StereoRig, used: StereoRig, seed: int, foreign: float = 0.0) -> StationHealth:
    camera = rectification(used).camera
    matches = seen(scene(seed), true, used, seed)
    right = matches.right_px.copy()
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(right)) < foreign
    right[wrong] += rng.uniform(-30, 30, (int(wrong.sum()), 2))
    fit = fit_rig(matches.left_px, right, camera, used)
    assert fit is not None
    return StationHealth(station=name, fit=fit, camera=camera)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("degrees", [0.1, 1.0])
def test_a_turn_about_each_axis_is_fitted_to_a_hundredth_of_a_degree(axis: int, degrees: float) -> None:
    """One match in seven is foreign; the refined rig stands where the true one does."""
    turn = [0.0, 0.0, 0.0]
    turn[axis] = degrees
    true = turned(calibrated(), (turn[0], turn[1], turn[2]))
    one = health("A", true, calibrated(), seed=axis, foreign=0.15)
    found = corrected_rig(calibrated(), one.camera, one.fit.correction_rad)
    off = found.right_from_left[:3, :3] @ true.right_from_left[:3, :3].T
    assert np.rad2deg(np.abs(rotation_vector(off))).max() < 0.01
    assert found.baseline_m == pytest.approx(true.baseline_m, rel=1e-12)
    assert judge([one], calibrated()).state == "knocked" or (axis == 2 and degrees == 0.1)


def rotation_vector(rotation: FloatArray) -> FloatArray:
    return (
        np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
        / 2
    )


def test_yaw_ruins_areas_and_hides_from_the_rows_pitch_does_the_opposite() -> None:
    camera = rectification(calibrated()).camera
    yaw, pitch = np.zeros(5), np.zeros(5)
    yaw[1] = pitch[0] = np.deg2rad(0.2)
    assert area_effects(yaw, camera)[0] > 0.15 and row_effect_px(yaw, camera) < 0.4
    assert np.abs(area_effects(pitch, camera)).max() < 0.005 and row_effect_px(pitch, camera) > 3.5


def test_the_sigma_of_the_area_effect_is_its_slope_times_the_yaws_sigma() -> None:
    camera = rectification(calibrated()).camera
    covariance = np.zeros((5, 5))
    covariance[1, 1] = np.deg2rad(0.01) ** 2
    _, sigma = worst_area_effect(np.zeros(5), covariance, camera)
    moved = np.zeros(5)
    moved[1] = np.deg2rad(0.01)
    assert sigma == pytest.approx(np.abs(area_effects(moved, camera)).max(), rel=0.02)


def test_what_the_fit_leaves_open_is_what_it_errs_by() -> None:
    """Twelve noisy stations: the corrections' errors over their claimed sigmas have an rms near one."""
    pulls = []
    for seed in range(12):
        fit = health("A", calibrated(), calibrated(), seed).fit
        pulls.append(fit.correction_rad / np.sqrt(np.diag(np.linalg.inv(fit.information))))
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 1.4


def test_an_error_of_the_calibration_is_carried_into_the_correction_as_it_arises() -> None:
    """The right principal point 0.3 px lower than calibrated: `from_rig` foretells the fitted correction."""
    used = calibrated()
    K = used.right.K.copy()
    K[1, 2] += 0.3
    true = replace(used, right=replace(used.right, K=frozen(K)))
    one = health("A", true, used, seed=3)
    error = rig_numbers(true) - rig_numbers(used)
    foretold = np.linalg.solve(one.fit.information, one.fit.from_rig @ (error / relative_units(used)))
    assert foretold[0] == pytest.approx(one.fit.correction_rad[0], abs=np.deg2rad(0.003))
    assert abs(foretold[0]) > np.deg2rad(0.01)


def bent(of: StereoRig, k1: float) -> StereoRig:
    """The right lens as it is and not as its file says: some tenths of a pixel within the frame, smoothly over it."""
    distortion = of.right.distortion + np.r_[k1, np.zeros(len(of.right.distortion) - 1)]
    return replace(of, right=replace(of.right, distortion=frozen(distortion)))


@pytest.mark.parametrize("k1", [-0.006, 0.006])
def test_what_unknown_lenses_leave_is_not_put_down_to_a_knock(k1: float) -> None:
    """Six stations agree on a turn that isn't there: a rig file without covariance can't tell it from its lenses."""
    used = replace(rig(), covariance=frozen(np.zeros((14, 14))))
    verdict = judge([health(f"S{i}", bent(used, k1), used, i) for i in range(6)], used)
    assert abs(verdict.area_effect) > 3.0 * worst_area_effect(verdict.correction_rad, verdict.noise, CAMERA)[1]
    assert verdict.state == "undetermined" and abs(verdict.area_effect) < 3.0 * verdict.area_sigma


def test_a_plain_knock_shows_with_unknown_lenses_too() -> None:
    used = replace(rig(), covariance=frozen(np.zeros((14, 14))))
    assert judge([health("S", turned(used, (0.0, 0.2, 0.0)), used, 1)], used).state == "knocked"


def test_an_untouched_rig_is_sound_and_a_visits_stations_are_one_stretch() -> None:
    (verdict,) = judge_visit([health(f"S{i}", calibrated(), calibrated(), i) for i in range(4)], calibrated())
    assert verdict.state == "sound" and verdict.stations == ("S0", "S1", "S2", "S3")
    assert abs(verdict.area_effect) < 0.02


def test_a_knock_on_the_way_parts_the_visit_where_it_happened() -> None:
    knocked = turned(calibrated(), (0.0, 0.15, 0.0))
    rigs = [calibrated(), calibrated(), knocked, knocked, knocked]
    before, after = judge_visit([health(f"S{i}", r, calibrated(), i) for i, r in enumerate(rigs)], calibrated())
    assert before.stations == ("S0", "S1") and before.state == "sound"
    assert after.stations == ("S2", "S3", "S4") and after.state == "knocked"


def test_the_refined_rig_is_sound_and_knows_its_yaw_better_than_the_calibration_did() -> None:
    true = turned(calibrated(), (0.1, 0.5, -0.2))
    verdict = judge([health(f"S{i}", true, calibrated(), i) for i in range(3)], calibrated())
    found = refined_rig(calibrated(), verdict, rectification(calibrated()).camera)
    again = judge([health(f"S{i}", true, found, i) for i in range(3)], found)
    assert verdict.state == "knocked" and again.state == "sound" and abs(again.area_effect) < 0.01
    assert np.all(np.linalg.eigvalsh(found.covariance) > -1e-12)
    off = inverse(found.right_from_left) @ true.right_from_left
    assert np.abs(off[:3, 3]).max() < 0.001


def test_a_refined_rig_without_covariance_is_trusted_to_what_its_matches_leave_open_and_not_to_its_file() -> None:
    bare = replace(calibrated(), covariance=frozen(np.zeros_like(calibrated().covariance)))
    true = turned(bare, (0.0, 0.5, 0.0))
    verdict = judge([health("S1", true, bare, 1)], bare)
    camera = rectification(bare).camera
    yaw = refined_rig(bare, verdict, camera).width.turn_rad[1]
    before = bare.width.turn_rad[1]
    assert np.hypot(yaw, before) == pytest.approx(np.sqrt(verdict.covariance[1, 1])) and yaw > 1.2 * before
    by_rows = refined_rig(bare, levelled(verdict, camera), camera)
    assert by_rows.width.turn_rad[1] == before  # rows say nothing of it


def knock_text(verdict: RigVerdict) -> str:
    return str(words_of(rig_rejection(Reason.RIG_KNOCKED, RIG, verdict)))


def test_a_knock_is_refused_with_its_yaw_its_sigma_what_it_costs_and_what_to_do() -> None:
    true = turned(calibrated(), (0.0, 0.2, 0.0))
    text = knock_text(judge([health("S1", true, calibrated(), 1)], calibrated()))
    assert (
        ("yaw +0.19" in text or "yaw +0.20" in text) and "±" in text and "limit 2 %" in text and "--refine-rig" in text
    )
    assert "an area at 5 m comes out +2" in text or "an area at 5 m comes out +1" in text


def test_a_scene_with_too_few_matches_says_nothing_of_the_rig() -> None:
    pair = pair_of([disc((0.0, 0.0, 4.0))])
    few = PairMatches(left_px=np.zeros((2, 2)), right_px=np.zeros((2, 2)))
    assert station_health(pair, few, calibrated()) is None


def test_matches_on_one_far_plane_leave_the_direction_of_the_baseline_open_and_say_so() -> None:
    used = calibrated()
    rng = np.random.default_rng(0)
    far = np.c_[rng.uniform(-20, 20, 600), rng.uniform(-12, 12, 600), np.full(600, 40.0)]
    matches = seen(far, used, used, seed=1)
    fit = fit_rig(matches.left_px, matches.right_px, rectification(used).camera, used)
    assert fit is not None
    near = health("A", used, used, seed=1).fit
    sigma, sigma_near = (np.sqrt(np.diag(np.linalg.inv(f.information))) for f in (fit, near))
    assert sigma[4] > 5.0 * sigma_near[4] and sigma[3] > 5.0 * sigma_near[3]


def test_photos_worked_on_at_half_their_size_weigh_the_calibration_alike() -> None:
    full = calibrated()
    points = scene(2)
    fits = []
    for used in (full, working_rig(full, 640)):
        camera = rectification(used).camera
        matches = seen(points, full, full, seed=5)
        scale, whole = camera.f_px / CAMERA.f_px, CAMERA
        left, right = (
            (px - [whole.cx_px, whole.cy_px]) * scale + [camera.cx_px, camera.cy_px]
            for px in (matches.left_px, matches.right_px)
        )
        fit = fit_rig(left, right, camera, used)
        assert fit is not None
        fits.append(StationHealth(station="A", fit=fit, camera=camera))
    one, half = (judge([health], full) for health in fits)
    assert np.allclose(one.covariance, half.covariance, rtol=0.02)


CAMERA: RectifiedCamera = rectification(rig()).camera


def test_no_turn_changes_nothing() -> None:
    assert np.abs(area_effects(np.zeros(5), CAMERA)).max() < 1e-12 and row_effect_px(np.zeros(5), CAMERA) < 1e-9
    assert np.allclose(corrected_rig(rig(), CAMERA, np.zeros(5)).right_from_left, rig().right_from_left)
    assert np.allclose(rotation_from_vector(np.zeros(3)), np.eye(3))


def test_a_turn_beyond_all_meaning_is_told_without_its_figures() -> None:
    verdict = judge([health("S1", calibrated(), calibrated(), 1)], calibrated())
    text = knock_text(replace(verdict, area_effect=2.5e9, rows_px=0.3))
    assert "don't belong together" in text and "over 100 %" in text and "250" not in text


@pytest.mark.parametrize("of_boards", [True, False])
def test_a_rig_left_open_is_told_in_a_whole_sentence_with_advice_for_the_rig_that_it_is(of_boards: bool) -> None:
    used = calibrated() if of_boards else replace(calibrated(), covariance=frozen(np.zeros((14, 14))))
    verdict = replace(judge([health("S", used, used, 1)], used), state="undetermined")
    doubt = rig_doubt(verdict, ("S",), used)
    assert doubt is not None
    words = str(words_of(doubt))
    assert re.search(
        r"too (large|small), but they can't tell that closely enough \(± \d+\.\d %, limit 2 %\); trust no area", words
    )
    assert ("another program" in words) == (not of_boards)
