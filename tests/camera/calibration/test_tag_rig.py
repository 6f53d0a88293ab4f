"""A rig from single tags of known size: the same adjustment as boards', and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, PLACES, area_slopes
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.calibration.parameters import layout_of, pack
from asbuilt_bim.camera.calibration.tag_rig import FEWEST_SIGHTINGS, rig_from_tags
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from tests.camera.tag_pictures import RIG, SIZE, TAG, placed, sightings

TRUE = pack(RIG.left, RIG.right, RIG.right_from_left)


def area_pulls(made: Calibration) -> FloatArray:
    """By how many of their sigmas areas over the frame err at 5 m."""
    rig = made.rig
    off = (pack(rig.left, rig.right, rig.right_from_left) - TRUE)[layout_of(TRUE).rig_rows]
    slopes = area_slopes(rig, PLACES, DISTANCE_M)
    pulls: FloatArray = slopes @ off / np.sqrt(np.einsum("ni,ij,nj->n", slopes, rig.covariance, slopes))
    return pulls


def test_tags_all_over_the_frame_give_the_rig_back_and_areas_err_as_their_sigma_says() -> None:
    """By these four draws a sigma 2.1 times too small is found, and one 2.5 times too large."""
    pulls = []
    for seed in range(4):
        scale = 1.0 + np.random.default_rng(seed).normal(0.0, TAG.print_share)
        made = rig_from_tags(sightings(placed(6, 5, seed), seed, 0.08, scale), SIZE, TAG)
        assert made.from_tags and made.rig.left.K[0, 0] == pytest.approx(800.0, rel=0.03)
        assert made.rig.baseline_m == pytest.approx(RIG.baseline_m, rel=0.006)
        pulls.append(area_pulls(made))
    assert 0.1 < np.mean(np.square(pulls)) < 2.6


def test_the_print_s_scale_is_the_rig_s_and_its_sigma_holds_it() -> None:
    tags = placed(6, 5, 3)
    careless = replace(TAG, print_share=0.01)
    sure, unsure = (rig_from_tags(sightings(tags, 3, 0.05, scale=1.01), SIZE, tag) for tag in (TAG, careless))
    assert sure.rig.baseline_m == pytest.approx(RIG.baseline_m / 1.01, rel=0.003)  # larger prints look nearer
    assert np.abs(area_pulls(sure)).max() > 3.0 and np.abs(area_pulls(unsure)).max() < 2.0


def test_a_tag_of_another_size_is_left_out_by_name_and_the_rig_stays() -> None:
    seen = sightings(placed(6, 5, 5), 5)
    small = sightings(placed(6, 5, 5), 5, scale=0.8)
    made = rig_from_tags([small[7], *seen[:7], *seen[8:]], SIZE, TAG)
    assert [one.code for one in made.left_out] == [Reason.TAG_MISFIT]
    assert made.left_out[0].subject.name == seen[7].name
    assert np.abs(area_pulls(made)).max() < 3.5


def test_too_few_tags_are_refused_with_how_many_are_needed() -> None:
    with pytest.raises(CalibrationError, match=f"10 sightings .* in 2 pairs; at least {FEWEST_SIGHTINGS} are needed"):
        rig_from_tags(sightings(placed(2, 5, 1), 1), SIZE, TAG)


def test_far_tags_that_all_face_the_rig_are_refused_with_what_is_missing() -> None:
    far = placed(4, 4, 1, near_m=5.0, far_m=6.0, tilt_deg=3.0)
    with pytest.raises(CalibrationError) as problem:
        rig_from_tags(sightings(far, 1, 0.15), SIZE, TAG)
    said = str(problem.value)
    assert "not enough for a rig" in said and "(limit 3 %)" in said
    assert "nearer and further tags (these are" in said and "tags seen from the side" in said


def test_left_and_right_exchanged_is_refused_by_that_name() -> None:
    exchanged = [replace(one, left_px=one.right_px, right_px=one.left_px) for one in sightings(placed(4, 5, 2), 2)]
    with pytest.raises(CalibrationError, match="left and right are swapped"):
        rig_from_tags(exchanged, SIZE, TAG)


def test_tags_that_say_nothing_at_all_are_refused_and_never_a_traceback() -> None:
    nonsense = [
        replace(one, left_px=frozen(np.full((4, 2), 5.0)), right_px=frozen(np.full((4, 2), 7.0)))
        for one in sightings(placed(4, 5, 2), 2)
    ]
    rng = np.random.default_rng(1)
    noise = [
        replace(one, left_px=frozen(rng.uniform(0, 700, (4, 2))), right_px=frozen(rng.uniform(0, 700, (4, 2))))
        for one in nonsense
    ]
    same = [replace(one, right_px=one.left_px) for one in sightings(placed(4, 5, 2), 2)]
    for seen in (nonsense, noise, same):
        with pytest.raises(CalibrationError, match="calibration: "):
            rig_from_tags(seen, SIZE, TAG)


@pytest.mark.parametrize("size_m", [0.0, 160.0, float("nan")])
def test_a_size_in_another_unit_is_refused(size_m: float) -> None:
    with pytest.raises(CalibrationError, match="give it in metres"):
        Tag(size_m=size_m)
