from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.scale import KnownLength, doubt_rejection, judge_scale, scale_rejection
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.stereo.rig_rejection import RIG
from tests.camera.virtual import rig

SIZE_M, DIAMETER_M = 0.25, 0.30
PLACES = [(-1.0, 0.2, 5.0), (0.8, 0.1, 4.2), (2.0, -0.3, 6.5)]
ROW = [(-3.0, 0.2, 5.0), (-0.8, 0.1, 5.2), (1.2, -0.3, 5.0), (3.4, 0.0, 5.4)]


def marker(number: int, places: Sequence[tuple[float, float, float]] = PLACES) -> SurveyedMarker:
    half = SIZE_M / 2
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]) + places[number]
    return SurveyedMarker(marker_id=number, corners_m=frozen(corners), sigma_m=0.002)


SURVEY = [marker(number) for number in range(3)]
WIDE = [marker(number, ROW) for number in range(4)]


def evidence(
    scale: float, disc: float = 1.0, seed: int = 0, survey: Sequence[SurveyedMarker] = SURVEY
) -> ScaleEvidence:
    """What a rig sees whose lengths come out `scale` times too large; the disc is `disc` times the given one."""
    rng = np.random.default_rng(seed)
    corners = np.array([m.corners_m for m in survey]) * scale
    return ScaleEvidence(
        target_diameter_m=DIAMETER_M * disc * scale * float(rng.normal(1.0, 0.004)),
        marker_ids=tuple(m.marker_id for m in survey),
        marker_corners_m=frozen(corners * rng.normal(1.0, 0.002, (len(survey), 1, 1))),
        marker_sigma=frozen(np.full(len(survey), 0.003)),
        marker_depth_m=frozen(np.full(len(survey), 0.01)),
    )


def test_a_right_scale_is_left_in_peace() -> None:
    verdict = judge_scale([evidence(1.0, seed=i) for i in range(5)], DIAMETER_M, SIZE_M, SURVEY)
    assert verdict is not None and not verdict.is_wrong and doubt_rejection(RIG, verdict, rig()) is None
    assert {kind.kind for kind in verdict.kinds} == set(KnownLength)


def test_squares_typed_ten_per_cent_too_large_are_refused_with_the_size_that_fits() -> None:
    verdict = judge_scale([evidence(1.1, seed=i) for i in range(5)], DIAMETER_M, SIZE_M, SURVEY)
    assert verdict is not None and verdict.is_wrong
    text = str(words_of(scale_rejection(RIG, verdict, rig(), square_m=0.088)))
    assert "rig.boards.square_m is 0.088 m" in text and "ask for 0.08" in text and "limit 3 %" in text


@pytest.mark.parametrize(("factor", "unit"), [(1 / 0.3048, "feet"), (1 / 0.0254, "inches"), (100.0, "centimetres")])
def test_a_baseline_in_another_unit_is_refused_with_the_unit(factor: float, unit: str) -> None:
    verdict = judge_scale([evidence(factor)], DIAMETER_M, SIZE_M, SURVEY)
    assert verdict is not None and verdict.is_wrong
    refused = scale_rejection(RIG, verdict, rig(), square_m=None)
    assert refused.values["unit"] == unit and f"looks like {unit}" in str(words_of(refused))


def test_a_disc_of_another_size_than_told_is_named_and_doesnt_condemn_the_rig() -> None:
    verdict = judge_scale([evidence(1.0, disc=1.1, seed=i) for i in range(5)], DIAMETER_M, SIZE_M, SURVEY)
    assert verdict is not None and not verdict.is_wrong
    doubt = doubt_rejection(RIG, verdict, rig())
    assert doubt is not None and doubt.code is Reason.LENGTHS_DOUBTFUL
    assert doubt.values["wrong"] == (KnownLength.TARGET_DIAMETER,) and len(doubt.values["kinds"]) == 3  # type: ignore
    assert words_of(doubt).remedy == "the rig is right by the others: measure again and correct target.diameter_m"


