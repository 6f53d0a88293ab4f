"""Colour lowers belief and is no veto: red-brown concrete, grey photos, formwork, and the option that counts any."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.photo.chroma import is_grey
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states.belief import place_log_odds
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.colour import Palette
from asbuilt_bim.register.pose import PlacedStation
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.surface_notes import colour_word
from tests.match.small_site import Box, box, element, looking, measured, model, placement, shifted, station
from tests.notes import codes, the
from tests.progress.test_surface import BACKDROP, DAY, GROUND, WALL

POSE = looking([1.5, -8.0, 1.6], [1.5, 0.0, 1.5])
LEFT, RIGHT = box(-3.2, 0, 0, 2.8, 0.25, 2.8), box(3.4, 0, 0, 2.8, 0.25, 2.8)
SITE = model([element("W", "wall", WALL), element("L", "wall", LEFT), element("R", "wall", RIGHT)])
GREY, RED_BROWN, PLY = (161.0, 167.0, 170.0), (90.0, 110.0, 150.0), (66.0, 128.0, 176.0)  # blue, green, red
COLOURS = {"W": GREY, "L": GREY, "R": GREY}


def seen(
    colours: dict[str, tuple[float, float, float]], before_m: float = 0.0, *, grey_photo: bool = False
) -> PlacedStation:
    """Return a station before the walls of these colours (blue, green, red); wall W stands so far before its design."""
    walls: dict[str, Box] = {"W": box(0, -before_m, 0, 3.0, 0.25, 2.8), "L": LEFT, "R": RIGHT}
    picture: FloatArray = np.full((480, 640, 3), 190.0)
    picture[:, :, 0] += 30.0  # the sky
    faces = []
    for number, name in enumerate(colours):
        frame = next(one for one in SITE.elements if one.global_id == name).faces[0].frame
        assert isinstance(frame, PlaneFrame)
        region = polygon.box(0.0, 0.0, 3.0 if name == "W" else 2.8, 2.8)
        stands = shifted(frame, before_m) if name == "W" else frame
        face = measured(f"A1/{number + 1}", POSE, stands, region)
        faces.append(face)
        (x0, y0), (x1, y1) = face.outline_px[0].min(axis=0), face.outline_px[0].max(axis=0)
        picture[int(y0) - 3 : int(y1) + 4, int(x0) - 3 : int(x1) + 4] = colours[name]
    if grey_photo:
        picture[:] = picture.mean(axis=2, keepdims=True)
    return station("A1", POSE, [*(walls[name] for name in colours), BACKDROP, GROUND], faces, picture=picture)


def visit(placed: PlacedStation, options: ProgressOptions | None = None) -> ProgressReport:
    chosen = options or ProgressOptions()
    matched = match_faces(placement(placed), SITE, MatchOptions())
    surfaces = classify_surface(matched, SITE, EMPTY_HISTORY, chosen)
    return summarise(surfaces, matched, SITE, EMPTY_HISTORY, DAY, options=chosen)


def wall(report: ProgressReport, name: str = "W") -> ElementProgress:
    return next(one for one in report.elements if one.global_id == name)


def test_a_red_brown_wall_alone_at_a_visit_is_as_complete_as_in_a_grey_photo() -> None:
    coloured, grey = (wall(visit(seen({"W": RED_BROWN}, grey_photo=one))) for one in (False, True))
    assert coloured.state == grey.state == "complete"
    assert coloured.completion.coverage == pytest.approx(grey.completion.coverage, abs=0.02)
    assert coloured.as_built_area_m2 == grey.as_built_area_m2 == pytest.approx(8.4)


def test_a_visit_of_red_brown_concrete_learns_that_colour_and_has_nothing_to_say_of_it() -> None:
    report = visit(seen(dict.fromkeys(COLOURS, RED_BROWN)))
    assert {one.state for one in report.elements} == {"complete"}
    assert not any(Reason.OTHER_COLOUR in codes(one.notes) for one in report.elements)


def test_a_red_brown_wall_among_grey_ones_counts_where_it_lies_on_the_design_and_is_named() -> None:
    one = wall(visit(seen(COLOURS | {"W": RED_BROWN})))
    assert one.state == "complete" and one.as_built_area_m2 == pytest.approx(8.4)
    words = note_words(the(one.notes, Reason.OTHER_COLOUR))
    assert "red-brown" in words and "100 %" in words and "was counted" in words


@pytest.mark.parametrize("before_m", [0.021, 0.04])
def test_a_sheet_of_ply_before_the_design_is_not_counted_and_the_note_says_colour_share_and_option(
    before_m: float,
) -> None:
    one = wall(visit(seen(COLOURS | {"W": PLY}, before_m)))
    assert one.state == "unknown" and one.as_built_area_m2 is None and one.completion.coverage < 0.1
    words = note_words(the(one.notes, Reason.OTHER_COLOUR))
    assert "yellow-brown" in words and "100 %" in words and "options.progress.tinted_share" in words
    grey = wall(visit(seen(COLOURS, before_m)))  # concrete 4 cm off its design is concrete
    assert grey.state == "complete" and Reason.OTHER_COLOUR not in codes(grey.notes)


@pytest.mark.parametrize("before_m", [0.0, 0.04])
def test_with_colour_switched_off_an_area_never_stands_beside_no_coverage(before_m: float) -> None:
    one = wall(visit(seen(COLOURS | {"W": PLY}, before_m), ProgressOptions(tinted_share=1.0)))
    assert one.as_built_area_m2 == pytest.approx(8.4) and one.completion.coverage > 0.9
    assert Reason.OTHER_COLOUR not in codes(one.notes)


def test_an_offset_speaks_for_concrete_only_as_far_as_it_is_known() -> None:
    options = ProgressOptions()
    well, badly = place_log_odds(0.0, 0.005, options), place_log_odds(0.0, 0.025, options)
    assert well > 3.0 > badly > 0.0  # against a colour that speaks 20 to 1
    assert place_log_odds(0.021, 0.005, options) < 1.0 and place_log_odds(0.04, 0.005, options) < -1.0


def test_a_tint_as_far_from_the_concrete_as_timber_is_likelier_something_else() -> None:
    palette = Palette(tints=np.zeros((1, 2)), sigma=0.06)
    odds = palette.log_odds(np.array([[0.0, 0.0], [0.0, 0.17], [0.0, 0.19], [0.1, 0.38]]))
    assert odds[0] > 4.0 and odds[1] > 0.0 > odds[2]
    assert odds[3] == pytest.approx(np.log(0.05), abs=0.01)  # never a veto
    assert replace(palette, sigma=0.12).log_odds(np.array([[0.0, 0.19]]))[0] > 0.0


def test_a_photo_is_grey_when_it_has_no_chroma_and_not_when_its_concrete_is_grey() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (80, 120, 1)).astype(np.uint8)
    grey = np.repeat(noise, 3, axis=2)
    stored = cv2.imdecode(cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, 60])[1], cv2.IMREAD_COLOR)
    assert is_grey(grey) and is_grey(np.asarray(stored, dtype=np.uint8))
    warm = np.repeat(noise, 3, axis=2)
    warm[..., 0] = warm[..., 0] * 0.93
    assert not is_grey(warm)


@pytest.mark.parametrize(
    ("tint", "word"),
    [((0.2, 0.26), "red-brown"), ((0.14, 0.52), "yellow-brown"), ((-0.2, 0.3), "green"), ((0.3, -0.01), "red")],
)
def test_a_colour_is_called_what_people_call_it(tint: tuple[float, float], word: str) -> None:
    assert colour_word(*tint) == word
