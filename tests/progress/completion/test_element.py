from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.completion.element import progress_of
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.states.likelihood import MOST_NATS, least_nats
from asbuilt_bim.progress.surface import SurfaceState, unseen
from tests.match.small_site import box, element
from tests.notes import codes, the
from tests.progress.clear_rows import clearly

WALL = element("W", "wall", box(0, 0, 0, 4.0, 0.25, 3.0))
COLUMN = element("C", "column", box(0, 0, 0, 0.4, 0.4, 3.0))
OPTIONS = ProgressOptions()


def says(
    index: int,
    built: Region = (),
    opened: Region = (),
    of: object = WALL,
    *,
    measured: bool = True,
    nats: float = MOST_NATS,
) -> SurfaceState:
    face = of.faces[index]  # type: ignore[attr-defined]
    return replace(
        unseen(face), built_uv_m=built, open_uv_m=opened, built_area_m2=polygon.area(built),
        open_area_m2=polygon.area(opened), outline_uv_m=built if measured else (), stations={"A1": 1.0},
        row_log_odds=clearly(of, index, built, opened, nats),
    )  # fmt: skip


def progress(*states: SurfaceState, of: object = WALL) -> ElementProgress:
    told = {state.face_id: state for state in states}
    surfaces = [told.get(face.face_id, unseen(face)) for face in of.faces]  # type: ignore[attr-defined]
    return progress_of(of, surfaces, date(2026, 3, 2), EMPTY_HISTORY, OPTIONS)  # type: ignore[arg-type]


def test_a_wall_photographed_from_one_side_is_known_whole() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 4, 3)))
    assert one.completion.coverage == 1.0 and one.state == "complete"
    assert one.surface_coverage == pytest.approx(12 / 25.5, rel=0.01)


def test_front_and_back_are_one_concrete_and_not_counted_twice() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 4, 1.5), opened=polygon.box(0, 1.5, 4, 3)))
    two = progress(
        says(0, built=polygon.box(0, 0, 4, 1.5), opened=polygon.box(0, 1.5, 4, 3)),
        says(2, built=polygon.box(0, 0, 4, 1.5), opened=polygon.box(0, 1.5, 4, 3)),
    )
    assert one.completion.best == two.completion.best == pytest.approx(0.5)
    assert one.cells_built == two.cells_built


def test_built_from_one_side_and_open_from_the_other_is_a_conflict_and_undecided() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 4, 3)), says(2, opened=polygon.box(0, 0, 4, 3)))
    assert one.cells_conflict == one.cells_conflict + one.cells_built + one.cells_open > 0
    assert one.completion.best is None and one.completion.upper == 1.0 and one.completion.lower == 0.0
    note = the(one.notes, Reason.PHOTOS_DISAGREE)
    assert note.values["cells"] == one.cells_conflict and note.subject.name == one.global_id
    assert (note.values["low_m"], note.values["high_m"]) == (pytest.approx(0.0), pytest.approx(3.0))


def test_where_photos_disagree_is_told_by_the_height_over_the_foot() -> None:
    strip, rest = polygon.box(0, 0, 0.4, 1.6), polygon.box(0, 1.6, 0.4, 3.0)
    one = progress(
        says(0, built=polygon.box(0, 0, 0.4, 1.9), opened=polygon.box(0, 1.9, 0.4, 3.0), of=COLUMN),
        says(1, built=strip, opened=rest, of=COLUMN),
        of=COLUMN,
    )
    note = the(one.notes, Reason.PHOTOS_DISAGREE)
    assert (note.values["low_m"], note.values["high_m"]) == (pytest.approx(1.6), pytest.approx(1.9))