def test_one_wrong_row_of_the_survey_doesnt_condemn_the_rig() -> None:
    away = frozen(SURVEY[2].corners_m + np.array([0.0, 0.0, 1.0]))
    wrong = SurveyedMarker(marker_id=2, corners_m=away, sigma_m=0.002)
    verdict = judge_scale([evidence(1.0, seed=i) for i in range(3)], DIAMETER_M, SIZE_M, [*SURVEY[:2], wrong])
    assert verdict is not None and not verdict.is_wrong


def test_nothing_known_says_nothing() -> None:
    empty = ScaleEvidence(
        target_diameter_m=0.0,
        marker_ids=(),
        marker_corners_m=frozen(np.zeros((0, 4, 3))),
        marker_sigma=frozen([]),
        marker_depth_m=frozen([]),
    )
    assert judge_scale([empty], None, SIZE_M, SURVEY) is None


def test_a_disc_told_three_per_cent_too_large_is_warned_of_with_the_limit_that_it_was_held_against() -> None:
    verdict = judge_scale([evidence(1.0, disc=0.966, seed=i) for i in range(5)], DIAMETER_M, SIZE_M, SURVEY)
    assert verdict is not None
    doubt = doubt_rejection(RIG, verdict, rig())
    assert doubt is not None and words_of(doubt).limit == "2.9 %"
    assert "target's diameter -3." in words_of(doubt).reason


def test_squares_typed_a_little_too_large_are_warned_of_with_the_areas_that_they_cost() -> None:
    verdict = judge_scale([evidence(1.0125, seed=i, survey=WIDE) for i in range(5)], DIAMETER_M, SIZE_M, WIDE)
    assert verdict is not None and not verdict.is_wrong
    doubt = doubt_rejection(RIG, verdict, rig(), square_m=0.081)
    assert doubt is not None and doubt.code is Reason.LENGTHS_DOUBTFUL_TOGETHER
    words = words_of(doubt)
    assert words.value.startswith("+1.") and words.limit < "1.00 %"
    assert "together come out 1." in words.reason and "so every area 2." in words.reason
    assert "rig.boards.square_m is 0.081 m, and known lengths ask for 0.0" in words.reason


def test_a_survey_one_per_cent_too_large_is_warned_of_by_its_distances() -> None:
    """Disc and prints are known to 1 % only: that they come out 0.4 % large is no reason to disbelieve the survey."""
    large = [replace(one, corners_m=frozen(1.01 * one.corners_m)) for one in WIDE]
    seen = [evidence(1.0, seed=i, survey=WIDE) for i in range(5)]
    verdict = judge_scale(seen, DIAMETER_M / 1.004, SIZE_M / 1.004, large)
    assert verdict is not None and verdict.agree
    doubt = doubt_rejection(RIG, verdict, rig())
    assert doubt is not None and doubt.code is Reason.LENGTHS_DOUBTFUL_TOGETHER
    assert "the survey's scale" in words_of(doubt).remedy


@pytest.mark.parametrize("survey", [SURVEY, WIDE])
def test_lengths_that_err_by_chance_alone_are_not_warned_of(survey: list[SurveyedMarker]) -> None:
    for visit in range(100):
        seen = [evidence(1.0, seed=100 * visit + i, survey=survey) for i in range(5)]
        verdict = judge_scale(seen, DIAMETER_M, SIZE_M, survey)
        assert verdict is not None and doubt_rejection(RIG, verdict, rig()) is None


def test_what_a_survey_errs_by_doesnt_average_out_over_the_stations() -> None:
    few, many = (judge_scale([evidence(1.0, seed=i) for i in range(n)], None, SIZE_M, SURVEY) for n in (5, 500))
    assert few is not None and many is not None
    surveyed = 0.002 / float(np.linalg.norm(np.subtract(PLACES[2], PLACES[1])))  # of two ends, over two distances
    assert surveyed < many.kinds[-1].sigma < few.kinds[-1].sigma
