"""Finished concrete that vanishes on a broad front says that the photos are older than those before them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.undone import undone_front
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import box, element, looking, measured, model, placement, station

FIRST, SECOND = date(2026, 3, 2), date(2026, 3, 16)
COLUMNS = [box(1.2 * n, 0, 0, 0.5, 0.5, 2.8) for n in range(6)]
DESIGN = model([element(f"C{n}", "column", shape) for n, shape in enumerate(COLUMNS)])
POSE = looking([3.2, -8.0, 1.6], [3.2, 0.0, 1.5])
AROUND = [box(-30, -30, -0.3, 60, 90, 0.3), box(-30, 12, 0, 60, 0.5, 12)]


def visit(
    built: Sequence[int], history: VisitHistory = EMPTY_HISTORY, day: date = FIRST
) -> tuple[tuple[Rejection, ...], VisitHistory]:
    """Look at the row of columns where those are built; return what is said of the visit, and the history after it."""
    faces = []
    for n in built:
        front = DESIGN.elements[n].faces[0].frame
        assert isinstance(front, PlaneFrame)
        faces.append(measured(f"A1/{n}", POSE, front, polygon.box(0.0, 0.0, 0.5, 2.8), "column"))
    seen = placement(station("A1", POSE, [*(COLUMNS[n] for n in built), *AROUND], faces))
    matched = match_faces(seen, DESIGN, MatchOptions())
    surfaces = classify_surface(matched, DESIGN, history, ProgressOptions())
    told = undone_front(surfaces, DESIGN, history, day, ProgressOptions())
    return told, remember(history, summarise(surfaces, matched, DESIGN, history, day))


def undone(first: Sequence[int], second: Sequence[int]) -> tuple[Rejection, ...]:
    told, history = visit(first)
    assert told == (), "a first visit undoes nothing"
    return visit(second, history, SECOND)[0]


def test_a_visit_in_which_most_of_what_was_built_is_gone_is_named_with_the_elements() -> None:
    (told,) = undone([0, 1, 2, 3, 4], [0, 1])
    assert told.code is Reason.VISIT_UNDOES and told.subject.name == "2026-03-16"
    gone = ("C2", "C3", "C4")
    assert told.values == {"elements": gone, "global_ids": gone, "risen": 0}
    assert "3 elements look open that earlier visits saw built: C2, C3, C4; only 0 have risen" in str(words_of(told))


def test_a_site_that_grows_is_never_said_to_be_undone() -> None:
    assert undone([0, 1, 2], [0, 1, 2, 3, 4, 5]) == ()
    assert undone([0, 1, 2], [0, 1, 2]) == ()


def test_two_columns_that_are_taken_down_again_are_no_broad_front() -> None:
    assert undone([0, 1, 2, 3], [0, 1]) == ()


def test_columns_taken_down_while_as_many_rise_are_no_visit_of_another_order() -> None:
    assert undone([0, 1, 2], [3, 4, 5]) == ()
    (told,) = undone([0, 1, 2], [3, 4])
    assert told.values["risen"] == 2
