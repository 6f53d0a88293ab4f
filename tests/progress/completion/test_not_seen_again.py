"""An element that no photo of a visit shows stays what it was, but for what may have been built since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.displaced import Displaced
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states.likelihood import MOST_NATS
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.report.wording.notes import note_words
from tests.match.small_site import box, element, model
from tests.notes import codes
from tests.progress.states.test_decide import BACK, FRONT, NOTHING, OPTIONS, SAMPLES, UP_M, WALL, judged
from tests.progress.test_money_and_dates import DAY
from tests.progress.test_money_and_dates import NOTHING as NO_MATCH

LOW = np.where(FRONT & (UP_M < 1.4), MOST_NATS, 0.0) + np.where(BACK & (UP_M > 1.4), -MOST_NATS, 0.0)
TORN = np.where(FRONT, MOST_NATS, 0.0) + np.where(BACK & (UP_M > 2.0), -MOST_NATS, 0.0)
WHOLE = np.where(FRONT, MOST_NATS, 0.0)


def report(
    surfaces: Sequence[SurfaceState],
    history: VisitHistory,
    of: BimElement = WALL,
    displaced: Mapping[str, Displaced] | None = None,
) -> ProgressReport:
    day = DAY + timedelta(days=7 * len(history.visits))
    return summarise(surfaces, NO_MATCH, model([of]), history, day, displaced=displaced)


def seen_once(odds: FloatArray, more: int) -> list[ElementProgress]:
    """Return what the wall is after a visit that shows it, and after `more` visits that show nothing of it."""
    surfaces, history, found = judged(odds), EMPTY_HISTORY, []
    for _ in range(1 + more):
        one = report(surfaces, history)
        found.append(one.elements[0])
        history, surfaces = remember(history, one), judged(NOTHING, surfaces)
    return found


def told_of(one: ElementProgress) -> str:
    return " ".join(note_words(note) for note in one.notes if note.code is Reason.PHOTOS_DISAGREE)


@pytest.mark.parametrize("odds", [LOW, TORN, WHOLE])
def test_what_is_certain_and_what_contradicts_itself_stay_and_nothing_becomes_complete(odds: FloatArray) -> None:
    first, *later = seen_once(odds, 3)
    for one in later:
        assert one.completion.lower == first.completion.lower and one.cells_built == first.cells_built
        assert one.cells_conflict == first.cells_conflict
        assert one.state == ("complete" if first.state == "complete" else "unknown")
        assert one.completion.upper == 1.0 and not one.stations and one.last_seen == DAY


def test_photos_that_disagree_are_told_as_long_as_nobody_looks_again() -> None:
    first, *later = seen_once(TORN, 2)
    assert first.cells_conflict > 0.0 and first.state == "unknown"
    assert "of 2026" not in told_of(first)
    for one in later:
        assert codes(one.notes).count(Reason.PHOTOS_DISAGREE) == 1
        assert f" of {DAY.isoformat()}" in told_of(one)  # a station of that name may be of this visit, too


def test_that_a_wall_was_seen_to_its_top_alone_is_told_as_long_as_nobody_looks_again() -> None:
    top = FRONT & (UP_M > 1.0) & (SAMPLES.uv_m[:, 0] < 1.5)
    for one in seen_once(np.where(top, MOST_NATS, 0.0), 2):
        assert one.state == "complete" and codes(one.notes).count(Reason.SEEN_TO_TOP) == 1


def test_a_wall_that_a_revision_moved_is_judged_where_it_is_now() -> None:
    first = report(judged(WHOLE), EMPTY_HISTORY)
    history = remember(EMPTY_HISTORY, first)
    moved = element("W", "wall", box(1, 0, 0, 4.0, 0.25, 3.0))
    assert history.as_it_stood(WALL) is not None and history.as_it_stood(moved) is None
    elsewhere = replace(first.elements[0], completion=replace(first.elements[0].completion, lower=0.77))
    kept = replace(history, elements={"W": elsewhere})
    again, there = (
        report([replace(s, stations={}) for s in judged(WHOLE)], kept, of).elements[0] for of in (WALL, moved)
    )
    assert again.completion.lower == 0.77 and there.completion.lower == pytest.approx(1.0, abs=0.02)


def test_a_wall_that_a_revision_made_longer_or_higher_is_not_complete_before_somebody_has_seen_the_rest() -> None:
    first = report(judged(WHOLE + np.where(BACK, MOST_NATS, 0.0)), EMPTY_HISTORY)
    assert first.elements[0].state == "complete"
    history = remember(EMPTY_HISTORY, first)
    for length_m, height_m in ((5.0, 3.0), (4.0, 3.6)):
        now = element("W", "wall", box(0, 0, 0, length_m, 0.25, height_m))
        one = report(unseen_again(now, history), history, now).elements[0]
        assert one.state == "unknown" and one.completion.best is None
        assert one.completion.lower == pytest.approx(4.0 * 3.0 / (length_m * height_m), abs=0.03)


def unseen_again(of: BimElement, history: VisitHistory) -> list[SurfaceState]:
    """Return the faces of an element of which a visit sees nothing, with what is known of where they are now."""
    earlier = [history.earlier(of.global_id, face, OPTIONS) for face in of.faces]
    return judged(np.zeros(len(cell_samples(of, OPTIONS.spacing_m).face)), earlier, of=of)


def test_a_wall_that_a_person_accepts_beside_its_design_stays_what_it_was_too() -> None:
    where = {"W": Displaced(element="W", move_m=np.array([0.3, 0.0, 0.0]), area_m2=0.0, accepted=True)}
    for odds in (LOW, TORN, WHOLE):
        surfaces, history, found = judged(odds), EMPTY_HISTORY, []
        for _ in range(3):
            one = report(surfaces, history, displaced=where)
            found.append(one.elements[0])
            history, surfaces = remember(history, one), judged(NOTHING, surfaces)
        first, *later = found
        for again in later:
            assert again.completion.lower == first.completion.lower and again.cells_built == first.cells_built
            assert again.state == ("complete" if first.state == "complete" else "unknown")
            assert codes(again.notes)[0] is Reason.DISPLACED_ACCEPTED and again.accepted


def test_what_a_revision_uncovers_of_a_wall_is_not_complete_for_what_was_seen_of_the_rest() -> None:
    """Other walls hid all but a metre of its front, in the design that the first visit was judged by."""
    front, *others = WALL.faces
    hidden = [replace(face, exposed_uv_m=polygon.EMPTY, exposed_area_m2=0.0) for face in others]
    seen = replace(front, exposed_uv_m=polygon.box(0, 0, 1.0, 3.0), exposed_area_m2=3.0)
    before = replace(WALL, faces=(seen, *hidden))
    odds = np.full(len(cell_samples(before, OPTIONS.spacing_m).face), MOST_NATS)
    was = report(judged(odds, of=before), EMPTY_HISTORY, before)
    assert was.elements[0].state == "complete" and was.elements[0].completion.lower == 1.0
    history = remember(EMPTY_HISTORY, was)
    now = [history.earlier("W", face, OPTIONS) for face in WALL.faces]
    one = report(judged(NOTHING, now), history).elements[0]
    assert one.completion.lower == pytest.approx(0.25, abs=0.05)
    assert one.cells_built + one.cells_unknown == element_cells(WALL).count