def test_an_element_whose_sides_contradict_one_another_nearly_everywhere_is_decided_nowhere() -> None:
    """A column that stands beside its design is built there on the one side, and open on the other."""
    one = progress(
        says(0, built=polygon.box(0, 0, 0.4, 3.0), of=COLUMN), says(1, opened=polygon.box(0, 0, 0.4, 3.0), of=COLUMN),
        of=COLUMN,
    )  # fmt: skip
    assert one.state == "unknown" and (one.completion.lower, one.completion.upper) == (0.0, 1.0)
    assert codes(one.notes) == [Reason.CONTRADICTS_ITSELF, Reason.PHOTOS_DISAGREE]
    assert (one.cells_built, one.cells_open, one.cells_unknown) == (0.0, 0.0, 0.0)


def test_a_contradiction_in_a_smaller_part_leaves_the_rest_decided() -> None:
    low, rest = polygon.box(0, 0, 0.4, 1.0), polygon.box(0, 1.0, 0.4, 3.0)
    front = says(0, built=low, opened=rest, of=COLUMN, measured=False)
    one = progress(front, says(1, opened=polygon.box(0, 0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.cells_open >= 20.0 and one.completion.lower == 0.0 and one.completion.upper < 0.5
    assert Reason.CONTRADICTS_ITSELF not in codes(one.notes)


def test_a_column_of_which_only_the_foot_was_seen_is_not_called_complete() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 0.4, 1.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown"
    assert one.completion.best == 1.0 and one.completion.lower == pytest.approx(1 / 3, abs=0.04)
    assert the(one.notes, Reason.TOP_NOT_SEEN).values["coverage"] == one.completion.coverage


def test_nobody_is_paid_what_lies_past_what_was_seen_however_likely_it_is() -> None:
    nearly = progress(says(0, built=polygon.box(0, 0, 4, 2.75))).completion
    assert nearly.best == 1.0 and nearly.lower == pytest.approx(2.75 / 3.0, abs=0.01) and nearly.upper == 1.0
    beside = progress(says(0, built=polygon.box(0, 0, 2, 3))).completion
    assert beside.lower == pytest.approx(0.5, abs=0.01)
    over = progress(says(0, opened=polygon.box(0, 0.25, 4, 3))).completion
    assert over.best == 0.0 and over.upper == pytest.approx(0.25 / 3.0, abs=0.01)


def test_a_column_whose_top_was_seen_built_is_complete_since_concrete_stands_on_concrete() -> None:
    one = progress(says(0, built=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.state == "complete" and one.completion.lower == 1.0
    assert one.completion.coverage == pytest.approx(1 / 3, abs=0.02)
    assert the(one.notes, Reason.SEEN_TO_TOP).values["coverage"] == one.completion.coverage


def test_a_top_that_something_else_may_be_since_no_measured_face_fits_it_leaves_a_column_unknown() -> None:
    top = polygon.box(0, 2.0, 0.4, 3.0)
    one = progress(says(0, built=top, of=COLUMN, measured=False, nats=least_nats()), of=COLUMN)
    assert one.state == "unknown" and codes(one.notes) == [Reason.LEVEL_UNCLEAR]
    assert progress(says(0, built=top, of=COLUMN, measured=False), of=COLUMN).state == "complete"  # it is plain
    two = [says(i, built=polygon.box(0, 0.0, 0.4, 3.0), of=COLUMN, measured=False) for i in (0, 1)]
    assert progress(*two, of=COLUMN).state == "complete"


def test_a_column_of_which_only_the_top_is_seen_open_is_not_called_not_started() -> None:
    one = progress(says(0, opened=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown" and one.completion.upper == pytest.approx(2 / 3, abs=0.04)
    assert codes(one.notes) == [Reason.FOOT_NOT_SEEN]


def test_the_bounds_hold_a_pour_line_and_are_the_tighter_the_more_shows_it() -> None:
    for height in np.arange(1.02, 1.5, 0.03):
        widths = []
        for of, width, sides in ((COLUMN, 0.4, (0,)), (COLUMN, 0.4, (0, 1)), (WALL, 4.0, (0,))):
            built, opened = polygon.box(0, 0, width, height), polygon.box(0, height, width, 3.0)
            completion = progress(*(says(i, built=built, opened=opened, of=of) for i in sides), of=of).completion
            assert completion.lower <= height / 3.0 <= completion.upper
            assert completion.best == pytest.approx(height / 3.0, abs=0.03)
            widths.append(completion.upper - completion.lower)
        assert widths[0] >= widths[1] - 1e-9 and widths[1] >= widths[2] - 1e-9 and widths[0] > widths[2] < 0.04


def test_the_bounds_of_what_was_seen_whole_are_tight() -> None:
    for states, share in (
        (says(0, built=polygon.box(0, 0, 4, 3)), 1.0),
        (says(0, opened=polygon.box(0, 0, 4, 3)), 0.0),
    ):
        completion = progress(states).completion
        assert completion.lower == completion.upper == share


def test_a_cell_half_seen_built_under_an_unseen_one_counts_by_what_was_seen_of_it() -> None:
    seen_m = 1.65  # of a cell from 1.5 to 1.75 m three rows of samples
    completion = progress(says(0, built=polygon.box(0, 0, 4, seen_m))).completion
    assert completion.lower == pytest.approx(seen_m / 3.0) and completion.upper == 1.0


def test_an_open_cell_under_a_built_one_may_be_a_mistake_and_stays_possible_in_the_upper_bound() -> None:
    hole = polygon.box(1.0, 1.0, 1.5, 1.5)
    completion = progress(says(0, built=polygon.difference(polygon.box(0, 0, 4, 3), hole), opened=hole)).completion
    assert completion.best == completion.lower == pytest.approx(1.0 - 4 / (16 * 12))
    assert completion.upper == 1.0


def test_what_hangs_over_open_cells_is_not_built_and_what_stands_over_a_few_is() -> None:
    hanging = progress(says(0, built=polygon.box(0, 2, 1, 3), opened=polygon.box(0, 0, 1, 2)))
    assert hanging.cells_built == 0.0 and hanging.completion.lower == 0.0
    standing = progress(says(0, built=polygon.box(0, 1, 1, 3), opened=polygon.box(0, 0.5, 1, 1)))
    assert standing.cells_built > 0.0


def test_a_kicker_alone_has_not_started_a_column_and_a_third_of_it_on_two_sides_has() -> None:
    for height, sides, state in ((0.1, (0,), "not started"), (0.15, (0, 1), "not started"), (1.0, (0, 1), "part")):
        built, opened = polygon.box(0, 0, 0.4, height), polygon.box(0, height, 0.4, 3.0)
        shown = [says(i, built=built, opened=opened, of=COLUMN) for i in sides]
        assert progress(*shown, of=COLUMN).state == state


def test_what_shows_built_no_higher_than_starter_bars_may_be_bars() -> None:
    built, opened = polygon.box(0, 0, 0.4, 0.6), polygon.box(0, 0.6, 0.4, 3.0)
    one = progress(says(0, built=built, opened=opened, of=COLUMN, measured=False), of=COLUMN)
    assert one.completion.lower == 0.0 and one.state != "part"


def test_a_column_open_down_to_its_starter_bars_is_not_started_and_one_open_in_its_upper_half_is_not_known() -> None:
    bars = progress(says(0, opened=polygon.box(0, 0.9, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert bars.state == "not started" and bars.completion.upper == pytest.approx(0.3, abs=0.04)
    upper = progress(says(0, opened=polygon.box(0, 1.4, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert upper.completion.coverage > 0.5 and upper.state == "unknown"
    assert codes(upper.notes) == [Reason.FOOT_NOT_SEEN]


def test_a_foot_seen_open_says_that_nothing_stands_there_seen_or_not() -> None:
    upper, foot = polygon.box(0, 2.0, 4, 3), polygon.box(0, 0, 2, 0.5)
    assert progress(says(0, opened=upper)).state == "unknown"
    one = progress(says(0, opened=polygon.union([upper, foot])))
    assert one.state == "not started" and one.completion.upper < 0.35


def test_a_quarter_of_a_side_decides_a_cell_only_where_nothing_contradicts() -> None:
    strip, rest = polygon.box(0, 0, 0.15, 3), polygon.box(0.25, 0, 0.4, 3)
    assert progress(says(0, built=strip, of=COLUMN), of=COLUMN).state == "complete"  # a prop hides the rest of it
    torn = progress(says(0, built=strip, opened=rest, of=COLUMN), of=COLUMN)
    assert torn.state in ("unknown", "not started") and torn.completion.lower == 0.0
    assert progress(says(0, built=polygon.box(0, 0, 0.05, 3), of=COLUMN), of=COLUMN).completion.coverage == 0.0


def test_a_few_stray_samples_decide_no_cell() -> None:
    one = progress(says(0, built=polygon.box(1.0, 1.0, 1.08, 1.08)))
    assert one.cells_built == 0.0 and one.state == "unknown"


def test_under_ten_percent_coverage_there_is_no_best_value() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 0.25, 3.0)))
    assert 0.0 < one.completion.coverage < 0.10
    assert one.completion.best is None and one.completion.lower > 0.0 and one.state == "unknown"


def test_areas_add_up_with_the_calibration_in_common() -> None:
    measured = dict(as_built_area_m2=2.0, as_built_sigma_calibration_m2=0.03, as_built_sigma_image_m2=0.04)
    states = [replace(says(i, built=polygon.box(0, 0, 1, 1)), **measured) for i in (0, 2)]  # type: ignore[arg-type]
    one = progress(*states)
    assert one.as_built_area_m2 == 4.0
    assert one.as_built_sigma_m2 == pytest.approx(np.hypot(0.06, 0.04 * np.sqrt(2)))


@given(built=st.floats(0, 3), seen=st.floats(0, 3), measured=st.booleans(), sides=st.sets(st.sampled_from([0, 1, 2])))
def test_best_lies_within_its_bounds_and_nothing_seen_is_never_nought_percent(
    built: float, seen: float, measured: bool, sides: set[int]
) -> None:
    low, high = (polygon.box(0, a, 0.4, b) if b > a else () for a, b in ((0.0, min(built, seen)), (built, seen)))
    shown = [says(i, built=low, opened=high, of=COLUMN, measured=measured) for i in sorted(sides)]
    completion = progress(*shown, of=COLUMN).completion
    assert 0.0 <= completion.lower <= completion.upper <= 1.0
    if completion.best is not None:
        assert completion.lower - 1e-9 <= completion.best <= completion.upper + 1e-9
        assert completion.coverage >= OPTIONS.known_from
    else:
        assert completion.coverage < OPTIONS.known_from


def test_what_is_complete_has_something_that_is_certain() -> None:
    for width, low in ((w, z) for w in np.arange(0.1, 0.45, 0.05) for z in np.arange(0.0, 2.8, 0.1)):
        strip = polygon.box(0, low, width, 3.0)
        one = progress(*(says(i, built=strip, of=COLUMN, measured=False) for i in (0, 1, 2)), of=COLUMN)
        assert one.state != "complete" or one.completion.lower > 0.0


def test_a_part_has_a_best_estimate_that_is_one() -> None:
    """Where a cage may be what shows, the middle of all levels is none at all."""
    for height in np.arange(0.4, 1.6, 0.05):
        shown = says(0, built=polygon.box(0, 0, 0.4, height), opened=polygon.box(0, height, 0.4, 3.0), of=COLUMN)
        one = progress(shown, of=COLUMN)
        assert one.state != "part" or (one.completion.best or 0.0) > OPTIONS.kicker_m / 3.0


def test_an_element_that_stands_within_others_has_nothing_to_show_and_is_unknown() -> None:
    within = element("N", "wall", box(0, 0, 0, 4.0, 0.25, 3.0), {side: () for side in range(4)})
    one = progress(of=within)
    assert one.state == "unknown" and (one.completion.lower, one.completion.upper) == (0.0, 1.0)
