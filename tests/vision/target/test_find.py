from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.target.circle import fit_circle
from asbuilt_bim.vision.target.ellipse import Ellipse, fit_ellipse, robust_ellipse
from asbuilt_bim.vision.target.find import TargetOptions, find_target
from tests.vision.flat_scene import CAMERA, centre_px, disc, pair_of, rectangle

TOLD = TargetOptions(diameter_m=0.30)


@pytest.mark.parametrize(
    ("place", "yaw", "pitch", "ground"),
    [
        ((0.2, -0.1, 3.0), 0.0, 0.0, 140.0),
        ((-1.0, 0.5, 5.0), 30.0, 10.0, 60.0),
        ((1.2, -0.8, 5.5), -35.0, -20.0, 190.0),
        ((0.0, 0.4, 8.0), 15.0, 0.0, 110.0),
    ],
)
def test_its_depth_is_right_to_half_a_per_cent(
    place: tuple[float, float, float], yaw: float, pitch: float, ground: float
) -> None:
    target = disc(place, yaw_deg=yaw, pitch_deg=pitch)
    sighting, others = find_target(pair_of([target], ground=ground), TOLD)
    assert sighting is not None and others == ()
    assert sighting.depth_m == pytest.approx(place[2], rel=0.005)
    assert abs(sighting.depth_m - place[2]) < 4.0 * sighting.depth_sigma_m
    assert sighting.range_m == pytest.approx(float(np.linalg.norm(place)), rel=0.005)
    assert sighting.diameter_m == pytest.approx(0.30, rel=0.01)
    assert np.abs(sighting.left_px - centre_px(target)).max() < 0.15
    assert sighting.left_px[1] == sighting.right_px[1]
    assert sighting.disparity_px == pytest.approx(sighting.left_px[0] - sighting.right_px[0])


def test_the_centre_is_the_discs_and_not_the_ellipses() -> None:
    target = disc((0.6, 0.3, 2.5), radius_m=0.2, yaw_deg=40.0)
    sighting, _ = find_target(pair_of([target]), TargetOptions())
    assert sighting is not None
    off = np.linalg.norm(np.array(sighting.ellipse_left[:2]) - centre_px(target))
    assert off > 1.0 and np.linalg.norm(sighting.left_px - centre_px(target)) < 0.2


