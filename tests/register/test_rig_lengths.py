"""A rig moved to where a visit's known lengths show it: as far as they know it better, with a sigma that holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, PLACES, area_slopes
from asbuilt_bim.camera.rectify import RectifiedCamera, rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.factory import FACTORY
from asbuilt_bim.camera.rig_numbers import rig_numbers, with_numbers
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.sigma.area import calibration_sigmas_m2
from asbuilt_bim.register.rig_lengths import LengthsFit, is_worth_it, known_rig, rig_by_lengths
from asbuilt_bim.vision.stereo.rig_fit import corrected_rig
from tests.camera.virtual import rig
from tests.register.lengths_seen import DIAMETER_M, visit
from tests.vision.stereo.test_rig_health import calibrated

BOUGHT = replace(rig(), width=FACTORY)
"""Out of a camera's memory: without a covariance."""


def camera(of: StereoRig) -> RectifiedCamera:
    return rectification(of).camera


def standing(of: StereoRig, yaw_deg: float = 0.0, longer: float = 0.0) -> StereoRig:
    """The rig as it really stands: turned in yaw, its baseline longer by a share."""
    turned = corrected_rig(of, camera(of), np.deg2rad([0.0, yaw_deg, 0.0, 0.0, 0.0]))
    stretched = np.array(turned.right_from_left)
    stretched[:3, 3] *= 1.0 + longer
    return replace(turned, right_from_left=frozen(stretched))


def fitted(true: StereoRig, believed: StereoRig, seed: int = 0, **more: object) -> LengthsFit | None:
    evidence, known = visit(true, believed, seed, **more)  # type: ignore[arg-type]
    return rig_by_lengths(believed, believed, evidence, known, camera(believed))


def area_errors(found: StereoRig, true: StereoRig) -> FloatArray:
    """Shares of areas at 5 m over the frame."""
    off = rig_numbers(found) - rig_numbers(replace(true, covariance=found.covariance))
    errors: FloatArray = area_slopes(found, PLACES, DISTANCE_M) @ off
    return errors


def area_pulls(fit: LengthsFit, true: StereoRig) -> FloatArray:
    slopes = area_slopes(fit.rig, PLACES, DISTANCE_M)
    sigmas = np.sqrt(np.einsum("ni,ij,nj->n", slopes, fit.rig.covariance, slopes))
    pulls: FloatArray = area_errors(fit.rig, true) / sigmas
    return pulls


@pytest.mark.parametrize(("yaw_deg", "longer"), [(0.05, 0.0), (0.0, 0.008), (-0.04, 0.005)])
def test_exact_lengths_give_yaw_and_baseline_back(yaw_deg: float, longer: float) -> None:
    fit = fitted(standing(BOUGHT, yaw_deg, longer), BOUGHT, exact=True, noise_px=0.01)
    assert fit is not None and is_worth_it(fit) and not fit.is_other
    assert np.rad2deg(fit.yaw_rad) == pytest.approx(yaw_deg, abs=0.003)
    assert fit.scale == pytest.approx(longer, abs=0.001)


def test_areas_of_bought_rigs_err_as_the_refined_sigma_says() -> None:
    """By these eight draws a sigma 1.5 times too small is found, and one 2.2 times too large."""
    pulls, gained = [], []
    bought = known_rig(BOUGHT, camera(BOUGHT))
    root = np.linalg.cholesky(bought.covariance + 1e-20 * np.eye(len(bought.covariance)))
    for seed in range(8):
        drawn = root @ np.random.default_rng([seed, 5]).normal(size=len(root))
        true = with_numbers(bought, rig_numbers(bought) + drawn)
        fit = fitted(true, BOUGHT, seed, lens_px=FACTORY.lens_px)
        assert fit is not None
        pulls.append(area_pulls(fit, true))
        gained.append(fit.area_sigma / fit.area_sigma_before)
    assert 0.25 < np.mean(np.square(pulls)) < 2.2
    assert max(gained) < 0.5


def test_a_calibrated_rig_that_was_knocked_in_yaw_is_another_and_is_found() -> None:
    true = standing(calibrated(), 0.1)
    fit = fitted(true, calibrated(), 3)
    assert fit is not None and fit.is_other and is_worth_it(fit)
    assert np.rad2deg(fit.yaw_rad) == pytest.approx(0.1, abs=0.02)
    assert np.abs(area_pulls(fit, true)).max() < 3.5


def test_a_well_calibrated_rig_that_stands_as_it_was_is_left_as_it_is() -> None:
    well = replace(calibrated(), covariance=frozen(calibrated().covariance * 0.04))
    fit = fitted(well, well, 4)
    assert fit is not None and not fit.is_other and not is_worth_it(fit)
    assert fit.area_sigma <= fit.area_sigma_before


def test_a_disc_typed_ten_per_cent_too_large_contradicts_the_rest_and_moves_nothing() -> None:
    evidence, known = visit(BOUGHT, BOUGHT, 5)
    wrong = replace(known, diameter_m=1.1 * DIAMETER_M)
    assert rig_by_lengths(BOUGHT, BOUGHT, evidence, wrong, camera(BOUGHT)) is None


def test_a_baseline_in_another_unit_is_no_rig_to_be_refined() -> None:
    assert fitted(standing(BOUGHT, 0.0, 2.28), BOUGHT, 6) is None


def test_too_few_lengths_say_nothing() -> None:
    evidence, known = visit(BOUGHT, BOUGHT, 7, stations=1, markers=2)
    few = replace(known, diameter_m=None, survey=())
    assert rig_by_lengths(BOUGHT, BOUGHT, evidence, few, camera(BOUGHT)) is None
    assert rig_by_lengths(BOUGHT, BOUGHT, [], known, camera(BOUGHT)) is None


def test_a_bought_rig_s_width_as_a_covariance_does_to_areas_what_the_width_did() -> None:
    at = camera(BOUGHT)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for x, y, depth_m in ((0.5, 0.5, 5.0), (0.25, 0.6, 3.0), (0.75, 0.4, 8.0)):
        middle = np.array([x * at.width_px, y * at.height_px])
        ring = middle + 0.5 * at.f_px / depth_m * corners
        outlines = [([ring], np.array([0.0, 0.0, at.baseline_m / depth_m * at.f_px]))]
        sigmas = [calibration_sigmas_m2(outlines, one, at)[0] for one in (BOUGHT, known_rig(BOUGHT, at))]
        assert sigmas[1] == pytest.approx(sigmas[0], rel=0.03)
