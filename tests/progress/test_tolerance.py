"""In, out or undecided: by two sigma, apart from built, and never in on what is not known."""

from __future__ import annotations

from dataclasses import replace

import pytest

from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.tolerance import EN_13670_1, PlumbLimit, Tolerance, checked
from tests.report.sample_report import sample_report

HEIGHT_M = 3.0
OFFSET = Tolerance(name="own", offset_m=0.020)
PLUMB = Tolerance(name="own", offset_m=None, plumb=(PlumbLimit(least_m=0.015),))


def face(offset_m: float | None = None, sigma_m: float | None = None, tilt: float | None = None,
         tilt_sigma: float | None = None) -> SurfaceState:  # fmt: skip
    empty = sample_report().faces[0].surface
    return replace(empty, offset_m=offset_m, offset_sigma_m=sigma_m, tilt_rad=tilt, tilt_sigma_rad=tilt_sigma)


@pytest.mark.parametrize(
    ("offset_m", "sigma_m", "verdict"),
    [
        (0.010, 0.004, "in"), (-0.010, 0.004, "in"), (0.010, 0.006, "undecided"), (0.029, 0.006, "undecided"),
        (0.035, 0.006, "out"), (-0.035, 0.006, "out"), (0.010, None, "undecided"), (None, None, "undecided"),
    ],
)  # fmt: skip
def test_a_face_is_in_or_out_only_by_two_sigma(offset_m: float | None, sigma_m: float | None, verdict: str) -> None:
    assert checked(OFFSET, [face(offset_m, sigma_m)], HEIGHT_M).verdict == verdict


def test_one_face_that_is_out_is_enough_and_one_that_is_not_certain_keeps_all_from_being_in() -> None:
    good, bad, vague = face(0.001, 0.002), face(0.050, 0.002), face(0.001, 0.030)
    assert checked(OFFSET, [good, vague, bad], HEIGHT_M).verdict == "out"
    assert checked(OFFSET, [good, vague], HEIGHT_M).verdict == "undecided"
    assert checked(OFFSET, [good, good], HEIGHT_M).verdict == "in"
    assert checked(OFFSET, [], HEIGHT_M).verdict == "undecided"


def test_plumb_is_the_lean_over_the_elements_height() -> None:
    small = checked(PLUMB, [face(tilt=0.004, tilt_sigma=0.0004)], 3.0)
    assert small.verdict == "in" and small.lean_m == pytest.approx(0.012, abs=1e-5)
    assert small.lean_sigma_m == pytest.approx(0.0012) and small.offset is None
    assert checked(PLUMB, [face(tilt=-0.004, tilt_sigma=0.0004)], 6.0).verdict == "out"


def test_the_standards_limit_grows_with_the_height_and_changes_above_ten_metres() -> None:
    assert EN_13670_1.plumb_limit_m(3.0) == 0.015
    assert EN_13670_1.plumb_limit_m(8.0) == pytest.approx(0.020)
    assert EN_13670_1.plumb_limit_m(12.0) == 0.025
    assert EN_13670_1.plumb_limit_m(18.0) == pytest.approx(0.030)


def test_both_have_to_be_in_and_either_one_is_enough_to_be_out() -> None:
    both = Tolerance(name="own", offset_m=0.020, plumb=(PlumbLimit(least_m=0.015),))
    assert checked(both, [face(0.001, 0.002, 0.001, 0.0002)], HEIGHT_M).verdict == "in"
    assert checked(both, [face(0.001, 0.002)], HEIGHT_M).verdict == "undecided"
    assert checked(both, [face(0.001, 0.002, 0.010, 0.0002)], HEIGHT_M).verdict == "out"


def test_what_stands_beside_its_design_is_never_in_place_however_well_it_stands_there() -> None:
    where_it_stands = [face(0.001, 0.001)]
    assert checked(OFFSET, where_it_stands, HEIGHT_M, moved_m=0.150).verdict == "out"
    assert (
        checked(Tolerance(name="wide", offset_m=0.3), where_it_stands, HEIGHT_M, moved_m=0.150).verdict == "undecided"
    )
