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
from asbuilt_bim.progress.completion.element import completion_of, progress_of
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.surface import SurfaceState, unseen
from tests.match.small_site import box, element
from tests.notes import codes, the

WALL = element("W", "wall", box(0, 0, 0, 4.0, 0.25, 3.0))
COLUMN = element("C", "column", box(0, 0, 0, 0.4, 0.4, 3.0))
OPTIONS = ProgressOptions()


def says(index: int, built: Region = (), opened: Region = (), of: object = WALL) -> SurfaceState:
    face = of.faces[index]  # type: ignore[attr-defined]
    return replace(
        unseen(face), built_uv_m=built, open_uv_m=opened, built_area_m2=polygon.area(built),
        open_area_m2=polygon.area(opened), stations={"A1": 1.0},
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
    one = progress(
        says(0, built=polygon.box(0, 0, 4, 3)),
        says(2, built=polygon.box(0, 0, 4, 1.0), opened=polygon.box(0, 1.0, 4, 1.5)),
    )
    note = the(one.notes, Reason.PHOTOS_DISAGREE)
    assert (note.values["low_m"], note.values["high_m"]) == (pytest.approx(1.0), pytest.approx(1.5))


def test_an_element_whose_sides_contradict_one_another_nearly_everywhere_is_decided_nowhere() -> None:
    """A column that stands beside its design is built there on the one side, and open on the other."""
    front = says(0, built=polygon.box(0, 0, 0.4, 2.0), opened=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN)
    one = progress(front, says(1, opened=polygon.box(0, 0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown" and (one.completion.lower, one.completion.upper) == (0.0, 1.0)
    assert codes(one.notes) == [Reason.CONTRADICTS_ITSELF, Reason.PHOTOS_DISAGREE]
    assert (one.cells_built, one.cells_open, one.cells_unknown) == (0.0, 0.0, 0.0)


def test_a_contradiction_in_a_smaller_part_leaves_the_rest_decided() -> None:
    front = says(0, built=polygon.box(0, 0, 0.4, 1.0), opened=polygon.box(0, 1.0, 0.4, 3.0), of=COLUMN)
    one = progress(front, says(1, opened=polygon.box(0, 0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert 0.0 < one.cells_conflict < one.cells_open and one.completion.upper < 0.5
    assert Reason.CONTRADICTS_ITSELF not in codes(one.notes)


def test_a_column_of_which_only_the_foot_was_seen_is_not_called_complete() -> None:
    one = progress(says(0, built=polygon.box(0, 0, 0.4, 1.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown"
    assert one.completion.best == 1.0 and one.completion.lower == pytest.approx(1 / 3, abs=0.04)
    assert the(one.notes, Reason.TOP_NOT_SEEN).values["coverage"] == one.completion.coverage


def test_a_column_whose_top_was_seen_built_is_complete() -> None:
    top = replace(says(0, built=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN), as_built_area_m2=0.4)
    one = progress(top, of=COLUMN)
    assert one.state == "complete" and one.completion.lower == pytest.approx(1 / 3, abs=0.02)


def test_a_top_that_something_else_may_be_since_no_measured_face_fits_it_leaves_a_column_unknown() -> None:
    one = progress(says(0, built=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown" and codes(one.notes) == [Reason.NO_FACE_FITS]
    assert progress(says(0, built=polygon.box(0, 0.0, 0.4, 3.0), of=COLUMN), of=COLUMN).state == "complete"


def test_a_column_of_which_only_the_top_is_seen_open_is_not_called_not_started() -> None:
    one = progress(says(0, opened=polygon.box(0, 2.0, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert one.state == "unknown" and one.completion.upper == pytest.approx(2 / 3, abs=0.04)


def test_the_bounds_hold_where_a_pour_line_runs_through_a_cell() -> None:
    for height in np.arange(1.02, 1.5, 0.03):
        for of, width in ((COLUMN, 0.4), (WALL, 4.0)):
            built, opened = polygon.box(0, 0, width, height), polygon.box(0, height, width, 3.0)
            completion = progress(says(0, built=built, opened=opened, of=of), of=of).completion
            assert completion.lower <= height / 3.0 <= completion.upper
            assert completion.upper - completion.lower < 0.11  # of 3 m: a border is known to 10 cm either way


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
    assert completion.lower == pytest.approx((1.5 + 0.05) / 3.0) and completion.upper == 1.0


def test_an_open_cell_under_a_built_one_may_be_a_mistake_and_stays_possible_in_the_upper_bound() -> None:
    hole = polygon.box(1.0, 1.0, 1.5, 1.5)
    completion = progress(says(0, built=polygon.difference(polygon.box(0, 0, 4, 3), hole), opened=hole)).completion
    assert completion.best == pytest.approx(1.0 - 4 / (16 * 12))
    assert completion.upper == 1.0 and completion.lower < completion.best


def test_what_hangs_over_open_cells_is_not_built_and_what_stands_over_a_few_is() -> None:
    hanging = progress(says(0, built=polygon.box(0, 2, 1, 3), opened=polygon.box(0, 0, 1, 2)))
    assert hanging.cells_built == 0.0 and hanging.completion.lower == 0.0
    standing = progress(says(0, built=polygon.box(0, 1, 1, 3), opened=polygon.box(0, 0.5, 1, 1)))
    assert standing.cells_built > 0.0


def test_a_kicker_alone_has_not_started_a_column_but_three_times_its_height_has() -> None:
    for height, state in ((0.1, "not started"), (0.2, "not started"), (0.3, "part")):
        built, opened = polygon.box(0, 0, 0.4, height), polygon.box(0, height, 0.4, 3.0)
        assert progress(says(0, built=built, opened=opened, of=COLUMN), of=COLUMN).state == state


def test_a_column_open_down_to_its_starter_bars_is_not_started_and_one_open_in_its_upper_half_is_not_known() -> None:
    bars = progress(says(0, opened=polygon.box(0, 0.9, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert bars.state == "not started" and bars.completion.upper == pytest.approx(0.3, abs=0.04)
    upper = progress(says(0, opened=polygon.box(0, 1.4, 0.4, 3.0), of=COLUMN), of=COLUMN)
    assert upper.completion.coverage > 0.5 and upper.state == "unknown"
    assert codes(upper.notes) == [Reason.FOOT_NOT_SEEN]


def test_one_cell_of_a_long_foot_is_no_look_at_it() -> None:
    upper, corner = polygon.box(0, 2.0, 4, 3), polygon.box(0, 0, 0.25, 0.25)
    assert progress(says(0, opened=polygon.union([upper, corner]))).state == "unknown"
    assert progress(says(0, opened=polygon.union([upper, polygon.box(0, 0, 2, 0.5)]))).state == "not started"


def test_a_quarter_of_a_side_decides_a_cell_only_where_nothing_contradicts() -> None:
    strip, rest = polygon.box(0, 0, 0.15, 3), polygon.box(0.25, 0, 0.4, 3)
    assert progress(says(0, built=strip, of=COLUMN), of=COLUMN).state == "complete"  # a prop hides the rest of it
    assert progress(says(0, built=strip, opened=rest, of=COLUMN), of=COLUMN).completion.coverage == 0.0
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


@given(built=st.floats(0, 1), opened=st.floats(0, 1), total=st.floats(0.01, 1000))
def test_best_lies_within_its_bounds_and_nothing_seen_is_never_nought_percent(
    built: float, opened: float, total: float
) -> None:
    scale = total / max(built + opened, 1.0)
    completion = completion_of(built * scale, opened * scale, total, OPTIONS)
    assert 0.0 <= completion.lower <= completion.upper <= 1.0
    if completion.best is not None:
        assert completion.lower - 1e-9 <= completion.best <= completion.upper + 1e-9
        assert completion.coverage >= OPTIONS.known_from
    else:
        assert completion.coverage < OPTIONS.known_from


def test_a_cell_that_a_little_is_seen_built_of_counts_only_if_it_was_not_open_before_and_the_note_says_so() -> None:
    seen = says(0, built=polygon.union([polygon.box(0, 0, 4, 1.5), polygon.box(0, 1.5, 4, 1.6)]))
    afresh = progress(seen)
    before = progress(replace(seen, was_open_uv_m=polygon.box(0, 1.6, 4, 3)))
    assert before.completion.lower < afresh.completion.lower
    assert before.cells_built == afresh.cells_built - 16.0 and before.cells_open == 0.0  # one row of the wall's twelve
    assert the(before.notes, Reason.OPEN_BEFORE).values["share"] == pytest.approx(1 / 12)
    assert Reason.OPEN_BEFORE not in codes(afresh.notes)
