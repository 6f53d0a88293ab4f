"""Crowded twins: some objects past the frame's ends, some before others, none in another, the target in view."""

from __future__ import annotations

import itertools

import numpy as np

from asbuilt_synthetic.crowd import _apart, crowded_plan, loose_things
from asbuilt_synthetic.twins import bearings, plan

HALF_FRAME_RAD = 0.54


def test_a_crowded_scene_holds_its_bare_one() -> None:
    for seed in range(2):
        bare, crowded = plan(seed), crowded_plan(seed)
        assert crowded.objects[: len(bare.objects)] == bare.objects
        assert np.array_equal(crowded.target_xy_m, bare.target_xy_m)


def test_objects_hide_one_another_and_the_frame_cuts_some_but_none_stands_in_another() -> None:
    cut = hidden = 0
    for seed in range(4):
        objects = crowded_plan(seed).objects
        ranges = [bearings(one.plan_m) for one in objects]
        cut += sum(low < -HALF_FRAME_RAD or high > HALF_FRAME_RAD for low, high in ranges)
        hidden += sum(a[0] < b[1] and b[0] < a[1] for a, b in itertools.combinations(ranges, 2))
        if seed < 2:
            new = objects[len(plan(seed).objects) :]
            assert all(_apart(a.plan_m, b.plan_m) for a in new for b in objects if a is not b)
    assert cut >= 2
    assert hidden >= 4


def test_no_object_hides_the_target() -> None:
    for seed in range(4):
        drawn = crowded_plan(seed)
        x, y = drawn.target_xy_m
        ranges = [bearings(one.plan_m) for one in drawn.objects]
        assert all(not low < np.arctan2(y, x) < high for low, high in ranges)


def test_the_same_seed_strews_the_same_things() -> None:
    drawn = crowded_plan(3)
    one, other = (loose_things(3, drawn.objects, drawn.target_xy_m) for _ in range(2))
    assert [p.name for p in one] == [p.name for p in other]
    assert all(np.array_equal(a.vertices_m, b.vertices_m) for a, b in zip(one, other, strict=True))
    assert {"Heap", "Bars"} & {p.name for seed in range(2) for p in _things(seed)}


def _things(seed: int) -> list:  # type: ignore[type-arg]
    drawn = crowded_plan(seed)
    return loose_things(seed, drawn.objects, drawn.target_xy_m)
