from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.area_effect import AreaEffect, area_effect
from asbuilt_bim.camera.calibration.calibrate import Calibration, calibrate_stereo
from asbuilt_bim.camera.calibration.check_length import LengthCheck
from asbuilt_bim.camera.calibration.checks import warning
from asbuilt_bim.camera.calibration.control_rig import rig_from_control_points
from asbuilt_bim.camera.calibration.photo_advice import PhotoAdvice
from asbuilt_bim.codes import Reason
from asbuilt_bim.report.page.calibration import calibration_html, unfit_words, verdict
from asbuilt_bim.report.wording.of_page.calibration_sources import SOURCE_WORDS, advice_words, place_words
from tests.camera.board_pictures import CHESS, pairs
from tests.camera.calibration.test_control_rig import control
from tests.camera.virtual import SIZE

CHECK = LengthCheck(what="the <tape>", known_m=1.2, measured_m=1.2024, sigma_m=0.0012)


@pytest.fixture(scope="module")
def made() -> Calibration:
    return calibrate_stereo(pairs(CHESS, 8), CHESS)


def effect(sigma: float) -> AreaEffect:
    return AreaEffect(
        sigma=0.5 * sigma, worst=sigma, worst_place=(0.8, 0.25), maps=np.full((3, 6, 8), sigma),
        parts=(("baseline", sigma),), sources=(("print", sigma),),
    )  # fmt: skip


def test_the_page_holds_every_view_every_figure_and_asks_for_nothing(made: Calibration) -> None:
    html = calibration_html(made, (CHECK,))
    for view in made.views:
        assert view.name in html and f"{view.rms_left_px:.3f} px" in html
    for figure in (
        f"{made.rig.baseline_m * 1000:.2f} mm",
        f"{made.checks.hold_out_rms_px:.3f} px",
        "+0.20 %",
        "1.2024",
    ):
        assert figure in html
    assert not re.search(r"(src|href)\s*=|url\(|<script", html)
    assert html.count("<svg") == 2 + 3 and html.count("<line") > 500


def test_names_are_escaped_and_tags_close(made: Calibration) -> None:
    hostile = '<img src=x onerror="x">&'
    named = replace(made, views=(replace(made.views[0], name=hostile), *made.views[1:]))
    html = calibration_html(named, (CHECK,))
    assert "<img" not in html and "&lt;img" in html and "the &lt;tape&gt;" in html
    open_tags: list[str] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: object) -> None:
            if tag not in ("meta", "line", "rect"):
                open_tags.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert open_tags.pop() == tag

        def handle_startendtag(self, tag: str, attrs: object) -> None:
            pass

    Reader().feed(html)
    assert not open_tags


def test_a_run_with_a_rig_that_is_not_to_measure_with_is_told_so(made: Calibration) -> None:
    """Boards that the project names gave it to the run without that word."""
    assert unfit_words(made, effect(0.02)) == ""
    said = unfit_words(made, effect(0.05))
    assert said.startswith("the rig isn't fit to measure with: every area carries this.")
    assert "5.0 % at its worst place (limit 3 %)" in said.replace("±", "") and "Take more pairs" in said
    assert "isn't known" in unfit_words(made, None)


def test_the_verdict_follows_the_area_the_warnings_and_the_known_length(made: Calibration) -> None:
    clean = replace(made, checks=replace(made.checks, warnings=()))
    careful = replace(
        made, checks=replace(made.checks, warnings=(warning(Reason.CALIBRATION_COVERAGE, {"share": 0.4}),))
    )
    assert verdict(clean, effect(0.002), (CHECK,)).grade == "good"
    judged = verdict(careful, effect(0.002), (CHECK,))
    assert judged.grade == "usable" and judged.reasons == ("the boards cover only 40 % of the frame",)
    assert judged.sentence == (
        "Usable with care. Calibration adds ±0.10 % to an area at 5 m in the middle of the frame, "
        "±0.20 % at its worst place."
    )
    assert verdict(clean, effect(0.02), (CHECK,)).grade == "usable"
    bad = verdict(clean, effect(0.05), (CHECK,))
    assert bad.grade == "doubtful" and "5.0 %" in bad.sentence
    assert verdict(clean, None, (CHECK,)).grade == "doubtful"
    unsure = verdict(clean, effect(0.002), (replace(CHECK, measured_m=1.0116 * CHECK.known_m),))
    assert unsure.grade == "usable" and "came out right" not in unsure.sentence
    assert "1.16 % off, and marked too unsurely" in unsure.reasons[0]
    unchecked = verdict(clean, effect(0.002), ())
    assert "known length" in unchecked.reasons[0] and "length came out right" not in unchecked.sentence


def test_the_page_draws_sigma_over_the_frame_names_what_counts_most_and_says_which_photos_help(
    made: Calibration,
) -> None:
    found = area_effect(made.rig, made.by_source)
    assert found is not None
    assert found.worst**2 == pytest.approx(sum(sigma**2 for _, sigma in found.sources), rel=1e-6)
    html = calibration_html(made)
    assert f">{100 * found.maps[1, 3, 4]:.2f}</text>" in html, "a cell of the map at 5 m"
    most = max(found.sources, key=lambda one: one[1])[0]
    assert f"of the variance, comes from {SOURCE_WORDS[most][:20]}" in html.replace("&#39;", "'")
    assert made.advice and all(advice_words(one) in html for one in made.advice)
    # one more photo of the same sort doesn't make a rig worse
    assert [one.worst for one in made.advice] == sorted((one.worst for one in made.advice), reverse=True)


def test_places_and_tilts_are_said_in_words() -> None:
    assert place_words((0.5, 0.5)) == "in the middle of the left photo"
    assert place_words((0.8, 0.25)) == "at the upper right of the left photo"
    assert place_words((0.2, 0.5)) == "at the left side of the left photo"
    one = PhotoAdvice(place=(0.5, 0.75), distance_m=1.3, tilt_rad=(0.0, np.deg2rad(-35.0)), worst=0.01)
    assert (
        advice_words(one) == "the board 1.3 m away, at the lower side of the left photo, its right side tilted 35° away"
    )


def test_a_page_of_control_points_speaks_of_points_not_of_boards() -> None:
    html = calibration_html(rig_from_control_points(control(24, 0.3), SIZE))
    assert "of 24 and 24 points" in html and "in points kept back" in html and "points measured in another unit" in html
    assert "board of another size" not in html and "diagonals" not in html and "model of lens explains" not in html
