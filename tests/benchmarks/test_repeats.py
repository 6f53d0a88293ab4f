"""Scatter against sigma in closed form; which faces of two frames are one."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.measure.faces import MeasuredFace
from benchmarks.real.fixed_patches import Repeat, pooled
from benchmarks.real.repeats import best_overlap, scene_lines
from benchmarks.real.scenes import SCENES, TWO_CAMERAS, chosen

ANY_FACE = cast(MeasuredFace, None)  # overlap is all that counts


def repeat(areas: tuple[float, ...], sigma: float) -> Repeat:
    return Repeat(name="patch", areas_m2=areas, sigmas_m2=(sigma,) * len(areas))


def test_scatter_is_told_in_stated_sigmas() -> None:
    assert repeat((1.0, 2.0, 3.0), 0.5).ratio == pytest.approx(2.0)  # the deviation is 1


def test_a_patch_of_many_frames_weighs_more_than_one_of_few() -> None:
    few, many = repeat((0.0, 1.0, 2.0), 1.0), repeat((0.0, 2.0) * 10, 1.0)
    variance = 20.0 / 19.0  # of 20 values, each 1 off their mean
    assert pooled([few, many]) == pytest.approx(np.sqrt((2 * 1.0 + 19 * variance) / 21))


def test_noise_of_the_stated_sigma_comes_out_as_one() -> None:
    draw = np.random.default_rng(3)
    repeats = [repeat(tuple(draw.normal(5.0, 0.2, 12)), 0.2) for _ in range(200)]
    assert pooled(repeats) == pytest.approx(1.0, abs=0.05)


def test_scatter_of_twice_the_sigma_falls_short() -> None:
    quiet, loud = [repeat((1.0, 2.0, 3.0), 1.0)] * 2, [repeat((1.0, 2.0, 3.0), 0.5)] * 2
    assert scene_lines("room", "patches", quiet, 3)[0].holds is True
    assert scene_lines("room", "patches", loud, 3)[0].holds is False


def test_a_face_is_found_again_where_half_of_both_together_is_shared() -> None:
    def strip(start: int, stop: int) -> BoolArray:
        mask = np.zeros((10, 100), dtype=bool)
        mask[:, start:stop] = True
        return mask

    others = [(strip(0, 20), ANY_FACE), (strip(30, 60), ANY_FACE)]
    assert best_overlap(strip(35, 60), others, 1, set()) == 1
    assert best_overlap(strip(35, 60), others, 1, {(1, 1)}) is None
    assert best_overlap(strip(50, 90), others, 1, set()) is None


def test_no_scene_is_both_developed_on_and_reported() -> None:
    names = [scene.name for scene in SCENES] + [name for name, _ in TWO_CAMERAS]
    assert len(names) == len(set(names))
    assert {scene.role for scene in chosen("report")} == {"report"}
    assert len(chosen("all")) == len(SCENES)
