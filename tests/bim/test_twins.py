"""A wall that stands in the file twice counts once."""

from __future__ import annotations

from dataclasses import replace

from asbuilt_bim.bim.model import BimElement, Task
from asbuilt_bim.bim.twins import once_each
from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.notes import note_words
from tests.match.small_site import box, element, model

WALL = element("W1", "wall", box(0, 0, 0, 4, 0.2, 3))
TWIN = element("W2", "wall", box(0, 0.001, 0, 4, 0.2, 3))
BEHIND = element("W3", "wall", box(0, 0.02, 0, 4, 0.2, 3))


def names(*elements: BimElement) -> list[str]:
    return [one.global_id for one in once_each(model(elements)).elements]


def test_of_two_elements_in_one_place_the_first_counts_and_the_other_is_named() -> None:
    assert names(WALL, BEHIND, TWIN) == ["W1", "W3"]
    (note,) = once_each(model([WALL, TWIN])).notes
    assert (note.code, note.subject.name) == (Reason.ELEMENT_TWICE, "W2")
    assert "(W1): the two count once" in note_words(note)


def test_three_in_one_place_are_one() -> None:
    assert names(WALL, TWIN, replace(WALL, global_id="W4")) == ["W1"]


def test_another_shape_or_class_in_the_same_box_is_kept() -> None:
    assert names(WALL, replace(TWIN, volume_m3=WALL.volume_m3 * 0.9)) == ["W1", "W2"]
    assert names(WALL, replace(TWIN, kind="column")) == ["W1", "W2"]


def test_a_task_of_the_twin_is_a_task_of_the_first_once() -> None:
    task = Task(
        global_id="T", name="pour", identification="", elements=("W2", "W1"), schedule_start=None, schedule_finish=None
    )
    (kept,) = once_each(model([WALL, TWIN], tasks=(task,))).tasks
    assert kept.elements == ("W1",)
