"""Pairs of board photos that don't belong together are told so, with those that do."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from asbuilt_bim.camera.calibration.calibrate import calibrate_stereo
from asbuilt_bim.camera.photo.read import Photo
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.report.wording.reasons import words_of
from tests.camera.board_pictures import CHESS, pairs

Pairs = list[tuple[Photo, Photo]]


def shifted(taken: Pairs) -> Pairs:
    return [(left, taken[(row + 1) % len(taken)][1]) for row, (left, _) in enumerate(taken)]


def two_and_two(taken: Pairs) -> Pairs:
    return [(left, taken[row ^ 1][1]) for row, (left, _) in enumerate(taken)]


def half_of_them(taken: Pairs) -> Pairs:
    return two_and_two(taken)[:4] + taken[4:]


@pytest.mark.parametrize("mixed", [shifted, two_and_two, half_of_them])
def test_pairs_that_were_shifted_or_mixed_are_told_so_with_the_photos_that_belong_together(mixed: object) -> None:
    assert callable(mixed)
    with pytest.raises(CalibrationError, match="not of the same moment") as refused:
        calibrate_stereo(mixed(list(pairs(CHESS, 8))), CHESS)
    told = re.findall(r"left_(\d+)\.jpg with right_(\d+)\.jpg", str(refused.value))
    assert len(told) == 3 and all(left == right for left, right in told)


def test_left_photos_that_no_right_one_belongs_to_are_said_to_be_of_other_moments() -> None:
    taken = list(pairs(CHESS, 16))
    with pytest.raises(CalibrationError, match=r"place differs by [\d.]+ m from pair to pair \(limit 0.05 m\)"):
        calibrate_stereo([(taken[row][0], taken[row + 8][1]) for row in range(8)], CHESS)


def test_a_rig_whose_pairs_are_half_exchanged_is_told_which() -> None:
    taken = [(left, right) if row % 2 else (right, left) for row, (left, right) in enumerate(_without_serials(8))]
    with pytest.raises(CalibrationError, match=r"exchanged in 4 of 8 pairs: right_01\.jpg \+ left_01\.jpg, "):
        calibrate_stereo(taken, CHESS)


def test_two_pairs_mixed_up_are_left_out_with_their_partners_and_an_exchanged_one_by_its_fault() -> None:
    taken = _without_serials(10)
    taken[1], taken[2] = (taken[1][0], taken[2][1]), (taken[2][0], taken[1][1])
    taken[6] = taken[6][1], taken[6][0]
    left_out = calibrate_stereo(taken, CHESS).left_out
    assert {one.code for one in left_out} == {Reason.BOARD_PAIR_MIXED, Reason.BOARD_PAIR_EXCHANGED}
    words = [str(words_of(one)) for one in left_out]
    assert "by the board left_02.jpg goes with right_02.jpg" in words[0] and "exchange the two photos" in words[2]


def _without_serials(count: int) -> Pairs:
    def bare(photo: Photo) -> Photo:
        return replace(photo, exif=replace(photo.exif, serial=""))

    return [(bare(left), bare(right)) for left, right in pairs(CHESS, count)]