def test_a_disc_with_a_quarter_of_its_width_covered_is_still_measured() -> None:
    sighting, _ = find_target(pair_of([disc((0.3, 0.2, 4.0), yaw_deg=20.0, hidden_share=0.25)]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize(("place", "pitch"), [((0.3, 0.2, 4.0), 0.0), ((0.3, 0.2, 5.0), 50.0)])
def test_a_disc_with_thirty_per_cent_of_its_area_covered_by_a_board_is_measured(
    place: tuple[float, float, float], pitch: float
) -> None:
    """A segment of 30 % of a circle's area is 34.2 % of its width and has 39.6 % of its outline."""
    sighting, _ = find_target(pair_of([disc(place, pitch_deg=pitch, hidden_share=0.342)]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(place[2], rel=0.005)


@pytest.mark.parametrize("hidden_share", [0.40, 0.48])
def test_a_disc_with_far_more_covered_than_thirty_per_cent_is_no_target(hidden_share: float) -> None:
    for place, pitch in (((0.3, 0.2, 5.0), 0.0), ((0.3, 0.2, 7.5), 30.0)):
        assert find_target(pair_of([disc(place, pitch_deg=pitch, hidden_share=hidden_share)]), TOLD)[0] is None


def test_half_a_disc_is_no_target() -> None:
    sighting, (rejection,) = find_target(pair_of([disc((0.3, 0.2, 4.0), hidden_share=0.55)]), TOLD)
    assert sighting is None and rejection.code is Reason.TARGET_ABSENT


def test_a_disc_in_shade_and_before_brick_is_found() -> None:
    wall = rectangle((0.0, 0.0, 5.0), 3.0, 2.0, bgr=(60, 70, 140))
    sighting, _ = find_target(pair_of([wall, disc((0.1, 0.1, 4.0), bgr=(12, 9, 90))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.005)


def test_a_disc_before_something_just_as_red_is_found() -> None:
    barrel = rectangle((0.33, 0.05, 6.0), 0.5, 0.5)
    sighting, _ = find_target(pair_of([barrel, disc((0.1, 0.1, 4.0))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.01)


def test_a_disc_before_a_red_thing_whose_edge_lies_just_beyond_its_own_is_found() -> None:
    barrel = rectangle((-0.03, 0.03, 6.2), 0.3, 0.3)
    sighting, _ = find_target(pair_of([barrel, disc((0.05, 0.08, 5.6), bgr=(20, 15, 140))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(5.6, rel=0.01)


def test_red_things_that_are_no_discs_are_passed_over() -> None:
    things = [
        rectangle((-0.8, 0.2, 4.0), 0.5, 0.8),
        rectangle((0.9, 0.5, 4.5), 0.3, 0.3),
        disc((0.8, -0.5, 5.0), bgr=(0, 140, 250)),  # orange
        disc((-0.3, -0.6, 5.0), bgr=(60, 160, 40)),  # green
    ]
    sighting, (rejection,) = find_target(pair_of(things), TOLD)
    assert sighting is None and rejection.code is Reason.TARGET_ABSENT
    sighting, _ = find_target(pair_of([*things, disc((0.1, 0.1, 5.0))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(5.0, rel=0.005)


def test_no_target_is_a_rejection_only_where_one_is_required() -> None:
    assert find_target(pair_of([]), replace(TOLD, required=False)) == (None, ())
    _, (rejection,) = find_target(pair_of([]), TOLD)
    assert words_of(rejection).what == "station T1, target" and words_of(rejection).remedy


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_target_in_one_photo_only_is_rejected_and_the_photo_named(side: str) -> None:
    sighting, (rejection,) = find_target(pair_of([disc((0.1, 0.1, 4.0))], only=side), TOLD)
    assert sighting is None and (rejection.code, rejection.values["side"]) == (Reason.TARGET_IN_ONE_PHOTO, side)


def test_of_two_discs_of_the_told_diameter_the_nearest_is_taken_and_the_other_named() -> None:
    sighting, (other,) = find_target(pair_of([disc((-0.5, 0.1, 4.0)), disc((0.6, 0.0, 5.0))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.005)
    assert other.code is Reason.DISC_SPARE and other.values["why"] == "further"
    assert other.subject.name == "x 766, y 480 px" and other.values["taken"] == "x 509, y 506 px"
    assert "red disc at x 766, y 480 px: it has the size of the target too, and is further away" in str(words_of(other))


def test_a_pale_disc_nearer_than_the_target_is_its_reflection() -> None:
    pair = pair_of([disc((-0.5, 0.1, 4.0), bgr=(125, 120, 175)), disc((0.6, 0.0, 5.0))])
    sighting, (other,) = find_target(pair, TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(5.0, rel=0.005)
    assert other.values["why"] == "paler"


def test_a_mirrors_picture_of_the_disc_is_further_off_even_where_more_of_it_is_seen() -> None:
    pair = pair_of([disc((-0.5, 0.1, 4.6), hidden_share=0.2, yaw_deg=35.0), disc((0.6, 0.0, 5.0))])
    sighting, (other,) = find_target(pair, TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.6, rel=0.01)
    assert other.values["why"] == "further"


def test_two_discs_are_rejected_with_both_places_where_no_diameter_is_told() -> None:
    pair = pair_of([disc((-0.5, 0.1, 4.0)), disc((0.6, 0.0, 5.0))])
    sighting, (rejection,) = find_target(pair, TargetOptions())
    assert sighting is None and rejection.code is Reason.TARGET_AMBIGUOUS
    assert set(rejection.values["places"]) == {"x 509, y 506 px", "x 766, y 480 px"}  # type: ignore
    assert words_of(rejection).value == "2"


def test_a_bar_across_a_disc_leaves_it_measured_and_a_bar_printed_on_it_does_not() -> None:
    """The bar reaches over the outline, a no-entry sign's bar doesn't."""
    bar = rectangle((0.3, 0.2, 3.95), 0.06, 0.8, bgr=(90, 110, 120))
    sighting, _ = find_target(pair_of([disc((0.3, 0.2, 4.0)), bar]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.01)
    for width_m in (0.2, 0.235):  # a sign's bar ends a fifth of the radius before the rim
        print_on_it = rectangle((0.3, 0.2, 3.999), width_m, 0.055, bgr=(220, 220, 220))
        sighting, _ = find_target(pair_of([disc((0.3, 0.2, 4.0)), print_on_it]), TOLD)
        assert sighting is None


@pytest.mark.parametrize("blur_px", [1.5, 3.0])
def test_a_sign_with_a_narrow_bar_is_no_target_however_blurred(blur_px: float) -> None:
    bar = rectangle((0.3, 0.2, 7.499), 0.22, 0.04, bgr=(220, 220, 220))
    assert find_target(_blurred(pair_of([disc((0.3, 0.2, 7.5)), bar]), blur_px), TOLD)[0] is None


def test_a_narrow_reddish_bar_before_a_blurred_disc_is_not_taken_for_a_print_on_it() -> None:
    bar = rectangle((0.3, 0.2, 5.6), 0.05, 0.8, bgr=(36, 40, 58))
    pair = pair_of([disc((0.3, 0.2, 5.7), bgr=(15, 12, 100)), bar], ground=170.0)
    sighting, _ = find_target(_blurred(pair), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(5.7, rel=0.01)


def test_a_dark_leaning_disc_whose_rim_is_pale_with_blur_has_no_cover() -> None:
    pair = pair_of([disc((0.3, 0.2, 6.2), bgr=(14, 10, 70), yaw_deg=58.0)], ground=215.0)
    sighting, _ = find_target(_blurred(pair), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(6.2, rel=0.01)


@pytest.mark.parametrize("depth_m", [6.0, 7.0])
def test_a_covered_dark_disc_before_something_bright_whose_grey_levels_were_blurred_is_found(depth_m: float) -> None:
    dark = disc((0.3, 0.2, depth_m), yaw_deg=10.0, bgr=(12, 10, 60), hidden_share=0.25)
    sighting, _ = find_target(_blurred(pair_of([dark], ground=225.0), 3.0), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(depth_m, rel=0.005)
    assert sighting.diameter_m == pytest.approx(0.30, rel=0.02)


def test_another_fit_of_the_targets_own_outline_is_not_told_as_a_disc_of_another_size() -> None:
    """Followed as blurred light's, the outline of this one has another size."""
    dark = disc((0.3, 0.2, 7.5), bgr=(10, 8, 45), hidden_share=0.05)
    sighting, said = find_target(_blurred(pair_of([dark], ground=230.0), 3.2), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(7.5, rel=0.005)
    assert said == ()


def _blurred(pair: RectifiedPair, blur_px: float = 2.2) -> RectifiedPair:
    """Blur grey levels."""
    photos = {side: cv2.GaussianBlur(getattr(pair, side), None, blur_px) for side in ("left", "right")}
    return replace(pair, **photos)


def test_the_told_diameter_decides_between_two_discs_and_the_other_is_named() -> None:
    pair = pair_of([disc((-0.5, 0.1, 4.0)), disc((0.6, 0.0, 5.0), radius_m=0.1)])
    sighting, (other,) = find_target(pair, TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.005)
    assert 0.195 < float(str(other.values["diameter_m"])) < 0.205 and "x 766" in other.subject.name
    assert find_target(pair, TargetOptions())[0] is None


def test_a_disc_of_another_size_is_rejected_with_both_diameters() -> None:
    sighting, (rejection,) = find_target(pair_of([disc((0.2, 0.0, 4.0), radius_m=0.2)]), TOLD)
    assert sighting is None and 0.39 < float(str(rejection.values["diameter_m"])) < 0.41
    assert words_of(rejection).limit == "0.3 m ± 6 %"


def test_a_disc_a_little_off_in_size_is_taken_and_the_doubt_about_the_rig_is_said() -> None:
    sighting, (doubt,) = find_target(pair_of([disc((0.2, 0.0, 4.0), radius_m=0.157)]), TOLD)
    assert sighting is not None and doubt.code is Reason.TARGET_SIZE_DOUBTFUL
    assert 0.04 <= float(str(doubt.values["off_share"])) < 0.06
    assert "areas by twice" in words_of(doubt).reason and "calibrate" in words_of(doubt).remedy


def test_rows_that_differ_say_that_the_rig_was_knocked() -> None:
    pair = pair_of([disc((0.1, 0.1, 4.0))])
    _, (rejection,) = find_target(replace(pair, right=np.roll(pair.right, 3, axis=0)), TOLD)
    assert rejection.code is Reason.TARGET_ROWS_APART and words_of(rejection).value == "-3.0 px"


def test_sigma_of_depth_holds_over_noise() -> None:
    """Eight noisy pictures of one disc: the errors' rms over the claimed sigma (without its bias part) is near one."""
    options = replace(TOLD, bias_sigma_px=0.0)
    scores = []
    for seed in range(8):
        sighting, _ = find_target(pair_of([disc((0.31, 0.17, 6.0), yaw_deg=20.0)], seed=seed, noise=5.0), options)
        assert sighting is not None
        scores.append((sighting.depth_m - 6.0) / sighting.depth_sigma_m)
    assert np.sqrt(np.mean(np.square(scores))) < 2.0


def test_a_blurred_pair_claims_less_of_its_distance() -> None:
    sharp = pair_of([disc((0.31, 0.17, 6.0), yaw_deg=20.0)])
    blurred = replace(
        sharp, left=cv2.GaussianBlur(sharp.left, None, 2.2), right=cv2.GaussianBlur(sharp.right, None, 2.2)
    )
    sigmas = []
    for pair in (sharp, blurred):
        sighting, _ = find_target(pair, TOLD)
        assert sighting is not None and abs(sighting.depth_m - 6.0) < 2.0 * sighting.depth_sigma_m
        sigmas.append(sighting.depth_sigma_m / sighting.depth_m * sighting.disparity_px)
    assert 2.0 * sigmas[0] < sigmas[1] < 0.4


ELLIPSE = Ellipse(x_px=300.0, y_px=200.0, major_px=40.0, minor_px=28.0, angle_rad=0.4)


def test_an_ellipse_is_fitted_exactly_to_its_own_points() -> None:
    points, normals = ELLIPSE.outline(60)
    found = fit_ellipse(points)
    assert found is not None
    for name in ("x_px", "y_px", "major_px", "minor_px"):
        assert getattr(found, name) == pytest.approx(getattr(ELLIPSE, name), abs=1e-6)
    assert np.sin(found.angle_rad - ELLIPSE.angle_rad) == pytest.approx(0.0, abs=1e-6)
    assert np.abs(ELLIPSE.distance_px(points + 0.5 * normals) - 0.5).max() < 0.02


def test_an_ellipse_is_found_among_foreign_points() -> None:
    points, _ = ELLIPSE.outline(60)
    stray = np.stack([np.linspace(330, 420, 40), np.linspace(190, 260, 40)], axis=-1)
    found = robust_ellipse(np.concatenate([points[5:], stray]), 0.5)
    assert found is not None and found[0].major_px == pytest.approx(40.0, abs=0.2)
    assert found[1][:55].all() and found[1][55:].sum() < 5


@pytest.mark.parametrize("x_m", [-1.6, 0.4, 1.8])
@pytest.mark.parametrize("lean", [0.7, 0.4, 0.1, -0.2, -0.6])
def test_a_circle_in_space_is_recovered_from_exact_outlines_wherever_it_stands_and_leans(
    x_m: float, lean: float
) -> None:
    centre, radius = np.array([x_m, -0.3, 4.0]), 0.15
    normal = np.array([lean, 0.1, -1.0]) / np.linalg.norm([lean, 0.1, -1.0])
    u = np.cross(normal, [0.0, 1.0, 0.0])
    u /= np.linalg.norm(u)
    turn = np.linspace(0.0, 2 * np.pi, 80, endpoint=False)[:, None]
    rim = centre + radius * (np.cos(turn) * u + np.sin(turn) * np.cross(normal, u))
    left, right = CAMERA.project(rim), CAMERA.project(rim - [CAMERA.baseline_m, 0.0, 0.0])
    ellipses = fit_ellipse(left), fit_ellipse(right)
    assert ellipses[0] is not None and ellipses[1] is not None
    circle = fit_circle(left, right, *ellipses, CAMERA)
    assert circle is not None
    assert np.abs(circle.centre_px - CAMERA.project(centre)).max() < 1e-4
    assert circle.disparity_px == pytest.approx(CAMERA.f_px * CAMERA.baseline_m / 4.0, abs=1e-4)
    assert circle.radius_m == pytest.approx(radius, rel=1e-5)
    assert abs(circle.normal @ normal) == pytest.approx(1.0, abs=1e-4)


def test_a_disc_that_has_grown_together_with_something_as_red_behind_it_is_found() -> None:
    drum = rectangle((0.55, 0.45, 4.6), 0.3, 0.6)
    sighting, _ = find_target(pair_of([drum, disc((0.3, 0.2, 4.0))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(4.0, rel=0.01)


def test_a_disc_is_found_by_one_arc_of_its_outline_where_most_of_that_is_a_red_boxs() -> None:
    box = rectangle((0.66, 0.25, 6.8), 0.48, 0.32)
    sighting, _ = find_target(pair_of([box, disc((0.5, 0.1, 6.0))]), TOLD)
    assert sighting is not None and sighting.depth_m == pytest.approx(6.0, rel=0.005)
