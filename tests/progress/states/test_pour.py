"""How high it reaches: exact against every level tried, and what sides say of it."""

from itertools import pairwise, product

import numpy as np
import pytest

from asbuilt_bim.progress.states import pour
from asbuilt_bim.progress.states.pour import Model, Shown, levels, model

FITTED = Model(built_weight=0.05, face_weight=0.15, open_weight=0.15, not_begun=0.3, doubt=0.07, limit=0.7)
CLEAR = 8.0
SIZE_M = (0.75, 0.15)


def shown(built: object, opened: object, measured: object = 0.0, every: float = 5.0) -> Shown:
    b, o = np.asarray(built, dtype=float), np.asarray(opened, dtype=float)
    return Shown(
        built=b, open=o, measured=np.broadcast_to(np.asarray(measured), b.shape),
        log_odds=CLEAR * (b - o) / every,
    )  # fmt: skip


def test_chances_are_those_of_all_walls_there_may_be_each_tried_for_itself() -> None:
    """One side, three lines of three rows: 64 walls. Levels lie under the row that each line begins to be open at."""
    rng = np.random.default_rng(3)
    built = rng.integers(0, 4, (1, 3, 3)).astype(float)
    opened = rng.integers(0, 2, (1, 3, 3)).astype(float)
    found = pour._along(pour._of_sides(shown(built, opened), FITTED)[0], PRIOR, 0.2)[1]
    total = np.zeros((3, 4))
    of_line = pour._of_sides(shown(built, opened), FITTED)[0]
    for wall in product(range(4), repeat=3):
        chance = PRIOR[wall[0]] * np.exp(sum(of_line[line, level] for line, level in enumerate(wall)))
        for before, after in pairwise(wall):
            chance *= 0.8 * (before == after) + 0.2 * PRIOR[after]
        for line, level in enumerate(wall):
            total[line, level] += chance
    assert found == pytest.approx(total / total.sum(axis=1, keepdims=True))


PRIOR = np.array([0.3, 0.2, 0.2, 0.3])


def test_what_nobody_sees_is_as_likely_as_anywhere_and_never_sure() -> None:
    nothing = levels(shown(np.zeros((4, 1, 58)), np.zeros((4, 1, 58))), (0.4, 2.9), model())
    assert not nothing.seen.any() and nothing.between(0, 58) == 0.0
    built = nothing.built()
    assert model().doubt < built.min() and built.max() < 1.0 - model().doubt


def test_a_measured_face_says_more_than_depth_alone_and_an_open_place_more_than_a_built_one() -> None:
    half = np.zeros((1, 1, 20))
    half[..., :10] = 5.0
    by_depth, by_face = (levels(shown(half, 0 * half, m), (0.4, 1.0), model()).built()[0, 5] for m in (0.0, half))
    opened = levels(shown(0 * half, half), (0.4, 1.0), model()).built()[0, 5]
    assert 0.5 < by_depth < by_face and 1.0 - opened > by_depth


def test_sides_that_contradict_one_another_as_a_whole_decide_nothing() -> None:
    all_of_it, none = np.full((1, 1, 58), 5.0), np.zeros((1, 1, 58))
    both = levels(
        shown(np.concatenate([all_of_it, none]), np.concatenate([none, all_of_it]), np.concatenate([all_of_it, none])),
        (0.4, 2.9), model(),
    )  # fmt: skip
    assert both.torn > 0.5
    agreed = levels(shown(np.tile(all_of_it, (2, 1, 1)), np.tile(none, (2, 1, 1))), (0.4, 2.9), model())
    assert agreed.torn < 0.05


def test_a_side_that_was_open_before_it_rose_contradicts_nothing_and_one_that_was_built_does() -> None:
    all_of_it, none = np.full((1, 4, 58), 5.0), np.zeros((1, 4, 58))
    built, opened = shown(all_of_it, none, all_of_it), shown(none, all_of_it)
    winter, spring = (levels(one, (1.6, 2.9), model()) for one in (opened, built))
    risen = levels(built, (1.6, 2.9), model(), winter.evidence)
    assert risen.torn < 0.05 and risen.built() == pytest.approx(spring.built(), abs=0.02)
    gone = levels(opened, (1.6, 2.9), model(), spring.evidence)
    assert gone.torn > 0.5 and gone.evidence is not None and np.ptp(gone.evidence) < 3.0  # the next visit says


def test_evidence_is_finite_of_the_tallest_walls_and_stays_what_it_was_over_clear_visits() -> None:
    tall = np.full((1, 2, 1200), 5.0)
    first = again = levels(shown(tall, 0.0 * tall, tall), (0.8, 60.0), model())
    assert first.evidence is not None and np.isfinite(first.evidence).all()
    for _ in range(10):
        again = levels(shown(tall, 0.0 * tall, tall), (0.8, 60.0), model(), again.evidence)
    assert again.evidence is not None and np.isfinite(again.evidence).all()
    assert again.torn < 0.01 and (again.built() > 0.99).all()


def test_lines_that_earlier_visits_alone_saw_count_as_seen() -> None:
    first, second = np.zeros((1, 2, 58)), np.zeros((1, 2, 58))
    first[0, 0], second[0, 1] = 5.0, 5.0
    winter = levels(shown(first, 0.0 * first, first), (8.0, 2.9), model())
    assert winter.seen.tolist() == [True, False]
    assert levels(shown(second, 0.0 * second, second), (8.0, 2.9), model(), winter.evidence).seen.all()
